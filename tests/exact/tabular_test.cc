// Exact values on processes that can be solved by hand.

#include "exact/tabular.h"

#include <gtest/gtest.h>

namespace o2v::exact {
namespace {

/// Any policies; the state moves 0 -> 1 -> 2 -> 0 whatever is done.
Process Cycle() {
  Process process = Instance(7).process;
  MatD next = MatD::Zero(S, S);
  next(0, 1) = next(1, 2) = next(2, 0) = 1;
  process.p.fill(next);
  return process;
}

void ExpectNear(const MatD& a, const MatD& b) {
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-12) << a << "\nand\n" << b;
}

TEST(Tabular, ARewardOfOneIsWorthTen) {
  Process process = Instance(7).process;
  process.r.setOnes();
  const Values v = Solve(process);  // 1 / (1 - 0.9)
  ExpectNear(v.V_bar, VecD::Constant(kRows, 10));
  ExpectNear(v.Q_O, VecD::Constant(kRows, 10));
  ExpectNear(v.Q_A, MatD::Constant(kRows, A, 10));
  ExpectNear(SecondMoment(process, v), VecD::Constant(kRows, 100));
  ExpectNear(VarianceOfReturn(process, v), VecD::Zero(kRows));
  ExpectNear(OptionTerm(process, v), MatD::Zero(kRows, K));
  ExpectNear(ActionTerm(process, v), MatD::Zero(kRows, A));
}

TEST(Tabular, ARewardInOneStateOfACycleIsDiscountedByTheWayToIt) {
  Process process = Cycle();
  process.r.setZero();
  process.r.row(0).setOnes();
  const double V_0 = 1 / (1 - 0.9 * 0.9 * 0.9);
  VecD V_bar(kRows);
  V_bar << V_0, V_0, 0.81 * V_0, 0.81 * V_0, 0.9 * V_0, 0.9 * V_0;
  ExpectNear(Solve(process).V_bar, V_bar);
  ExpectNear(Solve(process).Q_O, V_bar);
}

TEST(Tabular, OptionsThatAlternateAreTheActionsRewards) {
  Process process = Instance(7).process;
  for (int x = 0; x < kRows; ++x) {
    process.P.row(x) = VecD::Unit(K, 1 - OptionOf(x)).transpose();
    process.pi_a.row(x) = VecD::Unit(A, OptionOf(x)).transpose();
  }
  process.r.col(0).setZero();
  process.r.col(1).setOnes();
  const Values v = Solve(process);
  const double odd = 0.9 / (1 - 0.81),
               even = 1 / (1 - 0.81);  // rewards 0 1 0 1 ... and 1 0 1 0 ...
  for (int s = 0; s < S; ++s) {
    EXPECT_NEAR(v.V_bar(Row(s, 0)), even, 1e-12);  // after option 0 comes option 1
    EXPECT_NEAR(v.V_bar(Row(s, 1)), odd, 1e-12);
    EXPECT_NEAR(v.Q_O(Row(s, 0)), odd, 1e-12);
    EXPECT_NEAR(v.Q_O(Row(s, 1)), even, 1e-12);
    EXPECT_NEAR(v.Q_A(Row(s, 0), 1), 1 + 0.9 * even, 1e-12);  // reward 1 with option 0
  }
}

TEST(Tabular, IndependentRewardsOfUnitVarianceAddUpSquaredDiscounts) {
  Process process = Instance(7).process;
  process.pi_a.setConstant(0.5);
  process.r.col(0).setConstant(-1);
  process.r.col(1).setOnes();
  const Values v = Solve(process);
  const VecD sum = VecD::Constant(kRows, 1 / (1 - 0.81));
  ExpectNear(v.V_bar, VecD::Zero(kRows));
  ExpectNear(SecondMoment(process, v), sum);
  ExpectNear(VarianceOfReturn(process, v), sum);
  // dV_bar/dtheta = 0 by an option that changes nothing; dQ_O by an action: 1/4 of Q_A's difference
  // 2
  ExpectNear(OptionTerm(process, v), MatD::Zero(kRows, K));
  ExpectNear(ActionTerm(process, v), VecD::Ones(kRows) * Eigen::RowVector2d(-0.5, 0.5));
}

TEST(Tabular, ChainsAreStochasticAndShareTheirLawOfStates) {
  const Process process = Instance(7).process;
  const MatD T = Solve(process).T, U = ActionChain(process);
  ExpectNear(T.rowwise().sum(), VecD::Ones(kRows));
  ExpectNear(U.rowwise().sum(), VecD::Ones(kRows));
  const VecD d = Stationary(T), e = Stationary(U);
  EXPECT_NEAR(d.sum(), 1, 1e-12);
  EXPECT_GT(d.minCoeff(), 0);
  ExpectNear(T.transpose() * d, d);
  for (int s = 0; s < S; ++s) {
    EXPECT_NEAR(d.segment(Row(s, 0), K).sum(), e.segment(Row(s, 0), K).sum(), 1e-12);
  }
}

TEST(Tabular, ConditionsOnTheState) {
  VecD d(kRows), f(kRows), b(kRows);
  d << 0.1, 0.3, 0.2, 0.2, 0, 0.2;
  f << 4, 8, 1, 3, 9, 5;
  b << 0.25, 0.75, 0.5, 0.5, 0, 1;
  ExpectNear(GivenState(d), b);
  ExpectNear(MeanGivenState(b, f), Eigen::Vector3d(7, 2, 5));
  ExpectNear(VarianceGivenState(b, f), Eigen::Vector3d(3, 1, 0));  // (9 + 3) / 4, (1 + 1) / 2
}

TEST(Tabular, DrawsByTheLawOfTheRow) {
  MatD laws(2, 3);
  laws << 0.2, 0.5, 0.3, 0, 1, 0;
  Rng rng(1, "draws");
  VecD counts = VecD::Zero(3);
  for (int i = 0; i < 100000; ++i) {
    ++counts(Draw(laws, 0, rng));
    ASSERT_EQ(Draw(laws, 1, rng), 1);
  }
  // 4 standard deviations of a frequency: 4 sqrt(0.25 / 100000)
  EXPECT_LT((counts / 100000 - laws.row(0).transpose()).cwiseAbs().maxCoeff(), 0.0064);
}

}  // namespace
}  // namespace o2v::exact
