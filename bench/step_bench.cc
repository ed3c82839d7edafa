// CPU microseconds an environment step, split and beside the bound, for every task and method.

#include <benchmark/benchmark.h>

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

/// One rollout and its update an iteration, after one that is not counted; the fastest is reported.
void StepCost(benchmark::State& state, const std::string& task, const std::string& algorithm,
              const std::string& fidelity) {
  RunRequest request;
  request.task = task;
  request.algorithm = algorithm;
  request.fidelity = fidelity;
  request.seed = 0;
  const RunConfig config = ResolveRun(request);
  double physics = 0, physics_seconds = 0, collect = 0, total_seconds = INFINITY;
  VecEnv env([&] { return std::make_unique<TimedEnv>(MakeEnv(task, {}), &physics); },
             config.workers, config.seed);
  const auto learner = MakeRunAlgorithm(config, env.Spec());
  std::vector<Episode> episodes;
  std::vector<double> stats;
  env.Reset();
  learner->Collect(env, episodes);
  learner->Update(stats);

  // The least of the iterations, as the bound takes the least of its timings: what the machine does
  // besides is in neither.
  const std::int64_t first = env.TotalSteps();
  for (auto _ : state) {
    physics = 0;
    const auto start = Clock::now();
    learner->Collect(env, episodes);
    const double collected = SecondsSince(start);
    learner->Update(stats);
    const double seconds = SecondsSince(start);
    if (seconds < total_seconds) {
      total_seconds = seconds;
      collect = collected;
      physics_seconds = physics;
    }
  }

  // [us an environment step]
  const double scale = 1e6 * double(state.iterations()) / double(env.TotalSteps() - first);
  const int S = env.Spec().S, A = env.Spec().A;
  double products = 0, mflop = 0;
  for (const Product& p : Products(config, S, A)) {
    products += 1e6 * ProductSeconds(p.m, p.k, p.n) * p.per_step;
    mflop += p.MflopPerStep();
  }
  const double adam = 1e6 * AdamSecondsPerEntry() * AdamEntriesPerStep(config, S, A);
  const double total = total_seconds * scale, bound = physics_seconds * scale + products + adam;
  state.counters["total_us"] = total;
  state.counters["physics_us"] = physics_seconds * scale;
  state.counters["inference_us"] = (collect - physics_seconds) * scale;
  state.counters["learning_us"] = (total_seconds - collect) * scale;
  state.counters["bound_us"] = bound;
  state.counters["bound_products_us"] = products;
  state.counters["bound_adam_us"] = adam;
  state.counters["MFLOP"] = mflop;
  state.counters["ratio"] = total / bound;
}

}  // namespace

/// Registers StepCost for every task, method and fidelity.
void RegisterStepBenches() {
  for (const EnvEntry& task : EnvRegistry()) {
    for (const AlgorithmEntry& algorithm : AlgorithmRegistry()) {
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
