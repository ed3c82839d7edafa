#include "algo/method.h"

#include <algorithm>

#include "base/check.h"

namespace o2v {

// ---- Statistics ---------------------------------------------------------------------------------

void Method::RecordOptions(Index first, std::span<const int> o, std::span<const char> init,
                           Batch& rollout) {
  for (std::size_t i = 0; i < o.size(); ++i) {
    const std::size_t b = std::size_t(first) + i;
    rollout.o[b] = o[i];
    rollout.o_prev[b] = o_prev_[i];
    rollout.init[b] = init[i];
    usage_.Count(o[i], o_prev_[i], init[i]);
    o_prev_[i] = o[i];
  }
}

const std::vector<SumAndCount>& Method::Report() {
  statistics_.clear();
  for (LossMeans& means : means_) {
    means.Report(statistics_);
    means.Clear();
  }
  usage_.Report(statistics_);
  usage_.Clear();
  return statistics_;
}

std::vector<std::string> Method::StatNames() const {
  std::vector<std::string> names;
  for (const std::string& stage : stages_) LossMeans::Names(stage, names, more_);
  usage_.Names(names);
  return names;
}

// ---- Construction, state, optimiser -------------------------------------------------------------

Method::Method(const AlgorithmInput& in, Index K, std::vector<std::string> stages,
               const LossColumns& more)
    : seed_(in.seed),
      init_rng_(in.seed, "init"),
      switches_(in.switches),
      K_(K),
      N_(in.workers),
      initialiser_(in.draw_weights ? Initialiser(init_rng_) : Initialiser()),
      usage_(K),
      stages_(std::move(stages)),
      more_(more),
      means_(stages_.size(), LossMeans(more)) {}

Rng& Method::NewStream(const std::string& name) {
  return streams_.emplace_back(name, Rng(seed_, name)).second;
}

void Method::RegisterNetworks(const AlgorithmInput& in, std::vector<Param*> all,
                              std::initializer_list<std::vector<Param*>> stages,
                              IntraOptionPolicies* policy, Mlp* critic) {
  policy_ = policy;
  critic_ = critic;
  params_ = std::move(all);
  for (const std::vector<Param*>& reached : stages) {
    std::vector<char>& in_graph = in_graph_.emplace_back();
    for (const Param* p : params_) in_graph.push_back(std::ranges::count(reached, p) > 0);
  }
  const Settings& s = *in.hyper;
  adam_ = std::make_unique<Adam>(
      params_, Adam::Options{s.Real("learning_rate"), s.Real("adam_beta1"), s.Real("adam_beta2"),
                             s.Real("adam_eps"), s.Real("clip_norm")});
}

void Method::Serialize(StateVisitor& v) {
  for (Param* p : params_) v.Matrix(p->name, p->value);
  adam_->Serialize(v);
  for (auto& [name, rng] : streams_) rng.Serialize(v, "rng." + name);
  if (!o_prev_.empty()) v.AllBelow("o_prev", o_prev_, K_);
}

double Method::Step(int stage) {
  return adam_->Step(in_graph_[std::size_t(stage)], switches_.adam_idle == Fidelity::kPaper
                                                        ? IdleRule::kSkip
                                                        : IdleRule::kZeroGradient);
}

Activation ReadActivation(const Settings& settings) {
  const int g = settings.Int("activation");
  if (g > 1) throw ConfigError(Concat("activation: ", g, " is neither 0 (tanh) nor 1 (relu)"));
  return g == 0 ? Activation::kTanh : Activation::kRelu;
}

OptionNets MakeOptionNets(const AlgorithmInput& in, OptionNets::CriticHead head,
                          const Initialiser& init) {
  return OptionNets(in.hyper->Int("options", 1), in.S, in.A, in.hyper->Int("hidden", 1),
                    ReadActivation(*in.hyper), head, init);
}

// ---- Queries ------------------------------------------------------------------------------------

void Method::ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) {
  IntraOptionPolicies::Cache& c = query_caches_(s.cols()).policy;
  policy_->ForwardOne(s, o, c);
  mu = c.nets.out;
  sigma = c.sigma;
}

void Method::OptionValues(const Mat& s, const std::vector<int>&, Mat& q) {
  Mlp::Cache& c = query_caches_(s.cols()).critic;
  critic_->Forward(s, c);
  q = c.out.topRows(NumOptions());
}

}  // namespace o2v
