"""How figures look: one colour, line style and marker a method, the same in every figure.

Colours are those of Okabe and Ito, which the colour-blind tell apart; line styles and markers do
without colour. Black and white are the page's ink and paper, so that report.html can turn them.
"""

import argparse
import io
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from plots.inputs import Inputs
from plots.records import METHODS, DamagedFile

INK = "#1a1a1a"
PAPER = "#ffffff"
GREY = "#8c8c8c"  # the authors' curves
FOLDER = Path(__file__).parent
RESULTS = FOLDER.parent / "results"
PNG_DPI = 110
POINTS, MARKERS = 40, 5  # about, on a curve


@dataclass(frozen=True)
class Look:
    """Line style and marker in matplotlib's terms."""
    color: str
    line: str | tuple[int, tuple[float, ...]]
    marker: str


LOOKS = {
    "option2vec": Look("#d55e00", "-", "o"),
    "dac_onestep": Look("#0072b2", (0, (6, 2)), "s"),
    "dac_ppo": Look("#009e73", (0, (4, 1, 1, 1)), "^"),
    "ahp_ppo": Look("#cc79a7", (0, (2, 1)), "v"),
    "iopg": Look("#e69f00", (0, (1, 1)), "P"),
    "ppoc": Look("#56b4e9", (0, (8, 2, 1, 2)), "D"),
    "oc": Look("#999933", (0, (4, 1, 1, 1, 1, 1)), "X"),
    "ppo": Look(INK, (0, (3, 1)), ">"),
}


@dataclass(frozen=True)
class Drawing:
    """A figure, the name of its files and its caption; without a figure, when there is nothing to
    draw, the caption says what is missing."""
    name: str
    caption: str
    figure: Figure | None = None


@dataclass(frozen=True)
class Margins:
    """[inch] around the panels of a figure and between them."""
    left: float = 0.7
    right: float = 0.15
    above: float = 0.35
    below: float = 0.45
    columns: float = 0.55
    rows: float = 0.45


def new_figure(width: float, row: float, rows: int, columns: int, margins: Margins = Margins(),
               legend: float = 0, **more) -> tuple[Figure, list]:
    """width of the figure and height of a row of panels, strip for a legend above them [inch] ->
    the figure and its axes by row, [row][column]. The places are computed, not found by drawing,
    which would take most of the time."""
    matplotlib.rcdefaults()
    matplotlib.rcParams.update({
        "font.family": "DejaVu Sans", "font.size": 8, "axes.titlesize": 8, "legend.fontsize": 8,
        "text.color": INK, "axes.edgecolor": INK, "axes.labelcolor": INK, "xtick.color": INK,
        "ytick.color": INK, "figure.facecolor": PAPER, "axes.facecolor": PAPER,
        "savefig.facecolor": PAPER, "legend.frameon": False, "axes.spines.top": False,
        "axes.spines.right": False, "lines.linewidth": 1.4, "lines.markersize": 4,
        "axes.grid": True, "grid.color": GREY, "grid.alpha": 0.25, "grid.linewidth": 0.5,
        "axes.titley": 1.0, "axes.axisbelow": True,
        "hatch.linewidth": 0.6, "svg.hashsalt": "option2vec", "svg.fonttype": "none",
    })
    m = margins
    height = m.below + rows * row + (rows - 1) * m.rows + m.above + legend
    figure = Figure(figsize=(width, height))
    panel = (width - m.left - m.right - (columns - 1) * m.columns) / columns
    axes = figure.subplots(rows, columns, squeeze=False, **more)
    figure.subplots_adjust(m.left / width, m.below / height, 1 - m.right / width,
                           1 - (m.above + legend) / height, m.columns / panel, m.rows / row)
    return figure, [list(row) for row in axes]


