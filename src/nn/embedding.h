#pragma once
// Option embeddings W_o (D, K) as inputs: gathered columns, and affine maps of [x, o_hat].

#include <span>
#include <string>
#include <vector>

#include "nn/param.h"

namespace o2v {

/// out.col(b) = E.col(o[b]); E (D, K), o (B) in [0, K) -> out (D, B).
void GatherColumns(const Mat& E, std::span<const int> o, MatRef out);
/// dE.col(o[b]) += d.col(b): the backward of GatherColumns.
void ScatterColumns(const ConstMatRef& d, std::span<const int> o, Mat& dE);

/// Affine map y = W [x; E_o] + b of a state and the embedding of an option. Only K different
/// columns E_o exist, so W = [W_x, W_e] is split: y = W_x x + (W_e E + b)_o, and the second term is
/// a table of K columns, made once while the weights stand. Exact, at S / (S + D) of the cost.
struct EmbeddedLinear {
  Param W;  // (n_out, n_x + D)
  Param b;  // (n_out, 1)

  EmbeddedLinear() = default;
  /// Names `name`.W and `name`.b; all zero.
  EmbeddedLinear(const std::string& name, Index n_x, Index n_embedding, Index n_out)
      : W(name + ".W", n_out, n_x + n_embedding), b(name + ".b", n_out, 1), n_x_(n_x) {}

  /// E (D, K) -> table (n_out, K) = W_e E + b.
  void MakeTable(const Mat& E, Mat& table) const;
  /// x (n_x, B) -> y = W_x x (n_out, B), the part that the option does not touch.
  void MultiplyState(const ConstMatRef& x, MatRef y) const;

  /// dy (n_out, B) for samples x (n_x, B): adds to the columns of W.grad that belong to x.
  void AddStateGrad(const ConstMatRef& x, const ConstMatRef& dy);
  /// dtable (n_out, K), dy summed over the samples that used each option: adds to the rest of
  /// W.grad, to b.grad and, unless null, to dE (D, K).
  void AddTableGrad(const Mat& E, const Mat& dtable, Mat* dE);

  std::vector<Param*> Params() { return {&W, &b}; }

 private:
  Index n_x_ = 0;
};

}  // namespace o2v
