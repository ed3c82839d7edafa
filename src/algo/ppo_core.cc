#include "algo/ppo_core.h"

#include <algorithm>
#include <numeric>

namespace o2v {

PpoHyper::PpoHyper(const Settings& s)
    : gamma(s.Real("gamma")),
      lambda(s.Real("lambda")),
      rollout(s.Int("rollout", 1)),
      epochs(s.Int("epochs", 1)),
      minibatch(s.Int("minibatch", 1)),
      ratio_clip(s.Real("ratio_clip")),
      adam(ReadAdam(s)) {}

Adam::Options ReadAdam(const Settings& s) {
  return {s.Real("learning_rate"), s.Real("adam_beta1"), s.Real("adam_beta2"), s.Real("adam_eps"),
          s.Real("clip_norm")};
}

void CriticStream::Finish(const MatD& mask, const PpoHyper& hyper, double adv_std_eps,
                          Stream& out) {
  Gae(r, mask, v, hyper.gamma, hyper.lambda, adv, ret);
  NormalizeAdvantages(adv, adv_std_eps, out.adv_hat);
  out.ret = Eigen::Map<const VecD>(ret.data(), ret.size()).cast<Real>();
}

bool RecordEnds(const Transition& transition, int t, MatD& mask) {
  bool time_limit = false;
  for (Index i = 0; i < mask.rows(); ++i) {
    mask(i, t) = transition.Done(std::size_t(i)) ? 0 : 1;
    time_limit |= transition.TimeLimit(std::size_t(i));
  }
  return time_limit;
}

void OptionUsage::Clear() {
  std::fill(executed_.begin(), executed_.end(), 0);
  std::fill(begun_.begin(), begun_.end(), 0);
}

void OptionUsage::Count(int o, int o_prev, bool init) {
  executed_[std::size_t(o)] += 1;
  begun_[std::size_t(o)] += init || o != o_prev;
}

void OptionUsage::Report(std::vector<double>& stats) const {
  const double steps = std::accumulate(executed_.begin(), executed_.end(), 0.0);
  for (const double n : executed_) stats.push_back(n / steps);
  for (std::size_t k = 0; k < executed_.size(); ++k) {
    stats.push_back(executed_[k] / std::max(1.0, begun_[k]));
  }
}

void OptionUsage::Names(std::vector<std::string>& names) const {
  for (std::size_t k = 0; k < executed_.size(); ++k) names.push_back("usage_" + std::to_string(k));
  for (std::size_t k = 0; k < executed_.size(); ++k) {
    names.push_back("duration_" + std::to_string(k) + "_steps");
  }
}

void RecordOptions(Index column, std::span<const int> o, std::span<const char> init,
                   std::vector<int>& o_prev, Batch& rollout, OptionUsage& usage) {
  for (std::size_t i = 0; i < o.size(); ++i) {
    const std::size_t row = std::size_t(column) + i;
    rollout.o[row] = o[i];
    rollout.o_prev[row] = o_prev[i];
    rollout.init[row] = init[i];
    usage.Count(o[i], o_prev[i], init[i]);
    o_prev[i] = o[i];
  }
}

Activation ReadActivation(const Settings& settings) {
  return settings.Int("activation") == 0 ? Activation::kTanh : Activation::kRelu;
}

}  // namespace o2v
