"""Panels of learning curves: tasks by sources (paper, released, the authors' logs).

Option2Vec, the best of its rivals and joined methods stand out: thick, with a band. The others are
thin. Beyond the last step each method's end point has an interval.
"""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from plots.records import GRID_METHODS, MILLION
from plots.samples import Sample, Samples
from plots.statistics import one_sample
from plots.style import (GREY, INK, LOOKS, METHODS, Margins, legend_above, line_of, new_figure,
                         strip, thin)

OURS = "option2vec"
BEHIND = {"color": GREY, "linestyle": "--", "zorder": 1}  # the authors' line
TITLES = {"paper": "ours, paper", "released": "ours, released", "authors": "authors' logs"}
NOTE = (
    "Return: mean of the last 20 training episodes. Option2Vec and the best rival (highest mean at "
    "the end) are thick, with a band of one standard deviation over the n seeds; right of the "
    "curves, the mean of every method at the end with its 95 % interval (t), cut where it leaves "
    "the panel. Dashed grey: the authors' Option2Vec. The authors shade std/√n in their figures, "
    "where the paper's text says standard deviation.")
MARGIN, SPACING = 0.05, 0.03  # of the end points, as parts of the last step


def draw_curves(tasks: Sequence[str], methods: Sequence[str], sources: Mapping[str, Samples],
                behind: Mapping[str, Sample], blocks: int = 1) -> Figure:
    """A row a task, a column a source; with `blocks`, so many tasks beside each other. Behind our
    curves, in grey, the authors' of each task in `behind`."""
    rows, columns = -(-len(tasks) // blocks), len(sources) * blocks
    present = {m for m in methods for samples in sources.values() for t in tasks
               if (t, m) in samples}
    figure, axes = new_figure(3.1 * columns, 1.45, rows, columns, Margins(columns=0.45),
                              legend=strip(len(present) + 1, 5), sharex=True)
    for place, task in enumerate(tasks):
        block, row = divmod(place, rows)
        panels = axes[row][block * len(sources):(block + 1) * len(sources)]
        for panel, (source, samples) in zip(panels, sources.items()):
            found = {m: samples[task, m] for m in methods if (task, m) in samples}
            if task in behind and source != "authors":
                curve = behind[task].curve
                panel.plot(thin(curve.step) / MILLION, thin(curve.mean), **BEHIND)
            rivals = [m for m in found if m in GRID_METHODS and m != OURS]
            best = max(rivals, default=None, key=lambda m: found[m].moments.mean)
            for method, sample in reversed(found.items()):  # Option2Vec on top
                _curve(panel, method, sample, method == best or method not in rivals)
            panel.set_title(f"{task}, {TITLES[source]}\n{_coverage(found, methods)}",
                            loc="left")
        limits = [limit for panel in panels if panel.lines for limit in panel.get_ylim()]
        for panel, samples in zip(panels, sources.values()) if limits else []:
            panel.set_ylim(min(limits), max(limits))
            _ends(panel, {m: samples[task, m] for m in methods if (task, m) in samples})
        panels[0].set_ylabel("return [reward]")
    for panel in axes[-1]:
        panel.set_xlabel("environment steps [millions]")
    legend_above(figure, present, (Line2D([], [], **BEHIND), "authors' Option2Vec"))
    return figure


def _curve(panel: Axes, method: str, sample: Sample, stands_out: bool) -> None:
    curve = sample.curve
    step, mean, std = thin(curve.step) / MILLION, thin(curve.mean), thin(curve.std)
    line = line_of(method, len(step))
    if stands_out:
        panel.fill_between(step, mean - std, mean + std, alpha=0.2, color=line["color"],
                           linewidth=0, zorder=2)
        panel.plot(step, mean, **line, linewidth=2, zorder=4)
    else:
        panel.plot(step, mean, **line | {"markersize": 2.5}, linewidth=0.7, zorder=3)


def _ends(panel: Axes, found: Mapping[str, Sample]) -> None:
    """Means at the end with intervals, a column a method in the order of the legend."""
    if not found:
        return
    last = max(s.horizon for s in found.values()) / MILLION
    panel.axvline(last, color=INK, linewidth=0.5)
    for place, (method, sample) in enumerate(found.items()):
        x, look = last * (1 + MARGIN + SPACING * place), LOOKS[method]
        low, high = one_sample(sample.moments).interval
        if sample.moments.n > 1:
            panel.vlines(x, low, high, color=look.color, linewidth=1.2, zorder=3)
        panel.plot([x], [sample.moments.mean], color=look.color, marker=look.marker, markersize=3,
                   markeredgewidth=0, zorder=4)
    panel.set_xlim(-0.02 * last, last * (1 + 2 * MARGIN + SPACING * (len(METHODS) - 1)))
    panel.set_xticks([0, last / 2, last])


def _coverage(found: Mapping[str, Sample], methods: Sequence[str]) -> str:
    if not found:
        return "no runs yet"
    counts = sorted({len(s.final) for s in found.values()})
    seeds = f"n = {counts[0]}" + (f"-{counts[-1]}" if len(counts) > 1 else "")
    lost = sum(s.diverged for s in found.values())
    return (f"{len(found)} of {len(methods)} methods, {seeds}"
            + (f", {lost} diverged" if lost else ""))
