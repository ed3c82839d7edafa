#include <algorithm>
#include <optional>

#include "algo/option2vec_nets.h"
#include "algo/two_stage.h"
#include "base/check.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"

namespace o2v {
namespace {

/// Option2Vec: options are columns of the embedding matrix W_o (D, K); attention over them chooses
/// the next one, one shared Gaussian policy decodes it into actions.
///
///   option policy   P(o | s, o_{t-1}; W_o) = softmax(FFN(MHA(query(s, o_hat_{t-1}), W_o, W_o)))
///                   at an episode's start softmax(z_init(s))
///   action policy   pi_a(a | s, o) = N(mu, sigma^2)
///                   mu = tanh(.), sigma = softplus(.) of [s, o_hat]
///   option value    Q_O[s, o] = f([s, o_hat]),  V_bar[s, o_{t-1}] = sum_o P Q_O
///   option stage    L_o = clip-surrogate(ln P_o) - w_o mean H(P) + 1/2 mean (V_bar - R^o)^2
///   action stage    L_a = clip-surrogate(ln pi_a) - w_a mean H(pi_a)
///                         + 1/2 mean (Q_O[s, o] - R^a)^2
///
/// o_hat is detached in action policy and critic: W_o learns by L_o alone, as memory of the
/// attention and, with `o2v_prev_embed_grad` = paper, as part of the query. After a change of task
/// it is constant (`o2v_freeze`). Against the double actor-critic of DAC: one action policy and one
/// critic for all options, fed with o_hat; V_bar in the loss takes P as it is, not as it was in the
/// rollout; logarithms are the softmax's own.
/// Source: spec 2.6, 2.7, 4.8, 6; paper Eq. (3), (8)-(10).
class Option2Vec final : public TwoStageMethod {
 public:
  explicit Option2Vec(const AlgorithmInput& in);

  void ChangeTask() override { StartFreeze(); }
  void Serialize(StateVisitor& v) override;
  void OptionPolicy(const Mat& s, const std::vector<int>& o_prev, const std::vector<char>& init,
                    Mat& P) override;
  void ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) override;
  void OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) override;
  Param* Embedding() override { return &options_.W_o; }
  void MeanJacobian(const Mat& s, const std::vector<int>& o, MatD& J) override;

 private:
  /// What a batch of B samples leaves behind.
  struct Cache {
    PolicyOverOptions::Cache options;
    ActionPolicyNet::Cache action;
    OptionValueNet::Cache all, one;  // the critic of every option; of the option fed
    std::vector<int> o;              // (B) option that action net and critic are fed
    Vec logp, dlogp, v, dv, H;       // (B)
  };

  /// From now on `o2v_freeze` acts.
  void StartFreeze();
  OptionDistribution Options(const ConstMatRef& s, std::span<const int> o_prev,
                             std::span<const char> init) override;
  void DrawActions(const ConstMatRef& s, std::span<const int> o, Mat& a, Vec& logp) override;
  const Mat& Critic(const ConstMatRef& s, std::span<const int> o) override;
  void BeforeRollout() override;
  void AfterRollout() override;
  /// Masks for a pass over B samples: drawn, or taken from `fixed`; null without dropout.
  const AttentionBlock::Masks* Dropout(Index B, const FixedDraws* fixed, Cache& c);
  /// `o2v_option_in_update` = released: the update does not use the option that acted.
  bool Redraws() const { return !Paper(switches_.o2v_option_in_update); }
  /// Options drawn anew from c.options.P, or those of `fixed` -> c.o.
  void Redraw(const FixedDraws* fixed, Cache& c);
  LossTerms OptionLoss(const Batch& batch, const FixedDraws* fixed) override;
  LossTerms ActionLoss(const Batch& batch, const FixedDraws* fixed) override;

  static bool Paper(Fidelity f) { return f == Fidelity::kPaper; }

  const double clip_;       // c
  const double w_o_, w_a_;  // entropy weights of option and action stage
  const Option2VecSizes sizes_;
  const bool scalar_critic_;
  Rng &dropout_rng_ = NewStream("dropout"), &redraw_rng_ = NewStream("redraw");

  PolicyOverOptions options_;
  ActionPolicyNet action_;
  OptionValueNet critic_net_;
  std::optional<LayerNorm> unused_;        // spec 2.6 item 9
  std::vector<std::size_t> start_params_;  // positions of the net of first states in Params()
  bool frozen_ = false;                    // the task has changed, and o2v_freeze acts
  PolicyOverOptions::Tables tables_;       // products of weights: see Tabulate
  Mat action_table_, critic_table_;
  CacheByWidth<Cache> caches_;
};

