#include "nn/adam.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"

namespace o2v {

double GradNorm(std::span<Param* const> params) {
  double sum = 0;
  for (const Param* p : params) sum += static_cast<double>(p->grad.squaredNorm());
  return std::sqrt(sum);
}

double ClipFactor(double norm, double clip_norm) {
  return std::min(1.0, clip_norm / (norm + 1e-6));
}

Adam::Adam(std::vector<Param*> params, const Options& options)
    : params_(std::move(params)),
      options_(options),
      t_(params_.size(), 0),
      frozen_(params_.size(), 0) {
  for (const Param* p : params_) {
    m_.push_back(Mat::Zero(p->value.rows(), p->value.cols()));
    v_.push_back(m_.back());
  }
}

double Adam::Step(std::span<const char> in_graph, IdleRule idle) {
  Check(in_graph.size() == params_.size(), "Adam: got ", in_graph.size(), " flags, not ",
        params_.size());
  const Real b1 = Real(options_.beta1), b2 = Real(options_.beta2), eps = Real(options_.eps);
  // Rounded once: in floats 1 - 0.999f is 0.00100005.
  const Real c1 = Real(1 - options_.beta1), c2 = Real(1 - options_.beta2);
  const double norm = GradNorm(params_);
  const Real scale = Real(ClipFactor(norm, options_.clip_norm));
  std::int64_t corrected_t = -1;  // most tensors share one t: two powers a step, not two a tensor
  Real step = 0, root = 0;        // lr / (1 - beta1^t), 1 / sqrt(1 - beta2^t)
  for (std::size_t i = 0; i < params_.size(); ++i) {
    const bool started = t_[i] > 0;
    if (frozen_[i]) continue;
    if (!in_graph[i] && (idle == IdleRule::kSkip || !started)) continue;
    const std::int64_t t = ++t_[i];
    if (t != corrected_t) {
      corrected_t = t;
      const double td = static_cast<double>(t);
      step = Real(options_.learning_rate / (1 - std::pow(options_.beta1, td)));
      root = Real(1 / std::sqrt(1 - std::pow(options_.beta2, td)));
    }
    // One pass over the four arrays. A moment that decays below the normal numbers is set to zero:
    // its effect is below 1e-35, and arithmetic on subnormal numbers is a hundred times slower.
    constexpr Real kTiny = std::numeric_limits<Real>::min();
    Real* w = params_[i]->value.data();
    Real* g = params_[i]->grad.data();
    Real* m = m_[i].data();
    Real* v = v_[i].data();
    const Index n = params_[i]->value.size();
    for (Index k = 0; k < n; ++k) {
      const Real gk = scale * g[k];
      const Real mk = b1 * m[k] + c1 * gk;
      const Real vk = b2 * v[k] + c2 * gk * gk;
      m[k] = std::abs(mk) < kTiny ? 0 : mk;
      v[k] = vk < kTiny ? 0 : vk;
      w[k] -= step * m[k] / (std::sqrt(v[k]) * root + eps);
      g[k] = 0;
    }
  }
  return norm;
}

void Adam::Serialize(StateVisitor& visitor) {
  for (std::size_t i = 0; i < params_.size(); ++i) {
    visitor.Matrix("adam.m." + params_[i]->name, m_[i]);
    visitor.Matrix("adam.v." + params_[i]->name, v_[i]);
  }
  visitor.Counts("adam.t", t_.data(), t_.size());
}

}  // namespace o2v
