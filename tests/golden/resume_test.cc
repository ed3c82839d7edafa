// SIGKILL at any moment, then a resumed run: same bytes as without stopping.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <sstream>

#include "base/rng.h"
#include "real_run.h"

namespace o2v {
namespace {

constexpr int kMaxAhead = 4;  // a kill strikes within this many iterations

/// A run and how often it is killed in each way, one after the other.
struct KilledCase {
  RunCase run;
  int kills;

  /// A checkpoint follows every second iteration, so that a killed process leaves at most one new:
  /// all kills strike before the run is done. IOPG's iterations are of any length: twice as many.
  int Iterations() const { return (2 * kills + kMaxAhead) * (run.algorithm == "iopg" ? 2 : 1); }
};

enum class Moment { kRollout, kUpdate, kBeforeRename, kBeforeCheckpoint };
constexpr std::pair<Moment, const char*> kMoments[] = {
    {Moment::kRollout, "mid-rollout"},
    {Moment::kUpdate, "mid-update"},
    {Moment::kBeforeRename, "between temporary file and rename"},
    {Moment::kBeforeCheckpoint, "between CSV and checkpoint"}};

/// Kills the process at the n-th call.
class Killer {
 public:
  explicit Killer(std::uint64_t n) : left_(n) {}
  void operator()() {
    if (Due()) ::raise(SIGKILL);
  }
  bool Due() { return --left_ == 0; }

 private:
  std::uint64_t left_;
};

/// A task that kills its process in a step.
class KillingEnv final : public Env {
 public:
  KillingEnv(std::unique_ptr<Env> env, Killer& killer) : env_(std::move(env)), killer_(killer) {}
  const EnvSpec& Spec() const override { return env_->Spec(); }
  void Reset(Rng& rng, std::span<double> obs) override { env_->Reset(rng, obs); }
  StepResult Step(std::span<const double> a, std::span<double> obs) override {
    killer_();
    return env_->Step(a, obs);
  }
  void Serialize(StateVisitor& v, const std::string& prefix) override {
    env_->Serialize(v, prefix);
  }

 private:
  std::unique_ptr<Env> env_;
  Killer& killer_;
};

/// A method that is killed inside Update, by a timer of the kernel: where exactly does not matter
/// to what the test asks, which is that it matters to nothing.
class KilledAlgorithm final : public Algorithm {
 public:
  KilledAlgorithm(std::unique_ptr<Algorithm> algorithm, Killer& killer, long delay)
      : algorithm_(std::move(algorithm)), killer_(killer), delay_(delay) {}

  const std::vector<SumAndCount>& Update() override {
    if (!killer_.Due()) return algorithm_->Update();
    sigevent event{};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGKILL;
    timer_t timer;
    Check(::timer_create(CLOCK_MONOTONIC, &event, &timer) == 0, "no timer");
    const itimerspec when{{0, 0}, {0, delay_}};
    Check(::timer_settime(timer, 0, &when, nullptr) == 0, "no timer");
    const std::vector<SumAndCount>& stats = algorithm_->Update();
    ::raise(SIGKILL);  // the update was faster
    return stats;
  }

  void Collect(VecEnv& env, std::vector<Episode>& e) override { algorithm_->Collect(env, e); }
  std::vector<std::string> StatNames() const override { return algorithm_->StatNames(); }
  std::vector<Param*> Params() override { return algorithm_->Params(); }
  void Serialize(StateVisitor& v) override { algorithm_->Serialize(v); }
  int NumOptions() const override { return algorithm_->NumOptions(); }
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override {
    algorithm_->OptionPolicy(s, o_prev, init, P);
  }
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override {
    algorithm_->ActionPolicy(s, o, mu, sigma);
  }
  void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) override {
    algorithm_->OptionValues(s, o, q);
  }
  void ChangeTask() override { algorithm_->ChangeTask(); }
  std::vector<std::string> StageNames() const override { return algorithm_->StageNames(); }
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override {
    return algorithm_->Loss(stage, batch, fixed);
  }
  double Step(int stage) override { return algorithm_->Step(stage); }
  std::vector<char> InGraph(int stage) const override { return algorithm_->InGraph(stage); }

