#include "algo/ppo_method.h"

#include "base/check.h"

namespace o2v {

PpoMethod::PpoMethod(const AlgorithmInput& in, Index K, std::vector<std::string> stages,
                     const LossColumns& more)
    : Method(in, K, std::move(stages), more),
      rollout_(in.S, in.A, N_, in.hyper->Int("rollout", 1), int(StageNames().size())),
      a_(in.A, N_),
      T_(in.hyper->Int("rollout", 1)),
      epochs_(in.hyper->Int("epochs", 1)),
      minibatch_(in.hyper->Int("minibatch", 1)),
      gamma_(in.hyper->Real("gamma")),
      lambda_(in.hyper->Real("lambda")),
      adv_std_eps_(in.switches.adv_std_eps),
      bootstrap_(in.switches.timelimit == Fidelity::kPaper),
      not_initial_(std::size_t(N_), 0),
      order_(std::size_t(N_) * std::size_t(T_)),
      order_rng_(StageNames().size() == 2 ? &NewStream("order") : nullptr) {
  if (order_.size() < 2) {
    throw ConfigError(Concat(in.hyper->Origin("rollout"), ": 'rollout' is 1 with one worker; ",
                             "advantages are normalised over at least two samples"));
  }
}

void PpoMethod::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  Batch& batch = rollout_.batch;
  const Index after = batch.Size();  // of v: the states after the rollout, and those at time limits
  BeforeRollout();
  for (int t = 0; t < T_; ++t) {
    const Index first = Index(t) * N_;
    Act(env.States(), env.EpisodeStarts(), first);
    batch.s.middleCols(first, N_) = env.States();
    batch.a.middleCols(first, N_) = a_;
    env.Step(a_, transition_, episodes);
    const bool time_limit = rollout_.RecordStep(transition_, t);
    if (time_limit && bootstrap_) {
      Values(DrawForBootstrap(transition_.s_last, not_initial_), after);
      rollout_.BootstrapTimeLimits(transition_, t, gamma_);
    }
  }
  // Acting needs no values: they are computed here, in blocks as large as a minibatch.
  for (Index first = 0; first < after; first += minibatch_) {
    const Index n = std::min(Index(minibatch_), after - first);
    Values({batch.s.middleCols(first, n), Entries(batch.o_prev, first, n),
            Entries(batch.init, first, n), Entries(batch.o, first, n),
            batch.P_old.middleCols(first, n)},
           first);
  }
  Values(DrawForBootstrap(env.States(), env.EpisodeStarts()), after);
  rollout_.MakeTargets(gamma_, lambda_, adv_std_eps_);
  AfterRollout();
}

Choices PpoMethod::DrawForBootstrap(const Mat& s, std::span<const char> init) {
  return {s, o_prev_, init, {}, rollout_.batch.P_old.leftCols(0)};
}

void PpoMethod::LearnStage(int stage) {
  for (int epoch = 0; epoch < epochs_; ++epoch) {
    ForEachMinibatch(order_, minibatch_, shuffle_rng_, [&](std::span<const int> rows) {
      Batch& minibatch = int(rows.size()) == minibatch_ ? full_ : last_;
      Gather(rollout_.batch, rows, minibatch);
      Learn(stage, minibatch);
    });
  }
}

const std::vector<SumAndCount>& PpoMethod::Update() {
  if (order_rng_) {
    const int first = order_rng_->Uniform() < 0.5 ? 0 : 1;  // a fair coin; spec 4.6 (f), 4.8 (f)
    LearnStage(first);
    LearnStage(1 - first);
  } else {
    LearnStage(0);
  }
  return Report();
}

}  // namespace o2v
