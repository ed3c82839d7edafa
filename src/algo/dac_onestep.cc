#include "algo/double_actor_critic.h"
#include "base/check.h"
#include "dist/categorical.h"
#include "nn/layer_norm.h"

namespace o2v {
namespace {

/// DAC-OneStep: options are one-step choices. One option policy replaces master policy and
/// terminations,
///
///   P(o | s, o') = softmax(z([s, onehot(o')])),   onehot := 0 at first states,
///
/// and all else is the double actor-critic: the index o' where Option2Vec has an embedding.
/// The authors' code differs by three switches:
///   onestep_index   o' enters as the number 0..K-1, beside s in one LayerNorm
///   onestep_roles   that net serves first states alone (with the last option of the episode
///                   before); elsewhere a net y(s) of the state alone
///   onestep_norm    ReLU outputs + 1e-5 for probabilities (at first states softmax + 1e-5)
/// Source: spec 2.4, 2.5, 4.7, 5.
class DacOneStep final : public DoubleActorCritic {
 public:
  explicit DacOneStep(const AlgorithmInput& in);

 private:
  struct Cache {
    std::vector<int> rows;  // samples that the net of o' serves; they fill the first columns of
    Mat input, x;           // (S + K, B) or (S + 1, B): [s, o'] and, normalised or not, what is fed
    Mat h0, h1, net_z;      // (h, B), (h, B), (K, B)
    Mat dnet_z, dh0, dh1, dx;
    LayerNorm::Cache norm;
    Mat y_hidden, dy_hidden;  // (h_y, B)
    Mat z, dz;                // (K, B) logits of every sample, from either net
    Mat log_P, P;             // (K, B) softmax(z)
  };

  bool NumericIndex() const { return switches_.onestep_index == Fidelity::kReleased; }
  bool Swapped() const { return switches_.onestep_roles == Fidelity::kReleased; }
  bool Unnormalised() const { return switches_.onestep_norm == Fidelity::kReleased; }
  /// Probabilities of the sample are ReLU outputs.
  bool Rectified(char init) const { return Unnormalised() && !init; }

  void OptionForward(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                     When when, Mat& p) override;
  void OptionBackward(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                      const Mat& dp) override;

