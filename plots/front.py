"""The figure of README.md: learning curves on the ten single tasks, after the paper's Figure 4."""

import io
import re
import sys
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from plots.records import METHODS, MILLION, TASKS, DamagedFile, load_cells
from plots.samples import Curve, Sample, author_samples, our_samples
from plots.style import GREY, LOOKS, PAPER

ROOT = Path(__file__).parents[1]
FILE = ROOT / "docs" / "figure4.svg"
OPTION2VEC, FIDELITY, COLUMNS = "option2vec", "released", 5
POINTS, MARKERS = 50, 2  # about, on a curve
LEGEND = 0.27  # [inch] above the panels
AUTHORS = {"color": GREY, "linestyle": "--", "linewidth": 1.6, "zorder": 3}
FONT = "DejaVu Sans"
STYLE = {
    "font.family": FONT, "font.size": 8, "axes.titlesize": 8,
    "figure.facecolor": PAPER, "axes.facecolor": PAPER, "savefig.facecolor": PAPER,
    "legend.frameon": False, "axes.spines.top": False, "axes.spines.right": False,
    "lines.markersize": 4, "axes.grid": True, "grid.color": GREY, "grid.alpha": 0.25,
    "grid.linewidth": 0.5, "svg.hashsalt": "option2vec",
    "svg.fonttype": "none",  # letters stay text: as outlines they would be half of the file
}
NOTE = ("environment steps [millions]\n"
        "return: mean of the last 20 training episodes, then over n seeds. "
        "Band: one standard deviation of our Option2Vec.")


def draw(results: Path) -> Figure:
    """A panel a task: our `released` runs, Option2Vec in front, and the authors' Option2Vec."""
    ours, authors = our_samples(load_cells(results), FIDELITY), author_samples(results / "reference")
    rows = -(-len(TASKS) // COLUMNS)
    figure = Figure(figsize=(2.2 * COLUMNS, 1.7 * rows + 0.9), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, sharex=True).flat
    for place, (panel, task) in enumerate(zip(panels, TASKS)):
        found = {method: ours[task, method] for method in METHODS if (task, method) in ours}
        for method, sample in found.items():
            _curve(panel, sample.curve, method)
        x, mean, _ = _points(authors[task, OPTION2VEC].curve)
        panel.plot(x, mean, **AUTHORS)
        panel.set_title(f"{task}\n{_seeds(found)}")
        panel.set_ylabel("" if place % COLUMNS else "return [reward]")
    figure.supxlabel(NOTE, fontsize=8)
    lines = [Line2D([], [], **_line(method), marker=LOOKS[method].marker) for method in METHODS]
    figure.legend([*lines, Line2D([], [], **AUTHORS)],
                  [*METHODS.values(), "Option2Vec, authors' logs"],
                  loc="upper center", ncols=len(METHODS) + 1)
    figure.get_layout_engine().set(rect=(0, 0, 1, 1 - LEGEND / figure.get_figheight()))
    return figure


def svg(results: Path) -> str:
    """As SVG text, the same bytes every time; coordinates have one digit after the point."""
    text = io.StringIO()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        draw(results).savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg_text = text.getvalue().replace(f"'{FONT}'", f"'{FONT}', Verdana, sans-serif")
    return re.sub(r' d="[^"]*"', lambda d: re.sub(r"(\.\d)\d+", r"\1", d[0]), svg_text)


def _points(curve: Curve) -> tuple:
    """Steps in millions, mean and deviation; thinned out, the last point kept."""
    every = max(len(curve.step) // POINTS, 1)
    return tuple(x[::-1][::every][::-1] for x in (curve.step / MILLION, curve.mean, curve.std))


def _line(method: str) -> dict:
    front = method == OPTION2VEC
    return {"color": LOOKS[method].color, "linestyle": LOOKS[method].line, "markeredgewidth": 0,
            "linewidth": 2 if front else 0.9, "zorder": 4 if front else 2}


def _curve(panel: Axes, curve: Curve, method: str) -> None:
    x, mean, std = _points(curve)
    if method == OPTION2VEC:
        panel.fill_between(x, mean - std, mean + std, alpha=0.2, color=LOOKS[method].color,
                           linewidth=0, zorder=1)
    every = max(len(x) // MARKERS, 1)
    first = every * list(METHODS).index(method) // len(METHODS)  # markers of methods lie apart
    panel.plot(x, mean, **_line(method), marker=LOOKS[method].marker, markevery=(first, every))


def _seeds(found: dict[str, Sample]) -> str:
    """n of Option2Vec and of the other methods."""
    if not found:
        return "no runs yet"
    own = len(found[OPTION2VEC].final) if OPTION2VEC in found else 0
    others = {len(sample.final) for method, sample in found.items() if method != OPTION2VEC}
    bounds = "-".join(map(str, sorted({min(others), max(others)}))) if others else "0"
    return f"n = {own}, others {bounds}"


def main() -> None:
    """Writes FILE."""
    try:
        text = svg(ROOT / "results")
    except (DamagedFile, FileNotFoundError) as error:
        sys.exit(f"plots.front: {error}")
    FILE.write_text(text, encoding="utf-8")
    print(FILE.relative_to(ROOT))


if __name__ == "__main__":
    main()
