#include "algo/two_stage.h"

#include "dist/categorical.h"

namespace o2v {

TwoStageMethod::TwoStageMethod(const AlgorithmInput& in)
    : PpoMethod(in, in.hyper->Int("options", 1), {"high", "low"}), o_(std::size_t(N_)), logp_(N_) {
  rollout_.batch.P_old = Mat::Zero(K_, rollout_.batch.Size());
  o_prev_.assign(std::size_t(N_), 0);
}

void TwoStageMethod::Act(const Mat& s, std::span<const char> init, Index first) {
  Batch& batch = rollout_.batch;
  const OptionDistribution options = Options(s, o_prev_, init);
  SampleCategorical(options.P, policy_rng_, o_);
  batch.P_old.middleCols(first, N_) = options.P;
  for (Index i = 0; i < N_; ++i) {
    batch.option.logp_old(first + i) = options.log_P(o_[std::size_t(i)], i);
  }
  DrawActions(s, o_, a_, logp_);
  batch.action.logp_old.segment(first, N_) = logp_;
  RecordOptions(first, o_, init, batch);
}

/// o ~ P(. | s, o').
Choices TwoStageMethod::DrawForBootstrap(const Mat& s, std::span<const char> init) {
  const OptionDistribution options = Options(s, o_prev_, init);
  SampleCategorical(options.P, bootstrap_rng_, o_);
  return {s, o_prev_, init, o_, options.P};
}

void TwoStageMethod::Values(const Choices& x, Index first) {
  const Mat& q = Critic(x.s, x.o);
  double* option = rollout_.critics[kOption].v.data() + first;
  double* action = rollout_.critics[kAction].v.data() + first;
  for (Index b = 0; b < q.cols(); ++b) {
    option[b] = double(x.P.col(b).dot(q.col(b)));
    action[b] = double(q(x.o[std::size_t(b)], b));
  }
}

}  // namespace o2v
