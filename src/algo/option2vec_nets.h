#pragma once
// The three networks of Option2Vec: option policy, action policy, option value.

#include <span>
#include <string>
#include <vector>

#include "nn/attention_block.h"
#include "nn/embedding.h"
#include "nn/init.h"
#include "nn/layer_norm.h"
#include "nn/linear.h"

namespace o2v {

/// Sizes: state, action, options, embedding, FFN, attention heads, hidden, hidden of the net of
/// first states.
struct Option2VecSizes {
  Index S, A, K, D, F, heads, h, h_start;
};

/// Option policy P(o | s, o_{t-1}; W_o): attention of a query made of (s, o_hat_{t-1}) over the
/// columns of W_o; at an episode's start the logits of a net of s alone.
///   one token:   x = LN(ReLU(W [s, o_hat_{t-1}] + b)),           z = W_z t + b_z        (spec 2.7)
///   two tokens:  x0 = LN(ReLU(W s + b)), x1 = o_hat_{t-1},       z = W_z [t0; t1] + b_z (spec 2.6)
///   t = AttentionBlock(x; W_o)
struct PolicyOverOptions {
  /// The switches that shape it.
  struct Form {
    bool two_tokens;       // o2v_query = released
    bool init_relu;        // o2v_init_relu = released: ReLU on the initial logits
    bool prev_embed_grad;  // o2v_prev_embed_grad = paper: the gradient reaches o_hat_{t-1}
  };

  Param W_o;              // (D, K)
  Linear start0, start1;  // of first states, S -> h_start -> K
  EmbeddedLinear query;   // one token: [s, o_hat] -> D
  Linear state;           // two tokens: s -> D
  LayerNorm norm;
  AttentionBlock block;
  Linear logits;  // D or 2 D -> K

  /// What a batch of B samples leaves behind; n = B or 2 B columns, state tokens first.
  struct Cache {
    AttentionBlock::Masks masks;
    Mat z, log_P, P;  // (K, B) logits, ln P, P
    Mat dz;           // (K, B) adjoint of z: the input of Backward, overwritten
    Mat relu;         // (D, B) state token before its LayerNorm
    Mat x, dx;        // (D, n) query tokens; dx: only of those that pass a gradient on
    Mat dtokens;      // (D, n)
    LayerNorm::Cache norm;
    AttentionBlock::Cache block;
    std::vector<int> start_rows;  // samples with the initial flag; they fill the first columns of
    Mat start_s, start_hidden, start_z, start_dz, start_dhidden;  // these, which are B wide
    Mat dtable;  // (D, K) adjoint of the table of `query`
  };

  PolicyOverOptions() = default;
  PolicyOverOptions(const Option2VecSizes& sizes, const Form& form, const Initialiser& init);

  /// Products of weights alone: computed anew after every step of the optimiser.
  struct Tables {
    MemoryAttention::Memory memory;
    Mat query;  // (D, K) of `query`
  };

  void Tabulate(Tables& tables) const;
  /// s (S, B), o_prev, init (B) -> c.log_P, c.P (K, B). masks null: no dropout.
  void Forward(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
               const Tables& tables, const AttentionBlock::Masks* masks, Cache& c) const;
  /// From c.dz; same arguments as Forward. Adds to the gradients.
  void Backward(const ConstMatRef& s, std::span<const int> o_prev, const Tables& tables,
                const AttentionBlock::Masks* masks, Cache& c);

  Index Tokens() const { return form_.two_tokens ? 2 : 1; }
  std::vector<Param*> Params();
  /// Those of the net of first states.
  std::vector<Param*> StartParams();

 private:
  void BackwardStart(Cache& c);

  Form form_{};
};

/// Action policy pi_a(a | s, o) = N(mu, sigma^2): mu = tanh(.), sigma = softplus(.) of a ReLU body
/// on [s, o_hat], o_hat detached. Source: spec 2.6 item 7.
struct ActionPolicyNet {
  EmbeddedLinear layer0;
  Linear layer1, mu, sigma;

