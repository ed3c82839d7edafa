// Every gradient check of the list, and that each of them can fail.

#include <gtest/gtest.h>

#include <cctype>

#include "gradcheck/checks.h"

namespace o2v {
namespace {

class EveryCheck : public testing::TestWithParam<NamedCheck> {};

TEST_P(EveryCheck, AgreesWithCentralDifferences) {
  const Verdict verdict = RewardAndEnd(GetParam().run());
  EXPECT_LT(verdict.largest_error, kTolerance) << verdict.worst;
  EXPECT_GT(verdict.entries, 0u);
}

TEST_P(EveryCheck, CatchesAnErrorOfOnePercentInAnyTensor) {
  const Comparison comparison = GetParam().run();
  for (std::size_t i = 0; i < comparison.size(); ++i) {
    if (comparison[i].expect != Expect::kGradient) continue;
    EXPECT_FALSE(RewardAndEnd(WithPlantedError(comparison, i, 1.01)).Passed())
        << comparison[i].name;
  }
}

std::string TestName(const testing::TestParamInfo<NamedCheck>& info) {
  std::string name = info.param.name;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(Nn, EveryCheck, testing::ValuesIn(NnChecks()), TestName);
INSTANTIATE_TEST_SUITE_P(Dist, EveryCheck, testing::ValuesIn(DistChecks()), TestName);
INSTANTIATE_TEST_SUITE_P(Algo, EveryCheck, testing::ValuesIn(AlgoChecks()), TestName);

}  // namespace

void PrintTo(const NamedCheck& check, std::ostream* out) { *out << check.name; }

}  // namespace o2v
