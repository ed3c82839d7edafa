#include "algo/algorithm.h"
#include "algo/ppo_core.h"
#include "algo/surrogate.h"
#include "base/check.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "nn/attention_block.h"
#include "nn/embedding.h"
#include "nn/init.h"
#include "nn/mlp.h"
#include "nn/product.h"
#include "rollout/minibatch.h"

namespace o2v {
namespace {

/// Option2Vec: options are columns of the embedding matrix W_o (D, K); attention over them chooses
/// the next one, one shared Gaussian policy decodes it into actions.
///
///   option policy   P(o | s, o_{t-1}; W_o) = softmax(FFN(MHA(query(s, o_hat_{t-1}), W_o, W_o)))
///                   at an episode's start softmax(z_init(s))
///   action policy   pi_a(a | s, o) = N(mu, sigma^2),  mu = tanh(.), sigma = softplus(.) of [s,
///   o_hat] option value    Q_O[s, o] = f([s, o_hat]),   V_bar[s, o_{t-1}] = sum_o P Q_O option
///   stage    L_o = clip-surrogate(ln P_o) - w_o mean H(P) + 1/2 mean (V_bar - R^o)^2 action stage
///   L_a = clip-surrogate(ln pi_a) - w_a mean H(pi_a) + 1/2 mean (Q_O[s, o] - R^a)^2
///
/// o_hat is detached in action policy and critic: W_o learns by L_o alone, as memory of the
/// attention and, with `o2v_prev_embed_grad` = paper, as part of the query. Source:
/// spec 2.6, 2.7, 4.8; paper Eq. (3), (8)-(10).
class Option2Vec final : public Algorithm {
 public:
  explicit Option2Vec(const AlgorithmInput& in);

  void Collect(VecEnv& env, std::vector<Episode>& episodes) override;
  void Update(std::vector<double>& stats) override;
  std::vector<std::string> StatNames() const override;
  std::vector<Param*> Params() override;
  void Visit(StateVisitor& v) override;

  int NumOptions() const override { return int(K_); }
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override;
  void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) override;

  std::vector<std::string> Stages() const override { return {"high", "low"}; }
  LossTerms Loss(int stage, const Batch& batch, const FixedDraws* fixed) override;
  double Step(int stage) override;
  std::vector<char> InGraph(int stage) const override { return in_graph_[std::size_t(stage)]; }

 private:
  enum Stage { kHigh = 0, kLow = 1 };

  /// What a batch of B samples leaves behind. n = B tokens, or 2 B with two query tokens.
  struct Cache {
    // Option policy.
    AttentionBlock::Masks masks;
    Mat relu;                 // (D, B) state token before its LayerNorm
    Mat x, dx;                // (D, n) query tokens: state, then option
    LayerNorm::Cache x_norm;  // of the state token
    AttentionBlock::Cache block;
    Mat z, log_P, P, dz;                                     // (K, B)
    Mat dtokens;                                             // (D, n)
    std::vector<int> init_rows;                              // samples whose initial flag is set
    Mat init_s, init_hidden, init_z, init_dz, init_dhidden;  // their columns come first
    Vec H;                                                   // (B)
    // Action policy.
    Mat a0, a1, mu, sigma, dmu, dsigma, dhidden;  // (h, B), (A, B)
    // Critic, on m columns: B, or K B (sample-major) where every option is evaluated.
    Mat c_in;  // (S + D, B) [s; o_hat], then normalised: o2v_critic = released
    LayerNorm::Cache c_norm;
    Mat c_state;           // (h, B) W_x s
    Mat c0, c1, dc0, dc1;  // (h, m)
    Mat dW;                // (h, S + D) scratch
    Vec db;                // (h)
    Mat q, dq;             // (K, B), or (1, B) of the option fed
    // Losses.
    std::vector<int> o_fed;  // (B) option that action net and critic see
    Vec logp, dlogp, v, dv, p_dot_q;
  };

  /// What follows from the weights alone, made anew whenever they have changed.
  struct Tables {
    MemoryAttention::Memory memory;
    Mat query, action, critic;  // (n_out, K) W_e W_o + b of the three maps of [s, o_hat]
  };

  void MakeOptionTables();
  void MakeActionTables();

  // Forward passes into c; the tables must be current.
  void ForwardOptions(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                      const AttentionBlock::Masks* masks, Cache& c);
  void ForwardAction(const ConstMatRef& s, std::span<const int> o, Cache& c);
  void ForwardCriticAll(const ConstMatRef& s, std::span<const int> o, Cache& c);  // c.q (K, B)
  void ForwardCriticOne(const ConstMatRef& s, std::span<const int> o, Cache& c);  // c.q (1, B)
  // Backward passes: they add to the gradients.
  void BackwardOptions(const ConstMatRef& s, std::span<const int> o_prev,
                       const AttentionBlock::Masks* masks, Cache& c);           // from c.dz
  void BackwardAction(const ConstMatRef& s, std::span<const int> o, Cache& c);  // c.dmu, c.dsigma
  void BackwardCritic(const ConstMatRef& s, std::span<const int> o, Cache& c);  // from c.dq