Option2VecSizes ReadSizes(const AlgorithmInput& in) {
  const Settings& s = *in.hyper;
  return {in.S,
          in.A,
          s.Int("options", 1),
          s.Int("embedding", 1),
          s.Int("ffn", 1),
          s.Int("heads", 1),
          s.Int("hidden", 1),
          s.Int("init_hidden", 1)};
}

Option2Vec::Option2Vec(const AlgorithmInput& in)
    : TwoStageMethod(in),
      clip_(in.hyper->Real("ratio_clip")),
      w_o_(in.hyper->Real("entropy_weight_option")),
      w_a_(in.hyper->Real("entropy_weight_action")),
      sizes_(ReadSizes(in)),
      scalar_critic_(Paper(switches_.o2v_critic)) {
  const PolicyOverOptions::Form form{.two_tokens = !Paper(switches_.o2v_query),
                                     .init_relu = !Paper(switches_.o2v_init_relu),
                                     .prev_embed_grad = Paper(switches_.o2v_prev_embed_grad)};
  options_ = PolicyOverOptions(sizes_, form, initialiser_);
  action_ = ActionPolicyNet(sizes_, initialiser_);
  critic_net_ = OptionValueNet(sizes_, scalar_critic_, initialiser_);
  // The authors' network allocates one more LayerNorm; it counts, and exists only when every switch
  // of the architecture is `released` (spec 2.7).
  if (!scalar_critic_ && form.two_tokens && form.init_relu) {
    unused_.emplace("unused.ln", sizes_.S + sizes_.D);
  }

  std::vector<Param*> params = options_.Params();
  Append(params, action_.Params());
  Append(params, critic_net_.Params());
  if (unused_) Append(params, unused_->Params());
  std::vector<Param*> option_stage = options_.Params(), action_stage = action_.Params();
  Append(option_stage, critic_net_.Params());
  Append(action_stage, critic_net_.Params());
  RegisterNetworks(in, std::move(params), {option_stage, action_stage}, nullptr, nullptr);
  for (std::size_t i = 0; i < params_.size(); ++i) {
    if (std::ranges::count(options_.StartParams(), params_[i]) > 0) start_params_.push_back(i);
  }
}

void Option2Vec::Serialize(StateVisitor& v) {
  Method::Serialize(v);
  int frozen = frozen_;
  v.Below("frozen", frozen, 2);
  if (frozen && !frozen_) StartFreeze();
}

/// o2v_freeze  leaves the option stage's graph  its gradient  what still moves it
/// paper       W_o                              zero          nothing: it is held
/// released    W_o                              zero          momentum, by adam_idle = released
/// policy      the whole option policy          not computed  momentum, likewise
/// none        nothing
void Option2Vec::StartFreeze() {
  if (switches_.o2v_freeze == Freeze::kNone) return;
  frozen_ = true;
  const bool policy = switches_.o2v_freeze == Freeze::kPolicy;
  const std::vector<Param*> of_policy = options_.Params();
  for (std::size_t i = 0; i < params_.size(); ++i) {
    const bool leaves =
        policy ? std::ranges::count(of_policy, params_[i]) > 0 : params_[i] == &options_.W_o;
    if (!leaves) continue;
    in_graph_[kOption][i] = 0;
    if (switches_.o2v_freeze == Freeze::kPaper) Hold(i);
  }
}

// ---- Rollout ------------------------------------------------------------------------------------

const AttentionBlock::Masks* Option2Vec::Dropout(Index B, const FixedDraws* fixed, Cache& c) {
  AttentionBlock::Masks& masks = c.options.masks;
  if (fixed && !fixed->dropout.empty()) {
    const Real keep = Real(1 / (1 - switches_.o2v_dropout));
    Mat* kept[] = {&masks.attention, &masks.after_attention, &masks.inside_ffn, &masks.after_ffn};
    Check(fixed->dropout.size() == 4, "dropout: got ", fixed->dropout.size(), " masks, not 4");
    const Index n = options_.Tokens() * B;
    const Index rows[] = {sizes_.heads * sizes_.K, sizes_.D, sizes_.F, sizes_.D};
    for (std::size_t i = 0; i < 4; ++i) {
      const Mat& given = fixed->dropout[i];
      Check(given.rows() == rows[i] && given.cols() == n, "dropout: mask ", i, " is (",
            given.rows(), ", ", given.cols(), "), not (", rows[i], ", ", n, ")");
      *kept[i] = keep * given;
    }
    return &masks;
  }
  if (switches_.o2v_dropout == 0) return nullptr;
  masks.Resize(sizes_.heads * sizes_.K, sizes_.D, sizes_.F, options_.Tokens() * B);
  masks.Draw(switches_.o2v_dropout, dropout_rng_);
  return &masks;
}