 private:
  std::unique_ptr<Algorithm> algorithm_;
  Killer& killer_;
  long delay_;  // [ns]
};

/// Goes on with the run until kill number `kill` of this kind. The points in iterations are seeded;
/// those at a checkpoint are the first one of the run, then the next but one of each process.
void TrainUntilKilled(const RunConfig& config, const std::filesystem::path& dir, Moment moment,
                      int kill) {
  Rng rng(17, Concat("kill", static_cast<int>(moment), '.', kill));
  const auto steps = static_cast<std::uint64_t>(kRollout * config.workers);  // of an iteration
  Killer killer(moment == Moment::kRollout  ? 1 + rng.UniformInt(kMaxAhead * steps)
                : moment == Moment::kUpdate ? 1 + rng.UniformInt(kMaxAhead)
                : kill == 0                 ? 1
                                            : 2);
  const long delay =
      1 + static_cast<long>(rng.UniformInt(200'000));  // [ns] an update takes 30 to 400 us
  RunParts parts = PartsOf(config);
  RunHooks hooks;
  const RunParts real = parts;
  switch (moment) {
    case Moment::kRollout:
      parts.make_env = [&](int task) {
        return std::make_unique<KillingEnv>(real.make_env(task), killer);
      };
      break;
    case Moment::kUpdate:
      parts.make_algorithm = [&](const EnvSpec& spec) {
        return std::make_unique<KilledAlgorithm>(real.make_algorithm(spec), killer, delay);
      };
      break;
    case Moment::kBeforeRename:
      hooks.before_rename = std::ref(killer);
      break;
    case Moment::kBeforeCheckpoint:
      hooks.before_checkpoint = std::ref(killer);
      break;
  }
  std::ostringstream progress;
  Train(config, parts, dir, /*resume=*/true, progress, /*terminal=*/false, hooks);
}

/// Runs `action` in a process of its own and returns how that ended, as waitpid tells it.
template <typename Action>
int InChild(Action&& action) {
  const pid_t pid = ::fork();
  if (pid == 0) {
    try {
      action();
    } catch (const std::exception& e) {
      std::fprintf(stderr, "%s\n", e.what());
      std::_Exit(1);
    }
    std::_Exit(0);
  }
  int status = 0;
  Check(::waitpid(pid, &status, 0) == pid, "no child");
  return status;
}

void PrintTo(const KilledCase& c, std::ostream* out) { *out << c.run.Name(); }

class KilledRun : public testing::TestWithParam<KilledCase> {};

TEST_P(KilledRun, EndsInTheSameBytesWhenResumed) {
  const RunConfig config = ShortRun(GetParam().run, GetParam().Iterations());
  TestFolder dir;
  std::ostringstream progress;
  Train(config, dir / "whole", /*resume=*/false, progress, /*terminal=*/false);
  for (const auto& [moment, name] : kMoments) {
    const std::filesystem::path run = dir / name;
    for (int kill = 0; kill < GetParam().kills; ++kill) {
      const int status =
          InChild([&, moment = moment] { TrainUntilKilled(config, run, moment, kill); });
      ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << name << ", kill " << kill;
    }
    ASSERT_EQ(Train(config, run, /*resume=*/true, progress, /*terminal=*/false), RunStatus::kDone);
    for (const char* file : {"config.toml", "episodes.csv", "updates.csv", "last.ckpt"}) {
      EXPECT_TRUE(ReadFile(run / file) == ReadFile(dir / "whole" / file)) << name << ": " << file;
    }
  }
}

std::vector<KilledCase> Cases() {
  std::vector<KilledCase> cases;
  for (const AlgorithmEntry& method : AlgorithmRegistry()) {
    if (method.id == "ppo" || method.id == "option2vec") {
      for (const char* task :
           {"Ant-v2", "Humanoid-v2", "Reacher-v2", "Hopper-v2", "HalfCheetah-v2"}) {
        for (const int workers : {1, 4}) {
          cases.push_back({{task, method.id, Fidelity::kPaper, workers}, /*kills=*/8});
        }
        cases.push_back({{task, method.id, Fidelity::kReleased, /*workers=*/4}, /*kills=*/2});
      }
      for (const char* task : {"dm-cartpole-balance", "dm-reacher-hard", "dm-cheetah-run",
                               "dm-fish-downleft", "dm-walker-walk"}) {
        cases.push_back({{task, method.id, Fidelity::kPaper, /*workers=*/4}, /*kills=*/2});
      }
    } else {
      for (const Fidelity fidelity : {Fidelity::kPaper, Fidelity::kReleased}) {
        cases.push_back({{"Hopper-v2", method.id, fidelity, /*workers=*/4}, /*kills=*/5});
        cases.push_back({{"InvertedPendulum-v2", method.id, fidelity, /*workers=*/1}, /*kills=*/5});
      }
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Runs, KilledRun, testing::ValuesIn(Cases()),
                         [](const auto& info) { return info.param.run.Name(); });

}  // namespace
}  // namespace o2v
