"""Option2Vec less the best rival on every task, and all tasks together.

After Agarwal et al. 2021, "Deep Reinforcement Learning at the Edge of the Statistical Precipice":
interquartile mean with a stratified bootstrap, and performance profile.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from plots.claims import OURS, RIVALS
from plots.inputs import Inputs
from plots.records import METHODS, PAIRS, TASKS
from plots.samples import Sample, Samples
from plots.statistics import Scores
from plots.style import INK, LOOKS, PAPER, Drawing, Margins, legend_above, main, new_figure, strip

ORDER = {"authors": "authors' logs", "released": "ours, released", "paper": "ours, paper"}
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


def best_rival(samples: Samples, task: str) -> tuple[str, Sample] | None:
    """By mean at the end, among whole runs."""
    found = [(m, samples[task, m]) for m in METHODS if m != OURS and (task, m) in samples
             and not samples[task, m].shortened]
    return max(found, key=lambda pair: pair[1].moments.mean, default=None)


def pairs_of(samples: Samples) -> dict[str, tuple[Sample, str, Sample]]:
    """By task: Option2Vec's runs, the best rival and its runs."""
    found = {}
    for task in (*TASKS, *PAIRS):
        ours, rival = samples.get((task, OURS)), best_rival(samples, task)
        if ours is not None and not ours.shortened and rival is not None:
            found[task] = (ours, *rival)
    return found


def whole(samples: Samples, found: dict[str, tuple[Sample, str, Sample]]) -> list[tuple]:
    """Returns of Option2Vec and of the best rival on the tasks that have all of RIVALS."""
    return [(ours.final, rival.final) for task, (ours, _, rival) in found.items()
            if all((task, m) in samples and not samples[task, m].shortened for m in RIVALS)]


def draw(inputs: Inputs) -> list[Drawing]:
    """A column a source."""
    tasks = [*TASKS, *PAIRS]
    figure, axes = new_figure(9.5, 2.6, 2, len(ORDER), Margins(left=1.75, columns=0.95, rows=0.6,
                                                              right=0.85), legend=strip(2),
                              gridspec_kw={"height_ratios": [len(tasks) + 1, 8]})
    for (source, title), differences, profile in zip(ORDER.items(), *axes):
        found = pairs_of(inputs.sources[source])
        pairs = whole(inputs.sources[source], found)
        differences.set_title(f"{title}: all rivals on {len(pairs)} of {len(tasks)}",
                              loc="left")
        _differences(differences, tasks, found, pairs)
        if source != "authors":
            differences.tick_params(labelleft=False)
        profile.set(xlim=LIMITS, ylim=(0, 1), xlabel="τ [best rival's mean]")
        for panel in (differences, profile):
            panel.set_xticks(TICKS, [f"{x:g}" for x in TICKS])
        if pairs:
            _profile(profile, pairs)
    axes[1][0].set_ylabel("share of runs above τ [1]")
    rival = Line2D([], [], color=INK, linestyle="--", linewidth=1), "best rival"
    legend_above(figure, [OURS], rival)
    return [Drawing("aggregate", f"Option2Vec less the best rival. {NOTE}", figure)]


def _differences(panel: Axes, tasks: list[str], found: dict[str, tuple[Sample, str, Sample]],
                 pairs: list[tuple]) -> None:
    color = LOOKS[OURS].color
    scores = Scores.of([(ours.final, rival.final) for ours, _, rival in found.values()])
    for task, (mean, (low, high)) in zip(found, scores.means()):
        y = len(tasks) - tasks.index(task)
        _dot(panel, y, mean, low, high, color, 4, any(found[task][0].final is x for x, _ in pairs))
        panel.text(LIMITS[1] + 0.08, y, f"{METHODS[found[task][1]]}", va="center", fontsize=7)
    if pairs:
        mean, (low, high) = Scores.of(pairs).iqm()
        _dot(panel, 0, mean, low, high, INK, 6)
        panel.text(LIMITS[1] + 0.08, 0, f"{mean:+.2f}", va="center", fontsize=7)
    panel.axvline(0, color=INK, linewidth=0.8)
    panel.axhline(0.5, color=INK, linewidth=0.5)
    panel.set(xlim=LIMITS, ylim=(-0.6, len(tasks) + 0.6),
              yticks=range(len(tasks) + 1), yticklabels=["all tasks, IQM", *reversed(tasks)])
    panel.set_xlabel("difference [best rival's mean]")


def _dot(panel: Axes, y: float, mean: float, low: float, high: float, color: str, size: float,
         full: bool = True) -> None:
    if low <= high:  # not of a single run
        panel.hlines(y, low, high, color=color, linewidth=1.6)
    marker = "<" if mean < LIMITS[0] else ">" if mean > LIMITS[1] else "o"
    panel.plot([np.clip(mean, *LIMITS)], [y], color=color, marker=marker, markersize=size,
               markerfacecolor=color if full else PAPER, clip_on=False)


def _profile(panel: Axes, pairs: list[tuple]) -> None:
    thresholds = np.linspace(*LIMITS, 51)
    share, (low, high) = Scores.of(pairs).profile(thresholds)
    rival, _ = Scores.of([(y, y) for _, y in pairs]).profile(thresholds)
    panel.fill_between(thresholds, low, high, color=LOOKS[OURS].color, alpha=0.2, linewidth=0)
    panel.plot(thresholds, share, color=LOOKS[OURS].color, linewidth=2)
    panel.plot(thresholds, rival, color=INK, linestyle="--", linewidth=1)
    panel.axvline(0, color=INK, linewidth=0.8)


if __name__ == "__main__":
    main(draw, __doc__)
