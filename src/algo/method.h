#pragma once
// What all methods do alike beside their mathematics.

#include <deque>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "algo/algorithm.h"
#include "algo/losses.h"
#include "algo/option_nets.h"
#include "algo/statistics.h"
#include "base/flush_subnormals.h"
#include "nn/activation.h"
#include "nn/adam.h"

namespace o2v {

/// Scratch matrices by batch width, so that the widths in use (workers, minibatch, a last smaller
/// minibatch) each keep theirs and nothing is resized after their first use.
template <typename Cache>
class CacheByWidth {
 public:
  Cache& operator()(Index width) {
    std::unique_ptr<Cache>& cache = caches_[width];
    if (!cache) cache = std::make_unique<Cache>();
    return *cache;
  }

 private:
  std::map<Index, std::unique_ptr<Cache>> caches_;
};

/// The base of the methods: optimiser, random streams, statistics, saved state, and what most
/// networks are asked alike. How a method acts (Collect, OptionPolicy) and what it learns (Loss,
/// Update) is in its own file.
class Method : public Algorithm {
  // First, as members below draw from them while they are made.
  const std::uint64_t seed_;
  Rng init_rng_;                                     // not part of the state
  std::deque<std::pair<std::string, Rng>> streams_;  // which stay where they are

 public:
  /// Parameters, optimiser, random streams and o_prev_.
  void Serialize(StateVisitor& v) override;
  /// Of each stage the columns of LossMeans, then those of OptionUsage.
  std::vector<std::string> StatNames() const override;

  std::vector<Param*> Params() override { return params_; }
  int NumOptions() const override { return int(std::max<Index>(K_, 1)); }
  /// Of the intra-option policies given to RegisterNetworks.
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override;
  /// The first K outputs of the critic given to RegisterNetworks.
  void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) override;

  std::vector<std::string> StageNames() const override { return stages_; }
  double Step(int stage) override;
  std::vector<char> InGraph(int stage) const override { return in_graph_[std::size_t(stage)]; }

 protected:
  struct QueryCache {
    IntraOptionPolicies::Cache policy;
    Mlp::Cache critic;
  };

  /// K = 0: a method without options. more: columns of updates.csv beside those of all methods.
  Method(const AlgorithmInput& in, Index K, std::vector<std::string> stages = {"all"},
         const LossColumns& more = {});
  /// A random stream that is part of the state.
  Rng& NewStream(const std::string& name);
  /// Closes construction, when the method's networks exist: pointers to them are kept.
  /// all: every parameter in the order of the network; stages: those that each stage's loss
  /// reaches. policy, critic: null where the method answers ActionPolicy, OptionValues itself.
  void RegisterNetworks(const AlgorithmInput& in, std::vector<Param*> all,
                        std::initializer_list<std::vector<Param*>> stages,
                        IntraOptionPolicies* policy, Mlp* critic);

  /// A step of the optimiser on the gradients of a loss with these terms, which are reported.
  void StepOn(int stage, const LossTerms& terms) {
    const double norm = Step(stage);
    means_[stage].Add(terms, norm);
  }
  /// Loss and step on a batch. Where an option is almost never chosen, or a termination saturates,
  /// gradients are subnormal numbers: slow, and too small to move a weight.
  void Learn(int stage, const Batch& batch) {
    const FlushSubnormals flush;
    StepOn(stage, Loss(stage, batch, nullptr));
  }
  /// Parameter i, whose gradient must be zero from now on, is never stepped again.
  void Hold(std::size_t i) { adam_->Freeze(i); }
  /// Options o of a step of all workers into `rollout`, from sample `first` on, with o_prev_ and
  /// the flags; they are counted and become o_prev_.
  void RecordOptions(Index first, std::span<const int> o, std::span<const char> init,
                     Batch& rollout);
  /// The numbers of StatNames() of all steps since the last call.
  const std::vector<SumAndCount>& Report();

  const Switches switches_;
  const Index K_;
  const int N_;                    // workers
  const Initialiser initialiser_;  // of the networks; for constructors
  std::vector<Param*> params_;
  std::vector<std::vector<char>> in_graph_;  // of each stage
  std::vector<int> o_prev_;                  // (N), empty where a method keeps them elsewhere
  OptionUsage usage_;
  Rng& policy_rng_ = NewStream("policy");  // of options and actions drawn while acting
  CacheByWidth<QueryCache> query_caches_;  // scratch of the queries
  IntraOptionPolicies* policy_ = nullptr;  // the method's
  Mlp* critic_ = nullptr;

 private:
  const std::vector<std::string> stages_;
  const LossColumns more_;
  std::unique_ptr<Adam> adam_;
  std::vector<LossMeans> means_;         // of each stage
  std::vector<SumAndCount> statistics_;  // of the last Report
};

/// The hyper-parameter `activation`, tanh or relu.
Activation ReadActivation(const Settings& settings);

/// The network of spec 2.3 in the sizes that the hyper-parameters say.
OptionNets MakeOptionNets(const AlgorithmInput& in, OptionNets::CriticHead head,
                          const Initialiser& init);

}  // namespace o2v
