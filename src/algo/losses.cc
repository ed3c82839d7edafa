#include "algo/losses.h"

#include <algorithm>

#include "algo/option_policy.h"
#include "base/check.h"
#include "dist/diag_gaussian.h"

namespace o2v {

void ClippedSurrogate(const Vec& logp, const Vec& logp_old, const Vec& adv_hat, double clip,
                      LossTerms& terms, Vec& dlogp) {
  const Index B = logp.size();
  Check(logp_old.size() == B && adv_hat.size() == B, "surrogate: got ", B, " log-probabilities, ",
        logp_old.size(), " old ones and ", adv_hat.size(), " advantages");
  const Real low = Real(1 - clip), high = Real(1 + clip), scale = Real(1) / static_cast<Real>(B);
  dlogp = (logp - logp_old).array().exp();  // the ratios, for now
  double surrogate = 0, kl = 0, outside = 0;
  for (Index b = 0; b < B; ++b) {
    const Real r = dlogp(b), A = adv_hat(b);
    const Real clipped = std::min(std::max(r, low), high);
    surrogate += static_cast<double>(std::min(r * A, clipped * A));
    kl += static_cast<double>(r - 1 - (logp(b) - logp_old(b)));
    outside += r < low || r > high;
    const bool active = A >= 0 ? r <= high : r >= low;
    dlogp(b) = active ? -scale * r * A : Real(0);
  }
  const double n = static_cast<double>(B);
  terms.surrogate = -surrogate / n;
  terms.kl = kl / n;
  terms.clip_fraction = outside / n;
}

void ValueLoss(const Vec& v, const Vec& ret, LossTerms& terms, Vec& dv) {
  Check(v.size() == ret.size(), "value loss: got ", v.size(), " values and ", ret.size(),
        " targets");
  const Real scale = Real(1) / static_cast<Real>(v.size());
  dv = v - ret;
  terms.value = 0.5 * static_cast<double>(dv.squaredNorm() * scale);
  dv *= scale;
}

// ---- With one network an option -----------------------------------------------------------------

void SampleAction(const IntraOptionPolicies& policy, const ConstMatRef& s, std::span<const int> o,
                  Rng& rng, Mat& a, ActionCache& c) {
  policy.ForwardOne(s, o, c.policy);
  SampleGaussian(c.policy.nets.out, c.policy.sigma, rng, a);
  GaussianLogProb(a, c.policy.nets.out, c.policy.sigma, c.logp);
}

void ActionLogProb(const IntraOptionPolicies& policy, const Batch& batch, ActionCache& c) {
  policy.ForwardOne(batch.s, batch.o, c.policy);
  GaussianLogProb(batch.a, c.policy.nets.out, c.policy.sigma, c.logp);
}

void ActionSurrogate(IntraOptionPolicies& policy, const Batch& batch, Fidelity density_log_eps,
                     double clip, LossTerms& terms, ActionCache& c) {
  LogDensity(density_log_eps, c.logp, c.slope);
  ClippedSurrogate(c.logp, batch.action.logp_old, batch.action.adv_hat, clip, terms, c.dlogp);
  c.dlogp.array() *= c.slope.array();
  GaussianLogProbGrad(batch.a, c.policy.nets.out, c.policy.sigma, c.dlogp, c.policy.nets.dout,
                      c.policy.dsigma);
  policy.Backward(batch.s, batch.o, c.policy);
}

void EntryValues(const Mlp& critic, const ConstMatRef& s, std::span<const int> k, Mlp::Cache& c,
                 double* v) {
  critic.Forward(s, c);
  for (Index b = 0; b < s.cols(); ++b) v[b] = double(c.out(k[std::size_t(b)], b));
}

void EntryValueLoss(Mlp& critic, const ConstMatRef& s, std::span<const int> k, const Vec& ret,
                    LossTerms& terms, ValueCache& c) {
  const Index B = s.cols();
  critic.Forward(s, c.critic);
  c.v.resize(B);
  for (Index b = 0; b < B; ++b) c.v(b) = c.critic.out(k[std::size_t(b)], b);
  ValueLoss(c.v, ret, terms, c.dv);
  c.critic.dout.setZero(c.critic.out.rows(), B);
  for (Index b = 0; b < B; ++b) c.critic.dout(k[std::size_t(b)], b) = c.dv(b);
  critic.Backward(s, c.critic);
}

}  // namespace o2v
