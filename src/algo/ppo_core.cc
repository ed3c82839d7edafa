#include "algo/ppo_core.h"

namespace o2v {

PpoHyper::PpoHyper(const Settings& s)
    : gamma(s.Real("gamma")),
      lambda(s.Real("lambda")),
      rollout(s.Int("rollout", 1)),
      epochs(s.Int("epochs", 1)),
      minibatch(s.Int("minibatch", 1)),
      ratio_clip(s.Real("ratio_clip")),
      adam{s.Real("learning_rate"), s.Real("adam_beta1"), s.Real("adam_beta2"), s.Real("adam_eps"),
           s.Real("clip_norm")} {}

void CriticStream::Finish(const MatD& mask, const PpoHyper& hyper, double adv_std_eps,
                          Stream& out) {
  Gae(r, mask, v, hyper.gamma, hyper.lambda, adv, ret);
  NormalizeAdvantages(adv, adv_std_eps, out.adv_hat);
  out.ret = Eigen::Map<const VecD>(ret.data(), ret.size()).cast<Real>();
}

}  // namespace o2v
