#include <cmath>

#include "algo/method.h"
#include "algo/option_policy.h"
#include "base/check.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"

namespace o2v {
namespace {

/// IOPG: policy gradient with the options inferred from the history. With p_t[i] = pi_i(a_t | s_t)
/// and P_t[i, j] the probability that option j follows i at s_t (call-and-return),
///
///   m_0 = pi(. | s_0),  c_t = sum_i m_t[i] p_t[i],  w_t[i] = m_t[i] p_t[i] / c_t,
///   m_{t+1}[j] = sum_i w_t[i] P_{t+1}[i, j]
///   L = -(1/L_ep) sum_t A_t ln c_t + (1/L_ep) sum_t 1/2 (R_t - v_t)^2,  A = R - v constant,
///
/// c_t is the probability of a_t given the history; its gradient runs through all earlier m. Each
/// worker acts with a copy of the networks; when its episode ends, the gradient of its copy moves
/// the master copy, whose weights it then copies. v is the first entry of q.
///
/// Switches: `iopg_init_flag` = released takes every step for a first one, so that m_t = pi(s_t)
/// and no termination matters; `iopg_posterior` = released weighs m_t with p_t in place of p_{t-1}.
/// Source: spec 4.5; Smith et al. 2018.
class Iopg final : public Method {
 public:
  explicit Iopg(const AlgorithmInput& in);

  /// Steps the workers until at least one episode ends.
  void Collect(VecEnv& env, std::vector<Episode>& episodes) override;
  const std::vector<SumAndCount>& Update() override;
  void ChangeTask() override;
  void Serialize(StateVisitor& v) override;
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  /// The batch is one episode, its rewards in batch.r.
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;

 private:
  /// Steps that pass through the networks together; an episode's last block is padded with zeros.
  static constexpr Index kBlock = 64;

  struct Worker {
    OptionNets nets;
    std::vector<Param*> params;
    Mat s, a;               // (S, n), (A, n) of the running episode, room for n steps
    VecD r;                 // (n)
    std::vector<int> init;  // (n) first states
    int length = 0;         // steps so far
    int o_prev = 0;
  };

  /// What a block of an episode leaves behind.
  struct Block {
    Mat s, a;  // (S, kBlock); (A, K kBlock), the actions once for each option
    OptionNets::CallAndReturnCache options;
    Mlp::Cache critic;
    IntraOptionPolicies::Cache policy;
    Vec logp, dlogp;  // (K kBlock) option after option
  };

  /// Everything of an episode that the recursion reads or writes; columns are steps.
  struct History {
    MatD log_p, pi, beta;  // (K, n) ln p_t, pi(s_t), beta(s_t)
    VecD v, R;             // (n)
    MatD m, w;             // (K, n)
    VecD log_c;            // (n)
    MatD dlog_p, dz, db;   // (K, n) adjoints of ln p_t and of the logits of pi and beta
    VecD dv;               // (n)
    VecD dm, dweights;     // (K) adjoints of m_t and of the weights that pass through P_t
    VecD dlater;           // (K) what the steps after t leave: the adjoint of w_t, or with released
                           // `iopg_posterior` that of m_t
    void Resize(Index K, Index n);
  };

  bool AlwaysInitial() const { return switches_.iopg_init_flag == Fidelity::kReleased; }
  /// The distribution of the next option at s.
  const Mat& Options(OptionNets& nets, const ConstMatRef& s, std::span<const int> o_prev,
                     std::span<const char> init);
  /// Loss and gradients of `nets` on an episode of n steps.
  LossTerms EpisodeLoss(OptionNets& nets, const ConstMatRef& s, const ConstMatRef& a,
                        std::span<const double> r, std::span<const int> init);
  void AskNetworks(const OptionNets& nets, const ConstMatRef& s, const ConstMatRef& a);
  LossTerms Terms(std::span<const double> r);
  void BackwardNetworks(OptionNets& nets, Index n);
  void Forward(std::span<const int> init, Index n);
  void Backward(std::span<const int> init, Index n);
  void ForwardReleased(std::span<const int> init, Index n);
  void BackwardReleased(std::span<const int> init, Index n);
  void Pass(const Eigen::Ref<const VecD>& weights, bool init, Index t);
  void PassBackward(const Eigen::Ref<const VecD>& weights, bool init, Index t);
  double Kappa(Index n, Index t) const;

  const double gamma_;
  OptionNets nets_;  // the master copy
  std::vector<Worker> workers_;

