#include "algo/double_actor_critic.h"
#include "dist/categorical.h"

namespace o2v {
namespace {

/// DAC+PPO: the option policy is the call-and-return mixture of a master policy and of
/// terminations,
///
///   pi_hat(o | s, o') = (1 - beta_{o'}(s)) delta_{o o'} + beta_{o'}(s) pi(o | s),
///
/// pi itself at first states; all else is the double actor-critic. Source: spec 2.3, 4.6; Zhang &
/// Whiteson 2019.
class DacPpo final : public DoubleActorCritic {
 public:
  explicit DacPpo(const AlgorithmInput& in) : DoubleActorCritic(in) {
    Rng init(in.seed, "init");
    nets_ = OptionNets(in.hyper->Int("options", 1), in.S, in.A, in.hyper->Int("hidden", 1),
                       ReadActivation(*in.hyper), OptionNets::CriticHead::kQ, init);
    Assemble(
        nets_.policy, nets_.critic,
        [](const std::string& name) {
          return name.starts_with("master.") || name.starts_with("critic.body.") ||
                 name.starts_with("critic.q.") || name.find(".beta.") != std::string::npos;
        },
        [](const std::string& name) {
          return name.starts_with("critic.body.") || name.starts_with("critic.q.") ||
                 name.find(".mu.") != std::string::npos || name.ends_with(".rho");
        });
  }

  std::vector<Param*> Params() override { return nets_.Params(); }

 private:
  struct Cache {
    Net::Cache master;  // out is the logits z
    OptionNets::BetaCache beta;
    Mat log_pi, pi, M;  // (K, B)
  };

  void OptionForward(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                     Asked asked, Mat& p) override {
    Cache& c = caches_(s.cols());
    nets_.master.Forward(s, c.master);
    LogSoftmax(c.master.out, c.log_pi, c.pi);
    nets_.Beta(s, o_prev, switches_.beta_index == Fidelity::kReleased, c.beta);
    c.M.resize(c.pi.rows(), c.pi.cols());
    OneHot(o_prev, c.M);
    if (asked == Asked::kUpdate && switches_.dac_update_mask == Fidelity::kReleased) {
      // Every o' of the batch is marked in the first row, none in the others; spec 4.6 (g)
      c.M.col(0) = c.M.rowwise().maxCoeff();
      c.M.rightCols(c.M.cols() - 1).setZero();
    }
    CallAndReturn(c.pi, c.beta.beta, c.M, o_prev, init, switches_.beta_index, p);
  }

  void OptionBackward(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                      const Mat& dp) override {
    Cache& c = caches_(s.cols());
    CallAndReturnBackward(dp, c.pi, c.beta.beta, c.M, o_prev, init, switches_.beta_index,
                          c.master.dout, c.beta.db);
    nets_.master.Backward(s, c.master);
    nets_.BackwardBeta(s, o_prev, c.beta);
  }

  OptionNets nets_;
  CacheByWidth<Cache> caches_;
};

}  // namespace

std::unique_ptr<Algorithm> MakeDacPpo(const AlgorithmInput& in) {
  return std::make_unique<DacPpo>(in);
}

}  // namespace o2v
