#include "nn/attention.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "nn/product.h"

namespace o2v {

MemoryAttention::MemoryAttention(const std::string& name, Index D, Index n_heads)
    : Wq(name + ".in.Wq", D, D),
      bq(name + ".in.bq", D, 1),
      Wk(name + ".in.Wk", D, D),
      bk(name + ".in.bk", D, 1),
      Wv(name + ".in.Wv", D, D),
      bv(name + ".in.bv", D, 1),
      W_out(name + ".out.W", D, D),
      b_out(name + ".out.b", D, 1),
      heads(n_heads) {
  Check(n_heads > 0 && D % n_heads == 0, name, ": ", n_heads, " heads do not divide D = ", D);
}

void MemoryAttention::Init(const Initialiser& init) {
  const Index D = Wq.value.rows();
  for (Param* W : {&Wq, &Wk, &Wv}) init.XavierUniform(W->value, D, 3 * D);  // spec 2.6 item 5
  init.XavierUniform(W_out.value);
}

std::vector<Param*> MemoryAttention::Params() {
  return {&Wq, &bq, &Wk, &bk, &Wv, &bv, &W_out, &b_out};
}

void MemoryAttention::Project(const Mat& E, Memory& m) const {
  const Index D = E.rows(), K = E.cols(), d = D / heads;
  const Real scale = 1 / std::sqrt(static_cast<Real>(d));
  m.keys.resize(D, K);
  m.values.resize(D, K);
  SetAB(Wk.value, E, m.keys);
  SetAB(Wv.value, E, m.values);
  m.keys.colwise() += bk.value.col(0);
  m.values.colwise() += bv.value.col(0);
  m.score_map.resize(D, heads * K);
  m.out_map.resize(D, heads * K);
  m.score_bias.resize(heads * K, 1);
  for (Index h = 0; h < heads; ++h) {
    const auto keys = m.keys.middleRows(h * d, d);
    SetAtB(Wq.value.middleRows(h * d, d), keys, m.score_map.middleCols(h * K, K));
    SetAtB(keys, bq.value.middleRows(h * d, d), m.score_bias.middleRows(h * K, K));
    SetAB(W_out.value.middleCols(h * d, d), m.values.middleRows(h * d, d),
          m.out_map.middleCols(h * K, K));
  }
  m.score_map *= scale;
  m.score_bias *= scale;
}

void MemoryAttention::Forward(const ConstMatRef& x, const Memory& m, const Mat* mask, Cache& c,
                              MatRef y) const {
  Check(x.rows() == Wq.value.cols() && y.cols() == x.cols(), Wq.name, ": got x (", x.rows(), ", ",
        x.cols(), ") and y (", y.rows(), ", ", y.cols(), ")");
  const Index K = m.keys.cols();
  c.alpha.resize(heads * K, x.cols());
  SetAtB(m.score_map, x, c.alpha);
  const Real* bias = m.score_bias.data();
  for (Index b = 0; b < x.cols(); ++b) {
    Real* a = c.alpha.data() + b * heads * K;
    for (Index k = 0; k < heads * K; ++k) a[k] += bias[k];
  }
  // Softmax over the K scores of each sample and head, which lie together: segment i. Raw loops,
  // as K is too short for block expressions.
  const Index segments = heads * x.cols();
  for (Index i = 0; i < segments; ++i) {
    Real* a = c.alpha.data() + i * K;
    Real largest = -std::numeric_limits<Real>::infinity();
    for (Index k = 0; k < K; ++k) largest = std::max(largest, a[k]);
    for (Index k = 0; k < K; ++k) a[k] -= largest;
  }
  c.alpha = c.alpha.array().exp();
  for (Index i = 0; i < segments; ++i) {
    Real* a = c.alpha.data() + i * K;
    Real sum = 0;
    for (Index k = 0; k < K; ++k) sum += a[k];
    for (Index k = 0; k < K; ++k) a[k] /= sum;
  }
  if (mask) c.alpha_dropped = c.alpha.cwiseProduct(*mask);
  y.colwise() = b_out.value.col(0);
  AddAB(m.out_map, mask ? c.alpha_dropped : c.alpha, y);
}

void MemoryAttention::Backward(const ConstMatRef& x, const Mat& E, const Memory& m, const Mat* mask,
                               Cache& c, const ConstMatRef& dy, MatRef dx, Mat& dE) {
  const Index D = E.rows(), K = E.cols(), d = D / heads;
  const Real scale = 1 / std::sqrt(static_cast<Real>(d));
  b_out.grad.col(0) += dy.rowwise().sum();
  c.d_out_map.resize(D, heads * K);
  c.d_alpha.resize(heads * K, dy.cols());
  SetABt(dy, mask ? c.alpha_dropped : c.alpha, c.d_out_map);
  SetAtB(m.out_map, dy, c.d_alpha);
  if (mask) c.d_alpha.array() *= mask->array();
  for (Index i = 0; i < heads * dy.cols(); ++i) {  // softmax: ds = alpha (t - alpha . t)
    const Real* a = c.alpha.data() + i * K;
    Real* t = c.d_alpha.data() + i * K;
    Real mean = 0;
    for (Index k = 0; k < K; ++k) mean += a[k] * t[k];
    for (Index k = 0; k < K; ++k) t[k] = a[k] * (t[k] - mean);
  }
  c.d_score_map.resize(D, heads * K);
  SetAB(m.score_map, c.d_alpha.leftCols(dx.cols()), dx);
  SetABt(x, c.d_alpha, c.d_score_map);
  c.d_score_map *= scale;
  c.d_score_bias = scale * c.d_alpha.rowwise().sum();

  // From the maps to the weights: a few products of size D x D x K, once a batch.
  c.d_keys.resize(D, K);
  c.d_values.resize(D, K);
  for (Index h = 0; h < heads; ++h) {
    const Index row = h * d, col = h * K;
    const auto d_map = c.d_score_map.middleCols(col, K);
    const auto d_bias = c.d_score_bias.middleRows(col, K);
    const auto keys = m.keys.middleRows(row, d);
    auto d_keys = c.d_keys.middleRows(row, d);
    AddABt(keys, d_map, Wq.grad.middleRows(row, d));
    AddAB(keys, d_bias, bq.grad.middleRows(row, d));
    SetAB(Wq.value.middleRows(row, d), d_map, d_keys);
    AddABt(bq.value.middleRows(row, d), d_bias, d_keys);
    const auto d_out = c.d_out_map.middleCols(col, K);
    AddABt(d_out, m.values.middleRows(row, d), W_out.grad.middleCols(row, d));
    SetAtB(W_out.value.middleCols(row, d), d_out, c.d_values.middleRows(row, d));
  }
  AddABt(c.d_keys, E, Wk.grad);
  AddABt(c.d_values, E, Wv.grad);
  bk.grad.col(0) += c.d_keys.rowwise().sum();
  bv.grad.col(0) += c.d_values.rowwise().sum();
  AddAtB(Wk.value, c.d_keys, dE);
  AddAtB(Wv.value, c.d_values, dE);
}

}  // namespace o2v
