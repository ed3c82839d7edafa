#pragma once
// What the gradient checks of all methods share: a network, a batch and the comparisons.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "algo/algorithm.h"
#include "gradcheck/checks.h"

namespace o2v {

// Sizes: all different, so that a transposed product cannot pass; D is divisible by 1, 2 and 3
// heads.
inline constexpr int kS = 5, kA = 3, kK = 4, kHidden = 8, kD = 6, kF = 7, kInitHidden = 64;
// Numbers of the losses. Weights are ours: large enough for an error in their terms to show.
inline constexpr double kClip = 0.2;  // spec 7
inline constexpr double kGamma = 0.9, kEntropyWeight = 0.1, kPenalty = 0.3, kEpsilonGreedy = 0.2;

/// A network and a batch to check.
struct Setup {
  std::string method;
  Switches switches;
  std::uint64_t seed = 1;     // of weights and batch; the next ones where a ReLU is near its kink
  int heads = 1;              // of option2vec
  int activation = 0;         // of the others: 0 tanh, 1 ReLU
  int steps = 7;              // of iopg's episode
  bool second_start = false;  // of iopg: another first state in the middle of the episode
};

/// A network with random weights and a batch on both sides of every bend of its losses: both signs
/// of the advantage inside and outside both clip edges, first states of episodes and others.
class Problem {
 public:
  virtual ~Problem() = default;

  /// Distance of the nearest ReLU input from 0.
  double Margin() const { return margin_; }
  /// Every tensor, on the whole batch.
  Comparison Whole(int stage);
  /// The output layers' biases, whose gradients on one sample are the adjoints of its outputs.
  Comparison Outputs(int stage);

 protected:
  Problem(const Setup& setup, std::uint64_t seed);

  /// What the gradient of a tensor in a stage has to be.
  virtual Expect Expected(int stage, const std::string& name) const = 0;
  /// The stage's loss as a function of a tensor, with all that is detached held constant.
  virtual std::function<double()> LossOf(int stage, const std::string& name, const Batch& batch,
                                         const FixedDraws& fixed) = 0;
  /// Whether the tensor is the bias of a sample's output.
  virtual bool IsOutput(int stage, const std::string& name, const Batch& sample) const = 0;
  /// The part of the batch whose last sample is b: that sample alone, unless samples depend on
  /// others.
  virtual void Sample(int b, Batch& sample, FixedDraws& fixed) const;

  static bool Released(Fidelity f) { return f == Fidelity::kReleased; }
  /// Puts sample b at a distance from its choice's log-probability and from its value; every
  /// combination of side and sign comes in eight samples.
  void Place(StageTargets& targets, int b, double log_prob, double value);
  /// Whether Place puts the sample where the surrogate is flat.
  static bool IsClipped(int b);
  Mat& Tensor(const std::string& name);
  // Layers in textbook order, from the tensors of these names.
  Mat Affine(const std::string& name, const Mat& x);
  Mat Relu(const Mat& z);

  Setup setup_;
  Settings hyper_;
  Rng rng_;
  std::unique_ptr<Algorithm> algo_;
  std::vector<Param*> params_;
  std::map<std::string, Mat*> values_;  // of params_ by name; a method may add others
  Batch batch_;
  FixedDraws fixed_;
  double margin_;
};

/// Draws the problem of a seed.
using ProblemMaker = std::unique_ptr<Problem> (*)(const Setup& setup, std::uint64_t seed);
/// A name and what it changes in a setup.
using Variant = std::pair<std::string, void (*)(Setup& setup)>;

/// All checks of a method: of each stage, for both fidelities, each switch that a loss reads turned
/// over, each variant, and 20 random combinations of switches and variants (spec 10).
void AddChecks(const std::string& method, ProblemMaker make, const std::vector<Variant>& variants,
               std::vector<NamedCheck>& checks);

/// n options, each as often as any other, in random order.
std::vector<int> ShuffledOptions(std::size_t n, int K, Rng& rng);
Mat Stack(const Mat& top, const Mat& bottom);

/// Option2Vec.
void AddOption2VecChecks(std::vector<NamedCheck>& checks);
/// PPO and the methods with one network an option.
void AddBaselineChecks(std::vector<NamedCheck>& checks);

}  // namespace o2v
