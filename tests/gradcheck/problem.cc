#include "gradcheck/problem.h"

#include <algorithm>
#include <limits>
#include <set>

#include "base/check.h"
#include "random_mat.h"

namespace o2v {
namespace {

constexpr int kEntries = 21;  // of each tensor: 20 random ones, spec 10.2, and the largest

Settings Hyper(const Setup& setup) {
  Settings hyper;
  const std::pair<const char*, double> numbers[] = {
      // of every method
      {"gamma", kGamma},
      {"lambda", 0.95},
      {"rollout", 10},
      {"epochs", 1},
      {"minibatch", 10},
      {"learning_rate", 3e-4},
      {"adam_beta1", 0.9},
      {"adam_beta2", 0.999},
      {"adam_eps", 1e-5},
      {"clip_norm", 0.5},
      {"ratio_clip", kClip},
      {"hidden", kHidden},
      {"options", kK},
      // of Option2Vec
      {"embedding", kD},
      {"heads", setup.heads},
      {"ffn", kF},
      {"init_hidden", kInitHidden},
      {"entropy_weight_option", kEntropyWeight},
      {"entropy_weight_action", kEntropyWeight},
      // of the others
      {"activation", setup.activation},
      {"entropy_weight", kEntropyWeight},
      {"termination_penalty", kPenalty},
      {"epsilon_greedy", kEpsilonGreedy},
      {"target_every", 1000},
      {"ynet_hidden", kInitHidden},
  };
  for (const auto& [key, value] : numbers) hyper.Set(key, value, "gradcheck");
  return hyper;
}

/// Whether a loss reads the switch; the rest act in rollout and optimiser.
bool InLoss(const SwitchInfo& info, const std::string& method) {
  static const std::set<std::string> elsewhere = {"timelimit",       "adv_std_eps", "adam_idle",
                                                  "iopg_first_sync", "oc_sampling", "o2v_init_flag",
                                                  "contact_forces"};
  if (method == "oc" && info.name == "beta_index") return false;
  return info.Concerns(method) && !elsewhere.contains(info.name);
}

std::string Flipped(const SwitchInfo& info, const Switches& switches) {
  return SwitchValue(switches, info) == SwitchValue(SwitchesFor(Fidelity::kPaper), info)
             ? "released"
             : "paper";
}

/// A problem without a ReLU input near its kink.
std::unique_ptr<Problem> Smooth(ProblemMaker make, const Setup& setup) {
  for (std::uint64_t seed = setup.seed;; ++seed) {
    auto problem = make(setup, seed);
    if (problem->Margin() >= kReluMargin) return problem;
  }
}

}  // namespace

Problem::Problem(const Setup& setup, std::uint64_t seed)
    : setup_(setup),
      hyper_(Hyper(setup)),
      rng_(seed, "gradcheck." + setup.method),
      margin_(std::numeric_limits<double>::infinity()) {
  AlgorithmInput in;
  in.S = kS;
  in.A = kA;
  in.hyper = &hyper_;
  in.switches = setup.switches;
  in.seed = seed;
  algo_ = MakeAlgorithm(setup.method, in);
  params_ = algo_->Params();
  for (Param* p : params_) {
    p->value += RandomMat(p->value.rows(), p->value.cols(), rng_, 0.3);
    values_[p->name] = &p->value;
  }
}

bool Problem::IsClipped(int b) { return b % 8 == 3 || b % 8 == 4; }

void Problem::Place(StageTargets& targets, int b, double log_prob, double value) {
  constexpr double kRatios[] = {0.6, 0.9, 1.1, 1.5};  // outside and inside 1 -+ 0.2
  targets.logp_old(b) = log_prob - std::log(kRatios[b % 4] * rng_.Uniform(0.98, 1.02));
  targets.adv_hat(b) = (b / 4 % 2 ? -1 : 1) * rng_.Uniform(0.5, 2);
  targets.ret(b) = value + rng_.Uniform(0.2, 0.5);
}

void Problem::Sample(int b, Batch& sample, FixedDraws&) const {
  Gather(batch_, std::vector<int>{b}, sample);
}

Mat& Problem::Tensor(const std::string& name) {
  const auto it = values_.find(name);
  Check(it != values_.end(), setup_.method, ": no tensor '", name, "'");
  return *it->second;
}

Mat Problem::Affine(const std::string& name, const Mat& x) {
  return (Tensor(name + ".W") * x).colwise() + Tensor(name + ".b").col(0);
}

Mat Problem::Relu(const Mat& z) {
  margin_ = std::min(margin_, ReluMargin(z));
  return z.cwiseMax(0);
}

Comparison Problem::Whole(int stage) {
  ZeroGrad(params_);
  algo_->Loss(stage, batch_, &fixed_);
  const std::vector<char> in_graph = algo_->InGraph(stage);
  std::vector<Slot> slots;
  for (std::size_t i = 0; i < params_.size(); ++i) {
    Param& p = *params_[i];
    const Expect expect = Expected(stage, p.name);
    Check(bool(in_graph[i]) == (expect != Expect::kDetached), p.name, ": InGraph says ",
          int(in_graph[i]));
    slots.emplace_back(p.name, p.value, p.grad, LossOf(stage, p.name, batch_, fixed_), expect);
  }
  return Compare(slots, rng_, kEntries);
}

Comparison Problem::Outputs(int stage) {
  Comparison all;
  for (int b = 0; b < int(batch_.Size()); ++b) {
    Batch sample;
    FixedDraws fixed;
    Sample(b, sample, fixed);
    ZeroGrad(params_);
    algo_->Loss(stage, sample, &fixed);
    std::vector<Slot> slots;
    for (Param* p : params_) {
      if (!IsOutput(stage, p->name, sample)) continue;
      slots.emplace_back(p->name, p->value, p->grad, LossOf(stage, p->name, sample, fixed));
    }
    Merge(Compare(slots, rng_), all);
  }
  return all;
}

void AddChecks(const std::string& method, ProblemMaker make, const std::vector<Variant>& variants,
               std::vector<NamedCheck>& checks) {
  const bool two_stages = method == "option2vec" || method.starts_with("dac_");
  const std::vector<std::string> stages =
      two_stages ? std::vector<std::string>{"high", "low"} : std::vector<std::string>{"all"};
  const auto add = [&](const std::string& name, const Setup& setup) {
    for (int stage = 0; stage < int(stages.size()); ++stage) {
      const std::string full = method + " " + stages[std::size_t(stage)] + " " + name;
      checks.push_back({full, [=] { return Smooth(make, setup)->Whole(stage); }});
      checks.push_back({full + " outputs", [=] { return Smooth(make, setup)->Outputs(stage); }});
    }
  };
  for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
    const std::string name = ToString(fidelity);
    const Setup plain{method, SwitchesFor(fidelity)};
    add(name, plain);
    for (const SwitchInfo& info : SwitchRegistry()) {
      if (!InLoss(info, method)) continue;
      Setup setup = plain;
      const std::string value = Flipped(info, plain.switches);
      SetSwitch(setup.switches, method, info.name, value);
      add(name + " " + info.name + "=" + value, setup);
    }
    for (const auto& [variant, change] : variants) {
      Setup setup = plain;
      change(setup);
      add(name + " " + variant, setup);
    }
  }
  Rng rng(20, "gradcheck.switches");
  for (int i = 0; i < 20; ++i) {
    Setup setup{method, SwitchesFor(Fidelity::kPaper), /*seed=*/100 * (std::uint64_t(i) + 1)};
    for (const SwitchInfo& info : SwitchRegistry()) {
      if (!info.Concerns(method) || info.flag || rng.Uniform() < 0.5) continue;
      SetSwitch(setup.switches, method, info.name, "released");
    }
    for (const Variant& variant : variants) {
      if (rng.Uniform() < 0.5) variant.second(setup);
    }
    add("random switches " + std::to_string(i), setup);
  }
}

std::vector<int> ShuffledOptions(std::size_t n, int K, Rng& rng) {
  std::vector<int> o(n);
  for (std::size_t i = 0; i < n; ++i) {
    o[i] = int(i) % K;
    std::swap(o[i], o[rng.UniformInt(i + 1)]);
  }
  return o;
}

Mat Stack(const Mat& top, const Mat& bottom) {
  Mat x(top.rows() + bottom.rows(), top.cols());
  x << top, bottom;
  return x;
}

std::vector<NamedCheck> AlgoChecks() {
  std::vector<NamedCheck> checks;
  AddBaselineChecks(checks);
  AddOption2VecChecks(checks);
  return checks;
}

std::vector<NamedCheck> AllChecks() {
  std::vector<NamedCheck> all = NnChecks();
  for (const auto& more : {DistChecks(), AlgoChecks()}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

}  // namespace o2v
