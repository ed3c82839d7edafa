// Neither Step nor Reset allocates: the C library's allocation functions are counted.

#include <gtest/gtest.h>

#include "env/task_helpers.h"

#if !defined(__SANITIZE_ADDRESS__)  // which replaces them itself
#include "allocation_counter.h"

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
