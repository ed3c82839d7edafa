"""Usage and duration of options over training (the paper's Figure 7), and what chance would give.

With shares u_k, an option that is drawn anew at every step, whatever the previous one, lasts
1 / (1 - u_k) steps in the mean.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from plots.inputs import Inputs
from plots.records import FIDELITIES, METHODS, MILLION, PAIRS, TASKS, Run
from plots.samples import mean_duration
from plots.style import (INK, LOOKS, Drawing, Margins, legend_above, line_of, logarithmic, main,
                         new_figure, strip, thin)

OURS = "option2vec"
OPTIONS = (("#0072b2", "o"), ("#d55e00", "s"), ("#009e73", "^"), ("#cc79a7", "D"))  # by index
CHANCE = {"color": INK, "linestyle": ":", "linewidth": 1.1}
NOTE = (
    "Left and middle: one run, the first seed, each option by its index. Dotted: 1/(1 - u), how "
    "long an option of share u lasts if options are drawn as if the previous one did not matter. "
    "Right: mean duration of an option of every method that has options, with a band of one "
    "standard deviation over seeds (no lower than one step).")


def draw(inputs: Inputs) -> list[Drawing]:
    """By fidelity a figure of the single tasks that have such records, and one of the pairs."""
    return [_figure(inputs, fidelity, tasks, name) for fidelity in FIDELITIES
            for tasks, name in ((TASKS, f"figure_7_{fidelity}"),
                                (tuple(PAIRS), f"figure_7_{fidelity}_pairs"))]


def _figure(inputs: Inputs, fidelity: str, all_tasks: Sequence[str], name: str) -> Drawing:
    known = {(key.task, key.algorithm): [r for r in cell.whole if r.usage.size]
             for key, cell in inputs.cells.items() if (key.fidelity, key.variant) == (fidelity, "")}
    known = {key: runs for key, runs in known.items() if runs}
    tasks = [t for t in all_tasks if (t, OURS) in known]
    what = f"{fidelity}{', transfer pairs' if all_tasks != TASKS else ''}"
    if not tasks:
        return Drawing(name, f"No figure of options, {what}: no records of Option2Vec have "
                       "their usage and durations.")
    figure, axes = new_figure(9.5, 1.05, len(tasks), 3, Margins(columns=0.6),
                              legend=strip(12, 6), sharex=True)
    methods: set[str] = set()
    for task, (usage, duration, mean) in zip(tasks, axes):
        run, found = known[task, OURS][0], [m for m in METHODS if (task, m) in known]
        _by_index(usage, duration, run)
        usage.set_title(f"{task}\nshare, seed {run.seed}", loc="left")
        usage.set(ylim=(0, 1), ylabel="share of steps [1]")
        duration.set_title("\nduration, chance dotted; same run", loc="left")
        duration.set_ylabel("mean duration [steps]")
        for method in found:
            _duration(mean, method, known[task, method])
        methods |= set(found)
        mean.set_title(f"\n{len(found)} of 7 methods, n = {len(known[task, OURS])}", loc="left")
        for panel in (duration, mean):
            logarithmic(panel)
    for panel in axes[-1]:
        panel.set_xlabel("environment steps [millions]")
    options = [(Line2D([], [], color=color, marker=marker, markeredgewidth=0), f"option {k}")
               for k, (color, marker) in enumerate(OPTIONS)]
    by_chance = Line2D([], [], **CHANCE), "chance, 1/(1 - u)"
    legend_above(figure, methods, *options, by_chance, ncols=6)
    return Drawing(name, f"Figure 7, {what}: usage and duration of Option2Vec's options over "
                   f"training. {NOTE}", figure)


def _by_index(usage: Axes, duration: Axes, run: Run) -> None:
    step, shares, lengths = thin(run.step) / MILLION, thin(run.usage.T), thin(run.duration.T)
    for k, (u, d) in enumerate(zip(shares, lengths)):
        color, marker = OPTIONS[k % len(OPTIONS)]
        look = {"color": color, "marker": marker, "markeredgewidth": 0, "markersize": 3,
                "markevery": (3 * k, 14), "linewidth": 1}
        usage.plot(step, u, **look)
        duration.plot(step, d, **look)
        duration.plot(step, chance(u), **CHANCE | {"color": color})


def chance(u: np.ndarray) -> np.ndarray:
    """Mean duration [steps] of an option with share u under independent draws; NaN for 0 and 1."""
    return 1 / (1 - np.where((u > 0) & (u < 1), u, np.nan))


def _duration(panel: Axes, method: str, runs: Sequence[Run]) -> None:
    step, durations = _aligned(runs, [mean_duration(run) for run in runs])
    durations = np.ma.masked_invalid(durations)
    mean, std = (x.filled(np.nan) for x in (durations.mean(axis=0), durations.std(axis=0)))
    color = LOOKS[method].color
    line = line_of(method, len(step))
    if method == OURS:
        panel.fill_between(step, np.maximum(mean - std, 1), mean + std, color=color, alpha=0.2,
                           linewidth=0)
    else:
        line |= {"markersize": 2.5, "linewidth": 0.7}
    panel.plot(step, mean, **line)


def _aligned(runs: Sequence[Run], curves: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Steps in millions and curves (runs, ..., R), from the latest first step of a record on."""
    rows = min(len(run.step) for run in runs)
    return (thin(runs[0].step[-rows:]) / MILLION,
            np.array([thin(curve[..., -rows:]) for curve in curves]))


if __name__ == "__main__":
    main(draw, __doc__)
