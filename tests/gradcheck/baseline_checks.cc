#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>

#include "base/check.h"
#include "gradcheck/problem.h"
#include "random_mat.h"

namespace o2v {
namespace {

// The losses of spec 4 as plain functions of the tensors, apart from src/. What a loss holds
// constant is read from `base`, the networks at the unperturbed tensors.

constexpr int kB = 24;            // every ratio and sign with an initial state and without
constexpr int kN = 2, kT = 6;     // workers and steps of OC
constexpr double kLogEps = 1e-5;  // spec 3.3

// Everything behind the networks' outputs: the differences of losses come near double's rounding.
using Wide = long double;
using WideMat = Eigen::MatrixX<Wide>;
using WideVec = Eigen::VectorX<Wide>;

bool Has(const std::string& name, const char* part) { return name.find(part) != std::string::npos; }
bool IsCritic(const std::string& name) { return name.starts_with("critic."); }
bool IsIntra(const std::string& name) { return Has(name, ".mu.") || name.ends_with(".rho"); }
bool IsBeta(const std::string& name) { return Has(name, ".beta."); }

WideMat Softmax(const Mat& z) {
  const WideMat e = z.cast<Wide>().array().exp();
  return e.array().rowwise() / e.colwise().sum().array();
}

/// What the networks say about a batch.
struct Says {
  WideMat pi;    // (K, B) master policy; DAC-OneStep: its option policy
  WideMat q;     // (K, B) values; AHP: u (K + 1, B)
  WideMat beta;  // (K, B) terminations
  WideMat p;     // (K, B) densities pi_k(a_b | s_b)
  WideVec H;     // (K) entropies of pi_k
};

/// PPO, and what all other methods share with it: clip-surrogate(LogProb) + 1/2 mean
/// (Prediction - R)^2 + Extra.
class PpoProblem : public Problem {
 public:
  PpoProblem(const Setup& setup, std::uint64_t seed) : Problem(setup, seed) {}

  /// Makes the batch; to be called once.
  virtual void Fill();

 protected:
  /// What the networks say; with a `tensor`, only what that tensor moves is written.
  virtual void Ask(const Batch& batch, const std::string& tensor, Says& x);
  /// ln of the probability that the stage's surrogate is about, and the value, of sample b.
  virtual Wide LogProb(int, const Batch&, const Says& x, Index b) { return std::log(x.p(0, b)); }
  virtual Wide Prediction(int, const Batch&, const Says& x, Index b) { return x.q(0, b); }
  /// Terms beyond the two.
  virtual Wide Extra(int, const Batch&, const Says& now, const Says&) {
    return -kEntropyWeight * now.H(0);
  }
  virtual Wide Loss(int stage, const Batch& batch, const Says& now, const Says& base);
  /// Whether a stage's loss moves a tensor.
  virtual bool Moves(int, const std::string&) const { return true; }

  std::function<double()> LossOf(int stage, const std::string& name, const Batch& batch,
                                 const FixedDraws&) final {
    Says base;
    Ask(batch, "", base);
    const Wide start = Loss(stage, batch, base, base);  // taken off for the sake of rounding
    return [this, stage, name, &batch, base, start, now = base]() mutable {
      Ask(batch, name, now);
      return double(Loss(stage, batch, now, base) - start);
    };
  }
  Expect Expected(int stage, const std::string& name) const override {
    return Moves(stage, name) ? Expect::kGradient : Expect::kDetached;
  }
  bool IsOutput(int stage, const std::string& name, const Batch&) const final {
    return Moves(stage, name) &&
           (name.ends_with("head.b") || name.ends_with("rho") || name == "ynet.1.b" ||
            (IsCritic(name) && !Has(name, "body") && name.ends_with(".b")));
  }

  /// ln p under the switch density_log_eps.
  Wide Log(Wide p) const {
    return std::log(p + (Released(setup_.switches.density_log_eps) ? kLogEps : 0));
  }
  /// Whether a tensor belongs to the part of the networks with this prefix.
  static bool In(const std::string& part, const std::string& tensor) {
    return tensor.empty() || tensor.starts_with(part);
  }
  Mat Net(const std::string& body, const std::string& head, const Mat& x) {
    return Affine(head, Hidden(Affine(body + ".1", Hidden(Affine(body + ".0", x)))));
  }
  /// Densities of the actions under N(mu, sigma^2), as row k, and the entropy.
  void AskGaussian(const Batch& batch, const std::string& mu_net, const std::string& rho, Index k,
                   Says& x);
  /// The batch of n samples, without old log-probabilities and targets.
  void Draw(int n);
  /// That the loss of src/ is this one.
  void CheckLoss(int stage);

