#pragma once
// One iteration of every method that learns by PPO: a rollout, its targets, epochs of minibatches.

#include <vector>

#include "algo/method.h"
#include "rollout/minibatch.h"
#include "rollout/rollout.h"

namespace o2v {

/// B states and what was chosen there: views, valid until the method acts or draws again. Values
/// does not change the data that they point to.
struct Choices {
  ConstMatRef s;                // (S, B)
  std::span<const int> o_prev;  // (B) the options before
  std::span<const char> init;   // (B) first states of episodes
  std::span<const int> o;       // (B) options drawn, empty where none are
  ConstMatRef P;                // (K, B) probabilities they were drawn with: two-stage methods
};

/// PPO around what a method supplies: how it acts, what a state is worth, its loss. A training step
/// is Collect and Update, both in ppo_method.cc:
///   Collect   T times: Act -> VecEnv::Step -> Rollout::RecordStep
///             Values of all states -> Rollout::MakeTargets: advantages, returns
///   Update    each stage, each epoch, each minibatch: Gather -> Loss (adds gradients) -> Adam
/// Source: spec 1.3, 1.4; Schulman et al. 2017.
class PpoMethod : public Method {
 public:
  void Collect(VecEnv& env, std::vector<Episode>& episodes) final;
  const std::vector<SumAndCount>& Update() final;

 protected:
  /// Reads gamma, lambda, rollout, epochs and minibatch. Each stage has advantages and targets of
  /// its own. Arguments as for Method.
  PpoMethod(const AlgorithmInput& in, Index K, std::vector<std::string> stages = {"all"},
            const LossColumns& more = {});

  /// Chooses a_ at the states s (S, N), after o_prev_; writes options, probabilities and
  /// log-probabilities into the rollout's batch, from sample `first` on.
  virtual void Act(const Mat& s, std::span<const char> init, Index first) = 0;
  /// What the method would choose at s (S, N), after o_prev_: drawn for the values that a target is
  /// bootstrapped from, and thrown away. Source: spec 1.3.
  virtual Choices DrawForBootstrap(const Mat& s, std::span<const char> init);
  /// Values of B states into the critics' v, from entry `first` on.
  virtual void Values(const Choices& x, Index first) = 0;
  /// Around a rollout, in which the weights stand still.
  virtual void BeforeRollout() {}
  virtual void AfterRollout() {}

  Rollout rollout_;
  Mat a_;  // (A, N) the actions taken next

 private:
  /// All epochs of a stage.
  void LearnStage(int stage);

  const int T_, epochs_, minibatch_;
  const double gamma_, lambda_, adv_std_eps_;
  const bool bootstrap_;           // timelimit = paper
  std::vector<char> not_initial_;  // (N) zeros
  Transition transition_;
  std::vector<int> order_;  // of the samples
  Batch full_, last_;       // minibatches: of the size asked for; an epoch's last, smaller one
  Rng& shuffle_rng_ = NewStream("shuffle");
  Rng* const order_rng_;  // null with one stage
};

}  // namespace o2v
