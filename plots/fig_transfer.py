"""Learning curves on the six transfer pairs, two tasks in a row (the paper's Figure 5)."""

from collections.abc import Sequence
from pathlib import Path

from plots.curves import draw_curves
from plots.records import FIDELITIES, METHODS, PAIRS, load_cells
from plots.samples import author_samples, our_samples
from plots.style import INK, Drawing, main


def draw(results: Path, experiments: Sequence[str] | None = None) -> list[Drawing]:
    """One figure. The authors' OC is the real one; their own figure shows IOPG by that name."""
    cells = load_cells(results, experiments)
    authors = author_samples(results / "reference")
    sources = {fidelity: our_samples(cells, fidelity) for fidelity in FIDELITIES}
    figure = draw_curves(tuple(PAIRS), tuple(METHODS), sources | {"authors": authors},
                         {pair: authors[pair, "option2vec"] for pair in PAIRS})
    for panel in figure.axes:
        panel.axvline(1, color=INK, linewidth=0.8, linestyle=":")
    return [Drawing("transfer", "All methods on the transfer pairs. The second task begins at the "
                    "dotted line.", figure)]


if __name__ == "__main__":
    main(draw, __doc__)