 private:
  Mat Hidden(const Mat& z) { return setup_.activation == 1 ? Relu(z) : Mat(z.array().tanh()); }
};

void PpoProblem::AskGaussian(const Batch& batch, const std::string& mu_net, const std::string& rho,
                             Index k, Says& x) {
  const WideMat mu = Net(mu_net + ".body", mu_net + ".head", batch.s).cast<Wide>().array().tanh();
  const WideVec sigma = (1 + Tensor(rho).col(0).cast<Wide>().array().exp()).log();
  const Wide root = std::sqrt(2 * std::numbers::pi_v<Wide>);
  for (Index b = 0; b < batch.Size(); ++b) {
    const WideVec z = (batch.a.col(b).cast<Wide>() - mu.col(b)).cwiseQuotient(sigma);
    x.p(k, b) = std::exp(-z.squaredNorm() / 2) / (root * sigma.array()).prod();
  }
  x.H(k) = (Wide(0.5) + std::log(root) + sigma.array().log()).sum();
}

void PpoProblem::Ask(const Batch& batch, const std::string& tensor, Says& x) {
  x.p.resize(1, batch.Size());
  x.H.resize(1);
  if (In("actor", tensor)) AskGaussian(batch, "actor", "actor.rho", 0, x);
  if (In("critic", tensor)) x.q = Net("critic.body", "critic.v", batch.s).cast<Wide>();
}

Wide PpoProblem::Loss(int stage, const Batch& batch, const Says& now, const Says& base) {
  const Index B = batch.Size();
  const StageTargets& targets =
      Has(setup_.method, "dac_") && stage == 0 ? batch.option : batch.action;
  Wide sum = 0;
  for (Index b = 0; b < B; ++b) {
    const Wide r = std::exp(LogProb(stage, batch, now, b) - targets.logp_old(b));
    const Wide clipped = std::clamp<Wide>(r, 1 - kClip, 1 + kClip), A = targets.adv_hat(b);
    const Wide error = Prediction(stage, batch, now, b) - targets.ret(b);
    sum += error * error / 2 - std::min(r * A, clipped * A);
  }
  return sum / B + Extra(stage, batch, now, base);
}

void PpoProblem::Draw(int n) {
  batch_.Resize(kS, kA, n);
  batch_.s = RandomMat(kS, n, rng_);
  batch_.a = RandomMat(kA, n, rng_, 0.7);  // about sigma: no density far below kLogEps
  batch_.P_old = RandomMat(kK, n, rng_).cwiseAbs();
  for (std::size_t i = 0; i < std::size_t(n); ++i) batch_.init[i] = i % 3 == 1;
  // Every option is wanted, executed and before, at a state that is neither initial nor clipped.
  std::set<int> executed, before;
  while (int(std::min(executed.size(), before.size())) < algo_->NumOptions()) {
    batch_.o = ShuffledOptions(std::size_t(n), algo_->NumOptions(), rng_);
    batch_.o_prev = ShuffledOptions(std::size_t(n), algo_->NumOptions(), rng_);
    executed.clear();
    before.clear();
    for (std::size_t i = 0; i < batch_.o.size(); ++i) {
      if (rng_.Uniform() < 0.4) batch_.o_prev[i] = batch_.o[i];
      if (batch_.init[i] || IsClipped(int(i))) continue;
      executed.insert(batch_.o[i]);
      before.insert(batch_.o_prev[i]);
    }
  }
  batch_.stop.resize(std::size_t(n));
  for (std::size_t i = 0; i < batch_.o.size(); ++i) {
    batch_.stop[i] = batch_.init[i] || batch_.o[i] != batch_.o_prev[i] || rng_.Uniform() < 0.5;
  }
}

void PpoProblem::CheckLoss(int stage) {
  Says x;
  Ask(batch_, "", x);
  const double theirs = algo_->Loss(stage, batch_, nullptr).total;
  const double ours = double(Loss(stage, batch_, x, x));
  Check(std::abs(ours - theirs) < 1e-12, setup_.method, ", stage ", stage, ": the loss is ", theirs,
        ", by the specification ", ours);
}

void PpoProblem::Fill() {
  Draw(kB);
  Says x;
  Ask(batch_, "", x);
  for (int stage = 0; stage < int(algo_->StageNames().size()); ++stage) {
    StageTargets& targets =
        algo_->StageNames().size() == 2 && stage == 0 ? batch_.option : batch_.action;
    for (int b = 0; b < kB; ++b) {
      Place(targets, b, double(LogProb(stage, batch_, x, b)),
            double(Prediction(stage, batch_, x, b)));
    }
  }
  for (int stage = 0; stage < int(algo_->StageNames().size()); ++stage) CheckLoss(stage);
}

/// The network of spec 2.3, and what its methods have in common.
class OptionProblem : public PpoProblem {
 protected:
  using PpoProblem::PpoProblem;