  /// Masks for a pass over B samples: drawn, or taken from `fixed`; null without dropout.
  const AttentionBlock::Masks* Dropout(Index B, const FixedDraws* fixed, Cache& c);
  LossTerms OptionLoss(const Batch& batch, const FixedDraws* fixed);
  LossTerms ActionLoss(const Batch& batch, const FixedDraws* fixed);
  void RunStage(int stage);

  static bool Paper(Fidelity f) { return f == Fidelity::kPaper; }

  const PpoHyper hyper_;
  const Switches switches_;
  const double w_o_, w_a_;  // entropy weights of option and action stage
  const Index S_, A_, K_, D_, F_, heads_, h_;
  const int N_;
  const bool scalar_critic_;  // o2v_critic = paper: Q_O[s, o] = f([s, o_hat]) for every o
  const Index tokens_;        // o2v_query: paper 1, released 2
  Rng policy_rng_, dropout_rng_, bootstrap_rng_, redraw_rng_, shuffle_rng_, order_rng_;

  Param W_o_;             // (D, K)
  Linear init0_, init1_;  // S -> 64 -> K
  EmbeddedLinear query_;  // o2v_query = paper: [s, o_hat] -> D
  Linear state_;          // o2v_query = released: s -> D
  LayerNorm query_norm_;
  AttentionBlock block_;
  Linear logits_;  // tokens D -> K
  EmbeddedLinear action0_;
  Linear action1_, mu_, sigma_;
  LayerNorm critic_norm_;   // o2v_critic = released
  EmbeddedLinear critic0_;  // scalar critic
  Linear critic0_full_;     // on the normalised [s, o_hat]: o2v_critic = released
  Linear critic1_, critic_q_;
  LayerNorm unused_;  // spec 2.6 item 9
  bool has_unused_ = false;
  std::unique_ptr<Adam> adam_;
  std::vector<char> in_graph_[2];
  std::vector<std::size_t> init_params_;  // positions of the initial net in Params()

