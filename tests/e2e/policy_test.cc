// What the program says of a trained policy, by value: eval, forward, interpret.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "algo/toy.h"
#include "base/csv.h"
#include "program.h"
#include "run/checkpoint.h"
#include "run/config.h"
#include "run/evaluate.h"

namespace o2v {
namespace {

class PolicyCommands : public Program {
 protected:
  /// Trains a little into `run`.
  void TrainRun(const std::string& arguments) const {
    const Outcome outcome = Run("train " + arguments + " --set rollout=64 --out run");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  std::string Eval(const std::string& more) const {
    const Outcome outcome = Run("eval --checkpoint run/last.ckpt " + more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  }
};

/// A rollout of the policy in `checkpoint` on `task`, written down anew: what `eval` should print.
/// Resets, options and actions draw from the streams "eval.reset", "eval.option", "eval.action".
struct Rollout {
  std::vector<double> returns;
  std::vector<int> lengths;

  Rollout(const std::filesystem::path& checkpoint, const std::string& task, int episodes,
          bool sample, std::uint64_t seed) {
    const RunConfig config = ParseRunConfig(ReadMetadata(checkpoint).at("config"), "checkpoint");
    const auto env = MakeEnv(task, {});
    const EnvSpec spec = env->Spec();
    const auto policy = MakeRunAlgorithm(config, spec);
    Normalizer normalizer(spec.S);
    LoadPolicy(checkpoint, *policy, normalizer);
    Rng resets(seed, "eval.reset"), options(seed, "eval.option"), actions(seed, "eval.action");
    VecD obs(spec.S);
    const std::span<double> raw(obs.data(), std::size_t(spec.S));
    Vec state(spec.S);
    Mat P, mu, sigma;
    int o = 0;
    for (int episode = 0; episode < episodes; ++episode) {
      env->Reset(resets, raw);
      double sum = 0;
      int steps = 0;
      for (StepResult step{}; !step.terminated && !step.truncated; ++steps) {
        normalizer.Apply(obs, state);
        policy->OptionPolicy(state, {o}, {char(steps == 0)}, P);
        const double u = options.Uniform() * P.cast<double>().sum();
        o = 0;
        for (double below = P(0, 0); u >= below && o + 1 < P.rows(); below += P(o, 0)) ++o;
        policy->ActionPolicy(state, {o}, mu, sigma);
        std::vector<double> a;
        for (Index j = 0; j < spec.A; ++j) {
          const double noise = sample ? actions.Normal() : 0;
          const double low = spec.a_low[std::size_t(j)], high = spec.a_high[std::size_t(j)];
          a.push_back(std::min(std::max(mu(j, 0) + sigma(j, 0) * noise, low), high));
        }
        step = env->Step(a, raw);
        sum += step.reward;
      }
      returns.push_back(sum);
      lengths.push_back(steps);
    }
  }
};

/// Checks a line an episode and the last one with mean and deviation.
void ExpectPrinted(const std::string& text, const Rollout& expected) {
  std::istringstream lines(text);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(line, "episode,return,length");
  const std::size_t n = expected.returns.size();
  double mean = 0, variance = 0;
  for (const double x : expected.returns) mean += x / double(n);
  for (const double x : expected.returns) variance += (x - mean) * (x - mean) / double(n);
  const auto near = [](double x, double y) { EXPECT_NEAR(x, y, 1e-5 * std::abs(y) + 1e-9); };
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_TRUE(std::getline(lines, line)) << text;
    std::size_t number = 0;
    double ret = 0;
    int length = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%zu,%lf,%d", &number, &ret, &length), 3) << line;
    EXPECT_EQ(number, i);
    near(ret, expected.returns[i]);
    EXPECT_EQ(length, expected.lengths[i]) << line;
  }
  ASSERT_TRUE(std::getline(lines, line)) << text;
  double printed_mean = 0, printed_std = 0;
  std::size_t count = 0;
  ASSERT_EQ(std::sscanf(line.c_str(), "# mean %lf +- %lf (std, n %zu)", &printed_mean, &printed_std,
                        &count),
            3)
      << line;
  near(printed_mean, mean);
  EXPECT_NEAR(printed_std, std::sqrt(variance), 1e-4 * std::sqrt(variance) + 1e-9);
  EXPECT_EQ(count, n);
  EXPECT_FALSE(std::getline(lines, line)) << line;
}

TEST_F(PolicyCommands, EvalPrintsTheReturnsOfItsStreams) {
  TrainRun("--task Reacher-v2 --algo option2vec --fidelity released --steps 256 --seed 3");
  const auto rollout = [&](int episodes, bool sample, std::uint64_t seed) {
    return Rollout(dir_ / "run" / "last.ckpt", "Reacher-v2", episodes, sample, seed);
  };
  ExpectPrinted(Eval("--episodes 3 --seed 5 --action sample"), rollout(3, true, 5));
  ExpectPrinted(Eval("--episodes 3 --seed 5 --action mean"), rollout(3, false, 5));
  ExpectPrinted(Eval(""), rollout(10, true, 0));
}

TEST_F(PolicyCommands, EvalOfAMethodWithoutOptionsIsTheSame) {
  TrainRun("--task Hopper-v2 --algo ppo --steps 256 --set workers=2");
  for (const bool sample : {true, false}) {
    ExpectPrinted(
        Eval(std::string("--episodes 4 --seed 1 --action ") + (sample ? "sample" : "mean")),
        Rollout(dir_ / "run" / "last.ckpt", "Hopper-v2", 4, sample, 1));
  }
}

TEST_F(PolicyCommands, EvalIsOnTheLastTaskOfAPairUnlessToldOtherwise) {
  TrainRun("--task Cheetah --algo option2vec --steps 512");
  const auto rollout = [&](const std::string& task) {
    return Rollout(dir_ / "run" / "last.ckpt", task, 1, true, 2);
  };
  const Rollout first = rollout("dm-cheetah-run"), second = rollout("dm-cheetah-backward");
  ASSERT_GT(std::abs(first.returns[0] - second.returns[0]), 0.1);
  ExpectPrinted(Eval("--episodes 1 --seed 2"), second);
  ExpectPrinted(Eval("--episodes 1 --seed 2 --task dm-cheetah-backward"), second);
  ExpectPrinted(Eval("--episodes 1 --seed 2 --task dm-cheetah-run"), first);
}

TEST_F(PolicyCommands, ATaskOfOtherSizesIsRefusedByItsName) {
  TrainRun("--task Hopper-v2 --algo ppo --steps 64");
  const Outcome outcome = Run("eval --checkpoint run/last.ckpt --task HalfCheetah-v2");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("run/last.ckpt: trained on Hopper-v2, which has 11 observations and 3 "
                             "actions; HalfCheetah-v2 has 17 and 6"),
            std::string::npos)
      << outcome.err;
}

TEST_F(PolicyCommands, DropoutIsOff) {
  TrainRun("--task Reacher-v2 --algo option2vec --fidelity released --steps 256");
  const CsvTable states{
      "",
      {"s0", "s1", "s2", "s3", "s4", "s5", "s6", "s7", "s8", "s9", "s10", "o_prev", "init", "o"},
      {0, 1, 2, 1, 0, -1, -2, -1, 0, 1, 2, 1, 0, 3,  //
       1, 0, 1, 0, 1, 0,  1,  0,  1, 0, 1, 3, 0, 2}};
  WriteFileAtomically(dir_ / "in.csv", CsvText(states));
  const auto outputs = [&](const std::string& set) {
    std::vector<std::string> texts = {Eval("--episodes 2" + set)};
    for (const std::string command :
         {"forward --checkpoint run/last.ckpt --input in.csv", "interpret run --episodes 2"}) {
      const Outcome outcome = Run(command + " --out out.csv" + set);
      EXPECT_EQ(outcome.code, 0) << outcome.err;
      texts.push_back(ReadFile(dir_ / "out.csv"));
      std::filesystem::remove(dir_ / "out.csv");  // interpret replaces no file of forward's
    }
    return texts;
  };
  // The run's own probability is 0.2; 0.9 would leave a tenth of every layer.
  const std::vector<std::string> without = outputs(" --set o2v_dropout=0");
  EXPECT_EQ(outputs(""), without);
  EXPECT_EQ(outputs(" --set o2v_dropout=0.9"), without);
}

TEST_F(PolicyCommands, ExportedPoliciesActAsTheirRuns) {
  TrainRun("--task Reacher-v2 --algo option2vec --steps 256 --set workers=2");
  ASSERT_EQ(Run("export --policy run --out x.safetensors").code, 0);
  const Outcome outcome =
      Run("eval --checkpoint x.safetensors --episodes 2 --seed 3 --trajectory steps.csv");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, Eval("--episodes 2 --seed 3"));
  const Metadata metadata = ReadMetadata(dir_ / "x.safetensors");
  EXPECT_EQ(metadata.at("config"), ReadFile(dir_ / "run" / "config.toml"));
  EXPECT_EQ(metadata.at("total_steps"), "256");
  // Every number of the table is read back as it was: the returns are sums of its rewards.
  const CsvTable steps = ReadCsv(dir_ / "steps.csv");
  const Rollout expected(dir_ / "run" / "last.ckpt", "Reacher-v2", 2, /*sample=*/true, 3);
  std::vector<double> returns = {0, 0};
  for (std::size_t row = 0; row < steps.Rows(); ++row) {
    returns[std::size_t(steps.At(row, 0))] += steps.At(row, steps.Column("reward"));
  }
  EXPECT_EQ(returns, expected.returns);
  EXPECT_EQ(Eval("--episodes 2 --seed 3 --action mean --trajectory steps.csv"),
            Eval("--episodes 2 --seed 3 --action mean"))
      << "writing the steps changes nothing";
}

TEST_F(PolicyCommands, ExportOfAForeignFileSaysHowToActWithIt) {
  TrainRun("--task Reacher-v2 --algo ppo --steps 256 --set hidden=8 --set workers=2");
  ASSERT_EQ(Run("export --policy run --out x.safetensors").code, 0);
  std::string foreign = ReadFile(dir_ / "x.safetensors");
  foreign.replace(foreign.find("option2vec-1"), 12, "somewhere---");
  WriteFileAtomically(dir_ / "foreign", foreign);
  EXPECT_EQ(Run("export --policy foreign --out y").code, 2) << "of which method?";
  EXPECT_FALSE(std::filesystem::exists(dir_ / "y"));
  ASSERT_EQ(Run("export --policy foreign --task Reacher-v2 --algo ppo --set hidden=8 --out y").code,
            0);
  EXPECT_EQ(Run("eval --checkpoint y --episodes 2").out, Eval("--episodes 2"));
}

TEST_F(Program, ExportLeavesNoHalfFile) {
  ASSERT_EQ(Train("--out run").code, 0);
  EXPECT_EQ(Run("export --policy run --out nowhere/x").code, 2);
  EXPECT_EQ(Run("export --policy run --tensorboard run --out x").code, 2);
  EXPECT_EQ(Run("export --tensorboard nowhere --out x").code, 2);
  EXPECT_EQ(Run("eval --checkpoint run/last.ckpt --episodes 1 --trajectory nowhere/x").code, 2);
  EXPECT_FALSE(std::filesystem::exists(dir_ / "x"));
  ASSERT_EQ(Run("export --tensorboard run --out x/y").code, 0);
  EXPECT_TRUE(std::filesystem::exists(dir_ / "x" / "y" / "events.out.tfevents.option2vec"));
}

TEST_F(PolicyCommands, ForwardWritesWhatTheNetworksSay) {
  // All weights are 0, so that the outputs are those of the last biases:
  //   P = softmax(ln(1, 2, 3, 4)) at an episode's start, softmax(ln(4, 3, 2, 1)) elsewhere,
  //   mu = tanh(b), sigma = softplus(b), q = b.
  RunRequest request;
  request.task = "Reacher-v2";
  request.algorithm = "option2vec";
  request.fidelity = "released";
  const RunConfig config = ResolveRun(request);
  const auto policy = MakeRunAlgorithm(config, MakeEnv("Reacher-v2", {})->Spec());
  for (Param* p : policy->Params()) p->value.setZero();
  const auto value = [&](const char* name) -> Mat& { return FindParam(*policy, name).value; };
  for (Index k = 0; k < 4; ++k) {
    value("init.1.b")(k) = std::log(Real(1 + k));
    value("logits.b")(k) = std::log(Real(4 - k));
    value("critic.q.b")(k) = Real(10 + k);
  }
  value("action.mu.b") << Real(0.5), Real(-0.25);
  value("action.sigma.b") << 0, 1;
  Normalizer normalizer(11);
  SaveCheckpoint(dir_ / "x.ckpt", {{"config", ToToml(config)}}, *policy, [&](StateVisitor& v) {
    policy->Serialize(v);
    normalizer.Serialize(v);
  });
  // Columns in any order; an option of the episode before an initial state counts for nothing.
  WriteFileAtomically(dir_ / "in.csv",
                      "o,init,o_prev,s0,s1,s2,s3,s4,s5,s6,s7,s8,s9,s10\n"
                      "0,1,3,1,2,3,4,5,6,7,8,9,10,11\n"
                      "2,0,1,0,0,0,0,0,0,0,0,0,0,0\n");
  const Outcome outcome = Run("forward --checkpoint x.ckpt --input in.csv --out out.csv");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const CsvTable out = ReadCsv(dir_ / "out.csv");
  ASSERT_EQ(out.columns, (std::vector<std::string>{"P0", "P1", "P2", "P3", "mu0", "mu1", "sigma0",
                                                   "sigma1", "q0", "q1", "q2", "q3"}));
  const double mu0 = std::tanh(0.5), mu1 = std::tanh(-0.25);
  const double sigma0 = std::log(2), sigma1 = std::log(1 + std::exp(1));
  const std::vector<double> expected = {
      0.1, 0.2, 0.3, 0.4, mu0, mu1, sigma0, sigma1, 10, 11, 12, 13,  //
      0.4, 0.3, 0.2, 0.1, mu0, mu1, sigma0, sigma1, 10, 11, 12, 13};
  ASSERT_EQ(out.values.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(out.values[i], expected[i], 1e-6) << out.columns[i % 12];
  }
}

TEST_F(PolicyCommands, ForwardIsOnTheRunsOwnOptions) {
  TrainRun("--task Reacher-v2 --algo dac_ppo --steps 256 --set workers=2");
  WriteFileAtomically(dir_ / "in.csv",
                      "s0,s1,s2,s3,s4,s5,s6,s7,s8,s9,s10,o_prev,init,o\n"
                      "1,-1,0.5,0,1,2,-1,0,0.25,0,1,2,0,3\n"
                      "1,-1,0.5,0,1,2,-1,0,0.25,0,1,0,1,1\n");
  ASSERT_EQ(Run("forward --checkpoint run/last.ckpt --input in.csv --out out.csv").code, 0);
  const RunConfig config =
      ParseRunConfig(ReadMetadata(dir_ / "run" / "last.ckpt").at("config"), "checkpoint");
  const auto policy = MakeRunAlgorithm(config, MakeEnv("Reacher-v2", {})->Spec());
  Normalizer normalizer(11);
  LoadPolicy(dir_ / "run" / "last.ckpt", *policy, normalizer);
  Mat s(11, 1), P, mu, sigma, q;
  s << 1, -1, Real(0.5), 0, 1, 2, -1, 0, Real(0.25), 0, 1;
  const CsvTable out = ReadCsv(dir_ / "out.csv");
  for (std::size_t row = 0; row < 2; ++row) {  // one sample at a time
    policy->OptionPolicy(s, {row == 0 ? 2 : 0}, {char(row)}, P);
    policy->ActionPolicy(s, {row == 0 ? 3 : 1}, mu, sigma);
    policy->OptionValues(s, {row == 0 ? 3 : 1}, q);
    std::size_t column = 0;
    for (const Mat* part : {&P, &mu, &sigma, &q}) {
      for (Index i = 0; i < part->size(); ++i) {
        EXPECT_NEAR(out.At(row, column), double((*part)(i)), 1e-6) << out.columns[column];
        ++column;
      }
    }
    EXPECT_EQ(column, out.columns.size());
  }
}

// ---- Exit codes: 0 success, 1 an error, 2 configuration, usage or a refused folder, 3 diverged.

TEST_F(Program, ExitCodesAreThoseOfTheHelp) {
  EXPECT_EQ(Run("list tasks").code, 0);
  EXPECT_EQ(Train("--out run").code, 0);
  EXPECT_EQ(Run("eval --checkpoint run/last.ckpt --episodes 1").code, 0);
  WriteFileAtomically(dir_ / "cut.ckpt", ReadFile(dir_ / "run" / "last.ckpt").substr(0, 1000));
  EXPECT_EQ(Run("eval --checkpoint cut.ckpt").code, 1);
  EXPECT_EQ(Run("forward --checkpoint cut.ckpt --input x.csv --out y.csv").code, 1);
  EXPECT_EQ(Run("eval --checkpoint run/last.ckpt --algo option2vec").code, 2);
  EXPECT_EQ(Run("eval --checkpoint run/last.ckpt --action both").code, 2);
  EXPECT_EQ(Run("train --task Hopper-v2 --algo ppo --out run").code, 2);
}

TEST_F(Program, ADivergedRunExitsWith3AndKeepsItsRecord) {
  // One step of a size that a float barely holds, after a finite loss: the next rollout's actions
  // are no numbers, and the simulator says so.
  const std::string diverge =
      "train --task HalfCheetah-v2 --algo ppo --steps 1280 --set workers=1 --set rollout=64 "
      "--set minibatch=64 --set epochs=1 --set learning_rate=1e38 --out run";
  const Outcome outcome = Run(diverge);
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_NE(outcome.err.find("option2vec: "), std::string::npos) << outcome.err;
  EXPECT_NE(ReadFile(dir_ / "run" / "manifest.json").find("\"status\": \"diverged\""),
            std::string::npos);
  EXPECT_NE(ReadFile(dir_ / "run.json").find("\"status\": \"diverged\""), std::string::npos);
  EXPECT_EQ(ReadFile(dir_ / "run.csv"), "step,return_20\n") << "no episode has ended";
}

}  // namespace
}  // namespace o2v
