#include "algo/option_policy.h"

#include <cmath>

#include "base/check.h"

namespace o2v {
namespace {

constexpr Real kFloor = Real(1e-12);  // spec 3.5

}  // namespace

void OneHot(std::span<const int> o, Mat& M) {
  M.setZero();
  for (std::size_t b = 0; b < o.size(); ++b) M(o[b], Index(b)) = 1;
}

void NormalizeColumns(Mat& P) {
  for (Index b = 0; b < P.cols(); ++b) P.col(b) /= P.col(b).sum();
}

void MixCallAndReturn(const Mat& pi, const Mat& beta, const Mat& M, std::span<const int> o_prev,
                      std::span<const char> init, Fidelity beta_index, Mat& pi_hat) {
  pi_hat.resize(pi.rows(), pi.cols());
  for (Index b = 0; b < pi.cols(); ++b) {
    const std::size_t i = std::size_t(b);
    const auto p = pi.col(b).array(), m = M.col(b).array(), betas = beta.col(b).array();
    if (init[i]) {
      pi_hat.col(b) = p;
    } else if (beta_index == Fidelity::kPaper) {
      const Real stop = beta(o_prev[i], b);
      pi_hat.col(b) = (1 - stop) * m + stop * p;
    } else {
      pi_hat.col(b) = (1 - betas) * m + betas * p;
    }
  }
}

void MixCallAndReturnBackward(const Mat& G, const Mat& pi, const Mat& beta, const Mat& M,
                              std::span<const int> o_prev, std::span<const char> init,
                              Fidelity beta_index, Mat& dz, Mat& db) {
  dz.resize(pi.rows(), pi.cols());
  db.setZero(pi.rows(), pi.cols());
  for (Index b = 0; b < pi.cols(); ++b) {
    const std::size_t i = std::size_t(b);
    const auto g = G.col(b).array(), p = pi.col(b).array(), m = M.col(b).array(),
               betas = beta.col(b).array();
    if (init[i]) {
      dz.col(b) = p * (g - (p * g).sum());
    } else if (beta_index == Fidelity::kPaper) {
      const Real stop = beta(o_prev[i], b);
      dz.col(b) = stop * p * (g - (p * g).sum());
      db(o_prev[i], b) = (g * (p - m)).sum() * stop * (1 - stop);
    } else {
      dz.col(b) = p * (betas * g - (betas * p * g).sum());
      db.col(b) = g * (p - m) * betas * (1 - betas);
    }
  }
}

void SoftmaxBackward(const Mat& p, const Mat& dp, Mat& dz) {
  dz.resize(p.rows(), p.cols());
  for (Index b = 0; b < p.cols(); ++b) {
    const auto pb = p.col(b).array(), d = dp.col(b).array();
    dz.col(b) = pb * (d - (pb * d).sum());
  }
}

void PickEntries(const Mat& log_p, std::span<const int> o, Vec& logp) {
  logp.resize(log_p.cols());
  for (Index b = 0; b < log_p.cols(); ++b) logp(b) = log_p(o[std::size_t(b)], b);
}

double MeanEntropy(const Mat& p, const Mat& log_p) {
  double sum = 0;
  for (Index i = 0; i < p.size(); ++i) sum -= double(p.data()[i] * log_p.data()[i]);
  return sum / double(p.cols());
}

Real OptionLog::Log(Real p) const {
  return eps_ ? std::log(p + Real(kLogEps)) : std::log(std::max(p, kFloor));
}

Real OptionLog::Slope(Real p) const {
  if (eps_) return 1 / (p + Real(kLogEps));
  return p < kFloor ? 0 : 1 / p;
}

void OptionLog::Log(const Mat& p, Mat& log_p) const {
  log_p.resize(p.rows(), p.cols());
  for (Index i = 0; i < p.size(); ++i) log_p.data()[i] = Log(p.data()[i]);
}

void OptionLog::Backward(const Mat& p, std::span<const int> o, const Vec& dlogp, double dH,
                         Mat& dp) const {
  dp.resize(p.rows(), p.cols());
  const Real w = Real(dH / double(p.cols()));
  for (Index b = 0; b < p.cols(); ++b) {
    for (Index k = 0; k < p.rows(); ++k) {
      const Real x = p(k, b);
      dp(k, b) = -w * (Log(x) + x * Slope(x));
    }
    const int taken = o[std::size_t(b)];
    dp(taken, b) += dlogp(b) * Slope(p(taken, b));
  }
}

void LogDensity(Fidelity density_log_eps, Vec& logp, Vec& slope) {
  if (density_log_eps == Fidelity::kPaper) {
    slope.setOnes(logp.size());
    return;
  }
  slope = logp;
  logp = (logp.array().exp() + Real(kLogEps)).log();
  for (Index b = 0; b < slope.size(); ++b) {
    if (slope(b) <= Real(kLargeLog) || std::isnan(slope(b))) continue;
    logp(b) = slope(b);
    slope(b) = Real(kLargeLog);
  }
  slope = slope.array().exp();
  slope = slope.array() / (slope.array() + Real(kLogEps));
}

}  // namespace o2v