  std::vector<int> finished_;  // workers whose episodes ended in the last step
  CacheByWidth<OptionNets::CallAndReturnCache> options_;
  QueryCache acting_;  // of one worker's state
  // As many as the longest episode so far has needed: what the time limit allows would be tens of
  // megabytes. A longer episode adds to them, once, and nothing else on the training path allocates
  // after the first update.
  std::vector<std::unique_ptr<Block>> blocks_;
  History history_;
  Mat a_, a_one_;  // (A, N), (A, 1)
  Transition transition_;
  std::vector<int> o_one_;
  std::vector<int> init_given_;
};

Iopg::Iopg(const AlgorithmInput& in)
    : Method(in, in.hyper->Int("options", 1)),
      gamma_(in.hyper->Real("gamma")),
      workers_(std::size_t(in.workers)),
      a_(in.A, in.workers),
      o_one_(1) {
  const auto make = [&] { return MakeOptionNets(in, OptionNets::CriticHead::kQ, initialiser_); };
  nets_ = make();
  // Two time limits: at a change of task the running episode goes on into the new one (spec 4.5).
  const Index room = 2 * Index(in.time_limit);
  for (Worker& worker : workers_) {
    worker.nets = switches_.iopg_first_sync == Fidelity::kPaper ? nets_ : make();
    worker.params = worker.nets.Params();
    worker.s = Mat::Zero(in.S, room);
    worker.a = Mat::Zero(in.A, room);
    worker.r = VecD::Zero(room);
    worker.init.assign(std::size_t(room), 0);
  }
  RegisterNetworks(in, nets_.Params(), {nets_.UsedParams()}, &nets_.policy, &nets_.critic);
  finished_.reserve(workers_.size());
  nets_.critic.Forward(Mat::Zero(in.S, 1), acting_.critic);  // sized: a time limit may come late
  history_.Resize(K_, room);
  init_given_.reserve(std::size_t(room));
}

// The unfinished episodes of the old task are forgotten, or, where the new task's first step is not
// marked, joined with the new task's steps; spec 4.5 (g). An iteration ends with an episode, so
// that tasks change after one, not at the very next step as in the authors' code: where all
// workers' episodes are equally long, none is unfinished.
void Iopg::ChangeTask() {
  if (switches_.switch_init_flag == Fidelity::kReleased) return;
  for (Worker& worker : workers_) worker.length = 0;
}

void Iopg::Serialize(StateVisitor& v) {
  Method::Serialize(v);
  for (std::size_t i = 0; i < workers_.size(); ++i) {
    Worker& worker = workers_[i];
    const std::string name = "copy" + std::to_string(i) + ".";
    for (Param* p : worker.params) v.Matrix(name + p->name, p->value);
    v.Matrix(name + "s", worker.s);
    v.Matrix(name + "a", worker.a);
    v.Doubles(name + "r", worker.r);
    v.AllBelow(name + "init", worker.init, 2);
    v.Below(name + "length", worker.length, worker.r.size() + 1);
    v.Below(name + "o_prev", worker.o_prev, K_);
  }
}

// ---- Acting -------------------------------------------------------------------------------------

const Mat& Iopg::Options(OptionNets& nets, const ConstMatRef& s, std::span<const int> o_prev,
                         std::span<const char> init) {
  OptionNets::CallAndReturnCache& c = options_(s.cols());
  nets.Master(s, c);
  if (AlwaysInitial()) return c.pi;
  nets.CallAndReturn(s, o_prev, init, c.pi, switches_.beta_index, c);
  return c.pi_hat;
}

void Iopg::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  finished_.clear();
  QueryCache& c = acting_;
  while (finished_.empty()) {
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      Worker& worker = workers_[i];
      const auto s = env.States().col(Index(i));
      const bool init = env.EpisodeStarts()[i];
      Check(worker.length < worker.r.size(), "iopg: an episode of more than ", worker.r.size(),
            " steps, twice the time limit of the task it was made for");
      SampleCategorical(Options(worker.nets, s, {&worker.o_prev, 1}, {&env.EpisodeStarts()[i], 1}),
                        policy_rng_, o_one_);
      worker.nets.policy.ForwardOne(s, o_one_, c.policy);
      SampleGaussian(c.policy.nets.out, c.policy.sigma, policy_rng_, a_one_);
      a_.col(Index(i)) = a_one_;
      worker.s.col(worker.length) = s;
      worker.a.col(worker.length) = a_one_;
      worker.init[std::size_t(worker.length)] = init;
      usage_.Count(o_one_[0], worker.o_prev, init);
      worker.o_prev = o_one_[0];
    }
    env.Step(a_, transition_, episodes);
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      Worker& worker = workers_[i];
      double& r = worker.r(worker.length++);
      r = transition_.r(Index(i));
      if (!transition_.Done(i)) continue;
      finished_.push_back(int(i));
      if (transition_.TimeLimit(i) && switches_.timelimit == Fidelity::kPaper) {
        worker.nets.critic.Forward(transition_.s_last.col(Index(i)), c.critic);
        r += gamma_ * double(c.critic.out(0, 0));  // spec 1.3
      }
    }
  }
}

