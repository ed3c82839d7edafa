#include "render/renderer.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <set>

#include "base/check.h"

namespace o2v {
namespace {

bool HasOsMesa() { return ::dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_GLOBAL) != nullptr; }

/// A task in its first state.
struct Task {
  explicit Task(const std::string& id) : env(MakeEnv(id, {})), obs(std::size_t(env->Spec().S)) {
    Rng rng(7, "test");
    env->Reset(rng, obs);
  }
  void Step() { env->Step(std::vector<double>(std::size_t(env->Spec().A), 0.5), obs); }

  std::unique_ptr<Env> env;
  std::vector<double> obs;
};

class Drawing : public testing::Test {
 protected:
  void SetUp() override {
    if (!HasOsMesa()) GTEST_SKIP() << "OSMesa is not installed";
  }
};

TEST_F(Drawing, ShowsEveryTask) {
  for (const EnvEntry& entry : EnvRegistry()) {
    const Task task(entry.id);
    Image image;
    Renderer(*task.env, 160, 120).Draw({}, image);
    ASSERT_EQ(image.rgb.size(), 160u * 120 * 3) << entry.id;
    std::set<std::array<int, 3>> colors;
    for (int y = 0; y < 100; ++y) {
      for (int x = 0; x < 160; ++x) colors.insert(image.At(x, y));
    }
    EXPECT_GT(colors.size(), 100u) << entry.id << ": sky, floor, light and shadow of a body";
  }
}

TEST_F(Drawing, FollowsTheTask) {
  Task task("Reacher-v2");  // whose camera stands still
  Renderer renderer(*task.env, 160, 120);
  Image first, again, later;
  renderer.Draw({}, first);
  renderer.Draw({}, again);
  for (int i = 0; i < 5; ++i) task.Step();
  renderer.Draw({}, later);
  EXPECT_TRUE(first.rgb == again.rgb);
  EXPECT_FALSE(first.rgb == later.rgb);
}

TEST_F(Drawing, MarksTheOptions) {
  // 8 steps to come are 160 pixels, so that two steps are 40: option 1, then 3, then none yet.
  const Task task("HalfCheetah-v2");
  Image image;
  Renderer(*task.env, 160, 120).Draw({"", "", {1, 1, 3, 3}, 8}, image);
  const auto [bar, time_line] = BandsOf(120);
  for (const int x : {0, 20, 39}) EXPECT_EQ(image.At(x, 119), OptionColor(1)) << x;
  for (const int x : {40, 60, 79}) EXPECT_EQ(image.At(x, 120 - time_line), OptionColor(3)) << x;
  for (const int x : {80, 159}) EXPECT_EQ(image.At(x, 119), (std::array{38, 38, 38})) << x;
  for (const int y : {120 - time_line - 1, 120 - time_line - bar}) {  // left of the number
    for (const int x : {0, 20, 159}) EXPECT_EQ(image.At(x, y), OptionColor(3)) << x << " " << y;
  }
  EXPECT_NE(image.At(0, 120 - time_line - bar - 1), OptionColor(3)) << "the picture";
}

TEST_F(Drawing, ChangesNothing) {
  for (const char* id : {"Walker2d-v2", "dm-fish-upright"}) {
    Task drawn(id), alone(id);
    Renderer renderer(*drawn.env, 64, 64);
    Image image;
    for (int i = 0; i < 30; ++i) {
      renderer.Draw({"a", "b", {0}, 10}, image);
      drawn.Step();
      alone.Step();
      ASSERT_EQ(drawn.obs, alone.obs) << id << ", step " << i;
    }
  }
}

TEST_F(Drawing, RefusesSizesThatCannotBeDrawn) {
  const Task task("Hopper-v2");
  for (const auto& [width, height] : {std::pair(63, 64), {64, 65}, {62, 64}, {64, 4098}}) {
    EXPECT_THROW(Renderer(*task.env, width, height), ConfigError) << width << "x" << height;
  }
}

TEST(OptionColors, AreTheirOwn) {
  std::set<std::array<int, 3>> colors;
  for (int o = 0; o < 7; ++o) colors.insert(OptionColor(o));
  EXPECT_EQ(colors.size(), 7u);
}

}  // namespace
}  // namespace o2v