  Mlp policy_net_;  // of [s, o']
  LayerNorm norm_;  // with the numeric index only
  Linear y0_, y1_;  // the net y, with swapped roles only
  Mlp critic_net_;
  IntraOptionPolicies policies_;
  // The authors' network keeps the head and the terminations that nobody uses; they count, and
  // exist only when all three switches are `released` (spec 2.4).
  std::vector<Linear> unused_head_;
  PerOptionMlps unused_beta_;
  CacheByWidth<Cache> caches_;
};

DacOneStep::DacOneStep(const AlgorithmInput& in) : DoubleActorCritic(in) {
  const Index h = in.hyper->Int("hidden", 1), h_y = in.hyper->Int("ynet_hidden", 1);
  const Activation g = ReadActivation(*in.hyper);
  const std::string name = NumericIndex() ? "master" : "policy";
  const Index n_in = in.S + (NumericIndex() ? 1 : K_);
  policy_net_ = Mlp(name + ".body", name + ".head", n_in, h, K_, g, initialiser_);
  if (NumericIndex()) norm_ = LayerNorm(name + ".ln", n_in);
  if (Swapped()) {
    y0_ = Linear("ynet.0", in.S, h_y);
    y1_ = Linear("ynet.1", h_y, K_);
    initialiser_.XavierUniform(y0_.W.value);
    initialiser_.XavierUniform(y1_.W.value);
  }
  critic_net_ = Mlp("critic.body", "critic.q", in.S, h, K_, g, initialiser_);
  policies_ = IntraOptionPolicies(K_, in.S, in.A, h, g, initialiser_);
  if (NumericIndex() && Swapped() && Unnormalised()) {
    unused_head_.emplace_back("critic.u", h, K_ + 1);
    unused_beta_ = PerOptionMlps("beta", K_, in.S, h, 1, g, initialiser_);
  }
  std::vector<Param*> option_policy = policy_net_.Params();
  if (NumericIndex()) Append(option_policy, norm_.Params());
  if (Swapped()) {
    Append(option_policy, y0_.Params());
    Append(option_policy, y1_.Params());
  }
  std::vector<Param*> params = option_policy;
  Append(params, critic_net_.Params());
  for (Linear& head : unused_head_) Append(params, head.Params());
  for (Index k = 0; k < K_; ++k) Append(params, policies_.Params(k));
  Append(params, unused_beta_.Params());
  RegisterStages(in, std::move(params), std::move(option_policy), &policies_, &critic_net_);
}

void DacOneStep::OptionForward(const ConstMatRef& s, std::span<const int> o_prev,
                               std::span<const char> init, When, Mat& p) {
  const Index S = s.rows(), B = s.cols(), h = policy_net_.body.layer1.W.value.rows();
  Cache& c = caches_(B);
  c.rows.reserve(std::size_t(B));
  c.rows.clear();
  for (Index b = 0; b < B; ++b) {
    if (!Swapped() || init[std::size_t(b)]) c.rows.push_back(int(b));
  }
  const Index n = Index(c.rows.size());
  c.z.resize(K_, B);
  if (Swapped()) {
    c.y_hidden.resize(y0_.W.value.rows(), B);
    y0_.Multiply(s, c.y_hidden);
    BiasActivate(Activation::kRelu, y0_.b.value, c.y_hidden);
    y1_.Forward(c.y_hidden, c.z);
  }
  if (c.input.size() == 0) c.input.setZero(policy_net_.body.layer0.W.value.cols(), B);
  c.x.resize(c.input.rows(), B);
  c.h0.resize(h, B);
  c.h1.resize(h, B);
  c.net_z.resize(K_, B);
  if (n > 0) {
    for (Index i = 0; i < n; ++i) {
      const std::size_t b = std::size_t(c.rows[std::size_t(i)]);
      c.input.col(i).head(S) = s.col(Index(b));
      if (NumericIndex()) {
        c.input(S, i) = Real(o_prev[b]);
      } else {
        c.input.col(i).tail(K_).setZero();
        if (!init[b]) c.input(S + o_prev[b], i) = 1;
      }
    }
    if (NumericIndex()) {
      norm_.Forward(c.input, c.norm, c.x);  // columns from n on are stale and not used
    } else {
      c.x.leftCols(n) = c.input.leftCols(n);
    }
    policy_net_.body.Forward(c.x.leftCols(n), c.h0.leftCols(n), c.h1.leftCols(n));
    policy_net_.head.Forward(c.h1.leftCols(n), c.net_z.leftCols(n));
    for (Index i = 0; i < n; ++i) c.z.col(c.rows[std::size_t(i)]) = c.net_z.col(i);
  }

  LogSoftmax(c.z, c.log_P, c.P);
  p.resize(K_, B);
  const Real eps = Unnormalised() ? Real(kLogEps) : Real(0);
  for (Index b = 0; b < B; ++b) {
    if (Rectified(init[std::size_t(b)])) {
      p.col(b) = c.z.col(b).cwiseMax(0).array() + eps;
    } else {
      p.col(b) = c.P.col(b).array() + eps;
    }
  }
}

void DacOneStep::OptionBackward(const ConstMatRef& s, std::span<const int>,
                                std::span<const char> init, const Mat& dp) {
  const Index B = s.cols();
  Cache& c = caches_(B);
  const Index n = Index(c.rows.size());
  SoftmaxBackward(c.P, dp, c.dz);
  for (Index b = 0; b < B; ++b) {
    if (!Rectified(init[std::size_t(b)])) continue;
    c.dz.col(b) = (c.z.col(b).array() > 0).select(dp.col(b), Real(0));
  }
  c.dnet_z.resize(K_, B);
  c.dh0.resize(c.h0.rows(), B);
  c.dh1.resize(c.h1.rows(), B);
  c.dx.resize(c.x.rows(), B);
  if (n > 0) {
    for (Index i = 0; i < n; ++i) {
      auto dz = c.dz.col(c.rows[std::size_t(i)]);
      c.dnet_z.col(i) = dz;
      if (Swapped()) dz.setZero();  // nothing reaches y
    }
    const auto dz = c.dnet_z.leftCols(n);
    auto dh0 = c.dh0.leftCols(n), dh1 = c.dh1.leftCols(n);
    policy_net_.head.AddGrad(c.h1.leftCols(n), dz);
    policy_net_.head.BackwardInput(dz, dh1);
    policy_net_.body.Backward(c.x.leftCols(n), c.h0.leftCols(n), c.h1.leftCols(n), dh1, dh0);
    if (NumericIndex()) {
      policy_net_.body.layer0.BackwardInput(dh0, c.dx.leftCols(n));
      norm_.AddGrad(c.norm, c.dx.leftCols(n));
    }
  }
  if (!Swapped()) return;
  c.dy_hidden.resize(c.y_hidden.rows(), B);
  y1_.AddGrad(c.y_hidden, c.dz);
  y1_.BackwardInput(c.dz, c.dy_hidden);
  ActivationBackward(Activation::kRelu, c.y_hidden, c.dy_hidden);
  y0_.AddGrad(s, c.dy_hidden);
}

}  // namespace

std::unique_ptr<Algorithm> MakeDacOneStep(const AlgorithmInput& in) {
  return std::make_unique<DacOneStep>(in);
}

}  // namespace o2v
