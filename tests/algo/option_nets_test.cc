#include "algo/option_nets.h"

#include <gtest/gtest.h>

#include "algo/toy.h"

namespace o2v {
namespace {

constexpr Index K = 4, S = 5, A = 3, h = 8, B = 12;
// One sample passes through the same network either way, but in products of other widths.
constexpr double kTolerance = 1e-5;

/// An option network with weights of order 1, states, and options of which the last is absent.
struct OnSamples {
  Rng rng{4, "option nets"};
  OptionNets nets;
  Mat s = RandomMat(S, B, rng);
  std::vector<int> o = RandomOptions(B, K - 1, rng);

  explicit OnSamples(Activation activation = Activation::kTanh)
      : nets(K, S, A, h, activation, OptionNets::CriticHead::kQ, rng) {
    for (Param* p : nets.Params()) {
      p->value += RandomMat(p->value.rows(), p->value.cols(), rng, 0.3);
    }
  }
  /// The gradients so far, which are put back to zero.
  std::vector<Mat> TakeGradients() {
    std::vector<Mat> gradients;
    for (const Param* p : nets.Params()) gradients.push_back(p->grad);
    ZeroGrad(nets.Params());
    return gradients;
  }
  void ExpectEqual(const std::vector<Mat>& a, const std::vector<Mat>& b) {
    const std::vector<Param*> params = nets.Params();
    for (std::size_t i = 0; i < params.size(); ++i) {
      const double scale = 1 + double(b[i].cwiseAbs().maxCoeff());
      EXPECT_LT(double((a[i] - b[i]).cwiseAbs().maxCoeff()), kTolerance * scale) << params[i]->name;
    }
  }
};

/// Columns k B + b of `all` with k = o_b.
Mat Picked(const Mat& all, const std::vector<int>& o) {
  Mat picked(all.rows(), B);
  for (Index b = 0; b < B; ++b) picked.col(b) = all.col(o[std::size_t(b)] * B + b);
  return picked;
}
/// The reverse; 0 elsewhere.
Mat Spread(const Mat& one, const std::vector<int>& o) {
  Mat all = Mat::Zero(one.rows(), K * B);
  for (Index b = 0; b < B; ++b) all.col(o[std::size_t(b)] * B + b) = one.col(b);
  return all;
}

TEST(IntraOptionPolicies, OfOneAreThoseOfAllPickedByOption) {
  for (const Activation activation : {Activation::kTanh, Activation::kRelu}) {
    OnSamples on(activation);
    IntraOptionPolicies::Cache one, all;
    on.nets.policy.ForwardOne(on.s, on.o, one);
    on.nets.policy.ForwardAll(on.s, all);
    ASSERT_EQ(all.nets.out.cols(), K * B);
    EXPECT_LT((one.nets.out - Picked(all.nets.out, on.o)).cwiseAbs().maxCoeff(), kTolerance);
    EXPECT_EQ(one.sigma, Picked(all.sigma, on.o));
  }
}

TEST(IntraOptionPolicies, OfOneHaveTheGradientsOfAllWithZerosElsewhere) {
  for (const Activation activation : {Activation::kTanh, Activation::kRelu}) {
    OnSamples on(activation);
    const Mat dmu = RandomMat(A, B, on.rng), dsigma = RandomMat(A, B, on.rng);
    IntraOptionPolicies::Cache one, all;
    on.nets.policy.ForwardOne(on.s, on.o, one);
    one.nets.dout = dmu;
    one.dsigma = dsigma;
    on.nets.policy.Backward(on.s, on.o, one);
    const std::vector<Mat> of_one = on.TakeGradients();
    on.nets.policy.ForwardAll(on.s, all);
    all.nets.dout = Spread(dmu, on.o);
    all.dsigma = Spread(dsigma, on.o);
    on.nets.policy.Backward(on.s, {}, all);
    on.ExpectEqual(of_one, on.TakeGradients());
  }
}

TEST(OptionNets, TerminationsOfOneAreThoseOfAllPickedByOption) {
  OnSamples on;
  OptionNets::BetaCache one, all;
  on.nets.Beta(on.s, on.o, /*all=*/false, one);
  on.nets.Beta(on.s, {}, /*all=*/true, all);
  for (Index b = 0; b < B; ++b) {
    for (Index k = 0; k < K; ++k) {
      if (k == on.o[std::size_t(b)]) {
        EXPECT_NEAR(one.beta(k, b), all.beta(k, b), kTolerance);
      } else {
        EXPECT_EQ(one.beta(k, b), 0);
      }
    }
  }

  const Mat db = RandomMat(1, B, on.rng);
  one.db.setZero(K, B);
  for (Index b = 0; b < B; ++b) one.db(on.o[std::size_t(b)], b) = db(0, b);
  all.db = one.db;
  on.nets.BackwardBeta(on.s, on.o, one);
  const std::vector<Mat> of_one = on.TakeGradients();
  on.nets.BackwardBeta(on.s, {}, all);
  on.ExpectEqual(of_one, on.TakeGradients());
}

TEST(OptionNets, AnAbsentOptionGetsNoGradient) {
  OnSamples on;  // without option K - 1
  IntraOptionPolicies::Cache c;
  on.nets.policy.ForwardOne(on.s, on.o, c);
  c.nets.dout = RandomMat(A, B, on.rng);
  c.dsigma = RandomMat(A, B, on.rng);
  on.nets.policy.Backward(on.s, on.o, c);
  for (const Param* p : on.nets.Params()) {
    const bool present = p->name.find(".mu.") != std::string::npos || p->name.ends_with(".rho");
    const bool absent = p->name.starts_with("option3.");
    EXPECT_EQ(p->grad.cwiseAbs().maxCoeff() > 0, present && !absent) << p->name;
  }
}

TEST(PerOptionMlps, RefusesOptionsOfAnotherBatch) {
  OnSamples on;
  IntraOptionPolicies::Cache c;
  on.o.pop_back();
  EXPECT_THROW(on.nets.policy.ForwardOne(on.s, on.o, c), Error);
}

}  // namespace
}  // namespace o2v
