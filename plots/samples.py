"""What is known of a method on a task, in one form for our records and the authors' logs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from plots.records import METHODS, MILLION, PAIRS, Cell, Key, Run, finite, read_table
from plots.statistics import Moments

GRID = 10_000  # [environment steps] of the records
TENTH = 0.1  # of a run: the windows that gain and durations compare


@dataclass(frozen=True)
class Curve:
    """Mean and standard deviation (divisor n) over n runs of the smoothed return."""
    step: np.ndarray
    mean: np.ndarray
    std: np.ndarray
    n: int

    def at(self, step: int) -> Moments:
        """Interpolated."""
        return Moments(float(np.interp(step, self.step, self.mean)),
                       float(np.interp(step, self.step, self.std)), self.n)

    def window(self, begin: float, end: float) -> Moments:
        """Mean over begin < step <= end (parts of the last step). Its deviation over runs is not
        known: given is the mean one of the points, which is an upper bound."""
        rows = _window(self.step, begin, end)
        return Moments(float(self.mean[rows].mean()), float(self.std[rows].mean()), self.n)


@dataclass(frozen=True)
class Sample:
    """Returns are means of 20 training episodes. Of a pair: final is the end of the second task."""
    horizon: int  # [environment steps] that the experiment asks for
    step: int  # of final: less than the horizon in a shortened run
    final: np.ndarray  # return at `step`, one a run
    first: np.ndarray  # of a pair: return at the end of the first task, one a run
    curve: Curve
    area: Moments  # mean return over all steps
    gain: Moments  # mean return in the last tenth of the steps less that in the tenth before
    progress: float  # mean return in the last tenth less the first value
    durations: np.ndarray  # (2, runs) [steps] mean duration of an option, first and last tenth
    diverged: int = 0
    older: int = 0  # runs of older revisions, left out
    # Of each run: standard deviation of the return's change from a grid step to the next in the
    # second half of the steps, and persistence (of a run with options).
    jumps: np.ndarray = field(default_factory=lambda: np.empty(0))
    persistence: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def moments(self) -> Moments:
        return Moments.of(self.final)

    @property
    def shortened(self) -> bool:
        return self.step < self.horizon


Samples = Mapping[tuple[str, str], Sample]  # by task or pair, and method


def horizon_of(task: str) -> int:
    """[environment steps] of a whole run."""
    return 2 * MILLION if task in PAIRS else MILLION


def our_samples(cells: Mapping[Key, Cell], fidelity: str, variant: str = "") -> Samples:
    """Of our records. Diverged and too short runs have no return and are left out."""
    return {(key.task, key.algorithm): _of_runs(key.task, cell) for key, cell in cells.items()
            if (key.fidelity, key.variant) == (fidelity, variant) and cell.whole}


def mean_duration(run: Run) -> np.ndarray:
    """(R) [steps] at each grid step: steps by executions of options, those of all options
    together; NaN where nothing is known."""
    known = (run.usage > 0) & (run.duration > 0)
    usage = np.where(known, run.usage, 0)
    executions = usage / np.where(known, run.duration, 1)  # a step
    total = executions.sum(axis=1)
    return np.divide(usage.sum(axis=1), total, out=np.full(len(total), np.nan), where=total > 0)


def persistence(run: Run) -> float:
    """Mean duration of an option over the one of independent draws with the same shares, where an
    option lasts 1 / (1 - sum of u_k^2) steps in the mean; both pooled over the last tenth of the
    steps. NaN where nothing is known, as of one option alone."""
    late = run.step > (1 - TENTH) * run.wanted
    mean, u = mean_duration(run)[late], np.nan_to_num(run.usage[late])
    alike = (u**2).sum(axis=1)  # chance that two independent draws are the same
    known = ~np.isnan(mean) & (alike < 1 - 1e-9)
    if not known.any():
        return math.nan
    return float(_pooled(mean[known]) / _pooled(1 / (1 - alike[known])))


def _of_runs(task: str, cell: Cell) -> Sample:
    horizon = horizon_of(task)
    step = min(cell.wanted, horizon)
    grid = np.arange(GRID, step + 1, GRID)
    if not len(grid) or grid[-1] < step:
        grid = np.append(grid, step)
    # Left of a run's first value that value is held, as in the authors' curves.
    rows = [np.maximum(np.searchsorted(run.step, grid, side="right") - 1, 0) for run in cell.whole]
    returns = np.array([run.ret[row] for run, row in zip(cell.whole, rows)])
    late, before = _window(grid, 1 - TENTH, 1), _window(grid, 1 - 2 * TENTH, 1 - TENTH)
    gains = returns[:, late].mean(axis=1) - returns[:, before].mean(axis=1)
    first = [run.return_at(step // 2) for run in cell.whole] if task in PAIRS else []
    return Sample(
        horizon, step, returns[:, -1], np.array([x for x in first if x is not None]),
        Curve(grid, returns.mean(axis=0), returns.std(axis=0), len(returns)),
        Moments.of(returns.mean(axis=1)), Moments.of(gains),
        float(returns[:, late].mean() - returns[:, 0].mean()),
        _durations(cell.whole), cell.diverged, cell.older,
        np.diff(returns[:, grid > grid[-1] / 2]).std(axis=1) if len(grid) > 4 else np.empty(0),
        np.array([x for x in map(persistence, cell.whole) if not math.isnan(x)]))


def _window(grid: np.ndarray, begin: float, end: float) -> np.ndarray:
    """The last row alone where the grid is too coarse."""
    rows = (grid > begin * grid[-1]) & (grid <= end * grid[-1])
    return rows if rows.any() else grid == grid[-1]


def _durations(runs: tuple[Run, ...]) -> np.ndarray:
    pairs = []
    for run in runs:
        mean = mean_duration(run)
        known = ~np.isnan(mean)
        early = mean[known & (run.step <= TENTH * run.wanted)]
        late = mean[known & (run.step > (1 - TENTH) * run.wanted)]
        if len(early) and len(late):
            pairs.append((_pooled(early), _pooled(late)))
    return np.array(pairs).reshape(-1, 2).T


def _pooled(mean: np.ndarray) -> float:
    """Steps by executions over rows of equally many steps: the harmonic mean of the rows' own."""
    return len(mean) / (1 / mean).sum()