def line_of(method: str, points: int = 1) -> dict:
    """Keywords of a method's line through so many points; markers of methods lie apart."""
    look = LOOKS[method]
    every = max(points // MARKERS, 1)
    markevery = (every * (1 + list(METHODS).index(method)) // (1 + len(METHODS)), every)
    return {"color": look.color, "linestyle": look.line, "marker": look.marker,
            "markevery": markevery, "markeredgewidth": 0}


def legend_above(figure: Figure, methods: Iterable[str], *more: tuple[Artist, str],
                 ncols: int = 5) -> None:
    """A legend at the top: methods, in the order of their table, and `more`."""
    known = [m for m in METHODS if m in methods]
    handles = [Line2D([], [], **line_of(m)) for m in known] + [artist for artist, _ in more]
    labels = [METHODS[m] for m in known] + [text for _, text in more]
    figure.legend(handles, labels, loc="upper left", ncols=ncols, borderaxespad=0.2)


def logarithmic(panel: Axes) -> None:
    """A logarithmic ordinate with ticks at 1, 2, 5, 10, ..., written as such."""
    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter(FormatStrFormatter("%g"))


def strip(entries: int, ncols: int = 5) -> float:
    """[inch] that a legend of so many entries takes."""
    return 0.12 + 0.17 * -(-entries // ncols)


def thin(x: np.ndarray) -> np.ndarray:
    """x (..., R) with its last value and so many before that there are about POINTS."""
    return x[..., ::-1][..., ::max(x.shape[-1] // POINTS, 1)][..., ::-1]


@cache
def svg_of(drawing: Drawing) -> str:
    """The figure as SVG text, the same bytes every time."""
    assert drawing.figure is not None
    text = io.StringIO()
    drawing.figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return _smaller(text.getvalue())


def _smaller(text: str) -> str:
    """The same picture in less than half of the bytes: coordinates to a tenth of a point, no blanks
    between tags, the font named once, and only the ids that something refers to."""
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' (?:d|x|y)="[^"]*"', lambda attribute: re.sub(
        r"-?\d+\.\d+", lambda x: f"{float(x[0]):.1f}".removesuffix(".0"), attribute[0]), text)
    text = re.sub(r' d="[^"QC]*"', lambda path: path[0].replace("\nL ", " "), text)  # L is implied
    text = re.sub(r' ?\n"', '"', text).replace(" \nz", "z")
    text = re.sub(r">\s*\n\s*<", "><", text)
    text = re.sub(r"font: (\S+) 'DejaVu Sans'", r"font-size: \1", text)
    text = re.sub(r' transform="rotate\(-0 [^)]*\)"', "", text)
    text = text.replace("<svg ", "<svg font-family=\"'DejaVu Sans', Verdana, sans-serif\" ", 1)
    used = set(re.findall(r'(?:url\(|href=")#([^")]+)', text))
    text = re.sub(r' id="([^"]+)"', lambda x: x[0] if x[1] in used else "", text)
    return _with_classes(re.sub(r' style="[^"]*"', lambda style: re.sub(r"([:;]) ", r"\1", style[0]),
                                text))


def _with_classes(text: str) -> str:
    """A style that is there often becomes a class."""
    counts = Counter(re.findall(r' style="([^"]+)"', text))
    names = {style: f"s{i}" for i, style in enumerate(s for s, n in counts.items() if n > 3)}
    text = re.sub(r' style="([^"]+)"',
                  lambda x: f' class="{names[x[1]]}"' if x[1] in names else x[0], text)
    rules = "".join(f".{name}{{{style};}}" for style, name in names.items())
    return text.replace("</style>", f"{rules}</style>", 1)


def inline_svg(drawing: Drawing) -> str:
    """An <svg> element for a page: its ids and classes begin with the figure's name, ink and paper
    are the page's variables --ink and --paper, the size is the page's business."""
    text = svg_of(drawing)
    text = text[text.index("<svg"):]
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    # Names and what refers to them; a colour such as fill="#e69f00" begins with # too.
    text = re.sub(r'(\bid="|\bhref="#|url\(#|\bclass="|\.(?=s\d+\{))',
                  rf"\g<1>{drawing.name}-", text)
    return text.replace(INK, "var(--ink)").replace(PAPER, "var(--paper)").strip()


def save(drawing: Drawing, folder: Path, png: bool = True) -> None:
    """Writes <folder>/<name>.svg and .png."""
    assert drawing.figure is not None
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{drawing.name}.svg").write_text(svg_of(drawing), encoding="utf-8")
    if png:
        drawing.figure.savefig(folder / f"{drawing.name}.png", dpi=PNG_DPI,
                               metadata={"Software": None})


def main(draw: Callable[[Inputs], list[Drawing]], summary: str) -> None:
    """The program of a figure's script."""
    parser = argparse.ArgumentParser(description=summary)
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--experiment", action="append",
                        help="folder of results/ (again for more; default: all but quick and ci)")
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    try:
        drawings = draw(Inputs(options.results, options.experiment))
    except (DamagedFile, FileNotFoundError) as error:
        sys.exit(f"{parser.prog}: {error}")
    for drawing in drawings:
        if drawing.figure is None:
            print(f"{drawing.name}: {drawing.caption}")
            continue
        save(drawing, options.out)
        print(options.out / f"{drawing.name}.svg")
