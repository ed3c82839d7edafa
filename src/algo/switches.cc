#include "algo/switches.h"

#include <algorithm>
#include <charconv>

#include "base/check.h"
#include "base/names.h"

namespace o2v {
namespace {

SwitchInfo Choice(std::string name, std::vector<std::string> methods, Fidelity Switches::*member,
                  std::string effect) {
  SwitchInfo info{std::move(name), std::move(methods), std::move(effect)};
  info.choice = member;
  return info;
}

SwitchInfo Number(std::string name, std::vector<std::string> methods, double Switches::*member,
                  double paper, double released, double low, double high, std::string effect) {
  SwitchInfo info{std::move(name), std::move(methods), std::move(effect)};
  info.number = member;
  info.paper = paper;
  info.released = released;
  info.low = low;
  info.high = high;
  return info;
}

SwitchInfo OfTransfer(SwitchInfo info) {
  info.transfer = true;
  return info;
}

SwitchInfo FreezeChoice(std::string name, std::vector<std::string> methods,
                        Freeze Switches::*member, std::string effect) {
  SwitchInfo info{std::move(name), std::move(methods), std::move(effect)};
  info.freeze = member;
  return OfTransfer(info);
}

SwitchInfo Flag(std::string name, bool Switches::*member, std::string effect) {
  SwitchInfo info{std::move(name), {}, std::move(effect)};
  info.flag = member;
  return info;
}

constexpr const char* kFreezeNames[] = {"paper", "released", "policy", "none"};

std::vector<std::string> Names(const std::string& method) {
  std::vector<std::string> names;
  for (const SwitchInfo& info : SwitchRegistry()) {
    if (info.Concerns(method)) names.push_back(info.name);
  }
  return names;
}

}  // namespace

Fidelity ParseFidelity(const std::string& name) {
  if (name == "paper") return Fidelity::kPaper;
  if (name == "released") return Fidelity::kReleased;
  throw ConfigError(Concat("unknown fidelity '", name, "'; expected 'paper' or 'released'"));
}

std::string ToString(Fidelity fidelity) {
  return fidelity == Fidelity::kPaper ? "paper" : "released";
}

bool SwitchInfo::Concerns(const std::string& method) const {
  return methods.empty() || std::find(methods.begin(), methods.end(), method) != methods.end();
}

// Source: spec 8.
const std::vector<SwitchInfo>& SwitchRegistry() {
  using S = Switches;
  const std::vector<std::string> ppo_type = {"option2vec", "dac_onestep", "dac_ppo",
                                             "ahp_ppo",    "ppoc",        "ppo"};
  const std::vector<std::string> options = {"option2vec", "dac_onestep", "dac_ppo", "ahp_ppo",
                                            "iopg",       "ppoc",        "oc"};
  static const std::vector<SwitchInfo> registry = {
      Choice("timelimit", {}, &S::timelimit, "bootstrap at truncation | terminal"),
      Number("adv_std_eps", ppo_type, &S::adv_std_eps, 1e-8, 0, 0, 1,
             "added to the advantages' standard deviation"),
      Choice("adam_idle", {"dac_onestep", "dac_ppo", "option2vec"}, &S::adam_idle,
             "skip tensors outside the loss | zero-gradient Adam steps"),
      Choice("density_log_eps", {"dac_onestep", "dac_ppo", "ahp_ppo", "iopg", "ppoc"},
             &S::density_log_eps, "log-probabilities as they are | ln(p + 1e-5)"),
      Choice("beta_index", {"dac_ppo", "iopg", "ppoc", "oc"}, &S::beta_index,
             "termination of the previous option | of each entry's own, unnormalised"),
      Choice("dac_update_mask", {"dac_ppo"}, &S::dac_update_mask,
             "previous option marked in every row | in the minibatch's first row only"),
      Choice("ppoc_master_weight", {"ppoc"}, &S::ppoc_master_weight,
             "master credited by the posterior of a switch | always"),
      Choice("oc_sampling", {"oc"}, &S::oc_sampling,
             "options drawn by their probabilities | by a softmax of them"),
      Choice("ahp_beta_index", {"ahp_ppo"}, &S::ahp_beta_index,
             "termination of o_{t-1} in the update | of o_t"),
      Choice("ahp_init_factor", {"ahp_ppo"}, &S::ahp_init_factor,
             "no termination factor at first states | the stale option's"),
      Choice("iopg_init_flag", {"iopg"}, &S::iopg_init_flag,
             "first step of an episode is initial | every step is"),
      Choice("iopg_posterior", {"iopg"}, &S::iopg_posterior,
             "occupancy updated with p_{t-1} | with p_t"),
      Choice("iopg_first_sync", {"iopg"}, &S::iopg_first_sync,
             "worker copies start as the master | at random"),
      Choice("onestep_roles", {"dac_onestep"}, &S::onestep_roles,
             "the net of o' serves all states | first states only"),
      Choice("onestep_norm", {"dac_onestep"}, &S::onestep_norm, "softmax | ReLU + 1e-5"),
      Choice("onestep_index", {"dac_onestep"}, &S::onestep_index,
             "one-hot previous option | its number, in a LayerNorm with the state"),
      Choice("o2v_option_in_update", {"option2vec"}, &S::o2v_option_in_update,
             "executed option in the update | re-drawn at every minibatch"),
      Choice("o2v_init_flag", {"option2vec"}, &S::o2v_init_flag, "init_t in the update | done_t"),
      Number("o2v_dropout", {"option2vec"}, &S::o2v_dropout, 0, 0.2, 0, 0.9,
             "dropout probability, in rollout and update"),
      Choice("o2v_critic", {"option2vec"}, &S::o2v_critic,
             "scalar Q of every option | K outputs of the drawn option"),
      Choice("o2v_vloss_policy", {"option2vec"}, &S::o2v_vloss_policy,
             "P detached in the value loss | gradient through P"),
      Choice("o2v_init_relu", {"option2vec"}, &S::o2v_init_relu,
             "linear initial logits | ReLU on them"),
      Choice("o2v_query", {"option2vec"}, &S::o2v_query, "one query token | two, state and option"),
      Choice("o2v_prev_embed_grad", {"option2vec"}, &S::o2v_prev_embed_grad,
             "gradient to the previous option's embedding | detached"),
      FreezeChoice("o2v_freeze", {"option2vec"}, &S::o2v_freeze,
                   "after a change of task: W_o constant | no gradient to it | policy: no gradient "
                   "to the option policy | none"),
      OfTransfer(Choice("switch_init_flag", options, &S::switch_init_flag,
                        "after a change of task: first step marked as initial | not marked")),
      Flag("contact_forces", &S::contact_forces, "on fills cfrc_ext (mj_rnePostConstraint)"),
  };
  return registry;
}

Switches SwitchesFor(Fidelity fidelity) {
  Switches switches;
  for (const SwitchInfo& info : SwitchRegistry()) {
    if (info.choice) {
      switches.*info.choice = fidelity;
    } else if (info.number) {
      switches.*info.number = fidelity == Fidelity::kPaper ? info.paper : info.released;
    } else if (info.freeze) {
      switches.*info.freeze = fidelity == Fidelity::kPaper ? Freeze::kPaper : Freeze::kReleased;
    }
  }
  return switches;
}

void SetSwitch(Switches& switches, const std::string& method, const std::string& name,
               const std::string& value) {
  const auto& registry = SwitchRegistry();
  const auto info = std::find_if(registry.begin(), registry.end(),
                                 [&](const SwitchInfo& i) { return i.name == name; });
  if (info == registry.end() || !info->Concerns(method)) {
    throw ConfigError(Concat(info == registry.end() ? "unknown switch '" : "switch '", name, "'",
                             info == registry.end() ? "" : " does not concern " + method,
                             "; nearest: ", Nearest(name, Names(method))));
  }
  const ConfigError bad(Concat(name, " = '", value, "': expected ", SwitchRange(*info)));
  if (info->flag) {
    if (value != "off" && value != "on") throw bad;
    switches.*info->flag = value == "on";
  } else if (info->freeze) {
    const auto name = std::ranges::find(kFreezeNames, value);
    if (name == std::end(kFreezeNames)) throw bad;
    switches.*info->freeze = Freeze(name - std::begin(kFreezeNames));
  } else if (value == "paper" || value == "released") {
    const Fidelity fidelity = ParseFidelity(value);
    if (info->choice) {
      switches.*info->choice = fidelity;
    } else {
      switches.*info->number = fidelity == Fidelity::kPaper ? info->paper : info->released;
    }
  } else {
    double number = 0;
    const char* end = value.data() + value.size();
    const auto [stop, error] = std::from_chars(value.data(), end, number);
    const bool fits =
        error == std::errc() && stop == end && number >= info->low && number <= info->high;
    if (!info->number || !fits) throw bad;
    switches.*info->number = number;
  }
}

std::string SwitchValue(const Switches& switches, const SwitchInfo& info) {
  if (info.choice) return ToString(switches.*info.choice);
  if (info.flag) return switches.*info.flag ? "on" : "off";
  if (info.freeze) return kFreezeNames[int(switches.*info.freeze)];
  char text[32];
  const auto result = std::to_chars(text, text + sizeof text, switches.*info.number);
  return std::string(text, result.ptr);
}

std::string SwitchRange(const SwitchInfo& info) {
  if (info.flag) return "off, on";
  if (info.choice) return "paper, released";
  if (info.freeze) return "paper, released, policy, none";
  return Concat("paper, released, [", info.low, ", ", info.high, "]");
}

}  // namespace o2v
