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

from pathlib import Path

import numpy as np

from plots.inputs import Inputs
from plots.style import INK, PAPER, Drawing, Margins, main, new_figure
from plots.tables import Interpretation

SHEET_COLUMNS = 5


def draw(inputs: Inputs) -> list[Drawing]:
    """The first file in full, and a sheet with the effects of all files of each fidelity."""
    found = inputs.interpretations
    if not found:
        return [Drawing("figure_6", "No figure of the embedding: not measured yet, needs "
                        "`option2vec interpret`.")]
    path, interpretation = next(iter(found.items()))
    sheets: dict[str, dict[str, Interpretation]] = {}
    for p, i in found.items():
        sheets.setdefault(p.parts[-4], {})[_name(p)] = i
    return [_figure(f"{_name(path)}, {path.parts[-4]}", interpretation),
            *(_sheet(fidelity, files) for fidelity, files in sheets.items())]


def _name(path: Path) -> str:
    return f"{path.parts[-3]}, seed {int(path.stem.removeprefix('seed-'))}"


def _figure(title: str, found: Interpretation) -> Drawing:
    D, A = found.effects.shape
    delta = f"{found.delta:g}"
    margins = Margins(left=0.8, right=0.9, columns=0.15, rows=0.12)
    figure, panels = new_figure(9.5, 1.2, 4, 2, margins, sharex="col",
                                gridspec_kw={"width_ratios": [45, 1]})
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
    bars.set(xlabel="embedding dimension d [index]; above its bars its primary action by effect, "
             "by change",
             xlim=(-0.5, D - 0.5), xticks=range(0, D, 5))
    panels[0][0].set_title(title, loc="left")
    return Drawing("figure_6", "Figure 6: option embeddings and the effect of their dimensions on "
                   f"the actions: derivative, change when a dimension is made {delta} larger, and "
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


def _sheet(fidelity: str, files: dict[str, Interpretation]) -> Drawing:
    """Small heat maps of the effects, each on its own scale."""
    columns = min(SHEET_COLUMNS, len(files))
    figure, axes = new_figure(9.5, 0.6, -(-len(files) // columns), columns,
                              Margins(left=0.5, columns=0.15, rows=0.35))
    panels = [panel for row in axes for panel in row]
    for panel, (title, found) in zip(panels, files.items()):
        size = np.abs(found.effects).max() or 1
        panel.imshow(found.effects.T, aspect="auto", cmap="cividis", vmin=-size, vmax=size)
        panel.set_title(f"{title}: ±{size:.2g}", loc="left")
        panel.set(xticks=[], yticks=[])
        panel.grid(visible=False)
    for panel in panels[len(files):]:
        panel.set_axis_off()
    for panel in axes[-1]:
        panel.set_xlabel("dimension d")
    for row in axes:
        row[0].set_ylabel("action a")
    return Drawing(f"figure_6_{fidelity}", f"Figure 6, {fidelity}: effect of the dimensions on the "
                   "actions in every run that was examined; the title gives the largest effect, "
                   "which is the ends of the scale [action / embedding].", figure)


if __name__ == "__main__":
    main(draw, __doc__)
