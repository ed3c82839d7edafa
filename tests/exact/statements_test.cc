// Every statement of the list holds.

#include "exact/statements.h"

#include <gtest/gtest.h>

#include <cctype>
#include <limits>
#include <set>

namespace o2v::exact {
namespace {

class EveryStatement : public testing::TestWithParam<Statement> {};

TEST_P(EveryStatement, Holds) {
  const Statement& statement = GetParam();
  const Worst worst = WorstOf(statement);
  EXPECT_TRUE(statement.Holds(worst.gap)) << statement.compared << ": " << worst.gap << ", bound "
                                          << statement.bound << ", seed " << worst.seed;
}

std::string TestName(const testing::TestParamInfo<Statement>& info) {
  std::string name = info.param.name;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(Theory, EveryStatement, testing::ValuesIn(AllStatements()), TestName);

TEST(Statement, NamesAreDistinctAndFitIntoACsv) {
  std::set<std::string> names;
  for (const Statement& statement : AllStatements()) {
    EXPECT_TRUE(names.insert(statement.name).second) << statement.name;
    EXPECT_EQ((statement.name + statement.compared).find_first_of(",\"\n"), std::string::npos)
        << statement.name;
  }
}

/// A statement that measures 1, 2, ... on the instances with seeds 0, 1, ...
Statement Rising(Statement::Relation relation) {
  return {"rising", "", relation, 3,
          [](const Instance& instance) { return 1.0 + double(instance.seed); }};
}

TEST(Statement, IsJudgedByItsWorstInstance) {
  EXPECT_EQ(WorstOf(Rising(Statement::Relation::kBelow)).gap, kInstances);
  EXPECT_EQ(WorstOf(Rising(Statement::Relation::kBelow)).seed, kInstances - 1);
  EXPECT_EQ(WorstOf(Rising(Statement::Relation::kAbove)).gap, 1);
  EXPECT_EQ(WorstOf(Rising(Statement::Relation::kAbove)).seed, 0);
}

TEST(Statement, HoldsOnOneSideOfItsBoundOnly) {
  const Statement below = Rising(Statement::Relation::kBelow);
  const Statement above = Rising(Statement::Relation::kAbove);
  EXPECT_TRUE(below.Holds(2.9) && !below.Holds(3) && !below.Holds(3.1));
  EXPECT_TRUE(above.Holds(3.1) && !above.Holds(3) && !above.Holds(2.9));
}

TEST(Statement, NeverHoldsWhenAnInstanceGivesNoNumber) {
  for (const auto relation : {Statement::Relation::kBelow, Statement::Relation::kAbove}) {
    Statement statement = Rising(relation);
    statement.bound = relation == Statement::Relation::kBelow ? 1e300 : -1e300;
    ASSERT_TRUE(statement.Holds(WorstOf(statement).gap));
    statement.gap = [](const Instance& instance) {
      return instance.seed == 2 ? std::numeric_limits<double>::quiet_NaN() : 1.0;
    };
    EXPECT_FALSE(statement.Holds(WorstOf(statement).gap));
    EXPECT_EQ(WorstOf(statement).seed, 2);
  }
}

}  // namespace

void PrintTo(const Statement& statement, std::ostream* out) { *out << statement.name; }

}  // namespace o2v::exact