  void Ask(const Batch& batch, const std::string& tensor, Says& x) override {
    AskCriticAndOptions(batch, tensor, x);
    if (In("master", tensor)) x.pi = Softmax(Net("master.body", "master.head", batch.s));
    x.beta.resize(kK, batch.Size());
    for (int k = 0; k < kK; ++k) {
      if (In(Option(k, ".beta"), tensor)) x.beta.row(k) = Beta(Option(k, ".beta"), batch.s);
    }
  }
  void AskCriticAndOptions(const Batch& batch, const std::string& tensor, Says& x) {
    const std::string head = setup_.method == "ahp_ppo" ? "critic.u" : "critic.q";
    if (In("critic", tensor)) x.q = Net("critic.body", head, batch.s).cast<Wide>();
    x.p.resize(kK, batch.Size());
    x.H.resize(kK);
    for (int k = 0; k < kK; ++k) {
      if (!In(Option(k, ".mu"), tensor) && !In(Option(k, ".rho"), tensor)) continue;
      AskGaussian(batch, Option(k, ".mu"), Option(k, ".rho"), k, x);
    }
  }
  static std::string Option(int k, const char* part) { return "option" + std::to_string(k) + part; }
  WideMat Beta(const std::string& net, const Mat& s) {
    return 1 / (1 + (-Net(net + ".body", net + ".head", s).cast<Wide>().array()).exp());
  }

  Wide LogProb(int, const Batch& batch, const Says& x, Index b) override {
    return Log(x.p(batch.o[std::size_t(b)], b));
  }
  Wide Prediction(int, const Batch& batch, const Says& x, Index b) override {
    return x.q(batch.o[std::size_t(b)], b);
  }
  Wide Extra(int, const Batch&, const Says&, const Says&) override { return 0; }

  /// pi_hat_k after option i at a state that is not initial, `mark` being delta_{ki}; spec 3.5.
  Wide PiHat(const Says& x, Index b, int i, int k, bool mark) const {
    const Wide beta = x.beta(Released(setup_.switches.beta_index) ? k : i, b);
    return (1 - beta) * mark + beta * x.pi(k, b);
  }
};

/// Spec 4.6. Stage 0 is the high one.
class DacProblem : public OptionProblem {
 protected:
  using OptionProblem::OptionProblem;

  /// Entry k of the option policy's vector at sample b.
  virtual Wide P(const Batch& batch, const Says& x, int k, Index b) {
    const std::vector<int>& o_prev = batch.o_prev;
    const int i = o_prev[std::size_t(b)];
    bool mark = k == i;
    if (Released(setup_.switches.dac_update_mask)) {
      mark = b == 0 && std::find(o_prev.begin(), o_prev.end(), k) != o_prev.end();
    }
    return batch.init[std::size_t(b)] ? x.pi(k, b) : PiHat(x, b, i, k, mark);
  }

