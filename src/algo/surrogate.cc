#include "algo/surrogate.h"

#include "base/check.h"

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

void LossMeans::Add(const LossTerms& terms, double grad_norm) {
  sum_.total += terms.total;
  sum_.surrogate += terms.surrogate;
  sum_.value += terms.value;
  sum_.entropy += terms.entropy;
  sum_.kl += terms.kl;
  sum_.clip_fraction += terms.clip_fraction;
  grad_norm_ += grad_norm;
  ++n_;
}

void LossMeans::Report(std::vector<double>& stats) const {
  const double n = n_;
  for (const double x : {sum_.total, sum_.surrogate, sum_.value, sum_.entropy, sum_.kl,
                         sum_.clip_fraction, grad_norm_}) {
    stats.push_back(x / n);
  }
}

void LossMeans::Names(const std::string& stage, std::vector<std::string>& names) {
  for (const char* term :
       {"loss", "surrogate", "value_loss", "entropy", "kl", "clip_fraction", "grad_norm"}) {
    names.push_back(std::string(term) + "_" + stage);
  }
}

}  // namespace o2v
