#include "rollout/rollout.h"

#include "rollout/gae.h"

namespace o2v {

bool RecordEnds(const Transition& transition, int t, MatD& mask) {
  bool time_limit = false;
  for (Index i = 0; i < mask.rows(); ++i) {
    mask(i, t) = transition.Done(std::size_t(i)) ? 0 : 1;
    time_limit |= transition.TimeLimit(std::size_t(i));
  }
  return time_limit;
}

Rollout::Rollout(Index S, Index A, int N, int T, int n_critics)
    : mask(MatD::Ones(N, T)), critics(std::size_t(n_critics), CriticTargets(N, T)) {
  batch.Resize(S, A, Index(N) * T);
  batch.P_old.resize(0, batch.Size());  // two-stage methods give it K rows
}

bool Rollout::RecordStep(const Transition& transition, int t) {
  for (CriticTargets& critic : critics) critic.r.col(t) = transition.r;
  return RecordEnds(transition, t, mask);
}

void Rollout::BootstrapTimeLimits(const Transition& transition, int t, double gamma) {
  const Index T = mask.cols();
  for (Index i = 0; i < mask.rows(); ++i) {
    if (!transition.TimeLimit(std::size_t(i))) continue;
    for (CriticTargets& critic : critics) critic.r(i, t) += gamma * critic.v(i, T);
  }
}

void Rollout::MakeTargets(double gamma, double lambda, double adv_std_eps) {
  for (std::size_t i = 0; i < critics.size(); ++i) {
    CriticTargets& critic = critics[i];
    StageTargets& out = i + 1 < critics.size() ? batch.option : batch.action;
    Gae(critic.r, mask, critic.v, gamma, lambda, critic.adv, critic.ret);
    NormalizeAdvantages(critic.adv, adv_std_eps, out.adv_hat);
    out.ret = Eigen::Map<const VecD>(critic.ret.data(), critic.ret.size()).cast<Real>();
  }
}

}  // namespace o2v
