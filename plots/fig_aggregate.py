"""Option2Vec less the best rival on every task, and all tasks together; a joined method beside it.

After Agarwal et al. 2021, "Deep Reinforcement Learning at the Edge of the Statistical Precipice":
interquartile mean with a stratified bootstrap, and performance profile.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from plots.claims import OURS, RIVALS
from plots.inputs import Inputs
from plots.records import GRID_METHODS, METHODS, PAIRS, TASKS
from plots.samples import Sample, Samples
from plots.statistics import Scores
from plots.style import INK, LOOKS, PAPER, Drawing, Margins, legend_above, main, new_figure, strip

ORDER = {"authors": "authors' logs", "released": "ours, released", "paper": "ours, paper"}
SPREAD = 0.6  # [rows] of the methods within a task's; from one to the next below the line
LIMITS = (-1.0, 1.5)  # of what is shown
TICKS = (-1, -0.5, 0, 0.5, 1, 1.5)
NOTE = (
    "Return at the end of training. Left of the line Option2Vec is below its best rival, the "
    "method with the highest mean on that task, whose name stands at the right; unit: that mean. "
    "Dots: means over seeds, hollow where one of DAC+PPO, AHP+PPO, PPOC, OC and PPO has no runs "
    "yet; those tasks do not count below; an arrow points to a mean beyond the frame. Lines: 95 % "
    "bootstrap intervals, none for a single run. IQM: interquartile mean of all runs of all tasks, "
    "runs drawn again within each task and method. "
    "Below: share of the runs whose difference is larger than τ, with a pointwise 95 % band; the "
    "best rival's own runs for comparison. The best rival is chosen by the same runs, which "
    "favours it. After Agarwal et al. (2021).")
JOINED_NOTE = (" Joined methods are measured against the same rival, none of them is one, and "
               "their IQM and share are over the tasks on which they have runs.")

Pairs = dict[str, tuple[Sample, str, Sample]]  # by task: a method's runs, the rival and its runs


def best_rival(samples: Samples, task: str) -> tuple[str, Sample] | None:
    """By mean at the end, among whole runs of the grid's methods."""
    found = [(m, samples[task, m]) for m in GRID_METHODS if m != OURS and (task, m) in samples
             and not samples[task, m].shortened]
    return max(found, key=lambda pair: pair[1].moments.mean, default=None)


def pairs_of(samples: Samples, method: str) -> Pairs:
    """Of a method's whole runs."""
    found = {}
    for task in (*TASKS, *PAIRS):
        sample, rival = samples.get((task, method)), best_rival(samples, task)
        if sample is not None and not sample.shortened and rival is not None:
            found[task] = (sample, *rival)
    return found


def whole(samples: Samples, found: Pairs) -> list[tuple[np.ndarray, np.ndarray]]:
    """Returns of the method and of the best rival on the tasks that have all of RIVALS."""
    return [(sample.final, rival.final) for task, (sample, _, rival) in found.items()
            if all((task, m) in samples and not samples[task, m].shortened for m in RIVALS)]


def draw(inputs: Inputs) -> list[Drawing]:
    """A column a source."""
    tasks, joined = [*TASKS, *PAIRS], [m for m in METHODS if m not in GRID_METHODS]
    legend = strip(2 + len(joined))
    figure, axes = new_figure(9.5, 2.6, 2, len(ORDER), Margins(left=1.75, columns=0.95, rows=0.6,
                                                              right=0.85), legend=legend,
                              gridspec_kw={"height_ratios": [len(tasks) + 1, 8]})
    for (source, title), differences, profile in zip(ORDER.items(), *axes):
        samples = inputs.sources[source]
        found = {m: pairs_of(samples, m) for m in (OURS, *joined)}
        pairs = {m: whole(samples, of_method) for m, of_method in found.items()}
        differences.set_title(f"{title}: all rivals on {len(pairs[OURS])} of {len(tasks)}",
                              loc="left")
        _differences(differences, tasks, found, pairs)
        if source != "authors":
            differences.tick_params(labelleft=False)
        profile.set(xlim=LIMITS, ylim=(0, 1), xlabel="τ [best rival's mean]")
        for panel in (differences, profile):
            panel.set_xticks(TICKS, [f"{x:g}" for x in TICKS])
        _profile(profile, pairs)
    axes[1][0].set_ylabel("share of runs above τ [1]")
    rival = Line2D([], [], color=INK, linestyle="--", linewidth=1), "best rival"
    legend_above(figure, [OURS, *joined], rival)
    caption = f"Option2Vec less the best rival. {NOTE}{JOINED_NOTE if joined else ''}"
    return [Drawing("aggregate", caption, figure)]


