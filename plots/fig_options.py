"""Usage and duration of options over training (the paper's Figure 7)."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter

from plots.records import FIDELITIES, METHODS, MILLION, PAIRS, TASKS, Cell, Key, Run, load_cells
from plots.samples import mean_duration
from plots.style import LOOKS, Drawing, legend_above, line_of, main, new_figure, thin

RANKS = ("-", "--", "-.", ":")  # of the most used option, the second, ...


def draw(results: Path, experiments: Sequence[str] | None = None) -> list[Drawing]:
    """A figure a fidelity, a row a task with such records: the share of Option2Vec's options, most
    used first, since an option's number means nothing across seeds; and mean durations."""
    cells = load_cells(results, experiments)
    return [_figure(cells, fidelity) for fidelity in FIDELITIES]


def _figure(cells: Mapping[Key, Cell], fidelity: str) -> Drawing:
    known = {(key.task, key.algorithm): [r for r in cell.whole if r.usage.size]
             for key, cell in cells.items() if (key.fidelity, key.variant) == (fidelity, "")}
    known = {key: runs for key, runs in known.items() if runs}
    tasks = [t for t in TASKS + tuple(PAIRS) if (t, "option2vec") in known]
    name = f"options_{fidelity}"
    if not tasks:
        return Drawing(name, f"No figure of options, {fidelity}: no records of Option2Vec have "
                       "their usage and durations.")
    blocks = 1 if len(tasks) <= 5 else 2
    rows = -(-len(tasks) // blocks)
    figure, axes = new_figure(6.6 * blocks, 1.9 * rows + 0.9, rows, 2 * blocks)
    panels = [axes[row][2 * block:2 * block + 2] for block in range(blocks) for row in range(rows)]
    methods: set[str] = set()
    for task, (usage, duration) in zip(tasks, panels):
        runs = known[task, "option2vec"]
        _usage(usage, runs)
        usage.set(title=f"{task}\nOption2Vec, {fidelity}, n = {len(runs)}", ylim=(0, 1),
                  ylabel="share of steps [1]")
        found = [m for m in METHODS if (task, m) in known]
        for method in found:
            _duration(duration, method, known[task, method])
        methods |= set(found)
        duration.set(title=f"{task}\n{fidelity}, {len(found)} of 7 methods with options",
                     yscale="log", ylabel="mean duration [steps]")
        for axis in (duration.yaxis.set_major_formatter, duration.yaxis.set_minor_formatter):
            axis(LogFormatter(minor_thresholds=(2, 0.5)))
    for unused in panels[len(tasks):]:
        for panel in unused:
            panel.set_visible(False)
    figure.supxlabel("environment steps [millions]\nband: mean $\\pm$ one standard deviation over "
                     "the n seeds, of durations no lower than one step", fontsize=8)
    ranks = [(Line2D([], [], color=LOOKS["option2vec"].color, linestyle=line),
              f"option, rank {rank} by share") for rank, line in enumerate(RANKS, 1)]
    legend_above(figure, methods, *ranks, ncols=3)
    return Drawing(name, f"Usage of Option2Vec's options and mean duration of an "
                   f"option over training, {fidelity}.", figure)


def _usage(panel: Axes, runs: Sequence[Run]) -> None:
    ranked = [-np.sort(-np.nan_to_num(run.usage), axis=1).T for run in runs]
    step, shares = _aligned(runs, ranked)
    for rank, line in zip(range(shares.shape[1]), RANKS):
        _band(panel, step, shares[:, rank], LOOKS["option2vec"].color, 0.12)
        panel.plot(step, shares[:, rank].mean(axis=0), color=LOOKS["option2vec"].color,
                   linestyle=line)


def _duration(panel: Axes, method: str, runs: Sequence[Run]) -> None:
    step, durations = _aligned(runs, [mean_duration(run) for run in runs])
    durations = np.ma.masked_invalid(durations)
    _band(panel, step, durations, LOOKS[method].color, 0.15, least=1)
    panel.plot(step, durations.mean(axis=0), **line_of(method, len(step)))


def _aligned(runs: Sequence[Run], curves: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Steps in millions and curves (runs, ..., R), from the latest first step of a record on."""
    rows = min(len(run.step) for run in runs)
    return (thin(runs[0].step[-rows:]) / MILLION,
            np.array([thin(curve[..., -rows:]) for curve in curves]))


def _band(panel: Axes, step: np.ndarray, x: np.ndarray, color: str, alpha: float,
          least: float = 0) -> None:
    mean, std = x.mean(axis=0), x.std(axis=0)
    panel.fill_between(step, np.maximum(mean - std, least), mean + std, color=color, alpha=alpha,
                       linewidth=0)


if __name__ == "__main__":
    main(draw, __doc__)
