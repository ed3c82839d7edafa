#include "algo/double_actor_critic.h"
#include "algo/option_policy.h"

namespace o2v {
namespace {

/// DAC+PPO: the option policy is the call-and-return mixture of a master policy and of
/// terminations,
///
///   pi_hat(o | s, o') = (1 - beta_{o'}(s)) delta_{o o'} + beta_{o'}(s) pi(o | s),
///
/// pi itself at first states; all else is the double actor-critic: acting is in two_stage.cc, the
/// losses are in double_actor_critic.cc, the training step is in ppo_method.cc. Source: spec 2.3,
/// 4.6; Zhang & Whiteson 2019.
class DacPpo final : public DoubleActorCritic {
 public:
  explicit DacPpo(const AlgorithmInput& in) : DoubleActorCritic(in) {
    nets_ = MakeOptionNets(in, OptionNets::CriticHead::kQ, initialiser_);
    std::vector<Param*> option_policy = nets_.master.Params();
    Append(option_policy, nets_.beta.Params());
    RegisterStages(in, nets_.Params(), option_policy, &nets_.policy, &nets_.critic);
  }

 private:
  void OptionForward(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                     When when, Mat& p) override {
    OptionNets::CallAndReturnCache& c = caches_(s.cols());
    nets_.Master(s, c);
    nets_.BetaAndMask(s, o_prev, switches_.beta_index, c);
    if (when == When::kUpdate && switches_.dac_update_mask == Fidelity::kReleased) {
      // As in the authors' code: the first sample is marked with every o' of the minibatch, the
      // other samples with none; spec 4.6 (g).
      c.M.col(0) = c.M.rowwise().maxCoeff();
      c.M.rightCols(c.M.cols() - 1).setZero();
    }
    MixCallAndReturn(c.pi, c.beta.beta, c.M, o_prev, init, switches_.beta_index, p);
  }

  void OptionBackward(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                      const Mat& dp) override {
    OptionNets::CallAndReturnCache& c = caches_(s.cols());
    MixCallAndReturnBackward(dp, c.pi, c.beta.beta, c.M, o_prev, init, switches_.beta_index,
                             c.master.dout, c.beta.db);
    nets_.master.Backward(s, c.master);
    nets_.BackwardBeta(s, o_prev, c.beta);
  }

  OptionNets nets_;
  CacheByWidth<OptionNets::CallAndReturnCache> caches_;
};

}  // namespace

std::unique_ptr<Algorithm> MakeDacPpo(const AlgorithmInput& in) {
  return std::make_unique<DacPpo>(in);
}

}  // namespace o2v
