"""Statistics over seeds. A sample is an array with one value a run."""

import bisect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
POWER = 0.8  # of seeds_needed
RESAMPLES = 2000
STREAM = 2021  # seed of every bootstrap, so that an interval depends on its data only

Interval = tuple[float, float]
UNKNOWN: Interval = (math.nan, math.nan)


@dataclass(frozen=True)
class Moments:
    """Mean and standard deviation (divisor n, as in the authors' tables) of n values."""
    mean: float
    std: float
    n: int

    @staticmethod
    def of(x: Sequence[float] | np.ndarray) -> "Moments":
        return Moments(float(np.mean(x)), float(np.std(x)), len(x))

    @property
    def squared_error(self) -> float:
        """Estimated variance of the mean; infinite for one value."""
        return self.std**2 / (self.n - 1) if self.n > 1 else math.inf


@dataclass(frozen=True)
class Difference:
    """Mean of x minus mean of y, its interval and the two-sided p of Welch's test."""
    mean: float
    interval: Interval
    p: float

    @property
    def above(self) -> bool:
        """x is significantly larger."""
        return self.p < 1 - CONFIDENCE and self.mean > 0

    @property
    def below(self) -> bool:
        """x is significantly smaller."""
        return self.p < 1 - CONFIDENCE and self.mean < 0


def welch(x: Moments, y: Moments) -> Difference:
    """Welch's t test. p and interval are NaN with a sample of one."""
    mean = x.mean - y.mean
    if min(x.n, y.n) < 2:
        return Difference(mean, UNKNOWN, math.nan)
    a, b = x.squared_error, y.squared_error
    if a + b == 0:
        return Difference(mean, (mean, mean), float(mean == 0))
    dof = (a + b)**2 / (a**2 / (x.n - 1) + b**2 / (y.n - 1))  # Welch-Satterthwaite
    error = math.sqrt(a + b)
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, dof)) * error
    return Difference(mean, (mean - half, mean + half),
                      float(2 * stats.t.sf(abs(mean) / error, dof)))


def one_sample(x: Moments) -> Difference:
    """Student's t test of the mean against 0."""
    if x.n < 2:
        return Difference(x.mean, UNKNOWN, math.nan)
    error = math.sqrt(x.squared_error)
    if error == 0:
        return Difference(x.mean, (x.mean, x.mean), float(x.mean == 0))
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, x.n - 1)) * error
    return Difference(x.mean, (x.mean - half, x.mean + half),
                      float(2 * stats.t.sf(abs(x.mean) / error, x.n - 1)))


def holm(p: Sequence[float]) -> np.ndarray:
    """Holm's adjusted p: with `adjusted < 0.05` as the verdict on each, the chance of even one
    false verdict among all is below 0.05, however the tests depend on each other."""
    p = np.asarray(p, dtype=float)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)), 1)
    return adjusted


def iqm(x: np.ndarray, axis: int = -1) -> np.ndarray:
    """Mean of the middle half: value i of n sorted ones fills [i, i + 1), and [n/4, 3n/4) counts.
    The same as `option2vec summary`; a 25 % trimmed mean where 4 divides n."""
    x = np.sort(np.moveaxis(np.asarray(x, dtype=float), axis, -1), axis=-1)
    n = x.shape[-1]
    edges = np.clip(np.arange(n + 1), n / 4, 3 * n / 4)
    return x @ np.diff(edges) / (n / 2)


def improvement(x: np.ndarray, y: np.ndarray, axis: int = -1) -> np.ndarray:
    """Probability that a run of x beats one of y, ties counting half: Mann-Whitney's U / (n m)."""
    x = np.moveaxis(np.asarray(x), axis, -1)[..., :, None]
    y = np.moveaxis(np.asarray(y), axis, -1)[..., None, :]
    return ((x > y) + 0.5 * (x == y)).mean(axis=(-2, -1))


