"""Return against the number of options K: does Option2Vec need them?"""

from matplotlib.lines import Line2D

from plots.beyond import ALL_TASKS, options_of
from plots.inputs import Inputs
from plots.records import FIDELITIES
from plots.statistics import one_sample
from plots.style import INK, LOOKS, Drawing, Margins, legend_above, main, new_figure, strip

FIDELITY_LOOKS = {"paper": ("-", "o", 1), "released": ("--", "s", 1.08)}  # the last: shift
COLUMNS = 4


def draw(inputs: Inputs) -> list[Drawing]:
    """A panel a task that has runs with another number of options than the usual one."""
    found = {task: {f: options_of(inputs, f, task) for f in FIDELITIES} for task in ALL_TASKS}
    found = {task: by for task, by in found.items() if any(len(x) > 1 for x in by.values())}
    if not found:
        return [Drawing("options_count", "No figure of the return against the number of options: "
                        "not measured yet, needs runs with `options=K` in `results/ablation`.")]
    columns = min(COLUMNS, len(found))
    figure, axes = new_figure(max(2.6 * columns, 5), 1.5, -(-len(found) // columns), columns,
                              Margins(columns=0.6), legend=strip(3))
    panels = [panel for row in axes for panel in row]
    color = LOOKS["option2vec"].color
    for panel, (task, by_fidelity) in zip(panels, found.items()):
        for fidelity, samples in by_fidelity.items():
            if not samples:
                continue
            line, marker, shift = FIDELITY_LOOKS[fidelity]
            means = [s.moments.mean for s in samples.values()]
            panel.plot([K * shift for K in samples], means, color=color, linestyle=line,
                       marker=marker)
            for K, sample in samples.items():
                if sample.moments.n > 1:
                    low, high = one_sample(sample.moments).interval
                    panel.vlines(K * shift, low, high, color=color, linewidth=1)
            ppo = inputs.sources[fidelity].get((task, "ppo"))
            if ppo is not None:
                panel.axhline(ppo.moments.mean, color=INK, linewidth=0.8, linestyle=line)
        panel.set_title(task, loc="left")
        panel.set(xlabel="options K [1]", ylabel="return [reward]")
        panel.set_xscale("log", base=2)
        panel.set_xticks([1, 2, 4, 8, 16], ["1", "2", "4", "8", "16"])
    for panel in panels[len(found):]:
        panel.set_visible(False)
    entries = [(Line2D([], [], color=color, linestyle=line, marker=marker), f"Option2Vec, {f}")
               for f, (line, marker, _) in FIDELITY_LOOKS.items()]
    legend_above(figure, (), *entries, (Line2D([], [], color=INK, linewidth=0.8), "PPO, in the "
                                        "line style of its fidelity"))
    return [Drawing("options_count", "Return at the end against the number of options, with 95 % "
                    "intervals of the mean (t).", figure)]


if __name__ == "__main__":
    main(draw, __doc__)