const std::vector<SumAndCount>& Iopg::Update() {
  for (const int i : finished_) {
    Worker& worker = workers_[std::size_t(i)];
    const Index n = worker.length;
    const LossTerms terms =
        EpisodeLoss(worker.nets, worker.s.leftCols(n), worker.a.leftCols(n),
                    {worker.r.data(), std::size_t(n)}, {worker.init.data(), std::size_t(n)});
    for (std::size_t j = 0; j < params_.size(); ++j) {
      params_[j]->grad.swap(worker.params[j]->grad);  // and gives the worker the master's zeros
    }
    StepOn(0, terms);
  }
  // After all of them: those that finished together used the same old copies.
  for (const int i : finished_) {
    Worker& worker = workers_[std::size_t(i)];
    for (std::size_t j = 0; j < params_.size(); ++j) worker.params[j]->value = params_[j]->value;
    worker.length = 0;
  }
  return Report();
}

// ---- Loss ---------------------------------------------------------------------------------------

void Iopg::History::Resize(Index K, Index n) {
  for (VecD* x : {&dm, &dweights, &dlater}) x->resize(K);
  if (v.size() >= n) return;
  for (MatD* x : {&log_p, &pi, &beta, &m, &w, &dlog_p, &dz, &db}) x->resize(K, n);
  for (VecD* x : {&v, &R, &log_c, &dv}) x->resize(n);
}

LossTerms Iopg::EpisodeLoss(OptionNets& nets, const ConstMatRef& s, const ConstMatRef& a,
                            std::span<const double> r, std::span<const int> init) {
  const Index n = s.cols();
  history_.Resize(K_, n);
  init_given_.assign(init.begin(), init.end());
  init_given_[0] = 1;  // also where `switch_init_flag` = released joins the steps of two tasks
  if (AlwaysInitial()) std::fill(init_given_.begin(), init_given_.end(), 1);
  const bool paper = switches_.iopg_posterior == Fidelity::kPaper;

  AskNetworks(nets, s, a);
  paper ? Forward(init_given_, n) : ForwardReleased(init_given_, n);
  const LossTerms terms = Terms(r);
  paper ? Backward(init_given_, n) : BackwardReleased(init_given_, n);
  BackwardNetworks(nets, n);
  return terms;
}

/// ln p_t, pi, beta and v of every step, block by block.
void Iopg::AskNetworks(const OptionNets& nets, const ConstMatRef& s, const ConstMatRef& a) {
  History& h = history_;
  const Index n = s.cols();
  for (Index start = 0, i = 0; start < n; start += kBlock, ++i) {
    if (i == Index(blocks_.size())) blocks_.push_back(std::make_unique<Block>());
    Block& block = *blocks_[std::size_t(i)];
    const Index m = std::min(kBlock, n - start);
    block.s.setZero(s.rows(), kBlock);
    block.s.leftCols(m) = s.middleCols(start, m);
    block.a.setZero(a.rows(), K_ * kBlock);
    for (Index k = 0; k < K_; ++k) {
      block.a.middleCols(k * kBlock, m) = a.middleCols(start, m);
    }
    nets.Master(block.s, block.options);
    nets.critic.Forward(block.s, block.critic);
    nets.policy.ForwardAll(block.s, block.policy);
    GaussianLogProb(block.a, block.policy.nets.out, block.policy.sigma, block.logp);
    const Eigen::Map<const Mat> logp(block.logp.data(), kBlock, K_);
    h.log_p.middleCols(start, m) = logp.topRows(m).transpose().cast<double>();
    h.pi.middleCols(start, m) = block.options.pi.leftCols(m).cast<double>();
    if (AlwaysInitial()) {
      h.beta.middleCols(start, m).setOnes();
    } else {
      nets.Beta(block.s, {}, true, block.options.beta);
      h.beta.middleCols(start, m) = block.options.beta.beta.leftCols(m).cast<double>();
    }
    h.v.segment(start, m) = block.critic.out.row(0).head(m).transpose().cast<double>();
  }
}

