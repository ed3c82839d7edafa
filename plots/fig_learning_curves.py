"""Learning curves on the ten single tasks (the paper's Figure 4)."""

from collections.abc import Sequence
from pathlib import Path

from plots.curves import draw_curves
from plots.records import FIDELITIES, FINITE, INFINITE, METHODS, TASKS, load_cells
from plots.samples import author_samples, our_samples
from plots.style import Drawing, main


def draw(results: Path, experiments: Sequence[str] | None = None) -> list[Drawing]:
    """Three figures: Option2Vec and DAC-OneStep; tasks without termination; tasks with it."""
    cells = load_cells(results, experiments)
    authors = author_samples(results / "reference")
    behind = {task: authors[task, "option2vec"] for task in TASKS}
    ours = {fidelity: our_samples(cells, fidelity) for fidelity in FIDELITIES}
    every = ours | {"authors": authors}
    one_step = ("option2vec", "dac_onestep")
    return [
        Drawing("learning_curves_onestep", "Option2Vec and DAC-OneStep on the ten tasks.",
                draw_curves(TASKS, one_step, ours, behind, blocks=2)),
        Drawing("learning_curves_infinite", "All methods on the tasks without termination.",
                draw_curves(INFINITE, tuple(METHODS), every, behind)),
        Drawing("learning_curves_finite", "All methods on the tasks with termination.",
                draw_curves(FINITE, tuple(METHODS), every, behind)),
    ]


if __name__ == "__main__":
    main(draw, __doc__)