  Batch rollout_;
  Mat rollout_P_;  // (K, T N)
  MatD mask_;      // (N, T)
  CriticStream high_, low_;
  std::vector<int> o_prev_;        // (N)
  std::vector<char> not_initial_;  // (N) zeros
  CacheByWidth<Cache> caches_;
  Tables tables_;
  Mat dtable_;  // (n_out, K) scratch
  Mat a_;       // (A, N)
  Transition transition_;
  std::vector<int> order_;
  Batch minibatch_, rest_;
  LossMeans means_[2];
  std::vector<double> executed_, begun_;  // (K) steps of each option in the rollout; its segments
};

Option2Vec::Option2Vec(const AlgorithmInput& in)
    : hyper_(*in.hyper),
      switches_(in.switches),
      w_o_(in.hyper->Real("entropy_weight_option")),
      w_a_(in.hyper->Real("entropy_weight_action")),
      S_(in.S),
      A_(in.A),
      K_(in.hyper->Int("options", 1)),
      D_(in.hyper->Int("embedding", 1)),
      F_(in.hyper->Int("ffn", 1)),
      heads_(in.hyper->Int("heads", 1)),
      h_(in.hyper->Int("hidden", 1)),
      N_(in.workers),
      scalar_critic_(Paper(switches_.o2v_critic)),
      tokens_(Paper(switches_.o2v_query) ? 1 : 2),
      policy_rng_(in.seed, "policy"),
      dropout_rng_(in.seed, "dropout"),
      bootstrap_rng_(in.seed, "bootstrap"),
      redraw_rng_(in.seed, "redraw"),
      shuffle_rng_(in.seed, "shuffle"),
      order_rng_(in.seed, "order"),
      W_o_("embed.W_o", D_, K_),
      high_(in.workers, hyper_.rollout),
      low_(in.workers, hyper_.rollout) {
  Rng rng(in.seed, "init");
  const Index h_init = in.hyper->Int("init_hidden", 1);
  Orthogonal(W_o_.value, 1, rng);  // rows of E = W_o^T orthonormal for K <= D; spec 2.6 item 1
  init0_ = Linear("init.0", S_, h_init);
  init1_ = Linear("init.1", h_init, K_);
  XavierUniform(init0_.W.value, rng);
  XavierUniform(init1_.W.value, rng);
  if (tokens_ == 1) {
    query_ = EmbeddedLinear("query", S_, D_, D_);
    Orthogonal(query_.W.value, 1, rng);
    query_norm_ = LayerNorm("query.ln", D_);
  } else {
    state_ = Linear("state", S_, D_);
    Orthogonal(state_.W.value, 1, rng);
    query_norm_ = LayerNorm("state.ln", D_);
  }
  block_ = AttentionBlock("attention", "block", D_, heads_, F_);
  block_.Init(rng);
  logits_ = Linear("logits", tokens_ * D_, K_);
  Orthogonal(logits_.W.value, 1, rng);

  action0_ = EmbeddedLinear("action.body.0", S_, D_, h_);
  action1_ = Linear("action.body.1", h_, h_);
  XavierUniform(action0_.W.value, rng);
  XavierUniform(action1_.W.value, rng);
  mu_ = Linear("action.mu", h_, A_);
  sigma_ = Linear("action.sigma", h_, A_);
  Orthogonal(mu_.W.value, 1e-3, rng);  // spec 2.6 item 7
  Orthogonal(sigma_.W.value, 1e-3, rng);

  if (scalar_critic_) {
    critic0_ = EmbeddedLinear("critic.body.0", S_, D_, h_);
    XavierUniform(critic0_.W.value, rng);
  } else {
    critic_norm_ = LayerNorm("critic.ln", S_ + D_);
    critic0_full_ = Linear("critic.body.0", S_ + D_, h_);
    XavierUniform(critic0_full_.W.value, rng);
  }
  critic1_ = Linear("critic.body.1", h_, h_);
  XavierUniform(critic1_.W.value, rng);
  critic_q_ = Linear("critic.q", h_, scalar_critic_ ? 1 : K_);
  Orthogonal(critic_q_.W.value, 1, rng);

  // The authors' network allocates one more LayerNorm; it counts, and exists only when every switch
  // of the architecture is `released` (spec 2.7).
  has_unused_ = !scalar_critic_ && tokens_ == 2 && !Paper(switches_.o2v_init_relu);
  if (has_unused_) unused_ = LayerNorm("unused.ln", S_ + D_);

  const std::vector<Param*> params = Params();
  for (std::size_t i = 0; i < params.size(); ++i) {
    const std::string& name = params[i]->name;
    const bool action = name.starts_with("action."), critic = name.starts_with("critic."),
               unused = name.starts_with("unused.");
    in_graph_[kHigh].push_back(!action && !unused);
    in_graph_[kLow].push_back(action || critic);
    if (name.starts_with("init.")) init_params_.push_back(i);
  }
  adam_ = std::make_unique<Adam>(params, hyper_.adam);

  const Index n = Index(N_) * hyper_.rollout;
  rollout_.Resize(S_, A_, n);
  rollout_P_ = Mat::Zero(K_, n);
  mask_ = MatD::Ones(N_, hyper_.rollout);
  o_prev_.assign(std::size_t(N_), 0);
  not_initial_.assign(std::size_t(N_), 0);
  order_.resize(std::size_t(n));
  executed_.assign(std::size_t(K_), 0);
  begun_ = executed_;
}

std::vector<Param*> Option2Vec::Params() {
  std::vector<Param*> params = {&W_o_};
  Append(params, init0_.Params());
  Append(params, init1_.Params());
  Append(params, tokens_ == 1 ? query_.Params() : state_.Params());
  Append(params, query_norm_.Params());
  Append(params, block_.Params());
  Append(params, logits_.Params());
  Append(params, action0_.Params());
  Append(params, action1_.Params());
  Append(params, mu_.Params());
  Append(params, sigma_.Params());
  if (!scalar_critic_) Append(params, critic_norm_.Params());
  Append(params, scalar_critic_ ? critic0_.Params() : critic0_full_.Params());
  Append(params, critic1_.Params());
  Append(params, critic_q_.Params());
  if (has_unused_) Append(params, unused_.Params());
  return params;
}

void Option2Vec::Visit(StateVisitor& v) {
  for (Param* p : Params()) v.Matrix(p->name, p->value);
  adam_->Visit(v);
  policy_rng_.Visit(v, "rng.policy");
  dropout_rng_.Visit(v, "rng.dropout");
  bootstrap_rng_.Visit(v, "rng.bootstrap");
  redraw_rng_.Visit(v, "rng.redraw");
  shuffle_rng_.Visit(v, "rng.shuffle");
  order_rng_.Visit(v, "rng.order");
  v.Ints("o_prev", o_prev_);
}

// ---- Networks -----------------------------------------------------------------------------------

void Option2Vec::MakeOptionTables() {
  block_.attention.Project(W_o_.value, tables_.memory);
  if (tokens_ == 1) query_.MakeTable(W_o_.value, tables_.query);
}

void Option2Vec::MakeActionTables() {
  action0_.MakeTable(W_o_.value, tables_.action);
  if (scalar_critic_) critic0_.MakeTable(W_o_.value, tables_.critic);
}

/// y.col(b) := ReLU(y.col(b) + table.col(o[b])).
void AddTableRelu(const Mat& table, std::span<const int> o, MatRef y) {
  for (Index b = 0; b < y.cols(); ++b) {
    y.col(b) = (y.col(b) + table.col(o[std::size_t(b)])).cwiseMax(0);
  }
}

void Option2Vec::ForwardOptions(const ConstMatRef& s, std::span<const int> o_prev,
                                std::span<const char> init, const AttentionBlock::Masks* masks,
                                Cache& c) {
  const Index B = s.cols();
  c.x.resize(D_, tokens_ * B);
  c.relu.resize(D_, B);
  if (tokens_ == 1) {  // x = LN(ReLU(W [s, o_hat_{t-1}] + b)); spec 2.7
    query_.MultiplyState(s, c.relu);
    AddTableRelu(tables_.query, o_prev, c.relu);
  } else {  // x0 = LN(ReLU(W s + b)), x1 = o_hat_{t-1}; spec 2.6 items 3, 4
    state_.Multiply(s, c.relu);
    BiasActivate(Activation::kRelu, state_.b.value, c.relu);
    GatherColumns(W_o_.value, o_prev, c.x.rightCols(B));
  }
  query_norm_.Forward(c.relu, c.x_norm, c.x.leftCols(B));
  block_.Forward(c.x, tables_.memory, masks, c.block);

  c.z.resize(K_, B);
  SetAB(logits_.W.value.leftCols(D_), c.block.out.leftCols(B), c.z);
  if (tokens_ == 2) AddAB(logits_.W.value.rightCols(D_), c.block.out.rightCols(B), c.z);
  c.z.colwise() += logits_.b.value.col(0);

  // First states of episodes: z := z_init(s).
  c.init_rows.clear();
  c.init_rows.reserve(std::size_t(B));
  for (Index b = 0; b < B; ++b) {
    if (init[std::size_t(b)]) c.init_rows.push_back(int(b));
  }
  if (const Index n = Index(c.init_rows.size()); n > 0) {
    c.init_s.resize(S_, B);
    c.init_hidden.resize(init0_.W.value.rows(), B);
    c.init_z.resize(K_, B);
    for (Index i = 0; i < n; ++i) c.init_s.col(i) = s.col(c.init_rows[std::size_t(i)]);
    auto hidden = c.init_hidden.leftCols(n);
    auto z = c.init_z.leftCols(n);
    init0_.Multiply(c.init_s.leftCols(n), hidden);
    BiasActivate(Activation::kRelu, init0_.b.value, hidden);
    init1_.Forward(hidden, z);
    if (!Paper(switches_.o2v_init_relu)) z = z.cwiseMax(0);
    for (Index i = 0; i < n; ++i) c.z.col(c.init_rows[std::size_t(i)]) = z.col(i);
  }
  LogSoftmax(c.z, c.log_P, c.P);
}

void Option2Vec::BackwardOptions(const ConstMatRef& s, std::span<const int> o_prev,
                                 const AttentionBlock::Masks* masks, Cache& c) {
  const Index B = s.cols();
  if (const Index n = Index(c.init_rows.size()); n > 0) {
    c.init_dz.resize(K_, B);
    c.init_dhidden.resize(c.init_hidden.rows(), B);
    auto dz = c.init_dz.leftCols(n);
    auto dhidden = c.init_dhidden.leftCols(n);
    for (Index i = 0; i < n; ++i) {
      dz.col(i) = c.dz.col(c.init_rows[std::size_t(i)]);
      c.dz.col(c.init_rows[std::size_t(i)]).setZero();  // nothing reaches the attention
    }
    if (!Paper(switches_.o2v_init_relu)) {
      ActivationBackward(Activation::kRelu, c.init_z.leftCols(n), dz);
    }
    init1_.AddGrad(c.init_hidden.leftCols(n), dz);
    init1_.BackwardInput(dz, dhidden);
    ActivationBackward(Activation::kRelu, c.init_hidden.leftCols(n), dhidden);
    init0_.AddGrad(c.init_s.leftCols(n), dhidden);
  }

  c.dtokens.resize(D_, tokens_ * B);
  for (Index token = 0; token < tokens_; ++token) {
    AddABt(c.dz, c.block.out.middleCols(token * B, B), logits_.W.grad.middleCols(token * D_, D_));
    SetAtB(logits_.W.value.middleCols(token * D_, D_), c.dz, c.dtokens.middleCols(token * B, B));
  }
  logits_.b.grad.col(0) += c.dz.rowwise().sum();

  c.dx.resize(D_, tokens_ * B);
  block_.Backward(c.x, W_o_.value, tables_.memory, masks, c.block, c.dtokens, c.dx, W_o_.grad);
  auto dx0 = c.dx.leftCols(B);
  query_norm_.Backward(c.x_norm, dx0, dx0);
  ActivationBackward(Activation::kRelu, c.relu, dx0);
  const bool embed_grad = Paper(switches_.o2v_prev_embed_grad);
  if (tokens_ == 1) {
    query_.AddStateGrad(s, dx0);
    dtable_.setZero(D_, K_);
    ScatterColumns(dx0, o_prev, dtable_);
    query_.AddTableGrad(W_o_.value, dtable_, embed_grad ? &W_o_.grad : nullptr);
  } else {
    state_.AddGrad(s, dx0);
    if (embed_grad) ScatterColumns(c.dx.rightCols(B), o_prev, W_o_.grad);
  }
}

void Option2Vec::ForwardAction(const ConstMatRef& s, std::span<const int> o, Cache& c) {
  const Index B = s.cols();
  c.a0.resize(h_, B);
  c.a1.resize(h_, B);
  c.mu.resize(A_, B);
  c.sigma.resize(A_, B);
  action0_.MultiplyState(s, c.a0);
  AddTableRelu(tables_.action, o, c.a0);
  action1_.Multiply(c.a0, c.a1);
  BiasActivate(Activation::kRelu, action1_.b.value, c.a1);
  mu_.Multiply(c.a1, c.mu);
  BiasActivate(Activation::kTanh, mu_.b.value, c.mu);
  sigma_.Forward(c.a1, c.sigma);
  Softplus(c.sigma);
}

void Option2Vec::BackwardAction(const ConstMatRef& s, std::span<const int> o, Cache& c) {
  ActivationBackward(Activation::kTanh, c.mu, c.dmu);
  SoftplusBackward(c.sigma, c.dsigma);
  mu_.AddGrad(c.a1, c.dmu);
  sigma_.AddGrad(c.a1, c.dsigma);
  c.dhidden.resize(h_, s.cols());
  SetAtB(mu_.W.value, c.dmu, c.dhidden);
  AddAtB(sigma_.W.value, c.dsigma, c.dhidden);
  ActivationBackward(Activation::kRelu, c.a1, c.dhidden);
  action1_.AddGrad(c.a0, c.dhidden);
  action1_.BackwardInput(c.dhidden, c.a1);  // a1 has served; now da0
  ActivationBackward(Activation::kRelu, c.a0, c.a1);
  action0_.AddStateGrad(s, c.a1);
  dtable_.setZero(h_, K_);
  ScatterColumns(c.a1, o, dtable_);
  action0_.AddTableGrad(W_o_.value, dtable_, nullptr);  // o_hat is detached
}

void Option2Vec::ForwardCriticAll(const ConstMatRef& s, std::span<const int> o, Cache& c) {
  const Index B = s.cols();
  const Index m = scalar_critic_ ? K_ * B : B;
  c.c0.resize(h_, m);
  c.c1.resize(h_, m);
  if (scalar_critic_) {  // column b K + k: sample b, option k
    c.c_state.resize(h_, B);
    critic0_.MultiplyState(s, c.c_state);
    for (Index b = 0; b < B; ++b) {
      c.c0.middleCols(b * K_, K_) = (tables_.critic.colwise() + c.c_state.col(b)).cwiseMax(0);
    }
  } else {  // K outputs from LN([s, o_hat_o]); spec 2.6 item 8
    c.c_in.resize(S_ + D_, B);
    c.c_in.topRows(S_) = s;
    for (Index b = 0; b < B; ++b) c.c_in.col(b).tail(D_) = W_o_.value.col(o[std::size_t(b)]);
    critic_norm_.Forward(c.c_in, c.c_norm, c.c_in);
    critic0_full_.Multiply(c.c_in, c.c0);
    BiasActivate(Activation::kRelu, critic0_full_.b.value, c.c0);
  }
  critic1_.Multiply(c.c0, c.c1);
  BiasActivate(Activation::kRelu, critic1_.b.value, c.c1);
  c.q.resize(K_, B);
  if (scalar_critic_) {
    critic_q_.Forward(c.c1, Eigen::Map<Mat>(c.q.data(), 1, m));
  } else {
    critic_q_.Forward(c.c1, c.q);
  }
}

void Option2Vec::ForwardCriticOne(const ConstMatRef& s, std::span<const int> o, Cache& c) {
  const Index B = s.cols();
  c.c0.resize(h_, B);
  c.c1.resize(h_, B);
  c.q.resize(1, B);
  critic0_.MultiplyState(s, c.c0);
  AddTableRelu(tables_.critic, o, c.c0);
  critic1_.Multiply(c.c0, c.c1);
  BiasActivate(Activation::kRelu, critic1_.b.value, c.c1);
  critic_q_.Forward(c.c1, c.q);
}

/// Backward of y = W LN(x) + b where x needs no gradient. With G = dy x_hat^T all gradients follow
/// without a product of W^T with the batch:  dW = G diag(gain) + db shift^T,  dgain_j = sum_i W_ij
/// G_ij, dshift = W^T db.
void BackwardNormalized(LayerNorm& norm, Linear& linear, const LayerNorm::Cache& cache,
                        const Mat& dy, Mat& G, Vec& db) {
  G.resize(dy.rows(), cache.x_hat.rows());
  SetABt(dy, cache.x_hat, G);
  db = dy.rowwise().sum();
  linear.b.grad.col(0) += db;
  for (Index j = 0; j < G.cols(); ++j) {
    linear.W.grad.col(j) += norm.gain.value(j, 0) * G.col(j) + norm.shift.value(j, 0) * db;
    norm.gain.grad(j, 0) += linear.W.value.col(j).dot(G.col(j));
    norm.shift.grad(j, 0) += linear.W.value.col(j).dot(db);
  }
}

void Option2Vec::BackwardCritic(const ConstMatRef& s, std::span<const int> o, Cache& c) {
  const Index B = s.cols(), m = c.c0.cols();
  c.dc0.resize(h_, m);
  c.dc1.resize(h_, m);
  const Eigen::Map<const Mat> dq(c.dq.data(), critic_q_.W.value.rows(), m);
  critic_q_.AddGrad(c.c1, dq);
  critic_q_.BackwardInput(dq, c.dc1);
  ActivationBackward(Activation::kRelu, c.c1, c.dc1);
  critic1_.AddGrad(c.c0, c.dc1);
  critic1_.BackwardInput(c.dc1, c.dc0);
  ActivationBackward(Activation::kRelu, c.c0, c.dc0);
  if (!scalar_critic_) {
    BackwardNormalized(critic_norm_, critic0_full_, c.c_norm, c.dc0, c.dW, c.db);
    return;
  }
  dtable_.setZero(h_, K_);
  if (m == B) {
    critic0_.AddStateGrad(s, c.dc0);
    ScatterColumns(c.dc0, o, dtable_);
  } else {
    for (Index b = 0; b < B; ++b) {
      const auto block = c.dc0.middleCols(b * K_, K_);
      dtable_ += block;
      c.c_state.col(b) = block.rowwise().sum();
    }
    critic0_.AddStateGrad(s, c.c_state);
  }
  critic0_.AddTableGrad(W_o_.value, dtable_, nullptr);  // o_hat is detached
}

// ---- Rollout ------------------------------------------------------------------------------------

const AttentionBlock::Masks* Option2Vec::Dropout(Index B, const FixedDraws* fixed, Cache& c) {
  if (fixed && !fixed->dropout.empty()) {
    const Real keep = Real(1 / (1 - switches_.o2v_dropout));
    Mat* masks[] = {&c.masks.attention, &c.masks.after_attention, &c.masks.inside_ffn,
                    &c.masks.after_ffn};
    Check(fixed->dropout.size() == 4, "dropout: got ", fixed->dropout.size(), " masks, not 4");
    for (std::size_t i = 0; i < 4; ++i) *masks[i] = keep * fixed->dropout[i];
    return &c.masks;
  }
  if (switches_.o2v_dropout == 0) return nullptr;
  c.masks.Resize(heads_ * K_, D_, F_, tokens_ * B);
  c.masks.Draw(switches_.o2v_dropout, dropout_rng_);
  return &c.masks;
}

void Option2Vec::Collect(VecEnv& env, std::vector<Episode>& episodes) {
  MakeOptionTables();
  MakeActionTables();
  Cache& c = caches_(N_);
  c.o_fed.resize(std::size_t(N_));
  std::fill(executed_.begin(), executed_.end(), 0);
  std::fill(begun_.begin(), begun_.end(), 0);
  for (int t = 0; t < hyper_.rollout; ++t) {
    const Index column = Index(t) * N_;
    const Mat& s = env.States();
    ForwardOptions(s, o_prev_, env.Init(), Dropout(N_, nullptr, c), c);
    SampleCategorical(c.P, policy_rng_, c.o_fed);
    ForwardAction(s, c.o_fed, c);
    SampleGaussian(c.mu, c.sigma, policy_rng_, a_);
    GaussianLogProb(a_, c.mu, c.sigma, c.logp);

    rollout_.s.middleCols(column, N_) = s;
    rollout_.a.middleCols(column, N_) = a_;
    rollout_.low.logp_old.segment(column, N_) = c.logp;
    rollout_P_.middleCols(column, N_) = c.P;
    for (std::size_t i = 0; i < std::size_t(N_); ++i) {
      const std::size_t row = std::size_t(column) + i;
      const int o = c.o_fed[i];
      rollout_.o[row] = o;
      rollout_.o_prev[row] = o_prev_[i];
      rollout_.init[row] = env.Init()[i];
      rollout_.high.logp_old(Index(row)) = c.log_P(o, Index(i));
      executed_[std::size_t(o)] += 1;
      begun_[std::size_t(o)] += env.Init()[i] || o != o_prev_[i];
      o_prev_[i] = o;
    }

    env.Step(a_, transition_, episodes);
    high_.r.col(t) = low_.r.col(t) = transition_.r;
    bool bootstrap = false;
    for (std::size_t i = 0; i < std::size_t(N_); ++i) {
      const bool done = transition_.Done(i);
      mask_(Index(i), t) = done ? 0 : 1;
      bootstrap |= transition_.TimeLimit(i);
      // o2v_init_flag = released: the update is given done_t = init_{t+1}.
      if (!Paper(switches_.o2v_init_flag)) rollout_.init[std::size_t(column) + i] = done;
    }
    if (bootstrap && Paper(switches_.timelimit)) {
      // V_bar(s_last, o_t) and Q_O[s_last, o], o ~ P(. | s_last, o_t); spec 1.3
      ForwardOptions(transition_.s_last, o_prev_, not_initial_, Dropout(N_, nullptr, c), c);
      SampleCategorical(c.P, bootstrap_rng_, c.o_fed);
      ForwardCriticAll(transition_.s_last, c.o_fed, c);
      for (int i = 0; i < N_; ++i) {
        if (!transition_.TimeLimit(std::size_t(i))) continue;
        high_.r(i, t) += hyper_.gamma * double(c.P.col(i).dot(c.q.col(i)));
        low_.r(i, t) += hyper_.gamma * double(c.q(c.o_fed[std::size_t(i)], i));
      }
    }
  }
  // The critic does not act, so its values are taken after the rollout, in blocks.
  ForEachBlock(rollout_.Size(), hyper_.minibatch, [&](Index start, Index n) {
    Cache& block = caches_(n);
    const std::span<const int> o =
        std::span<const int>(rollout_.o).subspan(std::size_t(start), std::size_t(n));
    ForwardCriticAll(rollout_.s.middleCols(start, n), o, block);
    for (Index b = 0; b < n; ++b) {
      high_.v.data()[start + b] = double(rollout_P_.col(start + b).dot(block.q.col(b)));
      low_.v.data()[start + b] = double(block.q(o[std::size_t(b)], b));
    }
  });
  // v_T: one more pass; the option it draws is thrown away (spec 1.3).
  ForwardOptions(env.States(), o_prev_, env.Init(), Dropout(N_, nullptr, c), c);
  SampleCategorical(c.P, bootstrap_rng_, c.o_fed);
  ForwardCriticAll(env.States(), c.o_fed, c);
  for (int i = 0; i < N_; ++i) {
    high_.v(i, hyper_.rollout) = double(c.P.col(i).dot(c.q.col(i)));
    low_.v(i, hyper_.rollout) = double(c.q(c.o_fed[std::size_t(i)], i));
  }
  high_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.high);
  low_.Finish(mask_, hyper_, switches_.adv_std_eps, rollout_.low);
}