  Wide LogProb(int stage, const Batch& batch, const Says& x, Index b) override {
    if (stage == 1) return OptionProblem::LogProb(stage, batch, x, b);
    return Log(P(batch, x, batch.o[std::size_t(b)], b));
  }
  Wide Prediction(int stage, const Batch& batch, const Says& x, Index b) override {
    return stage == 1 ? OptionProblem::Prediction(stage, batch, x, b)
                      : batch.P_old.col(b).cast<Wide>().dot(x.q.col(b));
  }
  Wide Extra(int stage, const Batch& batch, const Says& now, const Says&) override {
    if (stage == 1) return 0;
    Wide sum = 0;  // of -H
    for (Index b = 0; b < batch.Size(); ++b) {
      for (int k = 0; k < kK; ++k) sum += P(batch, now, k, b) * Log(P(batch, now, k, b));
    }
    return kEntropyWeight * sum / batch.Size();
  }
  bool Moves(int stage, const std::string& name) const override {
    if (name.starts_with("critic.body") || name.starts_with("critic.q")) return true;
    if (IsCritic(name)) return false;
    return stage == 1 ? IsIntra(name) : name.starts_with("master") || IsBeta(name);
  }
};

/// Spec 4.7, 5. Says::pi is the option policy's vector, which some switches leave unnormalised.
class OneStepProblem final : public DacProblem {
 public:
  using DacProblem::DacProblem;

 private:
  void Ask(const Batch& batch, const std::string& tensor, Says& x) override {
    AskCriticAndOptions(batch, tensor, x);
    if (tensor.empty() || IsOptionPolicy(tensor)) AskOptionPolicy(batch, x);
  }
  void AskOptionPolicy(const Batch& batch, Says& x) {
    const Switches& sw = setup_.switches;
    const bool number = Released(sw.onestep_index);
    const Index B = batch.Size();
    Mat index = Mat::Zero(number ? 1 : kK, B);
    for (Index b = 0; b < B; ++b) {
      const int i = batch.o_prev[std::size_t(b)];
      if (number) {
        index(0, b) = i;
      } else if (!batch.init[std::size_t(b)]) {
        index(i, b) = 1;
      }
    }
    Mat input = Stack(batch.s, index);
    for (Index b = 0; number && b < B; ++b) {
      const Vec d = input.col(b).array() - input.col(b).mean();
      input.col(b) =
          Tensor("master.ln.gain").cwiseProduct(d) / std::sqrt(d.squaredNorm() / (kS + 1) + 1e-5) +
          Tensor("master.ln.shift");
    }
    const std::string net = number ? "master" : "policy";
    Mat z = Net(net + ".body", net + ".head", input);
    if (Released(sw.onestep_roles)) {
      const Mat y = Affine("ynet.1", Relu(Affine("ynet.0", batch.s)));
      for (Index b = 0; b < B; ++b) {
        if (!batch.init[std::size_t(b)]) z.col(b) = y.col(b);
      }
    }
    x.pi = Softmax(z);
    if (!Released(sw.onestep_norm)) return;
    for (Index b = 0; b < B; ++b) {
      if (batch.init[std::size_t(b)]) continue;
      x.pi.col(b) = Relu(z.col(b)).cast<Wide>();
      // 1/y bends hard where y is small.
      margin_ = std::min(margin_, 0.01 * z.col(b).cwiseAbs().minCoeff());
    }
    x.pi.array() += kLogEps;
  }
  Wide P(const Batch&, const Says& x, int k, Index b) override { return x.pi(k, b); }
  bool Moves(int stage, const std::string& name) const override {
    if (IsOptionPolicy(name)) return stage == 0;
    return !IsBeta(name) && DacProblem::Moves(stage, name);
  }
  static bool IsOptionPolicy(const std::string& name) {
    return name.starts_with("policy") || name.starts_with("master") || name.starts_with("ynet");
  }
};

/// Spec 4.4.
class AhpProblem final : public OptionProblem {
 public:
  using OptionProblem::OptionProblem;

