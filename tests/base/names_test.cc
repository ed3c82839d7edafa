#include "base/names.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

TEST(Nearest, PutsTheLeastDistanceFirst) {
  // Levenshtein: "kitchen" 2 (t -> c, insert h), "sitting" 3 (the textbook's example), "mitten" 1.
  EXPECT_EQ(Nearest("kitten", {"kitchen", "sitting", "mitten"}), "'mitten', 'kitchen', 'sitting'");
}

TEST(Nearest, CountsALetterForAnotherAsOneLikeALetterLess) {
  EXPECT_EQ(Nearest("cat", {"cot", "at"}), "'cot', 'at'");  // 1 and 1
}

TEST(Nearest, ShowsNoMoreThanThree) {
  EXPECT_EQ(Nearest("a", {"abcd", "abc", "ab", "a"}), "'a', 'ab', 'abc'");
}

TEST(Nearest, KeepsTheOrderOfEqualDistances) { EXPECT_EQ(Nearest("x", {"b", "a"}), "'b', 'a'"); }

TEST(Nearest, IsEmptyWhenNothingIsKnown) { EXPECT_EQ(Nearest("x", {}), ""); }

}  // namespace
}  // namespace o2v
