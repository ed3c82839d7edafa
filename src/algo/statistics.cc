#include "algo/statistics.h"

#include <algorithm>
#include <numeric>

namespace o2v {

namespace {

LossColumns AllColumns(const LossColumns& more) {
  LossColumns columns = {{"loss", &LossTerms::total},
                         {"surrogate", &LossTerms::surrogate},
                         {"value_loss", &LossTerms::value},
                         {"entropy", &LossTerms::entropy},
                         {"kl", &LossTerms::kl},
                         {"clip_fraction", &LossTerms::clip_fraction}};
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

}  // namespace

LossMeans::LossMeans(const LossColumns& more)
    : columns_(AllColumns(more)), sums_(columns_.size(), 0) {}

void LossMeans::Clear() {
  std::fill(sums_.begin(), sums_.end(), 0);
  grad_norm_ = 0;
  n_ = 0;
}

void LossMeans::Add(const LossTerms& terms, double grad_norm) {
  for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += terms.*columns_[i].second;
  grad_norm_ += grad_norm;
  ++n_;
}

void LossMeans::Report(std::vector<SumAndCount>& values) const {
  for (const double sum : sums_) values.push_back({sum, double(n_)});
  values.push_back({grad_norm_, double(n_)});
}

void LossMeans::Names(const std::string& stage, std::vector<std::string>& names,
                      const LossColumns& more) {
  for (const auto& [name, term] : AllColumns(more)) names.push_back(name + "_" + stage);
  names.push_back("grad_norm_" + stage);
}

void OptionUsage::Clear() {
  std::fill(executed_.begin(), executed_.end(), 0);
  std::fill(begun_.begin(), begun_.end(), 0);
}

void OptionUsage::Count(int o, int o_prev, bool init) {
  executed_[std::size_t(o)] += 1;
  begun_[std::size_t(o)] += init || o != o_prev;
}

void OptionUsage::Report(std::vector<SumAndCount>& values) const {
  const double steps = std::accumulate(executed_.begin(), executed_.end(), 0.0);
  for (const double n : executed_) values.push_back({n, steps});
  for (std::size_t k = 0; k < executed_.size(); ++k) values.push_back({executed_[k], begun_[k]});
}

void OptionUsage::Names(std::vector<std::string>& names) const {
  for (std::size_t k = 0; k < executed_.size(); ++k) names.push_back("usage_" + std::to_string(k));
  for (std::size_t k = 0; k < executed_.size(); ++k) {
    names.push_back("duration_" + std::to_string(k) + "_steps");
  }
}

}  // namespace o2v
