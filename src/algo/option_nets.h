#pragma once
// The networks of the methods with one network per option: intra-option policies, terminations.

#include <span>
#include <string>
#include <vector>

#include "algo/switches.h"
#include "nn/mlp.h"

namespace o2v {

/// K networks of one shape, one per option. A batch passes each sample through the network of one
/// option, at the cost of a single network, or through all K.
class PerOptionMlps {
 public:
  struct Cache {
    Mat out, dout;  // (n_out, n), n = B: column b of option o_b; or n = K B: column k B + b of
                    // option k. dout, the adjoint of out, is the input of Backward
    bool all = false;
    std::vector<int> sample;  // samples sorted by option: column i of the arrays below is sample[i]
    std::vector<Index> start;  // (K + 1) first column of each option below
    Mat s;                     // (S, B)
    Mat h0, h1, dh0, dh1;      // (h, n)
    Mat y, dy;                 // (n_out, n) out and dout, sorted
  };

  PerOptionMlps() = default;
  /// Networks named option<k>.`name`.body and option<k>.`name`.head.
  PerOptionMlps(const std::string& name, Index K, Index S, Index h, Index n_out,
                Activation activation, const Initialiser& init);

  /// s (S, B), o (B) -> cache.out (n_out, B).
  void ForwardOne(const ConstMatRef& s, std::span<const int> o, Cache& cache) const;
  /// s (S, B) -> cache.out (n_out, K B).
  void ForwardAll(const ConstMatRef& s, Cache& cache) const;
  /// From cache.dout, s as given to the forward pass. Adds to the gradients.
  void Backward(const ConstMatRef& s, Cache& cache);

  Index K() const { return Index(nets_.size()); }
  Mlp& operator[](Index k) { return nets_[std::size_t(k)]; }
  /// Option after option.
  std::vector<Param*> Params();

 private:
  void Forward(const ConstMatRef& s, Cache& cache) const;

  std::vector<Mlp> nets_;
};

/// Intra-option policies pi_k(a | s) = N(mu_k(s), sigma_k^2): mu_k = tanh(.), sigma_k =
/// softplus(rho_k) free of the state. Source: spec 2.3.
class IntraOptionPolicies {
 public:
  struct Cache {
    PerOptionMlps::Cache nets;  // nets.out is mu after its tanh, nets.dout its adjoint
    Mat sigma, dsigma;          // (A, n), column by column as nets.out
    Mat sigma_of, dsigma_of;    // (A, K) sigma_k of every option; its adjoint
  };

  IntraOptionPolicies() = default;
  IntraOptionPolicies(Index K, Index S, Index A, Index h, Activation activation,
                      const Initialiser& init);

  /// s (S, B), o (B) -> mu, sigma (A, B) of the options o.
  void ForwardOne(const ConstMatRef& s, std::span<const int> o, Cache& cache) const;
  /// s (S, B) -> mu, sigma (A, K B) of all options, option after option.
  void ForwardAll(const ConstMatRef& s, Cache& cache) const;
  /// From cache.nets.dout = dmu and cache.dsigma, overwritten. Adds to the gradients. o: as given
  /// to ForwardOne; empty after ForwardAll.
  void Backward(const ConstMatRef& s, std::span<const int> o, Cache& cache);

  /// Parameters of option k.
  std::vector<Param*> Params(Index k);

 private:
  void MakeSigma(Cache& cache) const;

  PerOptionMlps mu_;
  std::vector<Param> rho_;  // (A, 1) each
};

/// The network of PPOC, OC, AHP+PPO, IOPG and DAC+PPO: master policy, critic, and of each option an
/// intra-option policy and a termination. The critic's body carries two heads, q (K) and u (K + 1);
/// a method uses one, the other counts only. Source: spec 2.3.
struct OptionNets {
  enum class CriticHead { kQ, kU };

  Mlp master, critic;
  Linear idle_head;  // the critic's head that the method does not use
  IntraOptionPolicies policy;
  PerOptionMlps beta;  // logits b_k of the terminations

  OptionNets() = default;
  OptionNets(Index K, Index S, Index A, Index h, Activation activation, CriticHead head,
             const Initialiser& init);

  /// Terminations, beta_k = sigmoid(b_k).
  struct BetaCache {
    PerOptionMlps::Cache nets;
    Mat beta, db;  // (K, B); db, the adjoint of the logits, is the input of BackwardBeta
  };
  /// s (S, B) -> c.beta: of all options, or with `all` = false of option o_b alone, the rest 0.
  void Beta(const ConstMatRef& s, std::span<const int> o, bool all, BetaCache& c) const;
  /// From c.db; arguments as given to Beta. Adds to the gradients.
  void BackwardBeta(const ConstMatRef& s, std::span<const int> o, BetaCache& c);

  /// The call-and-return process at B states: a master policy pi(. | s) chooses when option o' has
  /// terminated.
  struct CallAndReturnCache {
    Mlp::Cache master;  // out is the logits z
    BetaCache beta;     // of o', or of all options
    Mat log_pi, pi;     // (K, B)
    Mat M, pi_hat;      // (K, B) onehot(o'), the mixture of both
  };
  /// s (S, B) -> c.pi, c.log_pi.
  void Master(const ConstMatRef& s, CallAndReturnCache& c) const;
  /// s (S, B), o_prev (B) -> c.beta, as `beta_index` asks, and c.M.
  void BetaAndMask(const ConstMatRef& s, std::span<const int> o_prev, Fidelity beta_index,
                   CallAndReturnCache& c) const;
  /// BetaAndMask, and c.pi_hat of spec 3.5, the mixture with pi (K, B): c.pi, or what chooses in
  /// place of the master policy.
  void CallAndReturn(const ConstMatRef& s, std::span<const int> o_prev, std::span<const char> init,
                     const Mat& pi, Fidelity beta_index, CallAndReturnCache& c) const;

  /// All in the order of the network; those without the idle head.
  std::vector<Param*> Params();
  std::vector<Param*> UsedParams();
};

}  // namespace o2v
