#include "algo/option_policy.h"

#include <gtest/gtest.h>

#include <cmath>

namespace o2v {
namespace {

constexpr double kTolerance = 1e-6;

Mat Column(std::initializer_list<double> x) {
  Mat m(Index(x.size()), 1);
  Index i = 0;
  for (const double value : x) m(i++) = Real(value);
  return m;
}

void ExpectNear(const Mat& x, const Mat& expected) {
  ASSERT_EQ(x.size(), expected.size());
  EXPECT_LT((x - expected).cwiseAbs().maxCoeff(), kTolerance)
      << x.transpose() << " is not " << expected.transpose();
}

/// One state after option 1, and G = (1, 2, 3) as the adjoint of pi_hat.
struct State {
  Mat pi = Column({0.5, 0.3, 0.2}), beta = Column({0.2, 0.4, 0.8}), M = Column({0, 1, 0});
  Mat G = Column({1, 2, 3});
  std::vector<int> o_prev = {1};
  std::vector<char> init = {0};
  Mat pi_hat, dz, db;

  State(Fidelity beta_index, bool first = false) {
    init[0] = first;
    MixCallAndReturn(pi, beta, M, o_prev, init, beta_index, pi_hat);
    MixCallAndReturnBackward(G, pi, beta, M, o_prev, init, beta_index, dz, db);
  }
};

TEST(CallAndReturn, MixesByTheTerminationOfThePreviousOption) {
  const State s(Fidelity::kPaper);
  ExpectNear(s.pi_hat, Column({0.2, 0.72, 0.08}));  // 0.6 delta + 0.4 pi
  // sum pi G = 1.7: dz_j = 0.4 pi_j (G_j - 1.7); db = (1.7 - G_1) 0.4 0.6 for option 1.
  ExpectNear(s.dz, Column({-0.14, 0.036, 0.104}));
  ExpectNear(s.db, Column({0, -0.072, 0}));
}

TEST(CallAndReturn, MixesByEachEntrysTerminationInReleased) {
  const State s(Fidelity::kReleased);
  ExpectNear(s.pi_hat, Column({0.1, 0.72, 0.16}));  // sums to 0.98
  // sum beta pi G = 0.82: dz_j = pi_j (beta_j G_j - 0.82); db_k = G_k (pi_k - M_k) beta_k
  // (1-beta_k)
  ExpectNear(s.dz, Column({-0.31, -0.006, 0.316}));
  ExpectNear(s.db, Column({0.08, -0.336, 0.096}));
}

TEST(CallAndReturn, IsTheMasterAtFirstStates) {
  for (const Fidelity beta_index : {Fidelity::kPaper, Fidelity::kReleased}) {
    const State s(beta_index, /*first=*/true);
    ExpectNear(s.pi_hat, s.pi);
    ExpectNear(s.dz, Column({-0.35, 0.09, 0.26}));  // pi_j (G_j - 1.7)
    ExpectNear(s.db, Column({0, 0, 0}));
  }
}

TEST(SoftmaxBackward, IsTheJacobiansProduct) {
  Mat dz;
  SoftmaxBackward(Column({0.5, 0.3, 0.2}), Column({1, 2, 3}), dz);
  ExpectNear(dz, Column({-0.35, 0.09, 0.26}));
}

TEST(OneHot, MarksOneRowAColumn) {
  Mat M(3, 2);
  M.setConstant(7);
  OneHot(std::vector<int>{2, 0}, M);
  EXPECT_EQ(M, (Mat(3, 2) << 0, 1, 0, 0, 1, 0).finished());
}

TEST(PickEntries, TakesTheEntryOfEachColumnsOption) {
  const Mat log_p = (Mat(3, 2) << 1, 2, 3, 4, 5, 6).finished();
  Vec logp;
  PickEntries(log_p, std::vector<int>{2, 0}, logp);
  EXPECT_EQ(logp, (Vec(2) << 5, 2).finished());
}

TEST(OptionLog, IsTheLogarithmInPaper) {
  const OptionLog log(Fidelity::kPaper);
  const std::vector<int> o = {0};
  Mat log_p;
  log.Log(Column({0.25, 0.75}), log_p);
  EXPECT_NEAR(log_p(0, 0), std::log(0.25), kTolerance);
  EXPECT_NEAR(log_p(1, 0), std::log(0.75), kTolerance);
  Mat dp;
  log.Backward(Column({0.25, 0.75}), o, Vec::Constant(1, 2), /*dH=*/-1, dp);
  ExpectNear(dp, Column({2 / 0.25 + std::log(0.25) + 1, std::log(0.75) + 1}));
}

TEST(OptionLog, IsConstantBelowItsFloorInPaper) {
  const OptionLog log(Fidelity::kPaper);
  const std::vector<int> o = {0};
  Mat log_p;
  log.Log(Column({0, 1}), log_p);
  EXPECT_NEAR(log_p(0, 0), std::log(1e-12), 1e-5);
  EXPECT_EQ(MeanEntropy(Column({0, 1}), log_p), 0);
  Mat dp;
  log.Backward(Column({0, 1}), o, Vec::Constant(1, 2), /*dH=*/0, dp);
  EXPECT_EQ(dp, Column({0, 0}));
}

TEST(OptionLog, AddsEpsilonInReleased) {
  const OptionLog log(Fidelity::kReleased);
  const std::vector<int> o = {0};
  Mat log_p;
  log.Log(Column({1e-5, 0.9}), log_p);
  EXPECT_NEAR(log_p(0, 0), std::log(2e-5), kTolerance);
  Mat dp;  // not a distribution: nothing asks for one
  log.Backward(Column({1e-5, 0.9}), o, Vec::Constant(1, Real(1e-5)), /*dH=*/-1, dp);
  // slope 1 / 2e-5: 1e-5 / 2e-5 + ln 2e-5 + 1e-5 / 2e-5
  ExpectNear(dp, Column({1 + std::log(2e-5), std::log(0.90001) + 0.9 / 0.90001}));
}

TEST(OptionLog, AveragesTheEntropy) {
  const OptionLog log(Fidelity::kPaper);
  const Mat p = (Mat(2, 2) << 0.5, 1, 0.5, 0).finished();
  Mat log_p;
  log.Log(p, log_p);
  EXPECT_NEAR(MeanEntropy(p, log_p), std::log(2.0) / 2, kTolerance);
  Mat dp;
  log.Backward(p, std::vector<int>{0, 0}, Vec::Zero(2), /*dH=*/2, dp);
  EXPECT_NEAR(dp(0, 0), -(std::log(0.5) + 1), kTolerance);
  EXPECT_NEAR(dp(0, 1), -1, kTolerance);
}

TEST(LogDensity, IsUntouchedInPaper) {
  Vec logp = Vec::Constant(1, -200), slope;
  LogDensity(Fidelity::kPaper, logp, slope);
  EXPECT_EQ(logp(0), -200);
  EXPECT_EQ(slope(0), 1);
}

TEST(LogDensity, AddsEpsilonInReleased) {
  Vec logp(2), slope;
  logp << Real(std::log(3e-5)), -2000;  // the second underflows
  LogDensity(Fidelity::kReleased, logp, slope);
  EXPECT_NEAR(logp(0), std::log(4e-5), 1e-5);
  EXPECT_NEAR(slope(0), 0.75, kTolerance);
  EXPECT_NEAR(logp(1), std::log(1e-5), 1e-5);
  EXPECT_EQ(slope(1), 0);
}

TEST(LogDensity, IsTheDensityItselfWhereItsExponentialWouldOverflow) {
  Vec logp(4), slope;
  logp << 90, 3000, 79, std::numeric_limits<Real>::quiet_NaN();
  LogDensity(Fidelity::kReleased, logp, slope);
  EXPECT_EQ(logp(0), 90);
  EXPECT_EQ(logp(1), 3000);
  EXPECT_NEAR(logp(2), 79, 1e-5);
  for (Index b = 0; b < 3; ++b) EXPECT_EQ(slope(b), 1) << b;
  EXPECT_TRUE(std::isnan(logp(3)) && std::isnan(slope(3)));  // not hidden
}

}  // namespace
}  // namespace o2v
