"""The figure of README.md: learning curves on the ten single tasks, after the paper's Figure 4."""

import re
import sys
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from plots.records import METHODS, MILLION, TASKS, DamagedFile, load_cells
from plots.samples import Sample, author_samples, our_samples
from plots.style import (FOLDER, GREY, RESULTS, Drawing, legend_above, line_of, new_figure, svg_of,
                         thin)

FILE = FOLDER.parent / "docs" / "figure4.svg"
OPTION2VEC, FIDELITY, COLUMNS = "option2vec", "released", 5
AUTHORS = {"color": GREY, "linestyle": "--", "linewidth": 1.6, "zorder": 3}
NOTE = ("environment steps [millions]\n"
        "return: mean of the last 20 training episodes, then over n seeds. "
        "Band: one standard deviation of our Option2Vec.")


def draw(results: Path) -> Drawing:
    """A panel a task: our `released` runs, Option2Vec in front, and the authors' Option2Vec."""
    ours, authors = our_samples(load_cells(results), FIDELITY), author_samples(results / "reference")
    rows = -(-len(TASKS) // COLUMNS)
    figure, axes = new_figure(2.2 * COLUMNS, 1.7 * rows + 0.9, rows, COLUMNS, sharex=True)
    for panel, task in zip((panel for row in axes for panel in row), TASKS):
        found = {method: ours[task, method] for method in METHODS if (task, method) in ours}
        for method, sample in found.items():
            _curve(panel, sample, method)
        curve = authors[task, OPTION2VEC].curve
        panel.plot(thin(curve.step) / MILLION, thin(curve.mean), **AUTHORS)
        panel.set_title(f"{task}\n{_seeds(found)}")
    for row in axes:
        row[0].set_ylabel("return [reward]")
    figure.supxlabel(NOTE, fontsize=8)
    legend_above(figure, METHODS, (Line2D([], [], **AUTHORS), "Option2Vec, authors' logs"), ncols=9)
    return Drawing("figure4", "Learning curves on the ten single tasks.", figure)


def svg(results: Path) -> str:
    """As SVG text, small: letters stay text, and coordinates have one digit after the point."""
    with matplotlib.rc_context():
        drawing = draw(results)
        matplotlib.rcParams["svg.fonttype"] = "none"
        text = svg_of(drawing).replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")
    return re.sub(r' d="[^"]*"', lambda d: re.sub(r"(\.\d)\d+", r"\1", d[0]), text)


def _curve(panel: Axes, sample: Sample, method: str) -> None:
    curve, front = sample.curve, method == OPTION2VEC
    step, mean, std = thin(curve.step) / MILLION, thin(curve.mean), thin(curve.std)
    line = line_of(method, 3 * len(step))  # a third of the usual markers
    if front:
        panel.fill_between(step, mean - std, mean + std, alpha=0.2, color=line["color"],
                           linewidth=0, zorder=1)
    panel.plot(step, mean, **line | {"linewidth": 2 if front else 0.9, "zorder": 4 if front else 2})


def _seeds(found: dict[str, Sample]) -> str:
    """n of Option2Vec and of the other methods."""
    others = sorted(len(s.final) for method, s in found.items() if method != OPTION2VEC)
    own = len(found[OPTION2VEC].final) if OPTION2VEC in found else 0
    if not found:
        return "no runs yet"
    return f"n = {own}" + (f", others {'-'.join(map(str, sorted({others[0], others[-1]})))}"
                           if others else "")


def main() -> None:
    """Writes FILE."""
    try:
        text = svg(RESULTS)
    except (DamagedFile, FileNotFoundError) as error:
        sys.exit(f"plots.front: {error}")
    FILE.write_text(text, encoding="utf-8")
    print(FILE.relative_to(FOLDER.parent))


if __name__ == "__main__":
    main()
