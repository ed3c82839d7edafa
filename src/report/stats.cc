#include "report/stats.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/check.h"
#include "base/rng.h"

namespace o2v {
namespace {

double Quantile(const std::vector<double>& sorted, double p) {
  const double at = p * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  const std::size_t next = std::min(i + 1, sorted.size() - 1);
  return std::lerp(sorted[i], sorted[next], at - static_cast<double>(i));
}

}  // namespace

double Mean(std::span<const double> x) {
  Check(!x.empty(), "a mean needs at least one value");
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

double Std(std::span<const double> x) {
  const double mean = Mean(x);
  double sum = 0;
  for (const double value : x) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

double StdError(std::span<const double> x) {
  return Std(x) / std::sqrt(static_cast<double>(x.size()));
}

double Iqm(std::span<const double> x) {
  Check(!x.empty(), "an interquartile mean needs at least one value");
  std::vector<double> sorted(x.begin(), x.end());
  std::sort(sorted.begin(), sorted.end());
  // Value i fills [i, i + 1) of an axis of length n; the middle half of the axis counts.
  const double n = static_cast<double>(sorted.size()), low = n / 4, high = 3 * n / 4;
  double sum = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const double begin = std::max(static_cast<double>(i), low);
    const double end = std::min(static_cast<double>(i + 1), high);
    sum += sorted[i] * std::max(end - begin, 0.0);
  }
  return sum / (high - low);
}

Interval BootstrapInterval(std::span<const double> x, std::uint64_t seed) {
  Check(!x.empty(), "a bootstrap needs at least one value");
  constexpr int kResamples = 10000;
  Rng rng(seed, "bootstrap");
  std::vector<double> means(kResamples);
  for (double& mean : means) {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += x[rng.UniformInt(x.size())];
    mean = sum / static_cast<double>(x.size());
  }
  std::sort(means.begin(), means.end());
  return {Quantile(means, 0.025), Quantile(means, 0.975)};
}

}  // namespace o2v
