#pragma once
// Numbers of a small network and short rollouts for every method, without the harness.

#include <map>
#include <string>

#include "base/settings.h"

namespace o2v {

/// Keys of all methods together (each reads its own), and then `set`.
inline Settings SmallHyper(const std::map<std::string, double>& set = {}) {
  std::map<std::string, double> numbers = {{"gamma", 0.99},
                                           {"lambda", 0.95},
                                           {"rollout", 24},
                                           {"epochs", 2},
                                           {"minibatch", 16},
                                           {"learning_rate", 3e-4},
                                           {"adam_beta1", 0.9},
                                           {"adam_beta2", 0.999},
                                           {"adam_eps", 1e-5},
                                           {"clip_norm", 0.5},
                                           {"ratio_clip", 0.2},
                                           {"hidden", 16},
                                           {"entropy_weight", 0.01},
                                           {"activation", 0},
                                           {"options", 4},
                                           {"embedding", 10},
                                           {"heads", 1},
                                           {"ffn", 12},
                                           {"init_hidden", 16},
                                           {"entropy_weight_option", 0.01},
                                           {"entropy_weight_action", 0},
                                           {"ynet_hidden", 16},
                                           {"termination_penalty", 0.01},
                                           {"epsilon_greedy", 0.1},
                                           {"target_every", 10}};
  for (const auto& [key, value] : set) numbers.at(key) = value;
  Settings hyper;
  for (const auto& [key, value] : numbers) hyper.Set(key, value, "test");
  return hyper;
}

}  // namespace o2v