  struct Cache {
    Mat h0, h1, dh0, dh1;  // (h, B)
    Mat mu, sigma;         // (A, B)
    Mat dmu, dsigma;       // (A, B) their adjoints: the input of Backward, overwritten
    Mat dtable;            // (h, K)
  };

  ActionPolicyNet() = default;
  ActionPolicyNet(const Option2VecSizes& sizes, const Initialiser& init);

  /// W_o (D, K) -> table (h, K) = W_e W_o + b, what each option adds to the first layer.
  void Tabulate(const Mat& W_o, Mat& table) const { layer0.MakeTable(W_o, table); }
  /// s (S, B), o (B) -> c.mu, c.sigma.
  void Forward(const ConstMatRef& s, std::span<const int> o, const Mat& table, Cache& c) const;
  /// From c.dmu, c.dsigma. Adds to the gradients.
  void Backward(const ConstMatRef& s, std::span<const int> o, const Mat& W_o, Cache& c);
  /// s (S, B), o (B) -> J (A, D), mean over the samples of
  ///   d mu / d o_hat = diag(1 - mu^2) W_mu diag(h1 > 0) W_1 diag(h0 > 0) W_e,
  /// W_e the part of W_0 that multiplies o_hat; 0 is the derivative at a ReLU's kink. Runs Forward.
  void MeanJacobian(const ConstMatRef& s, std::span<const int> o, const Mat& table, Cache& c,
                    MatD& J) const;

  std::vector<Param*> Params();
};

/// Option value, a ReLU body on [s, o_hat], o_hat detached.
///   scalar:    Q_O[s, o] = f([s, o_hat_o]), evaluated for every o            (o2v_critic = paper)
///   K outputs: q = f(LN([s, o_hat_fed])), of which q_k stands for option k   (o2v_critic =
///   released)
/// Source: spec 2.6 item 8, 2.7.
struct OptionValueNet {
  LayerNorm norm;         // K outputs only
  EmbeddedLinear layer0;  // scalar
  Linear layer0_full;     // K outputs: on the normalised [s, o_hat]
  Linear layer1, head;

  struct Cache {
    Mat state;  // (h, B) W_x s, then its adjoint: scalar
    Mat input;  // (S + D, B) normalised [s, o_hat]: K outputs
    LayerNorm::Cache norm;
    Mat h0, h1, dh0, dh1;  // (h, m), m = K B (sample-major) where every option is evaluated, else B
    Mat q;                 // (K, B), or (1, B) of the option fed
    Mat dq;                // its adjoint: the input of Backward
    Mat G;                 // (h, S + D) scratch
    Vec db;                // (h)
    Mat dtable;            // (h, K)
  };

  OptionValueNet() = default;
  OptionValueNet(const Option2VecSizes& sizes, bool scalar, const Initialiser& init);

  /// W_o (D, K) -> table (h, K) = W_e W_o + b, what each option adds to the first layer. Scalar
  /// form only.
  void Tabulate(const Mat& W_o, Mat& table) const {
    if (scalar_) layer0.MakeTable(W_o, table);
  }
  /// s (S, B), o (B) the option fed (K outputs only) -> c.q (K, B).
  void ForwardAll(const ConstMatRef& s, std::span<const int> o, const Mat& W_o, const Mat& table,
                  Cache& c) const;
  /// s (S, B), o (B) -> c.q (1, B) = Q_O[s, o]. Scalar form only.
  void ForwardOne(const ConstMatRef& s, std::span<const int> o, const Mat& table, Cache& c) const;
  /// From c.dq, shaped as c.q of the forward pass before. Adds to the gradients.
  void Backward(const ConstMatRef& s, std::span<const int> o, const Mat& W_o, Cache& c);

  std::vector<Param*> Params();

 private:
  void ForwardHead(Cache& c) const;

  bool scalar_ = true;
  Index K_ = 0;
};

}  // namespace o2v
