// Every switch changes what it says it changes, from either fidelity.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "algo/setup.h"

namespace o2v {
namespace {

/// Numbers that a switch should change, for one method.
using Fingerprint = std::function<std::vector<double>(const RunConfig&)>;

void Append(std::vector<double>& out, const Mat& x) {
  out.insert(out.end(), x.data(), x.data() + x.size());
}

void AppendValues(std::vector<double>& out, Algorithm& algorithm) {
  for (const Param* p : algorithm.Params()) Append(out, p->value);
}

/// The method on a batch of ours: a parameter's values depend on its name and shape alone, so that
/// networks of different architecture agree where they can.
struct OnBatch {
  explicit OnBatch(const RunConfig& config)
      : algorithm(MakeRunAlgorithm(config, Sizes(5, 3))),
        rng(7, "batch"),
        batch(RandomBatch(5, 3, algorithm->NumOptions(), 24, rng)) {
    for (Param* p : algorithm->Params()) {
      Rng values(7, p->name);
      p->value = RandomMat(p->value.rows(), p->value.cols(), values, 0.5);
    }
  }

  std::unique_ptr<Algorithm> algorithm;
  Rng rng;
  Batch batch;
};

/// Losses and gradients of all stages.
std::vector<double> Losses(const RunConfig& config) {
  OnBatch on(config);
  std::vector<double> out;
  for (std::size_t stage = 0; stage < on.algorithm->StageNames().size(); ++stage) {
    out.push_back(on.algorithm->Loss(int(stage), on.batch, nullptr).total);
    for (const Param* p : on.algorithm->Params()) Append(out, p->grad);
    ZeroGrad(on.algorithm->Params());
  }
  return out;
}

/// Parameters after a step of each stage.
std::vector<double> Steps(const RunConfig& config) {
  OnBatch on(config);
  for (std::size_t stage = 0; stage < on.algorithm->StageNames().size(); ++stage) {
    on.algorithm->Loss(int(stage), on.batch, nullptr);
    on.algorithm->Step(int(stage));
  }
  std::vector<double> out;
  AppendValues(out, *on.algorithm);
  return out;
}

/// Parameters after a rollout with truncated episodes and the update on it.
std::vector<double> Training(const RunConfig& config) {
  VecEnv env = PointTask(config.workers, /*time_limit=*/5);
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  Iterate(*algorithm, env);
  std::vector<double> out;
  AppendValues(out, *algorithm);
  return out;
}

/// Parameters after an iteration before and one after a change of task in the middle of episodes.
std::vector<double> Transfer(const RunConfig& config) {
  // Workers of different time limits: IOPG's iterations end with an episode of one of them.
  VecEnv env([i = 0]() mutable { return std::make_unique<PointEnv>(13 + 4 * (i++ % 2)); },
             config.workers, /*seed=*/3);
  env.Reset();
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  Iterate(*algorithm, env);
  env.ChangeTask([] { return std::make_unique<PointEnv>(13); },
                 config.switches.switch_init_flag == Fidelity::kPaper);
  algorithm->ChangeTask();
  Iterate(*algorithm, env);
  std::vector<double> out;
  AppendValues(out, *algorithm);
  return out;
}

/// The same where advantages are of the order 1e-6: values 0 and tiny rewards.
std::vector<double> TrainingOnTinyRewards(const RunConfig& config) {
  VecEnv env = PointTask(config.workers, /*time_limit=*/5, /*scale=*/1e-6);
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  const char* head = config.algorithm == "ppo"       ? "critic.v.W"
                     : config.algorithm == "ahp_ppo" ? "critic.u.W"
                                                     : "critic.q.W";
  FindParam(*algorithm, head).value.setZero();
  Iterate(*algorithm, env);
  std::vector<double> out;
  AppendValues(out, *algorithm);
  return out;
}

/// Probabilities that options are drawn with.
std::vector<double> OptionProbabilities(const RunConfig& config) {
  OnBatch on(config);
  Mat P;
  on.algorithm->OptionPolicy(on.batch.s, on.batch.o_prev, on.batch.init, P);
  std::vector<double> out;
  Append(out, P);
  return out;
}

/// Observations of an ant that falls on its legs.
std::vector<double> AntObservations(const RunConfig& config) {
  const auto env = MakeEnv("Ant-v2", {.contact_forces = config.switches.contact_forces});
  Rng rng(1, "ant");
  std::vector<double> obs(std::size_t(env->Spec().S)), out;
  const std::vector<double> a(std::size_t(env->Spec().A), 0.0);
  env->Reset(rng, obs);
  for (int step = 0; step < 30; ++step) {
    env->Step(a, obs);
    out.insert(out.end(), obs.begin(), obs.end());
  }
  return out;
}

/// What a switch changes.
struct Effect {
  std::string name;
  Fingerprint fingerprint;
  std::vector<std::string> methods = {};  // empty: all that it concerns
  std::vector<std::string> where = {};    // settings that it acts under; spec 8
};

const std::vector<Effect> kEffects = {
    {"timelimit", Training},
    {"adv_std_eps", TrainingOnTinyRewards},
    {"adam_idle", Steps},
    {"density_log_eps", Losses},
    {"beta_index", OptionProbabilities, {"dac_ppo", "ppoc", "oc"}},
    {"beta_index", OptionProbabilities, {"iopg"}, {"iopg_init_flag=paper"}},
    {"beta_index", Losses, {"dac_ppo"}},
    {"beta_index", Losses, {"iopg"}, {"iopg_init_flag=paper"}},
    {"beta_index", Losses, {"ppoc"}, {"ppoc_master_weight=paper"}},
    {"dac_update_mask", Losses},
    {"ppoc_master_weight", Losses},
    {"oc_sampling", OptionProbabilities},
    {"ahp_beta_index", Losses},
    {"ahp_init_factor", Losses},
    {"iopg_init_flag", Losses},
    {"iopg_init_flag", OptionProbabilities},
    {"iopg_posterior", Losses, {}, {"iopg_init_flag=paper"}},
    {"iopg_first_sync", Training},
    {"onestep_roles", OptionProbabilities},
    {"onestep_roles", Losses},
    {"onestep_norm", OptionProbabilities},
    {"onestep_norm", Losses},
    {"onestep_index", OptionProbabilities},
    {"o2v_option_in_update", Losses},
    {"o2v_init_flag", Training},
    {"o2v_dropout", Losses},
    {"o2v_critic", Losses},
    {"o2v_vloss_policy", Losses},
    {"o2v_init_relu", Losses},
    {"o2v_query", Losses},
    {"o2v_prev_embed_grad", Losses},
    {"o2v_freeze", Transfer, {}, {"adam_idle=released"}},
    {"switch_init_flag", Transfer},
    {"contact_forces", AntObservations},
};

/// The switch at another setting.
Switches Flipped(Switches switches, const SwitchInfo& info) {
  if (info.choice) {
    Fidelity& choice = switches.*info.choice;
    choice = choice == Fidelity::kPaper ? Fidelity::kReleased : Fidelity::kPaper;
  } else if (info.flag) {
    switches.*info.flag = !(switches.*info.flag);
  } else if (info.freeze) {
    Freeze& freeze = switches.*info.freeze;
    freeze = freeze == Freeze::kPaper ? Freeze::kReleased : Freeze::kPaper;
  } else {
    double& number = switches.*info.number;
    const double other = number == info.paper ? info.released : info.paper;
    number = other != number ? other : info.high;  // both fidelities agree on some
  }
  return switches;
}

bool Contains(const std::vector<std::string>& list, const std::string& x) {
  return std::find(list.begin(), list.end(), x) != list.end();
}

TEST(Switches, EachChangesALossAGradientAnOptionOrTheTraining) {
  for (const SwitchInfo& info : SwitchRegistry()) {
    for (const AlgorithmEntry& method : AlgorithmRegistry()) {
      if (!info.Concerns(method.id)) continue;
      bool tested = false;
      for (const Effect& effect : kEffects) {
        if (effect.name != info.name) continue;
        if (!effect.methods.empty() && !Contains(effect.methods, method.id)) continue;
        tested = true;
        for (const Fidelity base : {Fidelity::kPaper, Fidelity::kReleased}) {
          RunConfig config = SmallConfig(method.id, base, effect.where);
          const std::vector<double> before = effect.fingerprint(config);
          const std::string what = info.name + ", " + method.id + ", from " + ToString(base);
          EXPECT_EQ(effect.fingerprint(config), before) << what << ": not the same twice";
          config.switches = Flipped(config.switches, info);
          EXPECT_NE(effect.fingerprint(config), before) << what << ": changes nothing";
        }
      }
      EXPECT_TRUE(tested) << info.name << ", " << method.id << ": say here what it changes";
    }
  }
}

/// Expects that a switch, flipped under `where`, leaves the fingerprint as it is.
void ExpectIdle(const std::string& name, const std::string& method, const std::string& where,
                const Fingerprint& fingerprint) {
  for (const Fidelity base : {Fidelity::kPaper, Fidelity::kReleased}) {
    std::vector<std::vector<double>> found;
    for (const char* value : {"=paper", "=released"}) {
      found.push_back(fingerprint(SmallConfig(method, base, {where, name + value})));
    }
    EXPECT_EQ(found[0], found[1]) << name << " under " << where << ", from " << ToString(base);
  }
}

TEST(Switches, OfTerminationsDoNothingWhereIopgTakesEveryStepForAFirstOne) {
  for (const char* name : {"iopg_posterior", "beta_index"}) {
    for (const Fingerprint fingerprint : {Losses, OptionProbabilities, Training}) {
      ExpectIdle(name, "iopg", "iopg_init_flag=released", fingerprint);
    }
  }
}

TEST(Switches, BetaIndexActsOnTheSamplingAloneInReleasedPpoc) {
  ExpectIdle("beta_index", "ppoc", "ppoc_master_weight=released", Losses);
}

TEST(Switches, BetaIndexActsOnTheSamplingAloneInOc) {
  ExpectIdle("beta_index", "oc", "oc_sampling=paper", Losses);
}

}  // namespace
}  // namespace o2v