def bootstrap(statistic: Callable[..., np.ndarray], *samples: np.ndarray) -> Interval:
    """Percentile interval of statistic(*samples, axis=-1); every sample is a stratum, resampled by
    itself. NaN with a sample of one."""
    if min(len(x) for x in samples) < 2:
        return UNKNOWN
    result = stats.bootstrap(samples, statistic, n_resamples=RESAMPLES, vectorized=True, axis=-1,
                             confidence_level=CONFIDENCE, method="percentile",
                             random_state=np.random.default_rng(STREAM))
    return float(result.confidence_interval.low), float(result.confidence_interval.high)


def mean_improvement(*samples: np.ndarray, axis: int = -1) -> np.ndarray:
    """Mean over tasks of improvement; samples are x and y of the first task, of the second, ..."""
    return np.mean([improvement(x, y, axis) for x, y in zip(samples[::2], samples[1::2])], axis=0)


@dataclass(frozen=True)
class Scores:
    """Runs of one method on several tasks, each less the mean of its rival and over the size of it:
    Agarwal et al. 2021, "Deep Reinforcement Learning at the Edge of the Statistical Precipice".
    Resamples draw runs with replacement, each task's and each method's by themselves."""
    runs: tuple[np.ndarray, ...]  # of each task, (n)
    resampled: tuple[np.ndarray, ...]  # of each task, (RESAMPLES, n)

    @staticmethod
    def of(pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> "Scores":
        """pairs: by task the returns of the method and of its rival."""
        rng = np.random.default_rng(STREAM)

        def again(x: np.ndarray) -> np.ndarray:
            return x[rng.integers(len(x), size=(RESAMPLES, len(x)))]

        def score(x: np.ndarray, y: np.ndarray) -> np.ndarray:
            mean = y.mean(axis=-1, keepdims=True)
            return (x - mean) / np.abs(mean)

        return Scores(tuple(score(x, y) for x, y in pairs),
                      tuple(score(again(x), again(y)) for x, y in pairs))

    @staticmethod
    def _interval(resampled: np.ndarray) -> np.ndarray:
        tail = 50 * (1 - CONFIDENCE)
        return np.percentile(resampled, [tail, 100 - tail], axis=0)

    def means(self) -> list[tuple[float, Interval]]:
        """By task; the interval is NaN for a single run."""
        return [(float(x.mean()), tuple(self._interval(again.mean(axis=1))) if len(x) > 1
                 else UNKNOWN) for x, again in zip(self.runs, self.resampled)]

    def iqm(self) -> tuple[float, Interval]:
        """Interquartile mean of all runs of all tasks."""
        low, high = self._interval(iqm(np.concatenate(self.resampled, axis=1)))
        return float(iqm(np.concatenate(self.runs))), (float(low), float(high))

    def profile(self, thresholds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Share of the runs above each threshold, tasks counting alike, and its pointwise interval
        (2, thresholds)."""
        def share(x: np.ndarray) -> np.ndarray:
            return (x[..., None] > thresholds).mean(axis=-2)

        return (np.mean([share(x) for x in self.runs], axis=0),
                self._interval(np.mean([share(x) for x in self.resampled], axis=0)))


def seeds_needed(x: Moments, y: Moments, largest: int = 1000) -> int | None:
    """Seeds a method at which Welch's test would find this difference with 80 % power, were means
    and deviations the true ones. None for more than `largest` or where they are not known."""
    if min(x.n, y.n) < 2 or x.mean == y.mean:
        return None

    def enough(n: int) -> bool:
        a, b = x.squared_error * x.n / n, y.squared_error * y.n / n
        if a + b == 0:
            return True
        dof = (n - 1) * (a + b)**2 / (a**2 + b**2)
        critical = stats.t.ppf((1 + CONFIDENCE) / 2, dof)
        return bool(stats.nct.sf(critical, dof, abs(x.mean - y.mean) / math.sqrt(a + b)) >= POWER)

    with np.errstate(invalid="ignore"):  # scipy's nct raises the flag on the way to good values
        n = 2 + bisect.bisect_left(range(2, largest + 1), True, key=enough)
    return n if n <= largest else None
