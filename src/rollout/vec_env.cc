#include "rollout/vec_env.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/check.h"

namespace o2v {

VecEnv::VecEnv(const Factory& make, int workers, std::uint64_t seed) : normalizer_(0) {
  Check(workers > 0, "workers: got ", workers, ", not a positive number");
  for (int i = 0; i < workers; ++i) {
    envs_.push_back(make());
    rngs_.emplace_back(seed, "worker" + std::to_string(i));
  }
  const EnvSpec& spec = Spec();
  normalizer_ = Normalizer(spec.S);
  raw_ = last_ = MatD::Zero(spec.S, workers);
  s_ = Mat::Zero(spec.S, workers);
  init_.assign(static_cast<std::size_t>(workers), 1);
  returns_ = VecD::Zero(workers);
  lengths_.assign(static_cast<std::size_t>(workers), 0);
  a_env_.resize(static_cast<std::size_t>(spec.A));
}

void VecEnv::Observe() {
  normalizer_.Update(raw_);
  for (Index i = 0; i < raw_.cols(); ++i) normalizer_.Apply(raw_.col(i), s_.col(i));
}

void VecEnv::Reset() {
  for (std::size_t i = 0; i < envs_.size(); ++i) {
    envs_[i]->Reset(rngs_[i], {raw_.col(Index(i)).data(), std::size_t(raw_.rows())});
    init_[i] = 1;
    lengths_[i] = 0;
  }
  returns_.setZero();
  Observe();
}

void VecEnv::ReplaceEnvs(const Factory& make) {
  for (std::unique_ptr<Env>& env : envs_) {
    const EnvSpec old = env->Spec();
    env = make();
    const EnvSpec& spec = env->Spec();
    Check(spec.S == old.S && spec.A == old.A, spec.id, ": sizes (", spec.S, ", ", spec.A,
          "), not those of ", old.id, " (", old.S, ", ", old.A, ")");
  }
}

void VecEnv::ChangeTask(const Factory& make, bool set_init) {
  const std::vector<char> init = init_;
  ReplaceEnvs(make);
  Reset();
  if (!set_init) init_ = init;
}

void VecEnv::Step(const Mat& a, Transition& out, std::vector<Episode>& episodes) {
  const EnvSpec& spec = Spec();
  const Index n = raw_.cols();
  Check(a.rows() == spec.A && a.cols() == n, spec.id, ": actions are (", a.rows(), ", ", a.cols(),
        "), not (", spec.A, ", ", n, ")");
  if (out.r.size() != n) {
    out.r.resize(n);
    out.terminated.resize(std::size_t(n));
    out.truncated.resize(std::size_t(n));
    out.s_last = Mat::Zero(spec.S, n);
  }
  for (std::size_t i = 0; i < envs_.size(); ++i) {
    const Index col = static_cast<Index>(i);
    for (std::size_t j = 0; j < a_env_.size(); ++j) {
      a_env_[j] = std::clamp<double>(a(Index(j), col), spec.a_low[j], spec.a_high[j]);
    }
    const std::span<double> obs(raw_.col(col).data(), std::size_t(raw_.rows()));
    const StepResult result = envs_[i]->Step(a_env_, obs);
    out.r(col) = result.reward;
    out.terminated[i] = result.terminated;
    out.truncated[i] = result.truncated;
    returns_(col) += result.reward;
    if (!std::isfinite(returns_(col))) {
      throw DivergedError(Concat(spec.id, ": the return of worker ", i, " is ", returns_(col),
                                 " at step ", lengths_[i] + 1, " of the episode"));
    }
    ++lengths_[i];
    init_[i] = out.Done(i);
    if (out.Done(i)) {
      episodes.push_back({total_steps_ + col, int(i), returns_(col), lengths_[i], result.terminated,
                          result.truncated});
      returns_(col) = 0;
      lengths_[i] = 0;
      last_.col(col) = raw_.col(col);
      envs_[i]->Reset(rngs_[i], obs);
    }
  }
  Observe();
  for (std::size_t i = 0; i < envs_.size(); ++i) {
    if (out.TimeLimit(i)) normalizer_.Apply(last_.col(Index(i)), out.s_last.col(Index(i)));
  }
  total_steps_ += n;
}

void VecEnv::Serialize(StateVisitor& v) {
  normalizer_.Serialize(v);
  v.Count("total_steps", total_steps_);
  v.Matrix("states", s_);
  std::vector<int> init(init_.begin(), init_.end());
  v.AllBelow("init_flags", init, 2);
  std::copy(init.begin(), init.end(), init_.begin());
  v.Doubles("episode_returns", returns_);
  v.Ints("episode_lengths", lengths_);
  for (std::size_t i = 0; i < envs_.size(); ++i) {
    const std::string name = "worker" + std::to_string(i) + ".";
    rngs_[i].Serialize(v, name + "rng");
    envs_[i]->Serialize(v, name);
  }
}

}  // namespace o2v
