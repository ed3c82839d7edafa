"""Learning curves on the six transfer pairs, two tasks in a row (the paper's Figure 5)."""

from plots.curves import draw_curves
from plots.inputs import Inputs
from plots.records import METHODS, PAIRS
from plots.style import INK, Drawing, main


def draw(inputs: Inputs) -> list[Drawing]:
    """One figure. The authors' OC is the real one; their own figure shows IOPG by that name."""
    authors = inputs.sources["authors"]
    figure = draw_curves(tuple(PAIRS), tuple(METHODS), inputs.sources,
                         {pair: authors[pair, "option2vec"] for pair in PAIRS})
    for panel in figure.axes:
        panel.axvline(1, color=INK, linewidth=0.8, linestyle=":")
    return [Drawing("figure_5", "Figure 5: all methods on the transfer pairs. The second task "
                    "begins at the dotted line. Read as Figure 4a.", figure)]


if __name__ == "__main__":
    main(draw, __doc__)