// ---- Losses -------------------------------------------------------------------------------------

LossTerms Option2Vec::Loss(int stage, const Batch& batch, const FixedDraws* fixed) {
  return stage == kHigh ? OptionLoss(batch, fixed) : ActionLoss(batch, fixed);
}

LossTerms Option2Vec::OptionLoss(const Batch& batch, const FixedDraws* fixed) {
  LossTerms terms;
  const Index B = batch.Size();
  Cache& c = caches_(B);
  MakeOptionTables();
  if (scalar_critic_) critic0_.MakeTable(W_o_.value, tables_.critic);
  const AttentionBlock::Masks* masks = Dropout(B, fixed, c);
  ForwardOptions(batch.s, batch.o_prev, batch.init, masks, c);
  c.o_fed = batch.o;
  if (!scalar_critic_ && !Paper(switches_.o2v_option_in_update)) {
    if (fixed && !fixed->o.empty()) {
      c.o_fed = fixed->o;
    } else {
      SampleCategorical(c.P, redraw_rng_, c.o_fed);
    }
  }
  ForwardCriticAll(batch.s, c.o_fed, c);

  c.logp.resize(B);
  c.v.resize(B);
  for (Index b = 0; b < B; ++b) {
    c.logp(b) = c.log_P(batch.o[std::size_t(b)], b);
    c.v(b) = c.P.col(b).dot(c.q.col(b));
  }
  ClippedSurrogate(c.logp, batch.high.logp_old, batch.high.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  CategoricalEntropy(c.log_P, c.P, c.H);
  terms.entropy = double(c.H.sum()) / double(B);
  ValueLoss(c.v, batch.high.ret, terms, c.dv);
  terms.total = terms.surrogate - w_o_ * terms.entropy + terms.value;

  // Spec 4.8 (e).
  c.dz.setZero(K_, B);
  AddLogProbGrad(c.P, batch.o, c.dlogp, c.dz);
  AddEntropyGrad(c.log_P, c.P, c.H, Real(-w_o_) / Real(B), c.dz);
  c.dq.resize(K_, B);
  for (Index b = 0; b < B; ++b) {
    if (!Paper(switches_.o2v_vloss_policy)) {  // V_bar = sum_k P_k q_k moves with P
      c.dz.col(b).array() += c.dv(b) * c.P.col(b).array() * (c.q.col(b).array() - c.v(b));
    }
    c.dq.col(b) = c.dv(b) * c.P.col(b);
  }
  BackwardCritic(batch.s, c.o_fed, c);
  BackwardOptions(batch.s, batch.o_prev, masks, c);
  if (!Paper(switches_.adam_idle)) {
    // The initial net enters the graph with the first flagged row; spec 2.7.
    for (const std::size_t i : init_params_) in_graph_[kHigh][i] = !c.init_rows.empty();
  }
  return terms;
}

LossTerms Option2Vec::ActionLoss(const Batch& batch, const FixedDraws* fixed) {
  LossTerms terms;
  const Index B = batch.Size();
  Cache& c = caches_(B);
  MakeActionTables();
  c.o_fed = batch.o;
  if (!Paper(switches_.o2v_option_in_update)) {
    if (fixed && !fixed->o.empty()) {
      c.o_fed = fixed->o;
    } else {
      MakeOptionTables();
      ForwardOptions(batch.s, batch.o_prev, batch.init, Dropout(B, fixed, c), c);
      SampleCategorical(c.P, redraw_rng_, c.o_fed);
    }
  }
  ForwardAction(batch.s, c.o_fed, c);
  GaussianLogProb(batch.a, c.mu, c.sigma, c.logp);
  ClippedSurrogate(c.logp, batch.low.logp_old, batch.low.adv_hat, hyper_.ratio_clip, terms,
                   c.dlogp);
  terms.entropy = GaussianMeanEntropy(c.sigma);
  GaussianLogProbGrad(batch.a, c.mu, c.sigma, c.dlogp, c.dmu, c.dsigma);
  if (w_a_ != 0) AddGaussianEntropyGrad(c.sigma, Real(-w_a_), c.dsigma);
  BackwardAction(batch.s, c.o_fed, c);

  c.v.resize(B);
  if (scalar_critic_) {
    ForwardCriticOne(batch.s, c.o_fed, c);
    c.v = c.q.row(0).transpose();
    ValueLoss(c.v, batch.low.ret, terms, c.dv);
    c.dq = c.dv.transpose();
  } else {
    ForwardCriticAll(batch.s, c.o_fed, c);
    for (Index b = 0; b < B; ++b) c.v(b) = c.q(c.o_fed[std::size_t(b)], b);
    ValueLoss(c.v, batch.low.ret, terms, c.dv);
    c.dq.setZero(K_, B);
    for (Index b = 0; b < B; ++b) c.dq(c.o_fed[std::size_t(b)], b) = c.dv(b);
  }
  BackwardCritic(batch.s, c.o_fed, c);
  terms.total = terms.surrogate - w_a_ * terms.entropy + terms.value;
  return terms;
}

// ---- Update -------------------------------------------------------------------------------------

double Option2Vec::Step(int stage) {
  return adam_->Step(in_graph_[stage],
                     Paper(switches_.adam_idle) ? IdleRule::kSkip : IdleRule::kZeroGradient);
}

void Option2Vec::RunStage(int stage) {
  means_[stage].Clear();
  for (int epoch = 0; epoch < hyper_.epochs; ++epoch) {
    ForEachMinibatch(order_, hyper_.minibatch, shuffle_rng_, [&](std::span<const int> rows) {
      Batch& batch = int(rows.size()) == hyper_.minibatch ? minibatch_ : rest_;
      Gather(rollout_, rows, batch);
      const LossTerms terms = Loss(stage, batch, nullptr);
      means_[stage].Add(terms, Step(stage));
    });
  }
}

void Option2Vec::Update(std::vector<double>& stats) {
  const int first = order_rng_.Uniform() < 0.5 ? kHigh : kLow;  // fair coin; spec 4.8 (f)
  RunStage(first);
  RunStage(1 - first);
  stats.clear();
  for (const LossMeans& means : means_) means.Report(stats);
  const double steps = double(rollout_.Size());
  for (const double n : executed_) stats.push_back(n / steps);
  // Mean steps of a segment; the one that the rollout's start cuts counts where it began.
  for (std::size_t k = 0; k < executed_.size(); ++k) {
    stats.push_back(executed_[k] / std::max(1.0, begun_[k]));
  }
}

std::vector<std::string> Option2Vec::StatNames() const {
  std::vector<std::string> names;
  for (const std::string& stage : Stages()) LossMeans::Names(stage, names);
  for (Index k = 0; k < K_; ++k) names.push_back("usage_" + std::to_string(k));
  for (Index k = 0; k < K_; ++k) names.push_back("duration_" + std::to_string(k) + "_steps");
  return names;
}

// ---- Queries ------------------------------------------------------------------------------------

void Option2Vec::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                              const std::vector<char>& init, Mat& P) {
  MakeOptionTables();
  Cache& c = caches_(s.cols());
  ForwardOptions(s, o_prev, init, nullptr, c);
  P = c.P;
}

void Option2Vec::ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) {
  MakeActionTables();
  Cache& c = caches_(s.cols());
  ForwardAction(s, o, c);
  mu = c.mu;
  sigma = c.sigma;
}

void Option2Vec::OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) {
  MakeActionTables();
  Cache& c = caches_(s.cols());
  ForwardCriticAll(s, o, c);
  q = c.q;
}

}  // namespace

std::unique_ptr<Algorithm> MakeOption2Vec(const AlgorithmInput& in) {
  return std::make_unique<Option2Vec>(in);
}

}  // namespace o2v