/// m_t, from the weights of the options before that pass through P_t, and ln c_t.
void Iopg::Pass(const Eigen::Ref<const VecD>& weights, bool init, Index t) {
  History& h = history_;
  const auto pi = h.pi.col(t).array(), beta = h.beta.col(t).array(), log_p = h.log_p.col(t).array();
  auto m = h.m.col(t).array();
  if (init) {
    m = pi;
  } else if (switches_.beta_index == Fidelity::kPaper) {
    m = (1 - beta) * weights.array() + (beta * weights.array()).sum() * pi;
  } else {
    m = (1 - beta) * weights.array() + beta * pi;  // the weights sum to 1
  }
  const double top = (m.log() + log_p).maxCoeff();
  h.log_c(t) = top + std::log((m.log() + log_p - top).exp().sum());
}

/// The adjoints of the logits of pi and beta, and dweights, from dm; the backward of Pass.
void Iopg::PassBackward(const Eigen::Ref<const VecD>& weights, bool init, Index t) {
  History& h = history_;
  const auto pi = h.pi.col(t).array(), beta = h.beta.col(t).array();
  const auto dm = h.dm.array();
  h.db.col(t).setZero();
  h.dweights.setZero();
  const double along = (pi * dm).sum();
  if (init) {
    h.dz.col(t) = pi * (dm - along);
  } else if (switches_.beta_index == Fidelity::kPaper) {
    h.db.col(t) = weights.array() * (along - dm) * beta * (1 - beta);
    h.dz.col(t) = (beta * weights.array()).sum() * pi * (dm - along);
    h.dweights = (1 - beta) * dm + beta * along;
  } else {
    h.db.col(t) = dm * (pi - weights.array()) * beta * (1 - beta);
    h.dz.col(t) = pi * (beta * dm - (beta * pi * dm).sum());
    h.dweights = (1 - beta) * dm + (beta * pi * dm).sum();
  }
}

/// dL / d ln c_t.
double Iopg::Kappa(Index n, Index t) const {
  const History& h = history_;
  const bool eps = switches_.density_log_eps == Fidelity::kReleased;
  const double c = std::exp(std::min(h.log_c(t), kLargeLog));
  return -(h.R(t) - h.v(t)) / double(n) * (eps ? c / (c + kLogEps) : 1);
}

/// m, ln c and w from ln p, pi and beta: w_{t-1} passes through P_t. In log space: w_t is a softmax
/// of ln m_t + ln p_t.
void Iopg::Forward(std::span<const int> init, Index n) {
  History& h = history_;
  for (Index t = 0; t < n; ++t) {
    Pass(h.w.col(std::max<Index>(t - 1, 0)), init[std::size_t(t)], t);  // none before a first step
    h.w.col(t) = (h.m.col(t).array().log() + h.log_p.col(t).array() - h.log_c(t)).exp();
  }
}

/// Adjoints of ln p and of the logits, from the last step to the first; spec 4.5 (e). dlater: of
/// w_t.
void Iopg::Backward(std::span<const int> init, Index n) {
  History& h = history_;
  h.dlater.setZero();
  for (Index t = n - 1; t >= 0; --t) {
    const auto p_over_c = (h.log_p.col(t).array() - h.log_c(t)).exp();
    const double mean = h.dlater.dot(h.w.col(t));
    h.dm = (Kappa(n, t) + h.dlater.array() - mean) * p_over_c;
    h.dlog_p.col(t) = h.m.col(t).array() * h.dm.array();
    PassBackward(h.w.col(std::max<Index>(t - 1, 0)), init[std::size_t(t)], t);
    h.dlater = h.dweights;
  }
}

/// Forward with `iopg_posterior` = released: what passes through P_t is w_t = m_{t-1} p_t over its
/// sum, m_{-1} = 1/K.
void Iopg::ForwardReleased(std::span<const int> init, Index n) {
  History& h = history_;
  for (Index t = 0; t < n; ++t) {
    auto w = h.w.col(t).array();
    if (t > 0) {
      w = h.m.col(t - 1).array().log() + h.log_p.col(t).array();
    } else {
      w = h.log_p.col(t).array() - std::log(double(K_));
    }
    w = (w - w.maxCoeff()).exp();
    w /= w.sum();
    Pass(h.w.col(t), init[std::size_t(t)], t);
  }
}

