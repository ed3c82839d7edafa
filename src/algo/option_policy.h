#pragma once
// Option policies as vectors of probabilities: the call-and-return mixture, and the logarithms and
// entropies of vectors that need not sum to 1.

#include <span>

#include "algo/algorithm.h"

namespace o2v {

/// Added to p in ln(p + eps): spec 3.3.
inline constexpr double kLogEps = 1e-5;
/// ln(e^x + 1e-5) is x from here on, to the last bit; e^x is a float.
inline constexpr double kLargeLog = 80;

/// M.col(b) = onehot(o_b), (K, B).
void OneHot(std::span<const int> o, Mat& M);

/// Every column of P (K, B) divided by its sum: what an option is drawn with.
void NormalizeColumns(Mat& P);

/// Call-and-return option policy pi_hat (K, B), spec 3.5. pi, beta, M (K, B), M = onehot(o_prev):
///   beta_index = paper:     pi_hat_k = (1 - beta_{o'}) M_k + beta_{o'} pi_k
///   beta_index = released:  pi_hat_k = (1 - beta_k) M_k + beta_k pi_k, which need not sum to 1
/// and pi_hat = pi where init. With `paper` only beta[o'] is read.
void MixCallAndReturn(const Mat& pi, const Mat& beta, const Mat& M, std::span<const int> o_prev,
                      std::span<const char> init, Fidelity beta_index, Mat& pi_hat);
/// G = dL/dpi_hat (K, B) -> dz, db (K, B), the adjoints of the logits of pi and of beta.
void MixCallAndReturnBackward(const Mat& G, const Mat& pi, const Mat& beta, const Mat& M,
                              std::span<const int> o_prev, std::span<const char> init,
                              Fidelity beta_index, Mat& dz, Mat& db);

/// log_p (K, B), o (B) -> logp (B), the entries o_b.
void PickEntries(const Mat& log_p, std::span<const int> o, Vec& logp);
/// Mean over the batch of H = -sum_k p_k ln p_k; p, log_p (K, B).
double MeanEntropy(const Mat& p, const Mat& log_p);

/// dp = dL/dp of p = softmax(z) (K, B) -> dz_j = p_j (dp_j - sum_k p_k dp_k). Source: spec 3.4.
void SoftmaxBackward(const Mat& p, const Mat& dp, Mat& dz);

/// ln of an option probability under the switch density_log_eps:
///   released: ln(p + 1e-5);  paper: ln max(p, 1e-12), constant below the floor (spec 3.5).
class OptionLog {
 public:
  explicit OptionLog(Fidelity density_log_eps) : eps_(density_log_eps != Fidelity::kPaper) {}

  /// p (K, B) -> log_p (K, B).
  void Log(const Mat& p, Mat& log_p) const;
  /// Adjoint of p: dlogp (B) through ln p[o_b] and dH through the mean entropy -> dp (K, B),
  /// overwritten.
  void Backward(const Mat& p, std::span<const int> o, const Vec& dlogp, double dH, Mat& dp) const;

 private:
  Real Log(Real p) const;
  /// d ln / dp.
  Real Slope(Real p) const;

  bool eps_;
};

/// Log-densities under the switch density_log_eps. released: logp := ln(e^logp + 1e-5) and slope
/// (B) = p / (p + 1e-5), the derivative; paper: unchanged and ones. Source: spec 3.3.
void LogDensity(Fidelity density_log_eps, Vec& logp, Vec& slope);

}  // namespace o2v
