// IOPG's occupancies against the sum over all sequences of options (spec 9.7, checks 13 and 14), in
// double.

#include <gtest/gtest.h>

#include <cmath>

#include "algo/option_nets.h"
#include "algo/toy.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "grad_check.h"
#include "small_hyper.h"

namespace o2v {
namespace {

constexpr int K = 3, S = 5, A = 2, kHidden = 6, kSteps = 4;

/// An episode of four steps of a network of three options.
struct Episode4 {
  Settings hyper = SmallHyper({{"options", K}, {"hidden", kHidden}, {"gamma", 1}});
  Switches switches;
  std::unique_ptr<Algorithm> iopg;
  OptionNets nets;  // ours, to evaluate iopg's parameters by
  Batch batch;
  Rng rng{3, "iopg"};

  explicit Episode4(Fidelity beta_index) {
    switches.beta_index = beta_index;
    AlgorithmInput in;
    in.S = S;
    in.A = A;
    in.hyper = &hyper;
    in.switches = switches;
    iopg = MakeAlgorithm("iopg", in);
    nets = OptionNets(K, S, A, kHidden, Activation::kTanh, OptionNets::CriticHead::kQ, rng);
    for (Param* p : iopg->Params()) {
      p->value += RandomMat(p->value.rows(), p->value.cols(), rng, 0.7);
    }
    batch = RandomBatch(S, A, K, kSteps, rng);
    batch.init = {1, 0, 0, 0};
  }

  /// Probability of the first n actions, J_n = sum over o_1..o_n of pi(o_1) p_1[o_1] P_2[o_1, o_2]
  /// p_2[o_2] ...; entry n - 1.
  VecD Joint() {
    const std::vector<Param*> from = iopg->Params(), to = nets.Params();
    for (std::size_t i = 0; i < from.size(); ++i) to[i]->value = from[i]->value;
    Mlp::Cache master;
    Mat log_pi, pi;
    OptionNets::BetaCache beta;
    IntraOptionPolicies::Cache policy;
    nets.master.Forward(batch.s, master);
    LogSoftmax(master.out, log_pi, pi);
    nets.Beta(batch.s, {}, /*all=*/true, beta);
    MatD p(K, kSteps);
    for (int k = 0; k < K; ++k) {
      Vec logp;
      nets.policy.ForwardOne(batch.s, std::vector<int>(kSteps, k), policy);
      GaussianLogProb(batch.a, policy.nets.out, policy.sigma, logp);
      p.row(k) = logp.array().exp().transpose();
    }
    VecD joint = VecD::Zero(kSteps);
    for (int n = 1; n <= kSteps; ++n) {
      for (int code = 0; code < std::pow(K, n); ++code) {
        double product = 1;
        int before = 0;
        for (int t = 0, rest = code; t < n; ++t, rest /= K) {
          const int o = rest % K;
          // beta of the option that may end, or in released of the one that would follow
          const double stop = beta.beta(switches.beta_index == Fidelity::kPaper ? before : o, t);
          product *= p(o, t) * (t == 0 ? pi(o, t) : (1 - stop) * (o == before) + stop * pi(o, t));
          before = o;
        }
        joint(n - 1) += product;
      }
    }
    return joint;
  }
};

constexpr Fidelity kForms[] = {Fidelity::kPaper, Fidelity::kReleased};

TEST(IopgEnumeration, ProductOfStepsIsTheSumOverAllSequences) {
  for (const Fidelity beta_index : kForms) {
    Episode4 e(beta_index);
    // v = 0 and returns that are 1 up to step n, then 0: the surrogate is -(1/4) ln c_1 ... c_n.
    FindParam(*e.iopg, "critic.q.W").value.setZero();
    FindParam(*e.iopg, "critic.q.b").value.setZero();
    const VecD joint = e.Joint();
    for (int n = 1; n <= kSteps; ++n) {
      e.batch.r = VecD::Unit(kSteps, n - 1);
      const double product = std::exp(-kSteps * e.iopg->Loss(0, e.batch, nullptr).surrogate);
      EXPECT_NEAR(product / joint(n - 1), 1, 1e-12) << n << " steps, " << ToString(beta_index);
    }
  }
}

TEST(IopgEnumeration, GradientsAreThoseOfTheSum) {
  for (const Fidelity beta_index : kForms) {
    Episode4 e(beta_index);
    // Constant while the options' networks move.
    Mat q;
    e.iopg->OptionValues(e.batch.s, e.batch.o, q);
    VecD adv(kSteps);
    double R = 0;
    for (int t = kSteps - 1; t >= 0; --t) {
      R += e.batch.r(t);
      adv(t) = R - q(0, t);
    }
    const auto loss = [&] {
      const VecD joint = e.Joint();
      double sum = 0;
      for (int t = 0; t < kSteps; ++t) {
        sum -= adv(t) * std::log(joint(t) / (t == 0 ? 1 : joint(t - 1)));
      }
      return sum / kSteps;
    };
    EXPECT_NEAR(e.iopg->Loss(0, e.batch, nullptr).surrogate, loss(), 1e-12);
    std::vector<Slot> slots;
    for (Param* p : e.iopg->Params()) {
      if (!p->name.starts_with("critic.")) slots.emplace_back(p->name, p->value, p->grad, loss);
    }
    const Verdict verdict = RewardAndEnd(Compare(slots, e.rng, /*most=*/21));
    EXPECT_GT(verdict.entries, 300u);
    EXPECT_TRUE(verdict.Passed()) << verdict.largest_error << " of " << verdict.worst << ", "
                                  << ToString(beta_index);
  }
}

}  // namespace
}  // namespace o2v
