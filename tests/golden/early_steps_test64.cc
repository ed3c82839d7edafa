// The first steps of training, against numbers kept in tests/data/golden: what moves a learning
// curve shows here. `make golden` rewrites the file; its difference is to be reviewed.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "algo/algorithm.h"
#include "base/decimal.h"
#include "base/files.h"
#include "small_hyper.h"

namespace o2v {
namespace {

const std::filesystem::path kFile = std::filesystem::path(O2V_TEST_DATA) / "golden/early_steps.csv";

using Numbers = std::vector<std::pair<std::string, double>>;

/// A task whose episodes end after `time_limit` steps; 0: the task's own limit.
std::unique_ptr<Env> MakeTask(const std::string& id, int time_limit) {
  for (const EnvEntry& entry : EnvRegistry()) {
    if (entry.id == id) return entry.make({}, time_limit ? time_limit : entry.time_limit);
  }
  throw Error("no task " + id);
}

/// Two rollouts of 24 steps of two workers, each with its update (IOPG: two episodes of at most 24
/// steps): the numbers of both updates and the states after them.
void Run(const std::string& task, const std::string& method, Fidelity fidelity, Numbers& out) {
  const Settings hyper = SmallHyper({{"entropy_weight", method == "ppo" ? 0 : 0.01}});
  const int time_limit = method == "iopg" ? 24 : 0;
  VecEnv env([&] { return MakeTask(task, time_limit); }, /*workers=*/2, /*seed=*/1);
  AlgorithmInput in;
  in.S = env.Spec().S;
  in.A = env.Spec().A;
  in.workers = env.Workers();
  in.time_limit = env.Spec().time_limit;
  in.hyper = &hyper;
  in.switches = SwitchesFor(fidelity);
  in.seed = 1;
  const auto algorithm = MakeAlgorithm(method, in);
  const std::string name = task + "/" + method + "/" + ToString(fidelity) + "/";
  std::vector<Episode> episodes;
  env.Reset();
  for (int iteration = 0; iteration < 2; ++iteration) {
    algorithm->Collect(env, episodes);
    const std::vector<SumAndCount>& stats = algorithm->Update();
    const std::vector<std::string> columns = algorithm->StatNames();
    ASSERT_EQ(columns.size(), stats.size());
    for (std::size_t i = 0; i < stats.size(); ++i) {
      out.emplace_back(name + std::to_string(iteration) + "/" + columns[i], stats[i].Value());
    }
    for (Index i = 0; i < env.States().size(); ++i) {
      out.emplace_back(name + std::to_string(iteration) + "/s" + std::to_string(i),
                       env.States().data()[i]);
    }
  }
}

Numbers Measure() {
  Numbers out;
  for (const char* task : {"Hopper-v2", "Swimmer-v2"}) {
    for (const AlgorithmEntry& method : AlgorithmRegistry()) {
      for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
        Run(task, method.id, fidelity, out);
      }
    }
  }
  return out;
}

TEST(Golden, EarlyStepsAreThoseOnRecord) {
  const Numbers now = Measure();
  std::string text = "name,value\n";
  for (const auto& [name, value] : now) text += name + "," + Decimal(value) + "\n";
  if (std::getenv("O2V_REWRITE_GOLDEN")) WriteFileAtomically(kFile, text);

  std::istringstream kept(ReadFile(kFile));
  std::string line;
  std::getline(kept, line);
  ASSERT_EQ(line, "name,value");
  std::size_t rows = 0;
  while (std::getline(kept, line)) {
    ASSERT_LT(rows, now.size()) << "more rows on record";
    const std::size_t comma = line.find(',');
    ASSERT_EQ(line.substr(0, comma), now[rows].first);
    const double value = std::stod(line.substr(comma + 1));
    // Large for rounding in double precision, small for a change of the mathematics or the physics.
    EXPECT_NEAR(now[rows].second, value, 1e-6 * std::max(1.0, std::abs(value))) << now[rows].first;
    ++rows;
  }
  EXPECT_EQ(rows, now.size());
}

}  // namespace
}  // namespace o2v
