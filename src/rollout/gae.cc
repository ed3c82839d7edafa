#include "rollout/gae.h"

#include <cmath>

#include "base/check.h"

namespace o2v {

void Gae(const MatD& r, const MatD& mask, const MatD& v, double gamma, double lambda, MatD& adv,
         MatD& ret) {
  const Index N = r.rows(), T = r.cols();
  Check(mask.rows() == N && mask.cols() == T && v.rows() == N && v.cols() == T + 1, "GAE: got r (",
        N, ", ", T, "), mask (", mask.rows(), ", ", mask.cols(), "), v (", v.rows(), ", ", v.cols(),
        ")");
  adv.resize(N, T);
  ret.resize(N, T);
  for (Index i = 0; i < N; ++i) {
    double A = 0, R = v(i, T);
    for (Index t = T - 1; t >= 0; --t) {
      const double m = mask(i, t);
      const double delta = r(i, t) + gamma * m * v(i, t + 1) - v(i, t);
      A = delta + gamma * lambda * m * A;
      R = r(i, t) + gamma * m * R;
      adv(i, t) = A;
      ret(i, t) = R;
    }
  }
}

void NormalizeAdvantages(const MatD& adv, double std_eps, Vec& adv_hat) {
  const double n = static_cast<double>(adv.size());
  Check(adv.size() > 1, "advantages: got ", adv.size(), ", not at least 2");
  const double mean = adv.mean();
  const double std = std::sqrt((adv.array() - mean).square().sum() / (n - 1));
  adv_hat.resize(adv.size());
  for (Index i = 0; i < adv.size(); ++i) {
    adv_hat(i) = static_cast<Real>((adv.data()[i] - mean) / (std + std_eps));
  }
}

}  // namespace o2v
