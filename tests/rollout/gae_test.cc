#include "rollout/gae.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "base/rng.h"

namespace o2v {
namespace {

MatD Row(std::initializer_list<double> entries) {
  MatD x(1, Index(entries.size()));
  Index i = 0;
  for (const double e : entries) x(i++) = e;
  return x;
}

MatD Normals(Index rows, Index cols, Rng& rng) {
  MatD x(rows, cols);
  for (double& e : x.reshaped()) e = rng.Normal();
  return x;
}

TEST(Gae, CutsAtEpisodeEnds) {
  // gamma = lambda = 1/2, an episode ends with the second step:
  //   delta_3 = 4 + 4/2 - 2 = 4      A_3 = 4                R_3 = 4 + 4/2 = 6
  //   delta_2 = 3 + 2/2 - 2 = 2      A_2 = 2 + 4/4 = 3      R_2 = 3 + 6/2 = 6
  //   delta_1 = 2 - 1 = 1            A_1 = 1                R_1 = 2
  //   delta_0 = 1 + 1/2 - 1 = 1/2    A_0 = 1/2 + 1/4        R_0 = 1 + 2/2 = 2
  MatD adv, ret;
  Gae(Row({1, 2, 3, 4}), Row({1, 0, 1, 1}), Row({1, 1, 2, 2, 4}), 0.5, 0.5, adv, ret);
  EXPECT_EQ(adv, Row({0.75, 1, 3, 4}));
  EXPECT_EQ(ret, Row({2, 2, 6, 6}));
}

TEST(Gae, AtLambdaOneIsTheReturnMinusTheValue) {
  Rng rng(1, "test");
  const MatD r = Normals(3, 20, rng), v = Normals(3, 21, rng);
  MatD adv, ret;
  Gae(r, MatD::Ones(3, 20), v, 0.97, 1, adv, ret);
  EXPECT_LT((adv - (ret - v.leftCols(20))).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Gae, AtLambdaZeroIsTheOneStepError) {
  Rng rng(2, "test");
  const MatD r = Normals(2, 9, rng), v = Normals(2, 10, rng);
  MatD adv, ret;
  Gae(r, MatD::Ones(2, 9), v, 0.9, 0, adv, ret);
  EXPECT_LT((adv - (r + 0.9 * v.rightCols(9) - v.leftCols(9))).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Gae, KeepsWorkersApart) {
  Rng rng(3, "test");
  const MatD r = Normals(2, 6, rng), v = Normals(2, 7, rng);
  MatD mask = MatD::Ones(2, 6);
  mask(0, 2) = mask(1, 4) = 0;
  MatD adv, ret, adv_one, ret_one;
  Gae(r, mask, v, 0.9, 0.8, adv, ret);
  for (Index i = 0; i < 2; ++i) {
    Gae(r.row(i), mask.row(i), v.row(i), 0.9, 0.8, adv_one, ret_one);
    EXPECT_EQ(adv.row(i), adv_one.row(0));
    EXPECT_EQ(ret.row(i), ret_one.row(0));
  }
}

TEST(Gae, RefusesShapesThatDisagree) {
  MatD adv, ret;
  EXPECT_THROW(Gae(MatD(1, 4), MatD(1, 4), MatD(1, 4), 0.9, 0.9, adv, ret), Error);
  EXPECT_THROW(Gae(MatD(1, 4), MatD(1, 3), MatD(1, 5), 0.9, 0.9, adv, ret), Error);
}

TEST(NormalizeAdvantages, DividesByTheDeviationWithDivisorNMinusOne) {
  Vec adv_hat;
  NormalizeAdvantages(Row({1, 2, 3}), 0, adv_hat);  // mean 2, deviation 1
  EXPECT_EQ(adv_hat, (Vec(3) << -1, 0, 1).finished());
}

TEST(NormalizeAdvantages, AddsTheEpsilonToTheDeviation) {
  Vec adv_hat;
  NormalizeAdvantages(Row({1, 2, 3}), 1, adv_hat);
  EXPECT_EQ(adv_hat, (Vec(3) << -0.5, 0, 0.5).finished());
}

TEST(NormalizeAdvantages, IsTimeMajor) {
  MatD adv(2, 2);  // two workers, two steps
  adv << 1, 3, 2, 4;
  Vec adv_hat;
  NormalizeAdvantages(adv, 0, adv_hat);
  for (Index i = 1; i < 4; ++i) EXPECT_GT(adv_hat(i), adv_hat(i - 1));
}

TEST(NormalizeAdvantages, RefusesASingleEntry) {
  Vec adv_hat;
  EXPECT_THROW(NormalizeAdvantages(Row({1}), 0, adv_hat), Error);
}

}  // namespace
}  // namespace o2v
