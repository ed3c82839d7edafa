#pragma once
// What a learning method is to everybody else.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "algo/switches.h"
#include "base/check.h"
#include "base/settings.h"
#include "base/state.h"
#include "nn/param.h"
#include "rollout/batch.h"
#include "rollout/vec_env.h"

namespace o2v {

/// Everything that a method is made from.
struct AlgorithmInput {
  int S = 0, A = 0;                 // sizes of the task
  int workers = 1;                  // N
  int time_limit = 1000;            // [steps] of the task's episodes; gym's usual limit
  const Settings* hyper = nullptr;  // hyper-parameters: keys of paper_configs/algo/<method>.toml
  Switches switches;
  std::uint64_t seed = 0;    // of all its random streams
  bool draw_weights = true;  // false: they stay zero, where the networks are only to be counted
};

/// Terms of a stage's loss on one batch, as optimised: total is what the gradients belong to.
struct LossTerms {
  double total = 0;
  double surrogate = 0;    // clipped surrogate, or the plain policy gradient term of OC and IOPG,
                           // with its minus sign
  double value = 0;        // with the factor 1/2
  double entropy = 0;      // mean entropy, positive for a distribution
  double termination = 0;  // PPOC, OC: penalty on terminations
  double master = 0;       // PPOC: policy gradient term of the master policy, with its minus sign
  double kl = 0;           // mean of r - 1 - ln r, r the probability ratio (Schulman's k3 estimate)
  double clip_fraction = 0;  // share of samples with a ratio outside [1-c, 1+c]
};

/// A statistic of an update: a sum over n minibatches, steps or executions of an option. To combine
/// updates, add the sums and the counts separately. Where n is 0 (no execution began) the value is
/// the sum.
struct SumAndCount {
  double sum = 0, n = 0;
  double Value() const { return sum / std::max(1.0, n); }
};

/// Random choices inside a loss, given instead of drawn. Used by gradient checks and oracles.
struct FixedDraws {
  std::vector<int> o;        // (B) options fed to action net and critic; empty: drawn
  std::vector<Mat> dropout;  // keep masks 0/1 in forward order; empty: drawn
};

/// What the training loop asks of a method: it acts on N workers and learns from what came back.
class Learner {
 public:
  virtual ~Learner() = default;

  /// One rollout. Appends the episodes that ended.
  virtual void Collect(VecEnv& env, std::vector<Episode>& episodes) = 0;
  /// All epochs over it. Returns a statistic for each of StatNames().
  virtual const std::vector<SumAndCount>& Update() = 0;
  /// Columns of updates.csv after `step`.
  virtual std::vector<std::string> StatNames() const = 0;
  /// The workers have been put on another task, between two updates. Nothing is frozen or reset by
  /// most methods. Source: spec 6.
  virtual void ChangeTask() {}
  /// All trainable arrays in the order of the network; names as in the checkpoint format.
  virtual std::vector<Param*> Params() = 0;
  /// All state that a resumed run needs, the parameters included.
  virtual void Serialize(StateVisitor& v) = 0;
};

/// What the networks of a method say: for evaluation, films and analysis. Dropout is off; the
/// options are given by the caller.
class Policy {
 public:
  virtual ~Policy() = default;

  /// K; 1 for a method without options.
  virtual int NumOptions() const = 0;
  /// s (S, B), o_prev (B), init (B) -> P (K, B), probabilities an option is drawn with.
  virtual void OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                            const std::vector<char>& init, Mat& P) = 0;
  /// s (S, B), o (B) -> mu, sigma (A, B) of the action's Gaussian.
  virtual void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) = 0;
  /// s (S, B), o (B) the option that the critic is fed -> q (K, B).
  virtual void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) = 0;

  /// W_o (D, K), whose column k is the embedding o_hat of option k, as one of the learner's
  /// parameters; null for a method whose options have none.
  virtual Param* Embedding() { return nullptr; }
  /// s (S, B), o (B) -> J (A, D), mean over the samples of d mu / d o_hat at the embedding of the
  /// option given. Throws Error without an embedding.
  virtual void MeanJacobian(const Mat&, const std::vector<int>&, MatD&) {
    throw Error("the method's options have no embedding");
  }
};

/// The parts of Learner::Update one by one: for gradient checks and oracles.
class Stages {
 public:
  virtual ~Stages() = default;

  /// {"high", "low"}, the option and the action stage of a two-stage method, else {"all"}.
  virtual std::vector<std::string> StageNames() const = 0;
  /// Loss of a stage on a batch; adds its gradients to Params(). `fixed` may be null.
  virtual LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) = 0;
  /// Clips the gradients, steps the optimiser by the idle rule (`adam_idle`) and zeroes the
  /// gradients. Returns the global norm before clipping.
  virtual double Step(int stage) = 0;
  /// The tensors that the stage's loss can reach, by position in Params().
  virtual std::vector<char> InGraph(int stage) const = 0;
};

/// A learning method.
class Algorithm : public Learner, public Policy, public Stages {};

/// A registry line.
struct AlgorithmEntry {
  std::string id;
  std::string name;  // in tables and figures, the authors' included
  std::unique_ptr<Algorithm> (*make)(const AlgorithmInput&);
  int revision;  // of its code, counted up by a change that moves its results
};

/// All methods, in the order of list.inc.
const std::vector<AlgorithmEntry>& AlgorithmRegistry();
/// Throws ConfigError for an unknown id; the message lists the nearest known ones.
const AlgorithmEntry& FindAlgorithm(const std::string& id);
/// FindAlgorithm(id).make(input).
std::unique_ptr<Algorithm> MakeAlgorithm(const std::string& id, const AlgorithmInput& input);

}  // namespace o2v
