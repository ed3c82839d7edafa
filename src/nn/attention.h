#pragma once
// Multi-head attention over a small memory that the whole batch shares.

#include <string>
#include <vector>

#include "nn/init.h"
#include "nn/param.h"

namespace o2v {

/// y = W_out c + b_out, c = concat over heads h of sum_j alpha_hj v_hj, alpha_h = softmax_j(q_h .
/// k_hj / sqrt(D / H)), q = W_q x + b_q, k = W_k E + b_k, v = W_v E + b_v, memory E (D, K).
///
/// As keys and values do not depend on the sample, the maps of a query to its scores and of its
/// weights to the output are products of weights only, made once while the weights stand:
///   score_map_h = W_qh^T k_h / sqrt(D/H),   out_map_h = W_out,h v_h        (D, K) a head,
/// so a query costs 2 D H K multiplications rather than 2 D^2 + 2 D K. Exact.
/// Source: spec 2.6 item 5, 3.6; Vaswani et al. 2017.
struct MemoryAttention {
  Param Wq, bq, Wk, bk, Wv, bv;  // (D, D), (D, 1)
  Param W_out, b_out;            // (D, D), (D, 1)
  Index heads = 1;

  /// What follows from the weights and the memory alone.
  struct Memory {
    Mat keys, values;        // (D, K)
    Mat score_map, out_map;  // (D, H K), column h K + j
    Mat score_bias;          // (H K, 1)
  };
  struct Cache {
    Mat alpha;                                     // (H K, B) attention weights
    Mat alpha_dropped;                             // the same after dropout
    Mat d_alpha;                                   // (H K, B) scratch of Backward
    Mat d_score_map, d_out_map, d_keys, d_values;  // scratch, as in Memory
    Mat d_score_bias;
  };

  MemoryAttention() = default;
  /// `name`.in.Wq, .Wk, .Wv, .bq, .bk, .bv, `name`.out.W, .b; n_heads divides D.
  MemoryAttention(const std::string& name, Index D, Index n_heads);
  /// In-projections Xavier over the whole (3D, D) block, out-projection Xavier, biases 0.
  void Init(const Initialiser& init);

  /// E (D, K) -> memory.
  void Project(const Mat& E, Memory& memory) const;
  /// x (D, B) -> y (D, B). mask (H K, B) multiplies the attention weights; null: none.
  void Forward(const ConstMatRef& x, const Memory& memory, const Mat* mask, Cache& cache,
               MatRef y) const;
  /// dy (D, B) -> dx (D, n), of the first n samples; adds to the gradients and to dE (D, K).
  void Backward(const ConstMatRef& x, const Mat& E, const Memory& memory, const Mat* mask,
                Cache& cache, const ConstMatRef& dy, MatRef dx, Mat& dE);

  std::vector<Param*> Params();
};

}  // namespace o2v
