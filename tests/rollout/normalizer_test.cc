#include "rollout/normalizer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/check.h"
#include "base/rng.h"
#include "memory_visitor.h"

namespace o2v {
namespace {

MatD Data(Index cols, Rng& rng) {
  MatD x(2, cols);
  for (Index j = 0; j < cols; ++j) x.col(j) << 5 + 2 * rng.Normal(), -3 + 0.1 * rng.Normal();
  return x;
}

TEST(Normalizer, EqualsTheDirectMeanAndVarianceUpToItsPrior) {
  Rng rng(1, "test");
  const MatD x = Data(300, rng);
  Normalizer normalizer(2);
  for (Index j = 0; j < 300; j += 3) normalizer.Update(x.middleCols(j, 3));
  const VecD mean = x.rowwise().mean();
  const VecD var = (x.colwise() - mean).array().square().rowwise().mean();
  // The prior (mean 0, variance 1) weighs 1e-4 of 300: relative to the data's squares, 3e-7 mu^2.
  EXPECT_LT((normalizer.mean() - mean).cwiseAbs().maxCoeff(), 1e-4 / 300 * 5.5);
  EXPECT_LT((normalizer.var() - var).cwiseAbs().maxCoeff(), 1e-4 / 300 * 30);
  EXPECT_DOUBLE_EQ(normalizer.count(), 300.0001);
}

TEST(Normalizer, FirstUpdateFollowsTheFormula) {
  Normalizer normalizer(1);
  normalizer.Update(MatD::Constant(1, 1, 3));
  // Delta = 3, n' = 1.0001: mean = 3 / n', var = (1e-4 + 9 1e-4 / n') / n'. Spec 1.2.
  const double n = 1.0001;
  EXPECT_DOUBLE_EQ(normalizer.mean()(0), 3 / n);
  EXPECT_DOUBLE_EQ(normalizer.var()(0), (1e-4 + 9 * 1e-4 / n) / n);
}

TEST(Normalizer, DoesNotDependOnHowDataAreSplit) {
  Rng rng(2, "test");
  const MatD x = Data(60, rng);
  Normalizer ones(2), sixes(2);
  for (Index j = 0; j < 60; ++j) ones.Update(x.col(j));
  for (Index j = 0; j < 60; j += 6) sixes.Update(x.middleCols(j, 6));
  EXPECT_LT((ones.mean() - sixes.mean()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((ones.var() - sixes.var()).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(Normalizer, AppliesMeanAndDeviationAndClipsAtTen) {
  Normalizer normalizer(3);
  normalizer.Set((VecD(3) << 1, 2, 3).finished(), VecD::Constant(3, 4), 10);
  Vec out(3);
  normalizer.Apply((VecD(3) << 2, 1e6, -1e6).finished(), out);
  EXPECT_NEAR(out(0), 1 / std::sqrt(4 + 1e-8), 1e-7);
  EXPECT_EQ(out(1), 10);
  EXPECT_EQ(out(2), -10);
}

TEST(Normalizer, AddsItsEpsilonToTheVariance) {
  Normalizer normalizer(1);
  normalizer.Set(VecD::Zero(1), VecD::Zero(1), 1);
  Vec out(1);
  normalizer.Apply(VecD::Constant(1, 3e-4), out);
  EXPECT_NEAR(out(0), 3, 1e-6);  // / sqrt(1e-8)
}

TEST(Normalizer, StartsAsTheIdentity) {
  const Normalizer normalizer(1);
  Vec out(1);
  normalizer.Apply(VecD::Constant(1, 2), out);
  EXPECT_NEAR(out(0), 2, 1e-6);
}

TEST(Normalizer, GoesOnFromAStateThatWasKept) {
  Rng rng(3, "test");
  Normalizer normalizer(2), other(2);
  normalizer.Update(Data(5, rng));
  MemoryVisitor kept;
  normalizer.Serialize(kept);
  kept.load = true;
  other.Serialize(kept);
  const VecD x = Data(1, rng).col(0);
  Vec expected(2), out(2);
  normalizer.Apply(x, expected);
  other.Apply(x, out);
  EXPECT_EQ(out, expected);
  EXPECT_EQ(other.count(), normalizer.count());
}

TEST(Normalizer, RefusesDataOfAnotherSize) {
  Normalizer normalizer(2);
  EXPECT_THROW(normalizer.Update(MatD::Zero(3, 1)), Error);
  EXPECT_THROW(normalizer.Set(VecD::Zero(3), VecD::Zero(3), 1), Error);
}

}  // namespace
}  // namespace o2v