 private:
  Wide LogProb(int, const Batch& batch, const Says& x, Index b) override {
    const std::size_t i = std::size_t(b);
    const int o = batch.o[i];
    const Wide beta = x.beta(Released(setup_.switches.ahp_beta_index) ? o : batch.o_prev[i], b);
    Wide p = x.p(o, b);
    if (!batch.init[i] || Released(setup_.switches.ahp_init_factor)) {
      p *= batch.stop[i] ? beta : 1 - beta;
    }
    return Log(batch.stop[i] ? p * x.pi(o, b) : p);
  }
  Wide Prediction(int, const Batch& batch, const Says& x, Index b) override {
    return x.q(batch.init[std::size_t(b)] ? kK : batch.o_prev[std::size_t(b)], b);
  }
  bool Moves(int, const std::string& name) const override { return !name.starts_with("critic.q"); }
};

/// Spec 4.2.
class PpocProblem final : public OptionProblem {
 public:
  using OptionProblem::OptionProblem;

 private:
  Wide Extra(int, const Batch& batch, const Says& now, const Says& base) override {
    Wide sum = 0;
    for (Index b = 0; b < batch.Size(); ++b) {
      const int o = batch.o[std::size_t(b)], i = batch.o_prev[std::size_t(b)];
      Wide omega = 1;
      if (!batch.init[std::size_t(b)]) {
        const Wide V = base.pi.col(b).dot(base.q.col(b));
        sum += now.beta(i, b) * (base.q(i, b) - V + kPenalty);
        if (!Released(setup_.switches.ppoc_master_weight)) {
          omega = base.beta(i, b) * base.pi(o, b) / PiHat(base, b, i, o, o == i);
        }
      }
      sum -= omega * std::log(now.pi(o, b)) * batch.action.adv_hat(b);
      sum += kEntropyWeight * (now.pi.col(b).array() * now.pi.col(b).array().log()).sum();
    }
    return sum / batch.Size();
  }
  bool Moves(int, const std::string& name) const override { return !name.starts_with("critic.u"); }
};

/// Spec 4.3. The target network's tensors are random as well.
class OcProblem final : public OptionProblem {
 public:
  using OptionProblem::OptionProblem;

  void Fill() override {
    Draw(kN * kT);
    batch_.r = RandomMat(kN * kT, 1, rng_);
    batch_.mask = VecD::Ones(kN * kT);
    for (int b = 0; b < kN * (kT - 1); ++b) batch_.mask(b) = !batch_.init[std::size_t(b + kN)];
    batch_.s_end = RandomMat(kS, kN, rng_);
    Targets targets(*this);
    algo_->Serialize(targets);
    CheckLoss(0);
  }

 private:
  /// Finds the target network and moves it.
  struct Targets final : StateVisitor {
    explicit Targets(OcProblem& owner) : problem(owner) {}
    void Matrix(std::string_view name, Mat& x) override {
      if (!name.starts_with("target.")) return;
      x += RandomMat(x.rows(), x.cols(), problem.rng_, 0.3);
      problem.values_[std::string(name)] = &x;
    }
    void Doubles(std::string_view, double*, std::size_t) override {}
    void Ints(std::string_view, std::int64_t*, std::size_t) override {}
    OcProblem& problem;
  };

  void Sample(int b, Batch& sample, FixedDraws& fixed) const override {
    OptionProblem::Sample(b, sample, fixed);
    sample.r = batch_.r.segment(b, 1);
    sample.mask = batch_.mask.segment(b, 1);
    sample.s_end = batch_.s_end.col(b % kN);
  }

  Wide Loss(int, const Batch& batch, const Says& now, const Says& base) override {
    const Index B = batch.Size(), N = batch.s_end.cols();
    const WideMat q_end = Net("target.critic.body", "target.critic.q", batch.s_end).cast<Wide>();
    Wide sum = 0;
    for (Index worker = 0; worker < N; ++worker) {
      const int last = batch.o[std::size_t(B - N + worker)];
      const Wide beta = Beta("target." + Option(last, ".beta"), batch.s_end.col(worker))(0, 0);
      Wide R = (1 - beta) * q_end(last, worker) + beta * q_end.col(worker).maxCoeff();
      for (Index b = B - N + worker; b >= 0; b -= N) {
        const int o = batch.o[std::size_t(b)], i = batch.o_prev[std::size_t(b)];
        R = batch.r(b) + kGamma * batch.mask(b) * R;
        const Wide A = R - base.q(o, b), error = R - now.q(o, b);
        const Wide X = base.q(i, b) - (1 - kEpsilonGreedy) * base.q.col(b).maxCoeff() -
                       kEpsilonGreedy * base.q.col(b).mean() + kPenalty;
        sum += -A * std::log(now.p(o, b)) - kEntropyWeight * now.H(o) + error * error / 2;
        if (!batch.init[std::size_t(b)]) sum += now.beta(i, b) * X;
      }
    }
    return sum / B;
  }
  bool Moves(int, const std::string& name) const override {
    return !name.starts_with("critic.u") && !name.starts_with("master");
  }
};

/// Spec 4.5. The batch is an episode.
class IopgProblem final : public OptionProblem {
 public:
  using OptionProblem::OptionProblem;

