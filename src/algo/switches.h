#pragma once
// Registry of the switches between the method as written and what the authors' code did.

#include <string>
#include <vector>

namespace o2v {

/// `paper`: the method as written. `released`: what the authors' code did.
enum class Fidelity { kPaper, kReleased };

/// Throws ConfigError unless `name` is paper or released.
Fidelity ParseFidelity(const std::string& name);
std::string ToString(Fidelity fidelity);

/// What stays constant of Option2Vec from the second task on; spec 6.
enum class Freeze {
  kPaper,     // the embedding W_o
  kReleased,  // W_o gets no gradient, but momentum still moves it where idle tensors are stepped
  kPolicy,    // P detached: no gradient to any part of the option policy
  kNone,
};

/// All switches of spec 8. Most act in one file. Several: timelimit where a method values a step
/// that the time limit ended (PpoMethod, OC, IOPG); density_log_eps where one takes the logarithm
/// of a density or probability (LogDensity, OptionLog, IOPG); beta_index (DAC+PPO, PPOC, OC, IOPG);
/// adam_idle (Method, Option2Vec); switch_init_flag (trainer, IOPG); contact_forces (where tasks
/// are made, MujocoEnv).
struct Switches {
  Fidelity timelimit = Fidelity::kPaper;             // bootstrap at truncation | terminal
  double adv_std_eps = 1e-8;                         // added to the advantages' std | 0
  Fidelity adam_idle = Fidelity::kPaper;             // skip idle tensors | zero-gradient steps
  Fidelity density_log_eps = Fidelity::kPaper;       // off | ln(p + 1e-5)
  Fidelity beta_index = Fidelity::kPaper;            // beta of o' | of each entry
  Fidelity dac_update_mask = Fidelity::kPaper;       // one-hot per row | first row only
  Fidelity ppoc_master_weight = Fidelity::kPaper;    // posterior of switching | 1
  Fidelity oc_sampling = Fidelity::kPaper;           // probabilities | softmax of them
  Fidelity ahp_beta_index = Fidelity::kPaper;        // o_{t-1} | o_t in the update
  Fidelity ahp_init_factor = Fidelity::kPaper;       // 1 | beta
  Fidelity iopg_init_flag = Fidelity::kPaper;        // first step | every step
  Fidelity iopg_posterior = Fidelity::kPaper;        // p_{t-1} | p_t
  Fidelity iopg_first_sync = Fidelity::kPaper;       // copies start equal | at random
  Fidelity onestep_roles = Fidelity::kPaper;         // net sees o' | swapped
  Fidelity onestep_norm = Fidelity::kPaper;          // softmax | ReLU + 1e-5
  Fidelity onestep_index = Fidelity::kPaper;         // one-hot | number in a LayerNorm
  Fidelity o2v_option_in_update = Fidelity::kPaper;  // executed | re-drawn
  Fidelity o2v_init_flag = Fidelity::kPaper;         // init_t | done_t
  double o2v_dropout = 0;                            // probability: 0 | 0.2
  Fidelity o2v_critic = Fidelity::kPaper;            // scalar per option | K outputs of drawn o_hat
  Fidelity o2v_vloss_policy = Fidelity::kPaper;      // P detached | gradient through P
  Fidelity o2v_init_relu = Fidelity::kPaper;         // linear | ReLU on the initial logits
  Fidelity o2v_query = Fidelity::kPaper;             // one token | two tokens
  Fidelity o2v_prev_embed_grad = Fidelity::kPaper;   // on | off
  Freeze o2v_freeze = Freeze::kPaper;                // of transfer runs
  Fidelity switch_init_flag = Fidelity::kPaper;      // init set at a change of task | not set
  bool contact_forces = false;                       // on fills cfrc_ext; off in both
};

/// One line of the registry.
struct SwitchInfo {
  std::string name;
  std::vector<std::string> methods;  // empty: all
  std::string effect;                // what paper | released do
  // One of the four is set.
  Fidelity Switches::*choice = nullptr;  // paper | released
  double Switches::*number = nullptr;    // paper | released | a number
  bool Switches::*flag = nullptr;        // off | on; off in both fidelities
  Freeze Switches::*freeze = nullptr;    // paper | released | policy | none
  bool transfer = false;                 // concerns runs over more than one task only
  double paper = 0, released = 0;        // values of `number`
  double low = 0, high = 0;              // range of `number`

  bool Concerns(const std::string& method) const;
};

const std::vector<SwitchInfo>& SwitchRegistry();

/// All switches at the setting of one fidelity.
Switches SwitchesFor(Fidelity fidelity);
/// Sets one switch to `paper`, `released` or a further value that SwitchRange lists; a flag to
/// `off`, `on`.
/// Throws ConfigError for an unknown name (with the nearest known one), a bad value, or a switch
/// that does not concern `method`.
void SetSwitch(Switches& switches, const std::string& method, const std::string& name,
               const std::string& value);
/// The setting as text, as SetSwitch reads it: a word or the number.
std::string SwitchValue(const Switches& switches, const SwitchInfo& info);
/// What SetSwitch takes, for people: "paper, released".
std::string SwitchRange(const SwitchInfo& info);

}  // namespace o2v
