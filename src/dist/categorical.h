#pragma once
// Categorical distributions, one per column.

#include <span>
#include <vector>

#include "base/rng.h"
#include "base/types.h"

namespace o2v {

/// Logits z (K, B) -> log_P, P (K, B): log_P = z - logsumexp(z), P = softmax(z).
void LogSoftmax(const ConstMatRef& z, Mat& log_P, Mat& P);

/// H (B) = -sum_k P_k ln P_k.
void CategoricalEntropy(const Mat& log_P, const Mat& P, Vec& H);

/// Adds to dz (K, B) the gradient through ln P[o_b] with adjoint dlogp (B): dz_j += dlogp (delta_jo
/// - P_j). Source: spec 3.4.
void AddLogProbGrad(const Mat& P, std::span<const int> o, const Vec& dlogp, Mat& dz);
/// Adds the gradient through the entropies with adjoint dH, the same for all: dz_j -= dH P_j (ln
/// P_j + H). Source: spec 3.4.
void AddEntropyGrad(const Mat& log_P, const Mat& P, const Vec& H, Real dH, Mat& dz);

/// o[b] ~ P.col(b), normalised by its sum; one uniform draw a column.
void SampleCategorical(const ConstMatRef& P, Rng& rng, std::span<int> o);

}  // namespace o2v
