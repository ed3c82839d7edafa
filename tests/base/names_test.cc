#include "base/names.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

TEST(Nearest, PutsTheLeastDistanceFirst) {
  // Levenshtein distances to "Hoper-v2": Ant-v2 6, Hopper-v2 1, Reacher-v2 5.
  EXPECT_EQ(Nearest("Hoper-v2", {"Ant-v2", "Hopper-v2", "Reacher-v2"}),
            "'Hopper-v2', 'Reacher-v2', 'Ant-v2'");
}

TEST(Nearest, ShowsNoMoreThanThree) {
  EXPECT_EQ(Nearest("a", {"abcd", "abc", "ab", "a"}), "'a', 'ab', 'abc'");
}

TEST(Nearest, KeepsTheOrderOfEqualDistances) { EXPECT_EQ(Nearest("x", {"b", "a"}), "'b', 'a'"); }

TEST(Nearest, IsEmptyWhenNothingIsKnown) { EXPECT_EQ(Nearest("x", {}), ""); }

}  // namespace
}  // namespace o2v
