"""Option embeddings and what they do (the paper's Figure 6).

From results/interpret/<fidelity>/<task>/option2vec/seed-NNN.csv of `option2vec interpret RUN`: a
row an embedding dimension d = 0, ..., D-1, with the columns

    dimension                      d
    embedding_0 .. embedding_{K-1} W_o(d, k), the embedding matrix
    effect_0 .. effect_{A-1}       mean over visited states, with the options executed there, of
                                   the derivative of the mean action mu_a with respect to dimension
                                   d of the executed option's embedding, signed [action / embedding]
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plots.style import INK, Drawing, main, new_figure
from plots.tables import read_interpretations

NOTE = "Option embeddings, the effect of their dimensions on the actions"


def draw(results: Path, experiments: Sequence[str] | None = None) -> list[Drawing]:
    """A figure a file."""
    del experiments
    found = read_interpretations(results)
    if not found:
        return [Drawing("embedding", "No figure of the embedding: not measured yet, needs "
                        "`option2vec interpret`.")]
    return [_figure("_".join(("embedding",) + path.parts[-4:-2] + (path.stem,)),
                    f"{path.parts[-3]}, {path.parts[-4]}, {path.stem}", *matrices)
            for path, matrices in found.items()]


def _figure(name: str, title: str, W_o: np.ndarray, effects: np.ndarray) -> Drawing:
    D, A = effects.shape
    figure, [[left], [middle], [right]] = new_figure(9, 6.2, 3, 1)
    for panel, matrix, label, unit in (
            (left, W_o, "option k", "embedding W_o [1]"),
            (middle, effects, "action a", "effect [action / embedding]")):
        size = np.abs(matrix).max()
        image = panel.imshow(matrix.T, aspect="auto", cmap="cividis", vmin=-size, vmax=size)
        panel.set(ylabel=label, yticks=range(matrix.shape[1]), xlabel="embedding dimension d")
        panel.grid(visible=False)
        figure.colorbar(image, ax=panel, label=unit)
    primary = np.abs(effects).argmax(axis=1)
    bars = right.bar(np.arange(D), np.abs(effects).max(axis=1), color="#cccccc", edgecolor=INK,
                     linewidth=0.5)
    right.bar_label(bars, [str(a) for a in primary], fontsize=6)
    right.set(xlabel="embedding dimension d; above the bar its primary action",
              ylabel="largest effect\n[action / embedding]", xlim=(-0.5, D - 0.5))
    left.set_title(title)
    return Drawing(name, f"{NOTE}, and the primary action of each dimension: {title}.", figure)


if __name__ == "__main__":
    main(draw, __doc__)
