// Neither Step nor Reset allocates: the C library's allocation functions are counted.

#include <gtest/gtest.h>

#include <cstddef>

#include "env/task_helpers.h"

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
}  // extern "C"

namespace o2v {
namespace {

TEST(Allocations, AreCounted) {
  const long before = g_allocations;
  const auto some = std::make_unique<std::vector<double>>(100);
  EXPECT_GE(g_allocations, before + 2) << some->size();
}

TEST(Allocations, DoNotHappenInStepAndReset) {
  for (const std::string& id : AllTasks()) {
    for (const bool contact_forces : {false, true}) {
      TaskUnderTest task(id, contact_forces);
      const std::vector<double> a = task.Action();
      const long before = g_allocations;
      for (int episode = 0; episode < 2; ++episode) {
        task.Reset();
        for (int step = 0; step < 100; ++step) task.Step(a);
      }
      EXPECT_EQ(g_allocations, before) << id;
    }
  }
}

}  // namespace
}  // namespace o2v

#endif