def _differences(panel: Axes, tasks: list[str], found: dict[str, Pairs],
                 pairs: dict[str, list[tuple]]) -> None:
    """A row a task; in it the methods from above, Option2Vec first."""
    rivals = {task: rival for known in found.values() for task, (_, rival, _) in known.items()}
    for task, rival in rivals.items():
        panel.text(LIMITS[1] + 0.08, len(tasks) - tasks.index(task), METHODS[rival], va="center",
                   fontsize=7)
    for place, (method, of_method) in enumerate(found.items()):
        below, look = SPREAD * place / len(found), LOOKS[method]
        counted = {id(x) for x, _ in pairs[method]}
        scores = Scores.of([(sample.final, rival.final) for sample, _, rival in of_method.values()])
        for (task, (sample, *_)), (mean, (low, high)) in zip(of_method.items(), scores.means()):
            _dot(panel, len(tasks) - tasks.index(task) - below, mean, low, high, look.color,
                 look.marker, 4, id(sample.final) in counted)
        if pairs[method]:
            mean, (low, high) = Scores.of(pairs[method]).iqm()
            _dot(panel, -SPREAD * place, mean, low, high, INK if method == OURS else look.color,
                 look.marker, 6)
            panel.text(LIMITS[1] + 0.08, -SPREAD * place, f"{mean:+.2f}", va="center", fontsize=7)
    panel.axvline(0, color=INK, linewidth=0.8)
    panel.axhline(0.5, color=INK, linewidth=0.5)
    panel.set(xlim=LIMITS, ylim=(-0.6 - SPREAD * place, len(tasks) + 0.6),
              yticks=range(len(tasks) + 1), yticklabels=["all tasks, IQM", *reversed(tasks)])
    panel.set_xlabel("difference [best rival's mean]")


def _dot(panel: Axes, y: float, mean: float, low: float, high: float, color: str, marker: str,
         size: float, full: bool = True) -> None:
    if low <= high:  # not of a single run
        panel.hlines(y, low, high, color=color, linewidth=1.6)
    marker = "<" if mean < LIMITS[0] else ">" if mean > LIMITS[1] else marker
    panel.plot([np.clip(mean, *LIMITS)], [y], color=color, marker=marker, markersize=size,
               markerfacecolor=color if full else PAPER, clip_on=False)


def _profile(panel: Axes, pairs: dict[str, list[tuple]]) -> None:
    thresholds = np.linspace(*LIMITS, 51)
    for method, of_method in pairs.items():
        if not of_method:
            continue
        share, (low, high) = Scores.of(of_method).profile(thresholds)
        color = LOOKS[method].color
        panel.fill_between(thresholds, low, high, color=color, alpha=0.2, linewidth=0)
        panel.plot(thresholds, share, color=color, linestyle=LOOKS[method].line, linewidth=2)
    if pairs[OURS]:
        rival, _ = Scores.of([(y, y) for _, y in pairs[OURS]]).profile(thresholds)
        panel.plot(thresholds, rival, color=INK, linestyle="--", linewidth=1)
        panel.axvline(0, color=INK, linewidth=0.8)


if __name__ == "__main__":
    main(draw, __doc__)