/// Its backward. dlater: of m_t.
void Iopg::BackwardReleased(std::span<const int> init, Index n) {
  History& h = history_;
  h.dlater.setZero();
  for (Index t = n - 1; t >= 0; --t) {
    const auto p_over_c = (h.log_p.col(t).array() - h.log_c(t)).exp();
    const double kappa = Kappa(n, t);
    h.dm = kappa * p_over_c + h.dlater.array();
    h.dlog_p.col(t) = kappa * h.m.col(t).array() * p_over_c;
    PassBackward(h.w.col(t), init[std::size_t(t)], t);
    // w_t = softmax(ln m_{t-1} + ln p_t). No m is 0: Eigen's exp of floats, in whole registers as
    // for the K x kBlock probabilities here, gives 1e-38 at least.
    const auto w = h.w.col(t).array();
    const double mean = (w * h.dweights.array()).sum();
    h.dlog_p.col(t).array() += w * (h.dweights.array() - mean);
    if (t > 0) h.dlater = w * (h.dweights.array() - mean) / h.m.col(t - 1).array();
  }
}

/// R, the terms of the loss and dv, from ln c and v.
LossTerms Iopg::Terms(std::span<const double> r) {
  LossTerms terms;
  History& h = history_;
  const Index n = Index(r.size());
  double R = 0;
  for (Index t = n - 1; t >= 0; --t) {
    R = r[std::size_t(t)] + gamma_ * R;
    h.R(t) = R;
    const double A_t = R - h.v(t);
    // ln(c + 1e-5) is ln c where c is large; e^x would overflow.
    const bool add = switches_.density_log_eps == Fidelity::kReleased && h.log_c(t) < kLargeLog;
    const double log_c = add ? std::log(std::exp(h.log_c(t)) + kLogEps) : h.log_c(t);
    terms.surrogate -= A_t * log_c / double(n);
    terms.value += 0.5 * A_t * A_t / double(n);
    h.dv(t) = -A_t / double(n);
  }
  terms.entropy = GaussianMeanEntropy(blocks_[0]->policy.sigma_of);
  terms.total = terms.surrogate + terms.value;
  return terms;
}

/// The adjoints of ln p, of the logits and of v through the networks, block by block.
void Iopg::BackwardNetworks(OptionNets& nets, Index n) {
  const History& h = history_;
  for (Index start = 0, i = 0; start < n; start += kBlock, ++i) {
    Block& block = *blocks_[std::size_t(i)];
    const Index m = std::min(kBlock, n - start);
    block.dlogp.setZero(K_ * kBlock);
    Eigen::Map<Mat> dlogp(block.dlogp.data(), kBlock, K_);
    dlogp.topRows(m) = h.dlog_p.middleCols(start, m).transpose().cast<Real>();
    GaussianLogProbGrad(block.a, block.policy.nets.out, block.policy.sigma, block.dlogp,
                        block.policy.nets.dout, block.policy.dsigma);
    nets.policy.Backward(block.s, {}, block.policy);
    block.options.master.dout.setZero(K_, kBlock);
    block.options.master.dout.leftCols(m) = h.dz.middleCols(start, m).cast<Real>();
    nets.master.Backward(block.s, block.options.master);
    block.critic.dout.setZero(K_, kBlock);
    block.critic.dout.row(0).head(m) = h.dv.segment(start, m).transpose().cast<Real>();
    nets.critic.Backward(block.s, block.critic);
    if (AlwaysInitial()) continue;  // no termination matters
    block.options.beta.db.setZero(K_, kBlock);
    block.options.beta.db.leftCols(m) = h.db.middleCols(start, m).cast<Real>();
    nets.BackwardBeta(block.s, {}, block.options.beta);
  }
}

LossTerms Iopg::Loss(int, const Batch& batch, const FixedDraws*) {
  const std::vector<int> init(batch.init.begin(), batch.init.end());
  return EpisodeLoss(nets_, batch.s, batch.a, {batch.r.data(), std::size_t(batch.r.size())}, init);
}

/// Of the master copy.
void Iopg::OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                        Mat& P) {
  P = Options(nets_, s, o_prev, init);
  NormalizeColumns(P);
}

}  // namespace

std::unique_ptr<Algorithm> MakeIopg(const AlgorithmInput& in) { return std::make_unique<Iopg>(in); }

}  // namespace o2v