def author_samples(reference: Path) -> Samples:
    """Of the authors' logs: the runs of their figures, see results/reference/README.md (the second
    set of Option2Vec goes by another name). Curves are known as mean and deviation only, so that
    the deviations of area and gain are upper bounds."""
    single = read_table(reference / "single_task_runs.csv", {
        "suite": str, "env": str, "algorithm": str, "embed_dim": str, "run": str,
        "steps_logged": int, "return_at_1M": finite, "return_last": finite})
    transfer = read_table(reference / "transfer_runs.csv", {
        "pair": str, "first_task": str, "second_task": str, "algorithm": str, "embed_dim": str,
        "run": str, "return_task1_end": finite, "return_task2_end": finite, "steps_logged": int})
    ends: dict[tuple[str, str], list[tuple[float, float]]] = {}  # first, final
    for row in single:
        ends.setdefault((row["env"], row["algorithm"]), []).append((0, row["return_at_1M"]))
    for row in transfer:
        ends.setdefault((row["pair"], row["algorithm"]), []).append(
            (row["return_task1_end"], row["return_task2_end"]))
    points: dict[tuple[str, str], list[tuple[float, ...]]] = {}
    for file, name in (("single_task_curves.csv", "env"), ("transfer_curves.csv", "pair")):
        for row in read_table(reference / file, {name: str, "algorithm": str, "step": int,
                                                 "mean": finite, "std": finite, "n": int}):
            if row["step"] <= horizon_of(row[name]):
                points.setdefault((row[name], row["algorithm"]), []).append(
                    (row["step"], row["mean"], row["std"], row["n"]))
    ids = {name: method for method, name in METHODS.items()}
    return {(task, ids[name]): _of_authors(task, np.array(pairs), np.array(points[task, name]))
            for (task, name), pairs in sorted(ends.items()) if name in ids}


def original_code(reference: Path) -> dict[str, tuple[Moments, Moments]]:
    """By task, of the runs of the authors' own code on our simulator that went to one million
    steps: the return there, and the mean return of the updates until there."""
    path = reference / "original_code" / "runs.csv"
    runs: dict[tuple[str, int], list[tuple[int, float]]] = {}
    for row in read_table(path, {"env": str, "seed": int, "step": int, "return_20": finite}
                          | {f"usage_{k}": finite for k in range(4)}) if path.is_file() else ():
        runs.setdefault((row["env"], row["seed"]), []).append((row["step"], row["return_20"]))
    returns: dict[str, list[np.ndarray]] = {}
    for (task, _), points in sorted(runs.items()):
        if points[-1][0] >= MILLION:
            returns.setdefault(task, []).append(np.array([r for s, r in points if s <= MILLION]))
    return {task: (Moments.of(np.array([r[-1] for r in rows])),
                   Moments.of(np.array([r.mean() for r in rows])))
            for task, rows in returns.items()}


def _of_authors(task: str, ends: np.ndarray, points: np.ndarray) -> Sample:
    horizon = horizon_of(task)
    curve = Curve(points[:, 0], points[:, 1], points[:, 2], int(points[0, 3]))
    late, before = curve.window(1 - TENTH, 1), curve.window(1 - 2 * TENTH, 1 - TENTH)
    return Sample(
        horizon, horizon, ends[:, 1], ends[:, 0] if task in PAIRS else np.array([]), curve,
        curve.window(0, 1), Moments(late.mean - before.mean, late.std + before.std, curve.n),
        late.mean - float(curve.mean[0]), np.empty((2, 0)))
