#pragma once
// One post-norm transformer decoder block without self-attention.

#include <string>
#include <vector>

#include "nn/attention.h"
#include "nn/layer_norm.h"
#include "nn/linear.h"

namespace o2v {

/// y = LN2(x + drop(MHA(x, E, E))),  t = LN_final(LN3(y + drop(L2 drop(ReLU(L1 y))))).
/// Source: spec 2.6 item 5. Every column (sample and token) passes with the same weights.
struct AttentionBlock {
  MemoryAttention attention;
  LayerNorm ln2, ln3, ln_final;
  Linear ffn0, ffn1;  // D -> F -> D

  /// Kept dropout masks, entries 0 or 1/(1-p), for n columns.
  struct Masks {
    Mat attention;        // (H K, n)
    Mat after_attention;  // (D, n)
    Mat inside_ffn;       // (F, n)
    Mat after_ffn;        // (D, n)
    void Resize(Index HK, Index D, Index F, Index n);
    void Draw(double p, Rng& rng);
  };
  struct Cache {
    MemoryAttention::Cache attention;
    LayerNorm::Cache ln2, ln3, ln_final;
    Mat y, hidden, out;  // (D, n), (F, n), (D, n): after LN2, inside the FFN, the block's output
    Mat d_out, d_y, d_hidden;  // scratch of Backward
  };

  AttentionBlock() = default;
  /// `attention_name`.*, `name`.ln2, .ffn.0, .ffn.1, .ln3, .ln_final.
  AttentionBlock(const std::string& attention_name, const std::string& name, Index D, Index heads,
                 Index F);
  /// Xavier weights; FFN biases U(+-1/sqrt(fan_in)); the rest 0. Source: spec 2.6 item 5.
  void Init(const Initialiser& init);

  /// x (D, n) -> cache.out (D, n). masks null: no dropout.
  void Forward(const ConstMatRef& x, const MemoryAttention::Memory& memory, const Masks* masks,
               Cache& cache) const;
  /// dout (D, n), overwritten -> dx (D, m), of the first m samples; adds to the gradients and to
  /// dE (D, K).
  void Backward(const ConstMatRef& x, const Mat& E, const MemoryAttention::Memory& memory,
                const Masks* masks, Cache& cache, Mat& dout, MatRef dx, Mat& dE);

  std::vector<Param*> Params();
};

}  // namespace o2v
