#include "run/config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

#include "base/check.h"
#include "env/pairs.h"

namespace o2v {
namespace {

RunRequest Request(const std::string& algorithm, const std::string& task,
                   const std::string& fidelity = "paper") {
  RunRequest request;
  request.algorithm = algorithm;
  request.task = task;
  request.fidelity = fidelity;
  return request;
}

/// Message of the ConfigError that `action` throws; fails when it throws nothing.
template <typename Action>
std::string Message(Action&& action) {
  try {
    action();
  } catch (const ConfigError& e) {
    return e.what();
  }
  ADD_FAILURE() << "no ConfigError";
  return "";
}

/// The message about a --config file of this text, for ppo on Hopper-v2.
std::string MessageAbout(const std::string& text) {
  RunRequest request = Request("ppo", "Hopper-v2");
  request.config = ConfigText{"x.toml", text};
  return Message([&] { ResolveRun(request); });
}

std::string MessageAboutSet(const std::string& assignment) {
  RunRequest request = Request("ppo", "Hopper-v2");
  request.set = {assignment};
  return Message([&] { ResolveRun(request); });
}

RunConfig WithConfig(RunRequest request, const std::string& text) {
  request.config = ConfigText{"x.toml", text};
  return ResolveRun(request);
}

#define EXPECT_CONTAINS(text, part) \
  EXPECT_NE((text).find(part), std::string::npos) << "in: " << (text)

// ---- Layers

TEST(ResolveRun, TakesTheMethodsNumbersFromItsOwnFile) {
  const RunConfig config = ResolveRun(Request("option2vec", "HalfCheetah-v2"));
  EXPECT_EQ(config.hyper.Real("gamma"), 0.99);     // spec 7
  EXPECT_EQ(config.hyper.Int("rollout"), 2048);    // spec 7
  EXPECT_EQ(config.hyper.Int("epochs"), 10);       // spec 7: 10 + 10
  EXPECT_EQ(config.hyper.Int("options"), 4);       // spec 7
  EXPECT_EQ(config.hyper.Real("adam_eps"), 1e-5);  // spec 1.4
  EXPECT_EQ(config.steps, 1000000);                // spec 7
  EXPECT_EQ(config.fidelity, Fidelity::kPaper);
}

TEST(ResolveRun, RivalsHaveTheWidthsAndWorkersOfTheirFidelity) {
  std::vector<std::string> tasks;
  for (const EnvEntry& task : EnvRegistry()) tasks.push_back(task.id);
  for (const TaskPair& pair : PairRegistry()) tasks.push_back(pair.name);
  for (const AlgorithmEntry& entry : AlgorithmRegistry()) {
    const std::string& method = entry.id;
    if (method == "option2vec") continue;
    const bool onestep = method == "dac_onestep", four = method == "oc" || method == "iopg";
    for (const std::string& task : tasks) {
      const bool narrow = !onestep && (task == "HalfCheetah-v2" || task == "Walker2d-v2" ||
                                       task == "Swimmer-v2" || task == "Hopper-v2");  // spec 7
      const RunConfig paper = ResolveRun(Request(method, task));
      const RunConfig released = ResolveRun(Request(method, task, "released"));
      EXPECT_EQ(paper.hyper.Int("hidden"), 64) << method << task;
      EXPECT_EQ(released.hyper.Int("hidden"), narrow ? 64 : 128) << method << task;
      EXPECT_EQ(paper.workers, four ? 4 : 1) << method << task;
      EXPECT_EQ(released.workers, four || onestep ? 4 : 1) << method << task;
    }
  }
}

TEST(ResolveRun, Option2VecHasOneWorkerOnFiveReleasedTasksAndFourElsewhere) {
  for (const EnvEntry& task : EnvRegistry()) {
    const bool one = task.id == "HumanoidStandup-v2" || task.id == "Reacher-v2" ||
                     task.id == "Walker2d-v2" || task.id == "InvertedDoublePendulum-v2" ||
                     task.id == "Ant-v2";  // spec 7
    const RunConfig paper = ResolveRun(Request("option2vec", task.id));
    const RunConfig released = ResolveRun(Request("option2vec", task.id, "released"));
    EXPECT_EQ(paper.workers, 4) << task.id;
    EXPECT_EQ(released.workers, one ? 1 : 4) << task.id;
    EXPECT_EQ(paper.hyper.Int("embedding"), 40) << task.id;
    EXPECT_EQ(released.hyper.Int("embedding"), 40) << task.id;
    EXPECT_EQ(released.hyper.Int("hidden"), 64) << task.id;
  }
}

TEST(ResolveRun, APairIsItsTwoTasksForTwoMillionSteps) {
  const RunConfig named = ResolveRun(Request("option2vec", "Cheetah"));
  EXPECT_EQ(named.task, "dm-cheetah-run,dm-cheetah-backward");
  EXPECT_EQ(named.steps, 2'000'000);
  EXPECT_EQ(ToToml(ResolveRun(Request("option2vec", named.task))), ToToml(named));
}

TEST(ResolveRun, EmbeddingsOfReleasedPairsAreThoseOfTheLogs) {
  for (const auto& [pair, D] : {std::pair{"CartPole", 20},
                                {"Reacher", 30},
                                {"Cheetah", 20},
                                {"Fish", 20},
                                {"Walker1", 30},
                                {"Walker2", 20}}) {
    const RunConfig released = ResolveRun(Request("option2vec", pair, "released"));
    EXPECT_EQ(released.hyper.Int("embedding"), D) << pair;
    EXPECT_EQ(released.workers, 4) << pair;
    EXPECT_EQ(ResolveRun(Request("option2vec", pair)).hyper.Int("embedding"), 40) << pair;
  }
}

TEST(ResolveRun, RivalsUseReluOnDeepMindControl) {
  for (const AlgorithmEntry& entry : AlgorithmRegistry()) {
    const std::string& method = entry.id;
    if (method == "option2vec") continue;
    for (const std::string task : {"Walker2", "dm-fish-upright"}) {
      const RunConfig released = ResolveRun(Request(method, task, "released"));
      EXPECT_EQ(released.hyper.Int("activation"), 1) << method << task;
    }
    EXPECT_EQ(ResolveRun(Request(method, "Hopper-v2")).hyper.Int("activation"), 0) << method;
  }
}

TEST(ResolveRun, SwitchesOfTransferBelongToRunsOverSeveralTasks) {
  RunRequest pair = Request("option2vec", "Fish"), single = Request("option2vec", "Hopper-v2");
  EXPECT_EQ(ResolveRun(pair).switches.o2v_freeze, Freeze::kPaper);
  pair.fidelity = "released";
  EXPECT_EQ(ResolveRun(pair).switches.o2v_freeze, Freeze::kReleased);
  pair.set = single.set = {"o2v_freeze=policy"};
  EXPECT_EQ(ResolveRun(pair).switches.o2v_freeze, Freeze::kPolicy);
  EXPECT_NE(ToToml(ResolveRun(pair)).find("o2v_freeze = \"policy\""), std::string::npos);
  EXPECT_EQ(Message([&] { ResolveRun(single); }).substr(0, 35),
            "--set o2v_freeze=policy: unknown ke");
  single.set = {};
  EXPECT_EQ(ToToml(ResolveRun(single)).find("o2v_freeze"), std::string::npos);
}

TEST(ResolveRun, RefusesAnUnknownTaskOfAPair) {
  const std::string message =
      Message([] { ResolveRun(Request("ppo", "dm-cheetah-run,dm-cheetah-backwards")); });
  EXPECT_NE(message.find("unknown task 'dm-cheetah-backwards'"), std::string::npos) << message;
  EXPECT_NE(message.find("dm-cheetah-backward"), std::string::npos) << message;
  EXPECT_NE(Message([] { ResolveRun(Request("ppo", "Hopper-v2,")); }), "");
}

TEST(ResolveRun, FidelitySetsAllSwitches) {
  EXPECT_EQ(ResolveRun(Request("option2vec", "Ant-v2")).switches.o2v_dropout, 0);
  const Switches released = ResolveRun(Request("option2vec", "Ant-v2", "released")).switches;
  EXPECT_EQ(released.o2v_dropout, 0.2);
  EXPECT_EQ(released.timelimit, Fidelity::kReleased);
}

TEST(ResolveRun, LaterLayersWin) {
  RunRequest request = Request("ppo", "Hopper-v2", "released");
  const std::string file =
      "[run]\nsteps = 5\nseed = 6\n[switches]\ntimelimit = 'paper'\n[algo.ppo]\nhidden = 32\n"
      "workers = 3\n";
  RunConfig config = WithConfig(request, file);
  EXPECT_EQ(config.steps, 5);
  EXPECT_EQ(config.seed, 6u);
  EXPECT_EQ(config.hyper.Int("hidden"), 32);
  EXPECT_EQ(config.workers, 3);
  EXPECT_EQ(config.switches.timelimit, Fidelity::kPaper);
  EXPECT_EQ(config.switches.adv_std_eps, 0) << "other switches stay released";

  request.steps = 7;
  request.set = {"hidden=16",          "workers=2",       "timelimit=released",
                 "checkpoint_every=9", "activation=relu", "hidden=17"};
  config = WithConfig(request, file);
  EXPECT_EQ(config.steps, 7);
  EXPECT_EQ(config.hyper.Int("hidden"), 17);
  EXPECT_EQ(config.workers, 2);
  EXPECT_EQ(config.switches.timelimit, Fidelity::kReleased);
  EXPECT_EQ(config.checkpoint_every, 9);
  EXPECT_EQ(config.hyper.Real("activation"), 1);
}

TEST(ResolveRun, ConditionalTablesHoldForTheirFidelityMethodOrTaskOnly) {
  const std::string file =
      "[run]\nsteps = 1\nreleased = {steps = 2}\nppo = {steps = 3}\nHopper-v2 = {steps = 4}\n";
  EXPECT_EQ(WithConfig(Request("option2vec", "Ant-v2"), file).steps, 1);
  EXPECT_EQ(WithConfig(Request("option2vec", "Ant-v2", "released"), file).steps, 2);
  EXPECT_EQ(WithConfig(Request("ppo", "Ant-v2", "released"), file).steps, 3);
  EXPECT_EQ(WithConfig(Request("ppo", "Hopper-v2", "released"), file).steps, 4);
}

TEST(ResolveRun, OfTwoConditionalTablesTheNarrowerOneWins) {
  // The suite, several tasks, the fidelity, the method, the task: all of them hold for this run.
  const std::vector<std::string> tables = {"dm", "transfer", "released", "ppo", "Cheetah"};
  const RunRequest request = Request("ppo", "Cheetah", "released");
  for (std::size_t a = 0; a < tables.size(); ++a) {
    for (std::size_t b = a + 1; b < tables.size(); ++b) {
      const std::string wide = tables[a] + " = {hidden = 10}\n",
                        narrow = tables[b] + " = {hidden = 20}\n";
      for (const std::string& file : {wide + narrow, narrow + wide}) {
        EXPECT_EQ(WithConfig(request, "[algo.ppo]\n" + file).hyper.Int("hidden"), 20) << file;
      }
    }
  }
}

TEST(ResolveRun, ANumberOfAFidelityIsSetByItsName) {
  for (const char* fidelity : {"paper", "released"}) {
    RunRequest request = Request("option2vec", "Hopper-v2", fidelity);
    request.set = {"o2v_dropout=released", "adv_std_eps=released"};
    const Switches released = ResolveRun(request).switches;
    EXPECT_EQ(released.o2v_dropout, 0.2) << fidelity;
    EXPECT_EQ(released.adv_std_eps, 0) << fidelity;
    request.set = {"o2v_dropout=paper", "adv_std_eps=paper"};
    const Switches paper = ResolveRun(request).switches;
    EXPECT_EQ(paper.o2v_dropout, 0) << fidelity;
    EXPECT_EQ(paper.adv_std_eps, 1e-8) << fidelity;
  }
}

TEST(ResolveRun, SectionsOfOtherMethodsAreLeftAlone) {
  EXPECT_EQ(
      WithConfig(Request("ppo", "Ant-v2"), "[algo.option2vec]\nhidden = 5\n").hyper.Int("hidden"),
      64);
}

// ---- Errors

TEST(ResolveRun, NamesFileLineAndNearestKeyForAnUnknownKey) {
  const std::string message = MessageAbout("# comment\n[algo.ppo]\ngama = 0.9\n");
  EXPECT_CONTAINS(message, "x.toml:3");
  EXPECT_CONTAINS(message, "'gama'");
  EXPECT_CONTAINS(message, "'gamma'");
  EXPECT_CONTAINS(MessageAbout("[run]\nstep = 3\n"), "'steps'");
  EXPECT_CONTAINS(MessageAbout("[switches]\ntimelimits = 'paper'\n"), "x.toml:2");
  EXPECT_CONTAINS(MessageAbout("[switches]\ntimelimits = 'paper'\n"), "'timelimit'");
}

TEST(ResolveRun, NamesFileLineAndNearestNameForUnknownSectionsAndTables) {
  EXPECT_CONTAINS(MessageAbout("\n[runs]\nsteps = 3\n"), "x.toml:2");
  EXPECT_CONTAINS(MessageAbout("[runs]\nsteps = 3\n"), "'run'");
  EXPECT_CONTAINS(MessageAbout("[algo.pro]\ngamma = 1\n"), "'ppo'");
  EXPECT_CONTAINS(MessageAbout("[run]\nHoper-v2 = {steps = 3}\n"), "'Hopper-v2'");
}

TEST(ResolveRun, RefusesMistypedValues) {
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\ngamma = 'high'\n"), "x.toml:2: 'gamma' is 'high'");
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\ngamma = true\n"), "x.toml:2: 'gamma'");
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\ngamma = [1]\n"), "x.toml:2: 'gamma'");
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\ngamma = nan\n"), "finite");
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\nactivation = 'gelu'\n"), "'tanh'");
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\nactivation = 1\n"), "'tanh'");
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\nworkers = 0\n"), "whole number");
  EXPECT_CONTAINS(MessageAbout("[algo.ppo]\nworkers = 2147483648\n"), "[1, 2147483647]");
  EXPECT_CONTAINS(MessageAbout("[run]\neval_episodes = 4294967297\n"), "[1, 2147483647]");
  EXPECT_CONTAINS(MessageAbout("[run]\nsteps = 1.5\n"), "whole number");
  EXPECT_CONTAINS(MessageAbout("[run]\nseed = -1\n"), "whole number");
  RunRequest request;
  request.config = ConfigText{"x.toml", "[run]\ntask = 'Ant-v2'\nalgorithm = 3\n"};
  EXPECT_CONTAINS(Message([&] { ResolveRun(request); }), "x.toml:3: 'algorithm' is '3'");
  EXPECT_CONTAINS(MessageAbout("run = 3\n"), "[run]");
  EXPECT_CONTAINS(MessageAbout("[switches]\ntimelimit = 'sometimes'\n"), "x.toml:2");
}

TEST(ResolveRun, RefusesTomlThatDoesNotParseWithItsLine) {
  EXPECT_CONTAINS(MessageAbout("[run]\nsteps = \n"), "x.toml:2");
  EXPECT_CONTAINS(MessageAbout("[run]\nsteps = 1\nsteps = 2\n"), "x.toml:3");
  EXPECT_CONTAINS(MessageAbout("[run]\n[# run]\n"), "x.toml:2");
}

TEST(ResolveRun, RefusesBadAssignments) {
  EXPECT_CONTAINS(MessageAboutSet("gamma"), "key=value");
  EXPECT_CONTAINS(MessageAboutSet("gama=1"), "'gamma'");
  EXPECT_CONTAINS(MessageAboutSet("gamma="), "'gamma'");
  EXPECT_CONTAINS(MessageAboutSet("gamma=1x"), "'1x'");
  EXPECT_CONTAINS(MessageAboutSet("gamma=1e999"), "'1e999'");
  EXPECT_CONTAINS(MessageAboutSet("workers=0"), "whole number");
  EXPECT_CONTAINS(MessageAboutSet("seed=3"), "unknown key 'seed'");
  EXPECT_CONTAINS(MessageAboutSet("o2v_dropout=0"), "unknown key 'o2v_dropout'");
}

TEST(ResolveRun, RefusesUnknownNamesWithTheNearest) {
  EXPECT_CONTAINS(Message([] { ResolveRun(Request("ppo", "Hoper-v2")); }), "'Hopper-v2'");
  EXPECT_CONTAINS(Message([] { ResolveRun(Request("ppp", "Hopper-v2")); }), "'ppo'");
  EXPECT_CONTAINS(Message([] { ResolveRun(Request("ppo", "Hopper-v2", "papier")); }), "'paper'");
}

TEST(ResolveRun, RefusesARunWithoutATask) {
  RunRequest request;
  request.algorithm = "ppo";
  EXPECT_CONTAINS(Message([&] { ResolveRun(request); }), "missing key 'task'");
}

TEST(ResolveRun, NamesOfARunDoNotDependOnTheRun) {
  RunRequest request;
  request.config = ConfigText{
      "x.toml", "[run]\ntask = 'Ant-v2'\nalgorithm = 'ppo'\nppo = {task = 'Hopper-v2'}\n"};
  EXPECT_CONTAINS(Message([&] { ResolveRun(request); }), "x.toml:4: 'task'");
}

TEST(OpenConfig, RefusesAbsentFilesAndUnknownNames) {
  EXPECT_CONTAINS(Message([] { OpenConfig("/nonexistent/x.toml"); }), "/nonexistent/x.toml");
  EXPECT_CONTAINS(Message([] { OpenConfig("quik"); }), "'quick'");
}

// ---- Round trip

TEST(ToToml, IsReadBackToTheSameRunBitForBit) {
  RunRequest request = Request("option2vec", "HalfCheetah-v2", "released");
  request.seed = std::numeric_limits<std::int64_t>::max();
  request.set = {"gamma=0.1", "learning_rate=1.2345678901234567e-300",
                 "clip_norm=123456789012345680000", "adam_idle=paper",
                 "o2v_dropout=0.30000000000000004"};
  const RunConfig a = ResolveRun(request);
  const RunConfig b = ParseRunConfig(ToToml(a), "config.toml");
  EXPECT_EQ(b.task, a.task);
  EXPECT_EQ(b.algorithm, a.algorithm);
  EXPECT_EQ(b.fidelity, a.fidelity);
  EXPECT_EQ(b.seed, 9223372036854775807u);
  EXPECT_EQ(b.steps, a.steps);
  EXPECT_EQ(b.workers, a.workers);
  EXPECT_EQ(b.hyper.Items(), a.hyper.Items());
  EXPECT_EQ(b.hyper.Real("clip_norm"), 123456789012345680000.0);
  EXPECT_EQ(b.switches.o2v_dropout, 0.30000000000000004);
  EXPECT_EQ(b.switches.adam_idle, Fidelity::kPaper);
  EXPECT_EQ(b.switches.o2v_query, Fidelity::kReleased);
  EXPECT_EQ(ToToml(b), ToToml(a));
}

TEST(ToToml, CanBeGivenAsConfigOfANewRun) {
  RunRequest first = Request("ppo", "Hopper-v2", "released");
  first.seed = 3;
  first.set = {"hidden=7", "activation=relu", "timelimit=paper", "eval_every=100"};
  const std::string text = ToToml(ResolveRun(first));
  EXPECT_EQ(ToToml(WithConfig({}, text)), text);
}

TEST(ParseRunConfig, RefusesMissingKeys) {
  const std::string text = ToToml(ResolveRun(Request("ppo", "Hopper-v2")));
  for (const std::string key : {"task", "steps", "workers", "timelimit", "gamma"}) {
    const std::size_t begin = text.find("\n" + key + " = ") + 1, end = text.find('\n', begin);
    const std::string cut = text.substr(0, begin) + text.substr(end + 1);
    const std::string message = Message([&] { ParseRunConfig(cut, "config.toml"); });
    EXPECT_CONTAINS(message, "config.toml: missing key '" + key + "'");
  }
}

// ---- Formats

/// A program that got the switch timelimit in format 2 and the number gamma of ppo in format 3.
const std::vector<AddedKey> kAdded = {{"switches", "timelimit", "released", 2},
                                      {"ppo", "gamma", "0.5", 3}};

/// The configuration of Hopper-v2 and ppo without some keys.
std::string Without(std::initializer_list<std::string> keys) {
  std::string text = ToToml(ResolveRun(Request("ppo", "Hopper-v2")));
  for (const std::string& key : keys) {
    const std::size_t begin = text.find("\n" + key + " = ") + 1, end = text.find('\n', begin);
    text.erase(begin, end + 1 - begin);
  }
  return text;
}

TEST(Formats, AKeyThatWasAddedLaterHasItsHistoricalValue) {
  const RunConfig config = ParseRunConfig(Without({"timelimit", "gamma"}), "x.toml", kAdded);
  EXPECT_EQ(config.switches.timelimit, Fidelity::kReleased);  // not today's, which is paper
  EXPECT_EQ(config.hyper.Real("gamma"), 0.5);
  // The same as the layer of a new run.
  RunRequest request;
  request.config = ConfigText{"x.toml", Without({"timelimit", "gamma"})};
  EXPECT_EQ(ToToml(ResolveRun(request, kAdded), kAdded), ToToml(config, kAdded));
}

TEST(Formats, AKeyThatTheFormatHasMustBeThere) {
  const std::string second = "format = 2\n" + Without({"gamma"});
  EXPECT_EQ(ParseRunConfig(second, "x.toml", kAdded).hyper.Real("gamma"), 0.5);
  for (const std::string& text :
       {"format = 2\n" + Without({"timelimit"}), "format = 3\n" + Without({"gamma"})}) {
    EXPECT_CONTAINS(Message([&] { ParseRunConfig(text, "x.toml", kAdded); }), "missing key");
  }
}

TEST(Formats, AreSaidFromTheSecondOnAndReadBack) {
  const RunConfig config = ResolveRun(Request("ppo", "Hopper-v2"));
  EXPECT_TRUE(ToToml(config).starts_with("[run]\n"));
  const std::string text = ToToml(config, kAdded);
  EXPECT_EQ(text, "format = 3\n\n" + ToToml(config));
  EXPECT_EQ(ToToml(ParseRunConfig(text, "x.toml", kAdded), kAdded), text);
}

TEST(Formats, OfNewerProgramsAreRefused) {
  for (const char* format : {"2", "0", "-1", "1.5", "\"1\""}) {
    const std::string text = Concat("format = ", format, "\n", Without({}));
    EXPECT_CONTAINS(Message([&] { ParseRunConfig(text, "x.toml"); }),
                    "x.toml:1: configuration format");
  }
}

TEST(Formats, AnExperimentsFileThatLacksAKeyGetsTodaysValue) {
  RunRequest request = Request("ppo", "Hopper-v2");
  request.config = ConfigText{"x.toml", "[run]\nsteps = 7\n"};
  EXPECT_EQ(ResolveRun(request, kAdded).switches.timelimit, Fidelity::kPaper);
}

// ---- Methods

TEST(MakeRunAlgorithm, ReadsEveryNumberOfEveryMethod) {
  EnvSpec spec;
  spec.S = 3;
  spec.A = 2;
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    for (const char* fidelity : {"paper", "released"}) {
      const RunConfig config = ResolveRun(Request(method.id, "Hopper-v2", fidelity));
      EXPECT_GT(CountParams(MakeRunAlgorithm(config, spec)->Params()), 0) << method.id;
    }
  }
}

TEST(MakeRunAlgorithm, RefusesANumberThatTheMethodDoesNotRead) {
  EnvSpec spec;
  spec.S = 3;
  spec.A = 2;
  RunConfig config = ResolveRun(Request("ppo", "Hopper-v2"));
  config.hyper.Set("warmth", 1, "x.toml:5");
  const std::string message = Message([&] { MakeRunAlgorithm(config, spec); });
  EXPECT_CONTAINS(message, "x.toml:5");
  EXPECT_CONTAINS(message, "'warmth'");
}

// ---- Experiments

TEST(ReadExperiments, ReadsTheListsOfTheEmbeddedFiles) {
  const Experiment quick = ReadExperiments(OpenConfig("quick")).at(0);
  EXPECT_EQ(quick.name, "quick");
  EXPECT_EQ(quick.tasks, (std::vector<std::string>{"InvertedPendulum-v2", "HalfCheetah-v2"}));
  EXPECT_EQ(quick.algorithms, (std::vector<std::string>{"ppo", "option2vec"}));
  EXPECT_EQ(quick.seeds, (std::vector<std::uint64_t>{0, 1}));
}

TEST(ReadExperiments, TheSuiteOfCiHasEveryTaskAndMethod) {
  const Experiment ci = ReadExperiments(OpenConfig("ci")).at(0);
  std::set<std::string> tasks;
  for (const std::string& task : ci.tasks) {
    for (const std::string& id : SplitTasks(task)) tasks.insert(id);
  }
  EXPECT_EQ(tasks.size(), EnvRegistry().size());
  EXPECT_EQ(ci.algorithms.size(), AlgorithmRegistry().size());
}

TEST(ReadExperiments, ReadsSeveralWithWhatTheyChange) {
  const std::string lists = "tasks = ['Ant-v2']\nfidelities = ['paper']\n";
  const auto both = ReadExperiments(
      {"x/y.toml", "[[experiment]]\nalgorithms = ['ppo']\nseeds = [3]\n" + lists +
                       "[[experiment]]\nalgorithms = ['option2vec']\nseeds = [4]\n" + lists +
                       "ablations = ['o2v_query', 'options=2', ['o2v_critic', 'workers=1']]\n"});
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[1].name, "y");
  EXPECT_EQ(both[0].seeds, (std::vector<std::uint64_t>{3}));
  EXPECT_EQ(both[0].ablations, (std::vector<std::vector<std::string>>{}));
  EXPECT_EQ(both[1].ablations, (std::vector<std::vector<std::string>>{
                                   {"o2v_query"}, {"options=2"}, {"o2v_critic", "workers=1"}}));
}

