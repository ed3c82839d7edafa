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

SwitchInfo Flag(std::string name, bool Switches::*member, std::string effect) {
  SwitchInfo info{std::move(name), {}, std::move(effect)};
  info.flag = member;
  return info;
}

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
  throw ConfigError(Concat("unknown fidelity '", name, "'; it is 'paper' or 'released'"));
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
  static const std::vector<SwitchInfo> registry = {
      Choice("timelimit", {}, &S::timelimit, "bootstrap at truncation | terminal"),
      Number("adv_std_eps", {"ppo", "option2vec"}, &S::adv_std_eps, 1e-8, 0, 0, 1,
             "added to the advantages' standard deviation"),
      Choice("adam_idle", {"option2vec"}, &S::adam_idle,
             "skip tensors outside the loss | zero-gradient Adam steps"),
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
  char text[32];
  const auto result = std::to_chars(text, text + sizeof text, switches.*info.number);
  return std::string(text, result.ptr);
}

std::string SwitchRange(const SwitchInfo& info) {
  if (info.flag) return "off, on";
  if (info.choice) return "paper, released";
  return Concat("paper, released, [", info.low, ", ", info.high, "]");
}

}  // namespace o2v
