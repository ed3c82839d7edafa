// After the first rollout and update nothing on the training path allocates: the C library's
// allocation functions are counted.

#include <gtest/gtest.h>

#include <cstddef>

#include "algo/setup.h"

#if !defined(__SANITIZE_ADDRESS__)  // which replaces them itself

namespace {
long g_allocations = 0;
}  // namespace

extern "C" {
void* __libc_malloc(std::size_t n);
void* __libc_calloc(std::size_t n, std::size_t size);
void* __libc_realloc(void* p, std::size_t n);
void* __libc_memalign(std::size_t alignment, std::size_t n);

void* malloc(std::size_t n) {
  ++g_allocations;
  return __libc_malloc(n);
}
void* calloc(std::size_t n, std::size_t size) {
  ++g_allocations;
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t n) {
  ++g_allocations;
  return __libc_realloc(p, n);
}
void* aligned_alloc(std::size_t alignment, std::size_t n) {
  ++g_allocations;
  return __libc_memalign(alignment, n);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t n) {
  ++g_allocations;
  *p = __libc_memalign(alignment, n);
  return *p ? 0 : 12;  // ENOMEM
}
}  // extern "C"

namespace o2v {
namespace {

/// Allocations of two more rollouts and updates, after a first one, at the method's own widths.
long Allocations(const EnvEntry& task, const std::string& method, Fidelity fidelity) {
  RunRequest request;
  request.task = task.id;
  request.algorithm = method;
  request.fidelity = ToString(fidelity);
  request.seed = 1;
  request.steps = 1;
  // Episodes of at most 30 steps: every rollout meets time limits and resets. The last minibatch is
  // smaller than the others.
  request.set = {"rollout=75", "epochs=1"};
  const RunConfig config = ResolveRun(request);
  VecEnv env([&] { return task.make({}, /*time_limit=*/30); }, config.workers, config.seed);
  env.Reset();
  const auto algorithm = MakeRunAlgorithm(config, env.Spec());
  std::vector<Episode> episodes;
  std::vector<double> stats;
  episodes.reserve(1000);
  long before = 0;
  for (int iteration = 0; iteration < 3; ++iteration) {
    if (iteration == 1) before = g_allocations;
    algorithm->Collect(env, episodes);
    algorithm->Update(stats);
  }
  const long after = g_allocations;
  EXPECT_GT(episodes.size(), 6u) << task.id;
  return after - before;
}

TEST(Allocations, AreCounted) {
  const long before = g_allocations;
  const Mat x = Mat::Ones(10, 10);
  const auto y = std::make_unique<std::vector<double>>(std::size_t(x.size()));
  EXPECT_EQ(g_allocations, before + 3) << y->size();
}

TEST(Allocations, DoNotHappenInTrainingAfterTheFirstUpdate) {
  for (const EnvEntry& task : EnvRegistry()) {
    for (const AlgorithmEntry& method : AlgorithmRegistry()) {
      for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
        EXPECT_EQ(Allocations(task, method.id, fidelity), 0)
            << task.id << ", " << method.id << ", " << ToString(fidelity);
      }
    }
  }
}

}  // namespace
}  // namespace o2v

#endif