TEST(ReadExperiments, RefusesBadLists) {
  auto message = [](const std::string& lists) {
    return Message([&] { ReadExperiments({"x.toml", "[experiment]\n" + lists}); });
  };
  const std::string rest = "algorithms = ['ppo']\nfidelities = ['paper']\nseeds = [0]\n";
  EXPECT_CONTAINS(message(rest), "missing key 'tasks'");
  EXPECT_CONTAINS(message("tasks = []\n" + rest), "x.toml:2");
  EXPECT_CONTAINS(message("tasks = 'Ant-v2'\n" + rest), "x.toml:2");
  EXPECT_CONTAINS(message("tasks = ['Ant-v1']\n" + rest), "'Ant-v2'");
  EXPECT_CONTAINS(message("tasks = ['Ant-v2']\nseed = [1]\n" + rest), "'seeds'");
  // A flag such as contact_forces is the same in both fidelities: nothing to turn.
  EXPECT_CONTAINS(message("tasks = ['Ant-v2']\nablations = ['contact_forces']\n" + rest),
                  "x.toml:3");
  EXPECT_CONTAINS(message("tasks = ['Ant-v2']\nablations = ['time_limit']\n" + rest),
                  "'timelimit'");
  // A number that none of the methods has.
  EXPECT_CONTAINS(message("tasks = ['Ant-v2']\nablations = ['options=1']\n" + rest), "x.toml:3");
  EXPECT_CONTAINS(message("tasks = ['Ant-v2']\nablations = [['hiden=8']]\n" + rest), "'hidden'");
  EXPECT_CONTAINS(message("tasks = ['Ant-v2']\nablations = [[]]\n" + rest), "x.toml:3");
  for (const char* text : {"[run]\n", "experiment = []\n", "experiment = [1]\n"}) {
    EXPECT_CONTAINS(Message([&] { ReadExperiments({"x.toml", text}); }), "experiment") << text;
  }
}

}  // namespace
}  // namespace o2v
