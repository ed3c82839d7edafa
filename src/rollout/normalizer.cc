#include "rollout/normalizer.h"

#include "base/check.h"

namespace o2v {

Normalizer::Normalizer(Index size)
    : mean_(VecD::Zero(size)), var_(VecD::Ones(size)), inv_std_((var_.array() + 1e-8).rsqrt()) {}

void Normalizer::Update(const MatD& x) {
  Check(x.rows() == mean_.size(), "normalizer: got ", x.rows(), " rows, not ", mean_.size());
  const double n_batch = static_cast<double>(x.cols()), n = count_ + n_batch;
  for (Index i = 0; i < mean_.size(); ++i) {
    const double mean_batch = x.row(i).mean();
    const double var_batch = (x.row(i).array() - mean_batch).square().mean();
    const double delta = mean_batch - mean_(i);
    mean_(i) += delta * n_batch / n;
    var_(i) = (var_(i) * count_ + var_batch * n_batch + delta * delta * count_ * n_batch / n) / n;
  }
  count_ = n;
  inv_std_ = (var_.array() + 1e-8).sqrt().inverse();
}

void Normalizer::Apply(const Eigen::Ref<const VecD>& x, Eigen::Ref<Vec> out) const {
  out = ((x - mean_).array() * inv_std_.array()).cwiseMax(-10).cwiseMin(10).cast<Real>();
}

void Normalizer::Set(const VecD& mean, const VecD& var, double count) {
  Check(mean.size() == mean_.size() && var.size() == var_.size(), "normalizer: got ", mean.size(),
        " and ", var.size(), " entries, not ", mean_.size());
  mean_ = mean;
  var_ = var;
  count_ = count;
  inv_std_ = (var_.array() + 1e-8).sqrt().inverse();
}

void Normalizer::Serialize(StateVisitor& v) {
  v.Doubles("normalizer.mean", mean_);
  v.Doubles("normalizer.var", var_);
  v.Double("normalizer.count", count_);
  Check((var_.array() >= 0).all(), "normalizer.var has a negative entry");
  Check(count_ >= 0, "normalizer.count is ", count_);
  inv_std_ = (var_.array() + 1e-8).sqrt().inverse();
}

}  // namespace o2v
