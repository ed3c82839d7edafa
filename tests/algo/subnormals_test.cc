// An update does without subnormal numbers, which are many times slower; acting, and with it
// the physics, does not.

#include <gtest/gtest.h>

#include <limits>

#include "algo/method.h"
#include "algo/setup.h"

namespace o2v {
namespace {

volatile Real smallest = std::numeric_limits<Real>::min();  // not a constant to the compiler

/// A method whose loss is a subnormal number.
class Subnormal final : public Method {
 public:
  explicit Subnormal(const AlgorithmInput& in) : Method(in, /*K=*/0) {
    RegisterNetworks(in, {&weight_}, {{&weight_}}, nullptr, nullptr);
  }
  void Collect(VecEnv&, std::vector<Episode>&) override { acted = Half(); }
  const std::vector<SumAndCount>& Update() override {
    Learn(0, Batch());
    return Report();
  }
  LossTerms Loss(int, const Batch&, const FixedDraws*) override {
    learnt = Half();
    return {};
  }
  void OptionPolicy(const Mat&, const std::vector<int>&, const std::vector<char>&, Mat&) override {}

  Real acted = -1, learnt = -1;

 private:
  static Real Half() { return smallest * Real(0.5); }
  Param weight_{"w", 1, 1};
};

#ifdef __SSE__
TEST(Subnormals, AreZeroInAnUpdateAlone) {
  const RunConfig config = SmallConfig("ppo", Fidelity::kPaper);
  AlgorithmInput in;
  in.hyper = &config.hyper;
  Subnormal method(in);
  VecEnv env = PointTask(1, /*time_limit=*/5);
  std::vector<Episode> episodes;
  method.Update();
  method.Collect(env, episodes);
  EXPECT_EQ(method.learnt, 0);
  EXPECT_GT(method.acted, 0);
}
#endif

}  // namespace
}  // namespace o2v
