// Benchmarks: single layers, and whole steps of training beside their bound.
//   o2v_bench [--products TASK METHOD FIDELITY] [--steps TASK N] [Google Benchmark's options]

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "bench/bound.h"
#include "env/env.h"

namespace o2v::bench {

void RegisterStepBenches();

namespace {

/// Every product of the bound with its shape, work and the rate that a bare product reaches.
void PrintProducts(const char* task, const char* method, const char* fidelity) {
  RunRequest request;
  request.task = task;
  request.algorithm = method;
  request.fidelity = fidelity;
  request.seed = 0;
  const RunConfig config = ResolveRun(request);
  const auto env = MakeEnv(task, {});
  std::printf("%-36s %5s %5s %5s %10s %12s %9s %9s\n", "product", "m", "k", "n", "per step",
              "MFLOP/step", "GFLOP/s", "us/step");
  for (const Product& p : Products(config, env->Spec().S, env->Spec().A)) {
    const double seconds = ProductSeconds(p.m, p.k, p.n);
    std::printf("%-36s %5td %5td %5td %10.5f %12.5f %9.2f %9.3f\n", p.what.c_str(), p.m, p.k, p.n,
                p.per_step, p.MflopPerStep(), 1e-3 * p.MflopPerStep() / (seconds * p.per_step),
                1e6 * seconds * p.per_step);
  }
}

/// Random actions, for the CPU time of stepping alone (bench/peers).
void Step(const char* task, long steps) {
  const auto env = MakeEnv(task, {});
  const EnvSpec& spec = env->Spec();
  Rng rng(0, "bench");
  std::vector<double> obs(std::size_t(spec.S)), a(spec.a_low.size());
  env->Reset(rng, obs);
  for (long step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = rng.Uniform(spec.a_low[i], spec.a_high[i]);
    const StepResult result = env->Step(a, obs);
    if (result.terminated || result.truncated) env->Reset(rng, obs);
  }
}

}  // namespace
}  // namespace o2v::bench

int main(int argc, char** argv) {
  if (argc == 5 && std::strcmp(argv[1], "--products") == 0) {
    o2v::bench::PrintProducts(argv[2], argv[3], argv[4]);
    return 0;
  }
  if (argc == 4 && std::strcmp(argv[1], "--steps") == 0) {
    o2v::bench::Step(argv[2], std::atol(argv[3]));
    return 0;
  }
  o2v::bench::RegisterStepBenches();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
