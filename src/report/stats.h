#pragma once
// Statistics over a few runs.

#include <cstdint>
#include <span>

namespace o2v {

/// Arithmetic mean. All functions here throw Error when `x` is empty.
double Mean(std::span<const double> x);

/// Population standard deviation (divisor n), as the authors' tables have it.
double Std(std::span<const double> x);

/// Standard error of the mean, Std / sqrt(n): the band of the authors' figures.
double StdError(std::span<const double> x);

/// Interquartile mean: the mean of the middle half. A value that straddles a quartile counts by the
/// part of it inside, so that every n has one. Source: Agarwal et al. 2021, section 4.3.
double Iqm(std::span<const double> x);

struct Interval {
  double low, high;
};

/// 95 % interval of the mean by the percentile bootstrap, 10 000 resamples drawn from `seed`.
/// Source: Efron and Tibshirani 1993, section 13.3.
Interval BootstrapInterval(std::span<const double> x, std::uint64_t seed);

}  // namespace o2v
