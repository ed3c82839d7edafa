// CPU microseconds an environment step, split and beside the bound.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bench/bound.h"
#include "run/config.h"

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
  void Serialize(StateVisitor& v, const std::string& prefix) override {
    env_->Serialize(v, prefix);
  }

 private:
  std::unique_ptr<Env> env_;
  double* seconds_;
};

/// What training has cost over some steps, and what it had to cost.
struct Cost {
  std::int64_t steps = 0;                      // [environment steps]
  std::size_t episodes = 0;                    // that ended
  double total = 0, collect = 0, physics = 0;  // CPU seconds
  double products = 0, adam = 0;               // of the bound, CPU seconds

  double Bound() const { return physics + products + adam; }
  double SumAndCount() const { return total / Bound(); }
};

/// An iteration is the least rollouts and updates that fill kSteps environment steps, and then the
/// bound, measured at once: the speed of a shared machine changes from second to second. The
/// iteration of the median ratio is reported, after one that is not counted.
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
      learner->Update();
      cost.total += SecondsSince(start);
      cost.steps = env.TotalSteps() - first;
    }
    cost.physics = physics;
    cost.episodes = episodes.size();
    return cost;
  };
  env.Reset();
  train();

  const int S = env.Spec().S, A = env.Spec().A;
  const std::vector<Product> products = Products(config, S, A);
  std::vector<Cost> costs;
  for (auto _ : state) {
    Cost cost = train();
    state.PauseTiming();
    const double steps = double(cost.steps);
    const double adam_entries =
        AdamEntriesPerStep(config, S, A, steps / double(std::max<std::size_t>(cost.episodes, 1)));
    cost.products = steps * ProductSecondsPerStep(products);
    cost.adam = steps * AdamSecondsPerEntry() * adam_entries;
    costs.push_back(cost);
    state.ResumeTiming();
  }
  const auto median = costs.begin() + std::ptrdiff_t(costs.size() / 2);
  std::ranges::nth_element(costs, median, {}, &Cost::SumAndCount);

  const double scale = 1e6 / double(median->steps);  // [us an environment step]
  double mflop = 0;
  for (const Product& p : products) mflop += p.MflopPerStep();
  state.counters["total_us"] = median->total * scale;
  state.counters["physics_us"] = median->physics * scale;
  state.counters["inference_us"] = (median->collect - median->physics) * scale;
  state.counters["learning_us"] = (median->total - median->collect) * scale;
  state.counters["bound_us"] = median->Bound() * scale;
  state.counters["bound_products_us"] = median->products * scale;
  state.counters["bound_adam_us"] = median->adam * scale;
  state.counters["MFLOP"] = mflop;
  state.counters["ratio"] = median->SumAndCount();
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
