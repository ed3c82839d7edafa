// The derivative of Option2Vec's mean action by the executed option's embedding.

#include <gtest/gtest.h>

#include "algo/toy.h"
#include "grad_check.h"
#include "small_hyper.h"

namespace o2v {
namespace {

constexpr int kS = 5, kA = 3, kK = 4, kD = 6, kB = 20;

class MeanJacobian : public testing::TestWithParam<Fidelity> {
 protected:
  MeanJacobian() {
    AlgorithmInput in;
    in.S = kS;
    in.A = kA;
    in.switches = SwitchesFor(GetParam());
    const Settings hyper = SmallHyper({{"options", kK}, {"embedding", kD}, {"hidden", 9}});
    in.hyper = &hyper;
    algorithm_ = MakeAlgorithm("option2vec", in);
    for (Param* p : algorithm_->Params()) {
      p->value = RandomMat(p->value.rows(), p->value.cols(), rng_, 0.5);
    }
  }
  MatD Analytic(const Mat& s, const std::vector<int>& o) {
    MatD J;
    algorithm_->MeanJacobian(s, o, J);
    return J;
  }
  /// mu (A), mean over the samples.
  VecD Mean() {
    Mat mu, sigma;
    algorithm_->ActionPolicy(s_, o_, mu, sigma);
    return mu.rowwise().mean();
  }

  Rng rng_{11, "test"};
  std::unique_ptr<Algorithm> algorithm_;
  const Mat s_ = RandomMat(kS, kB, rng_);
  const std::vector<int> o_ = RandomOptions(kB, kK, rng_);
};

TEST_P(MeanJacobian, AgreesWithCentralDifferences) {
  const MatD J = Analytic(s_, o_);
  ASSERT_EQ(J.rows(), kA);
  ASSERT_EQ(J.cols(), kD);
  Mat& W_o = algorithm_->Embedding()->value;
  const Mat kept = W_o;
  for (int d = 0; d < kD; ++d) {  // of every option, and so of the one that each sample executes
    W_o.row(d) = kept.row(d).array() + kStep;
    const VecD above = Mean();
    W_o.row(d) = kept.row(d).array() - kStep;
    const VecD below = Mean();
    W_o.row(d) = kept.row(d);
    for (int a = 0; a < kA; ++a) {
      const double n = (above(a) - below(a)) / (2 * kStep);
      EXPECT_GT(std::abs(n), 1e-3) << a << d;
      EXPECT_NEAR(J(a, d), n, kTolerance * std::abs(n)) << a << d;
    }
  }
}

TEST_P(MeanJacobian, IsTheMeanOverTheSamples) {
  MatD sum = MatD::Zero(kA, kD);
  for (int b = 0; b < kB; ++b) sum += Analytic(s_.col(b), {o_[std::size_t(b)]});
  EXPECT_LT((Analytic(s_, o_) - sum / kB).norm(), 1e-14 * sum.norm());
}

INSTANTIATE_TEST_SUITE_P(Fidelities, MeanJacobian,
                         testing::Values(Fidelity::kPaper, Fidelity::kReleased),
                         [](const auto& info) { return ToString(info.param); });

}  // namespace
}  // namespace o2v
