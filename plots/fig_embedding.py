"""Option embeddings and what they do (the paper's Figure 6).

From results/interpret/<fidelity>/<task>/option2vec/seed-NNN.csv of `option2vec interpret RUN`: a
row an embedding dimension d = 0, ..., D-1, with the columns

    dimension                      d
    embedding_0 .. embedding_{K-1} W_o(d, k), the embedding matrix
    effect_0 .. effect_{A-1}       mean over visited states, with the options executed there, of
                                   the derivative of the mean action mu_a with respect to dimension
                                   d of the executed option's embedding, signed [action / embedding]
    perturbed_0 .. perturbed_{A-1} mean over the same states of the change of mu_a when that
                                   dimension is made larger by delta [action]
    delta                          the same in every row [embedding]
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from plots.style import INK, PAPER, Drawing, main, new_figure
from plots.tables import Interpretation, read_interpretations

NOTE = "Option embeddings, the effect of their dimensions on the actions"


def draw(results: Path, experiments: Sequence[str] | None = None) -> list[Drawing]:
    """A figure a file."""
    found = read_interpretations(results, experiments)
    if not found:
        return [Drawing("embedding", "No figure of the embedding: not measured yet, needs "
                        "`option2vec interpret`.")]
    return [_figure("_".join(("embedding",) + path.parts[-4:-2] + (path.stem,)),
                    f"{path.parts[-3]}, {path.parts[-4]}, {path.stem}", interpretation)
            for path, interpretation in found.items()]


def _figure(name: str, title: str, found: Interpretation) -> Drawing:
    D, A = found.effects.shape
    delta = f"{found.delta:g}"
    heights = [1.5, 1 + 0.13 * A, 1 + 0.13 * A, 2.2]  # [inch]
    figure, panels = new_figure(9, sum(heights), 4, 2, sharex="col", gridspec_kw={
        "width_ratios": [45, 1], "height_ratios": heights})
    for (panel, scale), matrix, label, unit in zip(
            panels, (found.W_o, found.effects, found.perturbed),
            ("option k\n[index]", "action a\n[index]", "action a\n[index]"),
            ("embedding W_o\n[1]", "effect\n[action / embedding]",
             f"change at +{delta}\n[action]")):
        size = np.abs(matrix).max() or 1
        image = panel.imshow(matrix.T, aspect="auto", cmap="cividis", vmin=-size, vmax=size)
        panel.set(ylabel=label, yticks=range(matrix.shape[1]))
        for axes in (panel, scale):
            axes.grid(visible=False)
        figure.colorbar(image, cax=scale, label=unit)
    bars, empty = panels[-1]
    empty.set_axis_off()
    _primary_actions(bars, found, delta)
    bars.set(xlabel="embedding dimension d [index]; above its bars its primary action by effect, by change",
             xlim=(-0.5, D - 0.5), xticks=range(0, D, 5))
    panels[0][0].set_title(title)
    return Drawing(name, f"{NOTE}: derivative, change when a dimension is made {delta} larger, and "
                   f"each dimension's primary action, the one that it moves most. {title}.", figure)


def _primary_actions(panel, found: Interpretation, delta: str) -> None:
    """Largest effect and largest change of each dimension, side by side."""
    D = len(found.effects)
    width = 0.4
    looks = (("effect", {"color": "#bbbbbb"}),
             (f"change at +{delta}, over {delta}", {"color": PAPER, "hatch": "//////"}))
    for side, matrix, (label, look) in zip(
            (-0.5, 0.5), (found.effects, found.perturbed / found.delta), looks):
        size = np.abs(matrix)
        bars = panel.bar(np.arange(D) + side * width, size.max(axis=1), width, edgecolor=INK,
                         linewidth=0.5, label=label, **look)
        panel.bar_label(bars, [str(a) for a in size.argmax(axis=1)], fontsize=6, padding=1)
    panel.set_ylabel("primary action\n[action / embedding]")
    panel.margins(y=0.25)
    panel.legend(loc="upper left", ncols=2)


if __name__ == "__main__":
    main(draw, __doc__)
