#include "algo/losses.h"
#include "dist/categorical.h"
#include "dist/diag_gaussian.h"
#include "gradcheck/checks.h"
#include "random_mat.h"

namespace o2v {
namespace {

constexpr Index kB = 8;

Comparison CheckCategoricalLogProb() {
  Rng rng(11, "gradcheck.categorical");
  Mat z = RandomMat(4, kB, rng), log_P, P, dz = Mat::Zero(4, kB);
  const std::vector<int> o = RandomOptions(std::size_t(kB), 4, rng);
  const Vec dlogp = RandomMat(kB, 1, rng);
  const auto loss = [&] {
    LogSoftmax(z, log_P, P);
    double sum = 0;
    for (Index b = 0; b < kB; ++b) sum += dlogp(b) * log_P(o[std::size_t(b)], b);
    return sum;
  };
  loss();
  AddLogProbGrad(P, o, dlogp, dz);
  return Compare({{"z", z, dz, loss}}, rng);
}

Comparison CheckCategoricalEntropy() {
  Rng rng(12, "gradcheck.categorical");
  Mat z = RandomMat(4, kB, rng), log_P, P, dz = Mat::Zero(4, kB);
  Vec H;
  const double dH = 0.7;
  const auto loss = [&] {
    LogSoftmax(z, log_P, P);
    CategoricalEntropy(log_P, P, H);
    return dH * H.sum();
  };
  loss();
  AddEntropyGrad(log_P, P, H, dH, dz);
  return Compare({{"z", z, dz, loss}}, rng);
}

Comparison CheckGaussianLogProb(bool shared) {
  Rng rng(13, "gradcheck.gaussian");
  const Mat a = RandomMat(3, kB, rng);
  Mat mu = RandomMat(3, kB, rng), dmu, dsigma;
  Mat sigma = (0.3 * RandomMat(3, shared ? 1 : kB, rng)).array().exp();
  const Vec dlogp = RandomMat(kB, 1, rng);
  Vec logp;
  const auto loss = [&] {
    GaussianLogProb(a, mu, sigma, logp);
    return logp.dot(dlogp);
  };
  GaussianLogProbGrad(a, mu, sigma, dlogp, dmu, dsigma);
  return Compare({{"mu", mu, dmu, loss}, {"sigma", sigma, dsigma, loss}}, rng);
}

Comparison CheckGaussianEntropy(bool shared) {
  Rng rng(14, "gradcheck.gaussian");
  Mat sigma = (0.3 * RandomMat(3, shared ? 1 : kB, rng)).array().exp();
  Mat dsigma = Mat::Zero(sigma.rows(), sigma.cols());
  const double dH = 0.7;
  const auto loss = [&] { return dH * GaussianMeanEntropy(sigma); };
  AddGaussianEntropyGrad(sigma, dH, dsigma);
  return Compare({{"sigma", sigma, dsigma, loss}}, rng);
}

/// Both signs of the advantage on both sides of both clip edges.
Comparison CheckClippedSurrogate() {
  Rng rng(15, "gradcheck.surrogate");
  Vec logp = RandomMat(kB, 1, rng), ratio(kB), adv_hat(kB), dlogp;
  ratio << 0.7, 0.9, 1.1, 1.3, 0.7, 0.9, 1.1, 1.3;
  adv_hat << 0.5, 1, 1.5, 2, -0.5, -1, -1.5, -2;
  const Vec logp_old = logp.array() - ratio.array().log();
  LossTerms terms;
  Vec scratch;
  const auto loss = [&] {
    ClippedSurrogate(logp, logp_old, adv_hat, 0.2, terms, scratch);
    return terms.surrogate;
  };
  ClippedSurrogate(logp, logp_old, adv_hat, 0.2, terms, dlogp);
  return Compare({{"logp", logp, dlogp, loss}}, rng);
}

Comparison CheckValueLoss() {
  Rng rng(16, "gradcheck.value_loss");
  Vec v = RandomMat(kB, 1, rng), dv, scratch;
  const Vec ret = RandomMat(kB, 1, rng);
  LossTerms terms;
  const auto loss = [&] {
    ValueLoss(v, ret, terms, scratch);
    return terms.value;
  };
  ValueLoss(v, ret, terms, dv);
  return Compare({{"v", v, dv, loss}}, rng);
}

}  // namespace

std::vector<NamedCheck> DistChecks() {
  return {
      {"categorical log_prob", CheckCategoricalLogProb},
      {"categorical entropy", CheckCategoricalEntropy},
      {"gaussian log_prob", [] { return CheckGaussianLogProb(false); }},
      {"gaussian log_prob shared sigma", [] { return CheckGaussianLogProb(true); }},
      {"gaussian entropy", [] { return CheckGaussianEntropy(false); }},
      {"gaussian entropy shared sigma", [] { return CheckGaussianEntropy(true); }},
      {"clipped_surrogate", CheckClippedSurrogate},
      {"value_loss", CheckValueLoss},
  };
}

}  // namespace o2v
