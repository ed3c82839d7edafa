"""Learning curves on the ten single tasks (the paper's Figure 4)."""

from plots.curves import NOTE, draw_curves
from plots.inputs import Inputs
from plots.records import FINITE, INFINITE, METHODS, TASKS
from plots.style import Drawing, main


def draw(inputs: Inputs) -> list[Drawing]:
    """Three figures: Option2Vec and DAC-OneStep; tasks without termination; tasks with it."""
    authors = inputs.sources["authors"]
    behind = {task: authors[task, "option2vec"] for task in TASKS}
    ours = {source: s for source, s in inputs.sources.items() if source != "authors"}
    one_step = ("option2vec", "dac_onestep")
    return [
        Drawing("figure_4a", f"Figure 4a: Option2Vec and DAC-OneStep on the ten tasks. {NOTE}",
                draw_curves(TASKS, one_step, ours, behind, blocks=2)),
        Drawing("figure_4b", "Figure 4b: all methods on the tasks without termination. "
                "Read as Figure 4a.",
                draw_curves(INFINITE, tuple(METHODS), inputs.sources, behind)),
        Drawing("figure_4c", "Figure 4c: all methods on the tasks with termination. "
                "Read as Figure 4a.", draw_curves(FINITE, tuple(METHODS), inputs.sources, behind)),
    ]


if __name__ == "__main__":
    main(draw, __doc__)
