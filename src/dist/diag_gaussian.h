#pragma once
// Diagonal Gaussians, one per column.

#include "base/rng.h"
#include "base/types.h"

namespace o2v {

// sigma is (A, B), or (A, 1) where all columns share it; its gradient has the same shape.

/// logp (B) = sum_j -1/2 ((a_j - mu_j) / sigma_j)^2 - ln sigma_j - 1/2 ln 2 pi. Source: spec 3.1.
void GaussianLogProb(const Mat& a, const Mat& mu, const Mat& sigma, Vec& logp);

/// Adjoint dlogp (B) -> dmu (A, B), dsigma (as sigma, overwritten; summed over the batch where
/// shared). Source: spec 3.1.
void GaussianLogProbGrad(const Mat& a, const Mat& mu, const Mat& sigma, const Vec& dlogp, Mat& dmu,
                         Mat& dsigma);

/// Mean over the B columns of the entropy H = sum_j 1/2 + 1/2 ln 2 pi + ln sigma_j.
double GaussianMeanEntropy(const Mat& sigma);
/// Adds to dsigma the gradient of dH * mean(H): dH / (B' sigma), B' the columns of sigma.
void AddGaussianEntropyGrad(const Mat& sigma, Real dH, Mat& dsigma);

/// a = mu + sigma * normal; draws column by column.
void SampleGaussian(const Mat& mu, const Mat& sigma, Rng& rng, Mat& a);

}  // namespace o2v
