#include "base/decimal.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

TEST(Decimal, WholeNumbersAreReadInTensWithLeadingZeros) {
  EXPECT_EQ(ReadWhole("10"), 10);
  EXPECT_EQ(ReadWhole("010"), 10);
  EXPECT_EQ(ReadWhole("0512"), 512);
  EXPECT_EQ(ReadWhole("-3"), -3);
  EXPECT_EQ(ReadWhole("1e3"), 1000);
  EXPECT_EQ(ReadWhole("2.0"), 2);
  EXPECT_EQ(ReadWhole("9223372036854775807"), INT64_MAX);
}

TEST(Decimal, WhatIsNoWholeNumberOrDoesNotFitIsRefused) {
  for (const char* text :
       {"", " ", "1 ", " 1", "+1", "0x10", "1_000", "1'000", "1.5", "1e-1", "one",
        "9223372036854775808", "18446744073709551615", "1e19", "inf", "nan"}) {
    EXPECT_FALSE(ReadWhole(text)) << text;
  }
}

TEST(Decimal, RealNumbersAreFinite) {
  EXPECT_EQ(ReadReal("010.5"), 10.5);
  EXPECT_EQ(ReadReal("1e-3"), 0.001);
  EXPECT_EQ(ReadReal("-2"), -2.0);
  for (const char* text : {"", "0x1p3", "inf", "nan", "1e999", "1,5", "1e", "+1"}) {
    EXPECT_FALSE(ReadReal(text)) << text;
  }
}

}  // namespace
}  // namespace o2v
