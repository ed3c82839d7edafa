"""CPU cost of an environment step by part, beside the bound of `make bench`."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from plots.inputs import Inputs
from plots.records import FIDELITIES, METHODS, TASKS
from plots.style import (GREY, INK, PAPER, Drawing, Margins, legend_above, main, new_figure,
                         strip)
from plots.tables import PARTS

FILLS = (("physics", GREY, ""), ("inference", "#56b4e9", "///"), ("learning", "#e69f00", "\\\\\\"))


def draw(inputs: Inputs) -> list[Drawing]:
    """A row a task that all methods were timed on, a column a fidelity; from results/bench.json."""
    costs = {(r["task"], r["method"], r["fidelity"]): r for r in inputs.bench}
    tasks = [t for t in TASKS if sum(key[0] == t for key in costs) > 2 * len(FIDELITIES)]
    if not tasks:
        return [Drawing("cost", "No figure of the cost: no task that all methods were timed on in "
                        "results/bench.json (`make bench`).")]
    figure, axes = new_figure(9.5, 1.7, len(tasks), 2,
                              Margins(left=0.9, columns=0.95, rows=0.7), legend=strip(4),
                              sharex="row")
    for task, panels in zip(tasks, axes):
        for panel, fidelity in zip(panels, FIDELITIES):
            methods = [m for m in METHODS if (task, m, fidelity) in costs][::-1]
            cells = [costs[task, m, fidelity] for m in methods]
            place, left = np.arange(len(cells)), np.zeros(len(cells))
            for part, (_, color, hatch) in zip(PARTS, FILLS):
                width = np.array([cell[part] for cell in cells])
                panel.barh(place, width, left=left, color=color, hatch=hatch, edgecolor=PAPER,
                           linewidth=0.4, height=0.7)
                left += width
            panel.vlines([cell["bound_us"] for cell in cells], place - 0.45, place + 0.45,
                         color=INK, linewidth=1.6)
            panel.set_yticks(place, [METHODS[m] for m in methods])
            panel.grid(visible=False, axis="y")
            panel.set_title(f"{task}, {fidelity}", loc="left")
            panel.set_xlabel("CPU time [µs per environment step]")
    parts = [(Patch(facecolor=color, hatch=hatch, edgecolor=PAPER, linewidth=0.4), name)
             for name, color, hatch in FILLS]
    legend_above(figure, (), *parts, (Line2D([], [], color=INK, linestyle="none", marker="|",
                                             markersize=10, markeredgewidth=1.6), "bound"))
    return [Drawing("cost", "CPU cost of an environment step by part, of the program in this "
                    "repository; the bound is what no implementation avoids "
                    "(docs/performance.md).", figure)]


if __name__ == "__main__":
    main(draw, __doc__)
