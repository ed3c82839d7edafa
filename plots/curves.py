"""Panels of learning curves: tasks by sources (paper, released, the authors' logs)."""

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from plots.records import MILLION
from plots.samples import Sample, Samples
from plots.style import GREY, legend_above, line_of, new_figure, thin

BEHIND = {"color": GREY, "linestyle": "--", "zorder": 1}  # the authors' line
TITLES = {"paper": "ours, paper", "released": "ours, released", "authors": "authors' logs"}
NOTE = ("environment steps [millions]\n"
        "return: mean of the last 20 training episodes (smoothing window 20); band: mean $\\pm$ "
        "one standard deviation over the n seeds")
AUTHORS_NOTE = ("\nbehind our curves the authors' Option2Vec; their other methods are in the panels "
                "of their logs")


def draw_curves(tasks: Sequence[str], methods: Sequence[str], sources: Mapping[str, Samples],
                behind: Mapping[str, Sample], blocks: int = 1) -> Figure:
    """A row a task, a column a source; with `blocks`, so many tasks beside each other. Behind our
    curves, in grey, the authors' of each task in `behind`."""
    rows, columns = -(-len(tasks) // blocks), len(sources) * blocks
    figure, axes = new_figure(3.1 * columns, 1.9 * rows + 0.9, rows, columns, sharex=True)
    present: set[str] = set()
    for place, task in enumerate(tasks):
        block, row = divmod(place, rows)
        panels = axes[row][block * len(sources):(block + 1) * len(sources)]
        for panel, (source, samples) in zip(panels, sources.items()):
            found = {m: samples[task, m] for m in methods if (task, m) in samples}
            if task in behind and source != "authors":
                _curve(panel, behind[task], BEHIND)
            for method, sample in reversed(found.items()):  # Option2Vec on top
                _curve(panel, sample, line_of(method, len(thin(sample.curve.step))))
            panel.set_title(f"{task}\n{TITLES[source]}: {_coverage(found, methods)}")
            present |= found.keys()
        limits = [limit for panel in panels if panel.lines for limit in panel.get_ylim()]
        for panel in panels if limits else []:
            panel.set_ylim(min(limits), max(limits))
        panels[0].set_ylabel("return [reward]")
    figure.supxlabel(NOTE + (AUTHORS_NOTE if "authors" in sources else ""), fontsize=8)
    legend_above(figure, present, (Line2D([], [], **BEHIND), "authors' Option2Vec"))
    return figure


def _curve(panel: Axes, sample: Sample, line: dict) -> None:
    curve = sample.curve
    step, mean, std = thin(curve.step) / MILLION, thin(curve.mean), thin(curve.std)
    low, high = mean - std, mean + std
    panel.fill_between(step, low, high, alpha=0.15, color=line["color"], linewidth=0,
                       zorder=line.get("zorder", 2))
    if line is BEHIND:  # an edge, since PPO's band is grey, too
        panel.plot(step, low, step, high, color=GREY, linewidth=0.5, zorder=1)
    panel.plot(step, mean, **line)


def _coverage(found: Mapping[str, Sample], methods: Sequence[str]) -> str:
    if not found:
        return "no runs yet"
    counts = sorted({len(s.final) for s in found.values()})
    seeds = f"n = {counts[0]}" + (f"-{counts[-1]}" if len(counts) > 1 else "")
    lost = sum(s.diverged for s in found.values())
    return (f"{len(found)} of {len(methods)} methods, {seeds}"
            + (f", {lost} diverged" if lost else ""))
