#include "base/rng.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/check.h"
#include "memory_visitor.h"

namespace o2v {
namespace {

TEST(Rng, EngineIsTheOneOfTheStandard) {
  // [rand.predef]: the 10000th consecutive invocation of a default-constructed mt19937_64.
  std::mt19937_64 engine;
  engine.discard(9999);
  EXPECT_EQ(engine(), 9981545732273789042u);
}

// Golden: every result of the project hangs on these sequences.
TEST(Rng, StreamsStayWhatTheyAre) {
  Rng policy(0, "policy"), init(7, "init");
  for (const std::uint64_t bits :
       {6174696655491863754u, 16370468080600022862u, 8030106074751896230u})
    EXPECT_EQ(policy.Bits(), bits);
  for (const std::uint64_t bits :
       {12060756045172042634u, 3528607032199804309u, 8821564226094913184u})
    EXPECT_EQ(init.Bits(), bits);
}

TEST(Rng, NamesSeedsAndTheirHighBitsMakeDifferentStreams) {
  const std::uint64_t first = Rng(1, "a").Bits();
  EXPECT_EQ(Rng(1, "a").Bits(), first);
  EXPECT_NE(Rng(1, "b").Bits(), first);
  EXPECT_NE(Rng(2, "a").Bits(), first);
  EXPECT_NE(Rng(1 + (std::uint64_t{1} << 32), "a").Bits(), first);
}

TEST(Rng, StreamsAreUncorrelated) {
  Rng a(3, "worker0"), b(3, "worker1");
  constexpr int n = 10000;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += a.Normal() * b.Normal();
  EXPECT_LT(std::abs(sum / n), 5 / std::sqrt(n));  // standard error 1 / sqrt(n)
}

TEST(Rng, UniformIsTheTop53BitsOfAWord) {
  Rng a(4, "test"), b(4, "test");
  for (int i = 0; i < 100; ++i) {
    const double u = a.Uniform();
    EXPECT_EQ(u * 0x1p53, static_cast<double>(b.Bits() >> 11));
    EXPECT_LT(u, 1);
  }
}

TEST(Rng, UniformFillsItsInterval) {
  Rng rng(5, "test");
  constexpr int n = 10000;
  double sum = 0, low = 2, high = -3;
  for (int i = 0; i < n; ++i) {
    const double u = rng.Uniform(-3, 2);
    sum += u;
    low = std::min(low, u);
    high = std::max(high, u);
  }
  EXPECT_NEAR(sum / n, -0.5, 5 * 5 / std::sqrt(12.0 * n));  // five standard errors
  EXPECT_GE(low, -3);
  EXPECT_LT(low, -2.98);
  EXPECT_LT(high, 2);
  EXPECT_GT(high, 1.98);
}

TEST(Rng, NormalHasTheMomentsOfAStandardNormal) {
  Rng rng(6, "test");
  constexpr int n = 20000;
  double m1 = 0, m2 = 0, m4 = 0;
  for (int i = 0; i < n; ++i) {
    const double z = rng.Normal();
    m1 += z / n;
    m2 += z * z / n;
    m4 += z * z * z * z / n;
  }
  // Five standard errors; Var z = 1, Var z^2 = 2, Var z^4 = 105 - 9.
  EXPECT_NEAR(m1, 0, 5 * std::sqrt(1.0 / n));
  EXPECT_NEAR(m2, 1, 5 * std::sqrt(2.0 / n));
  EXPECT_NEAR(m4, 3, 5 * std::sqrt(96.0 / n));
}

TEST(Rng, BelowHitsEveryValueEquallyOften) {
  Rng rng(7, "test");
  constexpr int n = 10000, k = 10;
  std::array<int, k> counts{};
  for (int i = 0; i < n; ++i) ++counts.at(rng.UniformInt(k));
  for (const int count : counts) EXPECT_NEAR(count, n / k, 5 * std::sqrt(n * 0.1 * 0.9));
}

TEST(Rng, BelowIsUnbiasedForRangesNearTheWordSize) {
  // Without rejection a third of the values below 3 * 2^62 would come twice as often as the others:
  // those with value mod 3 = 0.
  Rng rng(8, "test");
  constexpr std::uint64_t range = std::uint64_t{3} << 62;
  constexpr int n = 3000;
  std::array<int, 3> counts{};
  for (int i = 0; i < n; ++i) {
    const std::uint64_t x = rng.UniformInt(range);
    ASSERT_LT(x, range);
    ++counts[x % 3];
  }
  for (const int count : counts) EXPECT_NEAR(count, n / 3, 5 * std::sqrt(n * 2.0 / 9.0));
}

TEST(Rng, BelowOneIsZero) {
  Rng rng(9, "test");
  EXPECT_EQ(rng.UniformInt(1), 0u);
}

TEST(Rng, GoesOnFromAStateThatWasKept) {
  Rng rng(10, "test"), other(11, "other");
  for (int i = 0; i < 400; ++i) rng.Bits();  // past one block of 312 words
  MemoryVisitor kept;
  rng.Serialize(kept, "rng");
  kept.load = true;
  other.Serialize(kept, "rng");
  for (int i = 0; i < 700; ++i) ASSERT_EQ(rng.Bits(), other.Bits()) << "draw " << i;
}

TEST(Rng, SavingDoesNotDisturbTheStream) {
  Rng a(12, "test"), b(12, "test");
  MemoryVisitor kept;
  a.Serialize(kept, "rng");
  EXPECT_EQ(a.Bits(), b.Bits());
}

}  // namespace
}  // namespace o2v
