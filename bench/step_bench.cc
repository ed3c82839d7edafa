// CPU microseconds an environment step, split and beside the bound.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bench/bound.h"
#include "harness/config.h"

namespace o2v::bench {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A task that adds up the time spent in it.
class TimedEnv final : public Env {
 public:
  TimedEnv(std::unique_ptr<Env> env, double* seconds) : env_(std::move(env)), seconds_(seconds) {}
  const EnvSpec& Spec() const override { return env_->Spec(); }
  void Reset(Rng& rng, std::span<double> obs) override {
    const auto start = Clock::now();
    env_->Reset(rng, obs);
    *seconds_ += SecondsSince(start);
  }
  StepResult Step(std::span<const double> a, std::span<double> obs) override {
    const auto start = Clock::now();
    const StepResult result = env_->Step(a, obs);
    *seconds_ += SecondsSince(start);
    return result;
  }
  void Visit(StateVisitor& v, const std::string& prefix) override { env_->Visit(v, prefix); }

 private:
  std::unique_ptr<Env> env_;
  double* seconds_;
};

/// What training has cost over some steps.
struct Cost {
  std::int64_t steps = 0;                             // [environment steps]
  std::size_t episodes = 0;                           // that ended
  double total = INFINITY, collect = 0, physics = 0;  // CPU seconds
};

/// The least rollouts and updates that fill kSteps environment steps, once without counting them
/// and then an iteration; the cheapest a step is reported.
void StepCost(benchmark::State& state, const std::string& task, const std::string& algorithm,
              const std::string& fidelity) {
  RunRequest request;
  request.task = task;
  request.algorithm = algorithm;
  request.fidelity = fidelity;
  request.seed = 0;
  const RunConfig config = ResolveRun(request);
  double physics = 0;
  VecEnv env([&] { return std::make_unique<TimedEnv>(MakeEnv(task, {}), &physics); },
             config.workers, config.seed);
  const auto learner = MakeRunAlgorithm(config, env.Spec());
  std::vector<Episode> episodes;
  std::vector<double> stats;
  const auto train = [&] {
    constexpr std::int64_t kSteps = 2048;  // of one rollout; many of OC and of IOPG's episodes
    const std::int64_t first = env.TotalSteps();
    Cost cost;
    cost.total = physics = 0;
    episodes.clear();
    while (cost.steps < kSteps) {
      const auto start = Clock::now();
      learner->Collect(env, episodes);
      cost.collect += SecondsSince(start);
      learner->Update(stats);
      cost.total += SecondsSince(start);
      cost.steps = env.TotalSteps() - first;
    }
    cost.physics = physics;
    cost.episodes = episodes.size();
    return cost;
  };
  env.Reset();
  train();

  // The least of the iterations, as the bound takes the least of its timings: what the machine does
  // besides is in neither.
  Cost least;
  for (auto _ : state) {
    const Cost cost = train();
    if (cost.total * double(least.steps) <= least.total * double(cost.steps)) least = cost;
  }

  const double scale = 1e6 / double(least.steps);  // [us an environment step]
  const int S = env.Spec().S, A = env.Spec().A;
  double products = 0, mflop = 0;
  for (const Product& p : Products(config, S, A)) {
    products += 1e6 * ProductSeconds(p.m, p.k, p.n) * p.per_step;
    mflop += p.MflopPerStep();
  }
  const double episode_length = double(least.steps) / double(least.episodes);
  const double adam =
      1e6 * AdamSecondsPerEntry() * AdamEntriesPerStep(config, S, A, episode_length);
  const double total = least.total * scale, bound = least.physics * scale + products + adam;
  state.counters["total_us"] = total;
  state.counters["physics_us"] = least.physics * scale;
  state.counters["inference_us"] = (least.collect - least.physics) * scale;
  state.counters["learning_us"] = (least.total - least.collect) * scale;
  state.counters["bound_us"] = bound;
  state.counters["bound_products_us"] = products;
  state.counters["bound_adam_us"] = adam;
  state.counters["MFLOP"] = mflop;
  state.counters["ratio"] = total / bound;
}

/// Option2Vec and PPO on every gym task and one of each domain of DeepMind Control, where a
/// domain's tasks cost the same; the other methods on a small and on the largest one.
bool Wanted(const std::string& task, const std::string& algorithm) {
  constexpr const char* kDomains[] = {"dm-cartpole-balance", "dm-reacher-easy", "dm-cheetah-run",
                                      "dm-fish-upright", "dm-walker-walk"};
  if (task.starts_with("dm-") && std::ranges::count(kDomains, task) == 0) return false;
  return algorithm == "option2vec" || algorithm == "ppo" || task == "HalfCheetah-v2" ||
         task == "Humanoid-v2";
}

}  // namespace

/// Registers StepCost for tasks and methods in both fidelities.
void RegisterStepBenches() {
  for (const EnvEntry& task : EnvRegistry()) {
    for (const AlgorithmEntry& algorithm : AlgorithmRegistry()) {
      if (!Wanted(task.id, algorithm.id)) continue;
      for (const char* fidelity : {"paper", "released"}) {
        const std::string name = "step/" + task.id + "/" + algorithm.id + "/" + fidelity;
        const std::string id = task.id, method = algorithm.id;
        benchmark::RegisterBenchmark(
            name.c_str(), [=](benchmark::State& state) { StepCost(state, id, method, fidelity); })
            ->Iterations(5)
            ->Unit(benchmark::kMillisecond);
      }
    }
  }
}

}  // namespace o2v::bench
