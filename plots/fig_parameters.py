"""Parameters against the number of options K: Option2Vec and the option methods.

Counts are those of HalfCheetah-v2 (S = 17, A = 6) with hidden layers of h. Every function below
counts all parameters that a network allocates; sections are those of docs/algorithms.md.
"""

import numpy as np
from matplotlib.lines import Line2D

from plots.inputs import Inputs
from plots.style import INK, LOOKS, Drawing, Look, legend_above, main, new_figure, strip

D, F = 40, 50  # Option2Vec's embedding and the width inside its attention block; spec 2.6
INIT = 64  # of the initial-option net, not h; spec 2.4, 2.6
S, A = 17, 6  # HalfCheetah-v2


def body(i: int, h: int) -> int:
    """Two layers, i -> h -> h. spec 2.1."""
    return (i * h + h) + (h * h + h)


def initial_net(S: int, K: int) -> int:
    """spec 2.6, item 2."""
    return (INIT * S + INIT) + (INIT * K + K)


def ppo(S: int, A: int, h: int) -> int:
    """spec 2.2."""
    return 2 * body(S, h) + (h + 1) * A + (h + 1) + A


def option_network(S: int, A: int, K: int, h: int) -> int:
    """Of DAC+PPO, AHP+PPO, IOPG, PPOC and OC. spec 2.3."""
    return ((2 + 2 * K) * body(S, h) + 2 * (h * K + K) + h * (K + 1) + (K + 1)
            + K * ((h * A + A) + (h + 1) + A))


def onestep_released(S: int, A: int, K: int, h: int) -> int:
    """spec 2.4."""
    return option_network(S, A, K, h) + h + initial_net(S, K) + 2 * (S + 1)


def onestep_paper(S: int, A: int, K: int, h: int) -> int:
    """spec 2.5."""
    return (body(S + K, h) + (h + 1) * K + K * (body(S, h) + (h + 1) * A + A) + body(S, h)
            + (h + 1) * K)


def attention_block() -> int:
    """spec 2.6, item 5."""
    return 4 * D * D + 4 * D + 2 * D * F + F + D + 6 * D


def option2vec_released(S: int, A: int, K: int, h: int) -> int:
    """spec 2.6."""
    return (K * D + initial_net(S, K) + (S * D + D + 2 * D) + attention_block() + (2 * D * K + K)
            + (body(S + D, h) + 2 * (h * A + A)) + (2 * (S + D) + body(S + D, h) + h * K + K)
            + 2 * (S + D))


def option2vec_paper(S: int, A: int, K: int, h: int) -> int:
    """spec 2.7."""
    return (K * D + initial_net(S, K) + ((S + D) * D + D + 2 * D) + attention_block() + (D * K + K)
            + (body(S + D, h) + 2 * (h * A + A)) + (body(S + D, h) + h + 1))


def draw(inputs: Inputs) -> list[Drawing]:
    """From formulas alone."""
    del inputs
    K = np.array([1, 2, 4, 8, 16, 32, 64])
    figure, [[panel]] = new_figure(7, 3.2, 1, 1, legend=strip(6, 3))
    network, onestep, ours = LOOKS["dac_ppo"], LOOKS["dac_onestep"], LOOKS["option2vec"]
    entries = []
    for label, look, fill, count in (
            ("option network, h = 128", network, "full", lambda k: option_network(S, A, k, 128)),
            ("option network, h = 64", network, "none", lambda k: option_network(S, A, k, 64)),
            ("DAC-OneStep paper, h = 64", onestep, "none", lambda k: onestep_paper(S, A, k, 64)),
            ("Option2Vec paper", ours, "none", lambda k: option2vec_paper(S, A, k, 64)),
            ("Option2Vec released", ours, "full", lambda k: option2vec_released(S, A, k, 64)),
            ("PPO, h = 64", LOOKS["ppo"], "full", lambda k: ppo(S, A, 64) + 0 * k)):
        line = _line(look, fill)
        panel.plot(K, [count(k) for k in K], **line)
        entries.append((Line2D([], [], **line), label))
    small = option2vec_released(S, A, 4, 64)
    for h in (64, 128):
        large = option_network(S, A, 4, h)
        panel.annotate(f"{small} / {large}\n= {100 * small / large:.1f} %", (4, large),
                       (-8, 10), textcoords="offset points", ha="right", color=INK)
    panel.axvline(4, color=INK, linewidth=0.8, linestyle=":")
    panel.set_xscale("log", base=2)
    panel.set_yscale("log")
    panel.set_xticks(K, [str(k) for k in K])
    panel.set_xlabel("number of options K [1]; the experiments' 4 is dotted")
    panel.set_ylabel("parameters, used or not [1]")
    legend_above(figure, (), *entries, ncols=3)
    return [Drawing("parameters", "Parameters against the number of options, on HalfCheetah-v2 "
                    "(S = 17, A = 6). The option network is that of DAC+PPO, AHP+PPO, IOPG, PPOC "
                    "and OC; the percentages are Option2Vec's released network against it.",
                    figure)]


def _line(look: Look, fill: str) -> dict:
    return {"color": look.color, "linestyle": look.line, "marker": look.marker, "fillstyle": fill}


if __name__ == "__main__":
    main(draw, __doc__)
