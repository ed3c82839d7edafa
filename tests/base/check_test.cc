#include "base/check.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

TEST(Check, IsSilentWhenTheConditionHolds) { EXPECT_NO_THROW(Check(true, "never seen")); }

TEST(Check, ThrowsTheJoinedParts) {
  try {
    Check(false, "got ", 3, " rows, not ", 4);
    FAIL() << "nothing was thrown";
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "got 3 rows, not 4");
  }
}

TEST(Check, KindsOfErrorsAreCaughtAsError) {
  EXPECT_THROW(throw ConfigError("x"), Error);
  EXPECT_THROW(throw DivergedError("x"), Error);
}

}  // namespace
}  // namespace o2v
