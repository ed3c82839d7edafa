// What PPO's iteration hands to the method that values its samples (spec 1.3).

#include "algo/ppo_method.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "algo/toy.h"
#include "small_hyper.h"

namespace o2v {
namespace {

constexpr int kWorkers = 2, kSteps = 12, kMinibatch = 5, kOptions = 3;
constexpr int kLimits[kWorkers] = {5, 7};  // [steps] of the workers' episodes

/// Worker i takes option (t + i) mod 3 in step t. A state is worth 100 at an episode's start, 10
/// times the option before, and the option.
class Telling final : public PpoMethod {
 public:
  explicit Telling(const AlgorithmInput& in) : PpoMethod(in, kOptions) {
    o_prev_.assign(kWorkers, 0);
    RegisterNetworks(in, {}, {{}}, nullptr, nullptr);
  }
  const MatD& values() const { return rollout_.critics[0].v; }
  std::vector<int> learnt;  // samples in the order of the losses, by their actions

 private:
  void Act(const Mat&, std::span<const char> init, Index row) override {
    const int t = int(row) / kWorkers;
    for (Index i = 0; i < kWorkers; ++i) a_(0, i) = Real(100 * rollouts_ + int(row + i));
    rollouts_ += t == kSteps - 1;
    RecordOptions(row, std::vector<int>{t % kOptions, (t + 1) % kOptions}, init, rollout_.batch);
  }
  void Values(const Choices& x, Index row) override {
    for (Index b = 0; b < x.s.cols(); ++b) {
      const std::size_t i = std::size_t(b);
      const int o = x.o.empty() ? 0 : x.o[i];
      rollout_.critics[0].v.data()[row + b] = 100 * x.init[i] + 10 * x.o_prev[i] + o;
    }
  }
  LossTerms Loss(int, const Batch& batch, const FixedDraws*) override {
    for (Index b = 0; b < batch.Size(); ++b) learnt.push_back(int(batch.a(0, b)));
    return {};
  }
  void OptionPolicy(const Mat&, const std::vector<int>&, const std::vector<char>&, Mat&) override {}

  int rollouts_ = 0;
};

struct Told {
  Settings hyper = SmallHyper({{"rollout", kSteps}, {"minibatch", kMinibatch}, {"epochs", 3}});
  int made = 0;
  VecEnv env{[this] { return std::make_unique<PointEnv>(kLimits[made++]); }, kWorkers, /*seed=*/3};
  std::vector<Episode> episodes;
  std::unique_ptr<Telling> method;

  Told() {
    AlgorithmInput in;
    in.S = in.A = 1;
    in.workers = kWorkers;
    in.hyper = &hyper;
    in.switches.timelimit = Fidelity::kReleased;
    method = std::make_unique<Telling>(in);
    env.Reset();
  }
};

TEST(PpoMethod, LearnsEverySampleOnceAnEpochThatOfTheLastMinibatchIncluded) {
  Told told;  // 24 samples: four minibatches of 5 and one of 4
  for (int rollout = 0; rollout < 2; ++rollout) {
    told.method->learnt.clear();
    told.method->Collect(told.env, told.episodes);
    told.method->Update();
    std::vector<int> learnt = told.method->learnt, expected(kWorkers * kSteps);
    std::iota(expected.begin(), expected.end(), 100 * rollout);
    ASSERT_EQ(learnt.size(), 3 * expected.size());
    for (auto epoch = learnt.begin(); epoch != learnt.end(); epoch += kWorkers * kSteps) {
      std::sort(epoch, epoch + kWorkers * kSteps);
      EXPECT_TRUE(std::equal(expected.begin(), expected.end(), epoch)) << "rollout " << rollout;
    }
  }
}

TEST(PpoMethod, ValuesEverySampleByItsOwnFlagAndOptions) {
  Told told;
  told.method->Collect(told.env, told.episodes);
  for (int i = 0; i < kWorkers; ++i) {
    for (int t = 0; t <= kSteps; ++t) {
      const int init = t % kLimits[i] == 0, o_prev = t == 0 ? 0 : (t - 1 + i) % kOptions;
      const int o = t == kSteps ? 0 : (t + i) % kOptions;  // none is drawn after the rollout
      EXPECT_EQ(told.method->values()(i, t), 100 * init + 10 * o_prev + o) << i << ", step " << t;
    }
  }
}

}  // namespace
}  // namespace o2v