  void Fill() override {
    const int n = setup_.steps;
    Draw(n);
    batch_.r = RandomMat(n, 1, rng_);
    batch_.init.assign(std::size_t(n), 0);
    batch_.init[0] = 1;
    if (setup_.second_start) batch_.init[std::size_t(n / 2)] = 1;
    CheckLoss(0);
  }

 private:
  /// The episode up to step b.
  void Sample(int b, Batch& sample, FixedDraws&) const override {
    std::vector<int> rows;
    while (int(rows.size()) <= b) rows.push_back(int(rows.size()));
    Gather(batch_, rows, sample);
    sample.r = batch_.r.head(b + 1);
  }

  Wide Loss(int, const Batch& batch, const Says& now, const Says& base) override {
    const bool shifted = Released(setup_.switches.iopg_posterior);
    const Index n = batch.Size();
    WideVec R(n);
    for (Index t = n - 1; t >= 0; --t) R(t) = batch.r(t) + (t + 1 < n ? kGamma * R(t + 1) : 0);
    WideVec m = WideVec::Constant(kK, Wide(1) / kK), w = m;
    Wide sum = 0;
    for (Index t = 0; t < n; ++t) {
      const WideVec p = now.p.col(t);
      if (shifted) w = m.cwiseProduct(p) / m.dot(p);
      if (batch.init[std::size_t(t)] || Released(setup_.switches.iopg_init_flag)) {
        m = now.pi.col(t);
      } else {
        m.setZero();
        for (int i = 0; i < kK; ++i) {
          for (int j = 0; j < kK; ++j) m(j) += w(i) * PiHat(now, t, i, j, i == j);
        }
      }
      const Wide c = m.dot(p), error = R(t) - now.q(0, t);
      if (!shifted) w = m.cwiseProduct(p) / c;
      sum += (base.q(0, t) - R(t)) * Log(c) + error * error / 2;
    }
    return sum / n;
  }
  bool Moves(int, const std::string& name) const override {
    return !name.starts_with("critic.u") && !Idle(name);
  }
  /// In the graph, as in the authors' code, with gradient zero: every step is a first one.
  bool Idle(const std::string& name) const {
    return IsBeta(name) && Released(setup_.switches.iopg_init_flag);
  }
  Expect Expected(int stage, const std::string& name) const override {
    return Idle(name) ? Expect::kShift : OptionProblem::Expected(stage, name);
  }
};

template <typename Method>
std::unique_ptr<Problem> Make(const Setup& setup, std::uint64_t seed) {
  auto problem = std::make_unique<Method>(setup, seed);
  problem->Fill();
  return problem;
}

}  // namespace

void AddBaselineChecks(std::vector<NamedCheck>& checks) {
  const Variant relu = {"relu", [](Setup& setup) { setup.activation = 1; }};
  const Variant second = {"second start", [](Setup& setup) { setup.second_start = true; }};
  // More than the block of steps that passes through the networks together.
  const Variant more = {"70 steps", [](Setup& setup) { setup.steps = 70; }};
  AddChecks("ppo", Make<PpoProblem>, {relu}, checks);
  AddChecks("dac_onestep", Make<OneStepProblem>, {relu}, checks);
  AddChecks("dac_ppo", Make<DacProblem>, {relu}, checks);
  AddChecks("ahp_ppo", Make<AhpProblem>, {relu}, checks);
  AddChecks("iopg", Make<IopgProblem>, {relu, second, more}, checks);
  AddChecks("ppoc", Make<PpocProblem>, {relu}, checks);
  AddChecks("oc", Make<OcProblem>, {relu}, checks);
}

}  // namespace o2v