Option2Vec::OptionDistribution Option2Vec::Options(const ConstMatRef& s,
                                                   std::span<const int> o_prev,
                                                   std::span<const char> init) {
  Cache& c = caches_(s.cols());
  options_.Forward(s, o_prev, init, tables_, Dropout(s.cols(), nullptr, c), c.options);
  return {c.options.P, c.options.log_P};
}

void Option2Vec::DrawActions(const ConstMatRef& s, std::span<const int> o, Mat& a, Vec& logp) {
  ActionPolicyNet::Cache& c = caches_(s.cols()).action;
  action_.Forward(s, o, action_table_, c);
  SampleGaussian(c.mu, c.sigma, policy_rng_, a);
  GaussianLogProb(a, c.mu, c.sigma, logp);
}

const Mat& Option2Vec::Critic(const ConstMatRef& s, std::span<const int> o) {
  OptionValueNet::Cache& c = caches_(s.cols()).all;
  critic_net_.ForwardAll(s, o, options_.W_o.value, critic_table_, c);
  return c.q;
}

void Option2Vec::BeforeRollout() {
  options_.Tabulate(tables_);
  action_.Tabulate(options_.W_o.value, action_table_);
  critic_net_.Tabulate(options_.W_o.value, critic_table_);
}

/// With `o2v_init_flag` = released the losses see done_t in place of init_t.
void Option2Vec::AfterRollout() {
  if (Paper(switches_.o2v_init_flag)) return;
  std::vector<char>& init = rollout_.batch.init;
  for (std::size_t i = 0; i < init.size(); ++i) init[i] = rollout_.mask.data()[i] == 0;
}

// ---- Losses -------------------------------------------------------------------------------------

void Option2Vec::Redraw(const FixedDraws* fixed, Cache& c) {
  if (fixed && !fixed->o.empty()) {
    c.o = fixed->o;
  } else {
    SampleCategorical(c.options.P, redraw_rng_, c.o);
  }
}

LossTerms Option2Vec::OptionLoss(const Batch& batch, const FixedDraws* fixed) {
  LossTerms terms;
  const Index B = batch.Size();
  const Mat& W_o = options_.W_o.value;
  Cache& c = caches_(B);
  const Mat &P = c.options.P, &log_P = c.options.log_P, &q = c.all.q;
  options_.Tabulate(tables_);
  critic_net_.Tabulate(W_o, critic_table_);
  const AttentionBlock::Masks* masks = Dropout(B, fixed, c);
  options_.Forward(batch.s, batch.o_prev, batch.init, tables_, masks, c.options);
  c.o = batch.o;
  if (Redraws() && !scalar_critic_) Redraw(fixed, c);  // a scalar critic is fed every option
  critic_net_.ForwardAll(batch.s, c.o, W_o, critic_table_, c.all);

  c.logp.resize(B);
  c.v.resize(B);
  for (Index b = 0; b < B; ++b) {
    c.logp(b) = log_P(batch.o[std::size_t(b)], b);
    c.v(b) = P.col(b).dot(q.col(b));
  }
  ClippedSurrogate(c.logp, batch.option.logp_old, batch.option.adv_hat, clip_, terms, c.dlogp);
  CategoricalEntropy(log_P, P, c.H);
  terms.entropy = double(c.H.sum()) / double(B);
  ValueLoss(c.v, batch.option.ret, terms, c.dv);
  terms.total = terms.surrogate - w_o_ * terms.entropy + terms.value;

  // Spec 4.8 (e).
  Mat &dz = c.options.dz, &dq = c.all.dq;
  dz.setZero(sizes_.K, B);
  AddLogProbGrad(P, batch.o, c.dlogp, dz);
  AddEntropyGrad(log_P, P, c.H, Real(-w_o_) / Real(B), dz);
  dq.resize(sizes_.K, B);
  for (Index b = 0; b < B; ++b) {
    if (!Paper(switches_.o2v_vloss_policy)) {  // V_bar = sum_k P_k q_k moves with P
      dz.col(b).array() += c.dv(b) * P.col(b).array() * (q.col(b).array() - c.v(b));
    }
    dq.col(b) = c.dv(b) * P.col(b);
  }
  critic_net_.Backward(batch.s, c.o, W_o, c.all);
  if (frozen_ && switches_.o2v_freeze == Freeze::kPolicy) return terms;  // P is detached
  options_.Backward(batch.s, batch.o_prev, tables_, masks, c.options);
  if (frozen_) options_.W_o.grad.setZero();
  if (!Paper(switches_.adam_idle)) {
    // The net of first states is in the graph of a minibatch that has one; spec 2.7.
    for (const std::size_t i : start_params_) in_graph_[kOption][i] = !c.options.start_rows.empty();
  }
  return terms;
}

