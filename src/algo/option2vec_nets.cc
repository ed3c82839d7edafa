#include "algo/option2vec_nets.h"

#include "dist/categorical.h"
#include "nn/activation.h"
#include "nn/product.h"

namespace o2v {
namespace {

/// y.col(b) := ReLU(y.col(b) + table.col(o[b])).
void AddTableRelu(const Mat& table, std::span<const int> o, Mat& y) {
  for (Index b = 0; b < y.cols(); ++b) {
    y.col(b) = (y.col(b) + table.col(o[std::size_t(b)])).cwiseMax(0);
  }
}

/// Backward of y = W LN(x) + b where x needs no gradient. With G = dy x_hat^T all gradients follow
/// without a product of W^T with the batch:  dW = G diag(gain) + db shift^T,
/// dgain_j = sum_i W_ij G_ij,  dshift = W^T db.
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

}  // namespace

// ---- Option policy ------------------------------------------------------------------------------

PolicyOverOptions::PolicyOverOptions(const Option2VecSizes& n, const Form& form,
                                     const Initialiser& init)
    : W_o("embed.W_o", n.D, n.K),
      start0("init.0", n.S, n.h_start),
      start1("init.1", n.h_start, n.K),
      form_(form) {
  init.Orthogonal(W_o.value, 1);  // rows of E = W_o^T orthonormal for K <= D; spec 2.6 item 1
  init.XavierUniform(start0.W.value);
  init.XavierUniform(start1.W.value);
  if (form.two_tokens) {
    state = Linear("state", n.S, n.D);
    init.Orthogonal(state.W.value, 1);
    norm = LayerNorm("state.ln", n.D);
  } else {
    query = EmbeddedLinear("query", n.S, n.D, n.D);
    init.Orthogonal(query.W.value, 1);
    norm = LayerNorm("query.ln", n.D);
  }
  block = AttentionBlock("attention", "block", n.D, n.heads, n.F);
  block.Init(init);
  logits = Linear("logits", Tokens() * n.D, n.K);
  init.Orthogonal(logits.W.value, 1);
}

std::vector<Param*> PolicyOverOptions::Params() {
  std::vector<Param*> params = {&W_o};
  Append(params, start0.Params());
  Append(params, start1.Params());
  Append(params, form_.two_tokens ? state.Params() : query.Params());
  Append(params, norm.Params());
  Append(params, block.Params());
  Append(params, logits.Params());
  return params;
}

std::vector<Param*> PolicyOverOptions::StartParams() {
  std::vector<Param*> params = start0.Params();
  Append(params, start1.Params());
  return params;
}

void PolicyOverOptions::Tabulate(Tables& tables) const {
  block.attention.Project(W_o.value, tables.memory);
  if (!form_.two_tokens) query.MakeTable(W_o.value, tables.query);
}

void PolicyOverOptions::Forward(const ConstMatRef& s, std::span<const int> o_prev,
                                std::span<const char> init, const Tables& tables,
                                const AttentionBlock::Masks* masks, Cache& c) const {
  const Index B = s.cols(), D = W_o.value.rows(), K = W_o.value.cols();
  c.x.resize(D, Tokens() * B);
  c.relu.resize(D, B);
  if (form_.two_tokens) {
    state.Multiply(s, c.relu);
    BiasActivate(Activation::kRelu, state.b.value, c.relu);
    GatherColumns(W_o.value, o_prev, c.x.rightCols(B));
  } else {
    query.MultiplyState(s, c.relu);
    AddTableRelu(tables.query, o_prev, c.relu);
  }
  norm.Forward(c.relu, c.norm, c.x.leftCols(B));
  block.Forward(c.x, tables.memory, masks, c.block);

  c.z.resize(K, B);
  SetAB(logits.W.value.leftCols(D), c.block.out.leftCols(B), c.z);
  if (form_.two_tokens) AddAB(logits.W.value.rightCols(D), c.block.out.rightCols(B), c.z);
  c.z.colwise() += logits.b.value.col(0);

  // First states of episodes: z := z_init(s).
  c.start_rows.clear();
  c.start_rows.reserve(std::size_t(B));
  for (Index b = 0; b < B; ++b) {
    if (init[std::size_t(b)]) c.start_rows.push_back(int(b));
  }
  c.start_s.resize(s.rows(), B);
  c.start_hidden.resize(start0.W.value.rows(), B);
  c.start_z.resize(K, B);
  if (const Index n = Index(c.start_rows.size()); n > 0) {
    for (Index i = 0; i < n; ++i) c.start_s.col(i) = s.col(c.start_rows[std::size_t(i)]);
    auto hidden = c.start_hidden.leftCols(n);
    auto z = c.start_z.leftCols(n);
    start0.Multiply(c.start_s.leftCols(n), hidden);
    BiasActivate(Activation::kRelu, start0.b.value, hidden);
    start1.Forward(hidden, z);
    if (form_.init_relu) z = z.cwiseMax(0);
    for (Index i = 0; i < n; ++i) c.z.col(c.start_rows[std::size_t(i)]) = z.col(i);
  }
  LogSoftmax(c.z, c.log_P, c.P);
}

void PolicyOverOptions::BackwardStart(Cache& c) {
  c.start_dz.resize(c.dz.rows(), c.dz.cols());
  c.start_dhidden.resize(c.start_hidden.rows(), c.dz.cols());
  const Index n = Index(c.start_rows.size());
  if (n == 0) return;
  auto dz = c.start_dz.leftCols(n);
  auto dhidden = c.start_dhidden.leftCols(n);
  for (Index i = 0; i < n; ++i) {
    dz.col(i) = c.dz.col(c.start_rows[std::size_t(i)]);
    c.dz.col(c.start_rows[std::size_t(i)]).setZero();  // nothing reaches the attention
  }
  if (form_.init_relu) ActivationBackward(Activation::kRelu, c.start_z.leftCols(n), dz);
  start1.AddGrad(c.start_hidden.leftCols(n), dz);
  start1.BackwardInput(dz, dhidden);
  ActivationBackward(Activation::kRelu, c.start_hidden.leftCols(n), dhidden);
  start0.AddGrad(c.start_s.leftCols(n), dhidden);
}

void PolicyOverOptions::Backward(const ConstMatRef& s, std::span<const int> o_prev,
                                 const Tables& tables, const AttentionBlock::Masks* masks,
                                 Cache& c) {
  const Index B = s.cols(), D = W_o.value.rows(), K = W_o.value.cols();
  BackwardStart(c);
  c.dtokens.resize(D, Tokens() * B);
  for (Index token = 0; token < Tokens(); ++token) {
    AddABt(c.dz, c.block.out.middleCols(token * B, B), logits.W.grad.middleCols(token * D, D));
    SetAtB(logits.W.value.middleCols(token * D, D), c.dz, c.dtokens.middleCols(token * B, B));
  }
  logits.b.grad.col(0) += c.dz.rowwise().sum();

  const Index passing = form_.prev_embed_grad ? Tokens() * B : B;  // columns with a gradient: the
  c.dx.resize(D, passing);                                         // state tokens are the first
  block.Backward(c.x, W_o.value, tables.memory, masks, c.block, c.dtokens, c.dx, W_o.grad);
  auto dx0 = c.dx.leftCols(B);
  norm.Backward(c.norm, dx0, dx0);
  ActivationBackward(Activation::kRelu, c.relu, dx0);
  if (form_.two_tokens) {
    state.AddGrad(s, dx0);
    if (form_.prev_embed_grad) ScatterColumns(c.dx.rightCols(B), o_prev, W_o.grad);
  } else {
    query.AddStateGrad(s, dx0);
    c.dtable.setZero(D, K);
    ScatterColumns(dx0, o_prev, c.dtable);
    query.AddTableGrad(W_o.value, c.dtable, form_.prev_embed_grad ? &W_o.grad : nullptr);
  }
}

// ---- Action policy ------------------------------------------------------------------------------

ActionPolicyNet::ActionPolicyNet(const Option2VecSizes& n, const Initialiser& init)
    : layer0("action.body.0", n.S, n.D, n.h),
      layer1("action.body.1", n.h, n.h),
      mu("action.mu", n.h, n.A),
      sigma("action.sigma", n.h, n.A) {
  init.XavierUniform(layer0.W.value);
  init.XavierUniform(layer1.W.value);
  init.Orthogonal(mu.W.value, kHeadGain);
  init.Orthogonal(sigma.W.value, kHeadGain);
}

std::vector<Param*> ActionPolicyNet::Params() {
  std::vector<Param*> params = layer0.Params();
  Append(params, layer1.Params());
  Append(params, mu.Params());
  Append(params, sigma.Params());
  return params;
}

void ActionPolicyNet::Forward(const ConstMatRef& s, std::span<const int> o, const Mat& table,
                              Cache& c) const {
  const Index h = layer1.W.value.rows(), A = mu.W.value.rows(), B = s.cols();
  c.h0.resize(h, B);
  c.h1.resize(h, B);
  c.mu.resize(A, B);
  c.sigma.resize(A, B);
  layer0.MultiplyState(s, c.h0);
  AddTableRelu(table, o, c.h0);
  layer1.Multiply(c.h0, c.h1);
  BiasActivate(Activation::kRelu, layer1.b.value, c.h1);
  mu.Multiply(c.h1, c.mu);
  BiasActivate(Activation::kTanh, mu.b.value, c.mu);
  sigma.Forward(c.h1, c.sigma);
  Softplus(c.sigma);
}

void ActionPolicyNet::Backward(const ConstMatRef& s, std::span<const int> o, const Mat& W_o,
                               Cache& c) {
  c.dh0.resize(c.h0.rows(), c.h0.cols());
  c.dh1.resize(c.h1.rows(), c.h1.cols());
  ActivationBackward(Activation::kTanh, c.mu, c.dmu);
  SoftplusBackward(c.sigma, c.dsigma);
  mu.AddGrad(c.h1, c.dmu);
  sigma.AddGrad(c.h1, c.dsigma);
  SetAtB(mu.W.value, c.dmu, c.dh1);
  AddAtB(sigma.W.value, c.dsigma, c.dh1);
  ActivationBackward(Activation::kRelu, c.h1, c.dh1);
  layer1.AddGrad(c.h0, c.dh1);
  layer1.BackwardInput(c.dh1, c.dh0);
  ActivationBackward(Activation::kRelu, c.h0, c.dh0);
  layer0.AddStateGrad(s, c.dh0);
  c.dtable.setZero(c.h0.rows(), W_o.cols());
  ScatterColumns(c.dh0, o, c.dtable);
  layer0.AddTableGrad(W_o, c.dtable, nullptr);  // o_hat is detached
}

void ActionPolicyNet::MeanJacobian(const ConstMatRef& s, std::span<const int> o, const Mat& table,
                                   Cache& c, MatD& J) const {
  Forward(s, o, table, c);
  const Index h = layer1.W.value.rows(), D = layer0.W.value.cols() - s.rows();
  const auto on = [](const auto& y) -> Vec { return (y.array() > 0).template cast<Real>(); };
  MatD sum = MatD::Zero(mu.W.value.rows(), h);  // of what stands before W_e
  Mat G;
  for (Index b = 0; b < s.cols(); ++b) {
    const Vec slope = 1 - c.mu.col(b).array().square();
    G = slope.asDiagonal() * mu.W.value * on(c.h1.col(b)).asDiagonal();
    G = G * layer1.W.value * on(c.h0.col(b)).asDiagonal();
    sum += G.cast<double>();
  }
  J = sum * layer0.W.value.rightCols(D).cast<double>() / double(s.cols());
}

// ---- Option value -------------------------------------------------------------------------------

OptionValueNet::OptionValueNet(const Option2VecSizes& n, bool scalar, const Initialiser& init)
    : layer1("critic.body.1", n.h, n.h),
      head("critic.q", n.h, scalar ? 1 : n.K),
      scalar_(scalar),
      K_(n.K) {
  if (scalar) {
    layer0 = EmbeddedLinear("critic.body.0", n.S, n.D, n.h);
    init.XavierUniform(layer0.W.value);
  } else {
    norm = LayerNorm("critic.ln", n.S + n.D);
    layer0_full = Linear("critic.body.0", n.S + n.D, n.h);
    init.XavierUniform(layer0_full.W.value);
  }
  init.XavierUniform(layer1.W.value);
  init.Orthogonal(head.W.value, 1);
}

std::vector<Param*> OptionValueNet::Params() {
  std::vector<Param*> params;
  if (!scalar_) Append(params, norm.Params());
  Append(params, scalar_ ? layer0.Params() : layer0_full.Params());
  Append(params, layer1.Params());
  Append(params, head.Params());
  return params;
}

void OptionValueNet::ForwardHead(Cache& c) const {
  c.h1.resize(c.h0.rows(), c.h0.cols());
  layer1.Multiply(c.h0, c.h1);
  BiasActivate(Activation::kRelu, layer1.b.value, c.h1);
  head.Forward(c.h1, Eigen::Map<Mat>(c.q.data(), head.W.value.rows(), c.h1.cols()));
}

void OptionValueNet::ForwardAll(const ConstMatRef& s, std::span<const int> o, const Mat& W_o,
                                const Mat& table, Cache& c) const {
  const Index B = s.cols(), h = layer1.W.value.rows();
  if (scalar_) {  // column b K + k: sample b, option k
    c.state.resize(h, B);
    c.h0.resize(h, K_ * B);
    layer0.MultiplyState(s, c.state);
    for (Index b = 0; b < B; ++b) {
      c.h0.middleCols(b * K_, K_) = (table.colwise() + c.state.col(b)).cwiseMax(0);
    }
  } else {
    c.input.resize(s.rows() + W_o.rows(), B);
    c.h0.resize(h, B);
    c.input.topRows(s.rows()) = s;
    GatherColumns(W_o, o, c.input.bottomRows(W_o.rows()));
    norm.Forward(c.input, c.norm, c.input);
    layer0_full.Multiply(c.input, c.h0);
    BiasActivate(Activation::kRelu, layer0_full.b.value, c.h0);
  }
  c.q.resize(K_, B);
  ForwardHead(c);
}

void OptionValueNet::ForwardOne(const ConstMatRef& s, std::span<const int> o, const Mat& table,
                                Cache& c) const {
  c.h0.resize(layer1.W.value.rows(), s.cols());
  c.q.resize(1, s.cols());
  layer0.MultiplyState(s, c.h0);
  AddTableRelu(table, o, c.h0);
  ForwardHead(c);
}

void OptionValueNet::Backward(const ConstMatRef& s, std::span<const int> o, const Mat& W_o,
                              Cache& c) {
  const Index B = s.cols(), h = c.h0.rows(), m = c.h0.cols();
  c.dh0.resize(h, m);
  c.dh1.resize(h, m);
  const Eigen::Map<const Mat> dq(c.dq.data(), head.W.value.rows(), m);
  head.AddGrad(c.h1, dq);
  head.BackwardInput(dq, c.dh1);
  ActivationBackward(Activation::kRelu, c.h1, c.dh1);
  layer1.AddGrad(c.h0, c.dh1);
  layer1.BackwardInput(c.dh1, c.dh0);
  ActivationBackward(Activation::kRelu, c.h0, c.dh0);
  if (!scalar_) {
    BackwardNormalized(norm, layer0_full, c.norm, c.dh0, c.G, c.db);
    return;
  }
  c.dtable.setZero(h, K_);
  if (c.q.rows() == 1) {
    layer0.AddStateGrad(s, c.dh0);
    ScatterColumns(c.dh0, o, c.dtable);
  } else {
    for (Index b = 0; b < B; ++b) {
      const auto options = c.dh0.middleCols(b * K_, K_);
      c.dtable += options;
      c.state.col(b) = options.rowwise().sum();
    }
    layer0.AddStateGrad(s, c.state);
  }
  layer0.AddTableGrad(W_o, c.dtable, nullptr);  // o_hat is detached
}

}  // namespace o2v
