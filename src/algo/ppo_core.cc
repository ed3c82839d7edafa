#include "algo/ppo_core.h"

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

PpoRollout::PpoRollout(const AlgorithmInput& in, int n_critics)
    : N_(in.workers),
      T_(in.hyper->Int("rollout", 1)),
      epochs_(in.hyper->Int("epochs", 1)),
      minibatch_(in.hyper->Int("minibatch", 1)),
      gamma_(in.hyper->Real("gamma")),
      lambda_(in.hyper->Real("lambda")),
      adv_std_eps_(in.switches.adv_std_eps),
      bootstrap_(in.switches.timelimit == Fidelity::kPaper),
      not_initial_(std::size_t(N_), 0),
      order_(std::size_t(N_) * std::size_t(T_)) {
  if (order_.size() < 2) {
    throw ConfigError(Concat(in.hyper->Origin("rollout"), ": 'rollout' is 1 with one worker; ",
                             "advantages are normalised over at least two samples"));
  }
  batch.Resize(in.S, in.A, Index(N_) * T_);
  mask = MatD::Ones(N_, T_);
  critics.assign(std::size_t(n_critics), CriticStream(N_, T_));
}

void PpoRollout::SetOptionValues(const ConstMatRef& p, const Mat& q, std::span<const int> o,
                                 Index row) {
  double* high = critics[0].v.data() + row;
  double* low = critics[1].v.data() + row;
  for (Index b = 0; b < q.cols(); ++b) {
    high[b] = double(p.col(b).dot(q.col(b)));
    low[b] = double(q(o[std::size_t(b)], b));
  }
}

void PpoRollout::Bootstrap(int t) {
  for (int i = 0; i < N_; ++i) {
    if (!transition_.TimeLimit(std::size_t(i))) continue;
    for (CriticStream& critic : critics) critic.r(i, t) += gamma_ * critic.v(i, T_);
  }
}

void PpoRollout::Finish() {
  for (CriticStream& critic : critics) {
    Stream& out = &critic == &critics.back() ? batch.low : batch.high;
    Gae(critic.r, mask, critic.v, gamma_, lambda_, critic.adv, critic.ret);
    NormalizeAdvantages(critic.adv, adv_std_eps_, out.adv_hat);
    out.ret = Eigen::Map<const VecD>(critic.ret.data(), critic.ret.size()).cast<Real>();
  }
}

}  // namespace o2v