LossTerms Option2Vec::ActionLoss(const Batch& batch, const FixedDraws* fixed) {
  LossTerms terms;
  const Index B = batch.Size();
  const Mat& W_o = options_.W_o.value;
  Cache& c = caches_(B);
  action_.Tabulate(W_o, action_table_);
  critic_net_.Tabulate(W_o, critic_table_);
  c.o = batch.o;
  if (Redraws()) {
    if (!fixed || fixed->o.empty()) {
      options_.Tabulate(tables_);
      options_.Forward(batch.s, batch.o_prev, batch.init, tables_, Dropout(B, fixed, c), c.options);
    }
    Redraw(fixed, c);
  }
  const Mat &mu = c.action.mu, &sigma = c.action.sigma;
  action_.Forward(batch.s, c.o, action_table_, c.action);
  GaussianLogProb(batch.a, mu, sigma, c.logp);
  ClippedSurrogate(c.logp, batch.action.logp_old, batch.action.adv_hat, clip_, terms, c.dlogp);
  terms.entropy = GaussianMeanEntropy(sigma);
  GaussianLogProbGrad(batch.a, mu, sigma, c.dlogp, c.action.dmu, c.action.dsigma);
  if (w_a_ != 0) AddGaussianEntropyGrad(sigma, Real(-w_a_), c.action.dsigma);
  action_.Backward(batch.s, c.o, W_o, c.action);

  OptionValueNet::Cache& critic = scalar_critic_ ? c.one : c.all;
  c.v.resize(B);
  if (scalar_critic_) {
    critic_net_.ForwardOne(batch.s, c.o, critic_table_, critic);
    c.v = critic.q.row(0).transpose();
  } else {
    critic_net_.ForwardAll(batch.s, c.o, W_o, critic_table_, critic);
    for (Index b = 0; b < B; ++b) c.v(b) = critic.q(c.o[std::size_t(b)], b);
  }
  ValueLoss(c.v, batch.action.ret, terms, c.dv);
  critic.dq.setZero(critic.q.rows(), B);
  for (Index b = 0; b < B; ++b) critic.dq(scalar_critic_ ? 0 : c.o[std::size_t(b)], b) = c.dv(b);
  critic_net_.Backward(batch.s, c.o, W_o, critic);
  terms.total = terms.surrogate - w_a_ * terms.entropy + terms.value;
  return terms;
}

// ---- Queries ------------------------------------------------------------------------------------

void Option2Vec::OptionPolicy(const Mat& s, const std::vector<int>& o_prev,
                              const std::vector<char>& init, Mat& P) {
  Cache& c = caches_(s.cols());
  options_.Tabulate(tables_);
  options_.Forward(s, o_prev, init, tables_, nullptr, c.options);
  P = c.options.P;
}

void Option2Vec::ActionPolicy(const Mat& s, const std::vector<int>& o, Mat& mu, Mat& sigma) {
  Cache& c = caches_(s.cols());
  action_.Tabulate(options_.W_o.value, action_table_);
  action_.Forward(s, o, action_table_, c.action);
  mu = c.action.mu;
  sigma = c.action.sigma;
}

void Option2Vec::OptionValues(const Mat& s, const std::vector<int>& o, Mat& q) {
  Cache& c = caches_(s.cols());
  critic_net_.Tabulate(options_.W_o.value, critic_table_);
  critic_net_.ForwardAll(s, o, options_.W_o.value, critic_table_, c.all);
  q = c.all.q;
}

void Option2Vec::MeanJacobian(const Mat& s, const std::vector<int>& o, MatD& J) {
  action_.Tabulate(options_.W_o.value, action_table_);
  action_.MeanJacobian(s, o, action_table_, caches_(s.cols()).action, J);
}

}  // namespace

std::unique_ptr<Algorithm> MakeOption2Vec(const AlgorithmInput& in) {
  return std::make_unique<Option2Vec>(in);
}

}  // namespace o2v
