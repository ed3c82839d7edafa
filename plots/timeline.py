"""Which option is active when, of `option2vec eval --trajectory`, and what it tells of the motion.

The paper says that options coincide with phases of the movement ("runs forward", "recovers"). Here
that is a number: the mutual information between the option and the option before, and between the
option and a phase of the state, beside what shuffled options would give.
"""

import argparse
import csv
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.colors import ListedColormap

from plots.records import DamagedFile, read_numbers
from plots.style import Drawing, new_figure, save

BINS = 4  # of a quantity of the state, equally full
SHUFFLES = 200
STREAM = 0  # of the shuffles
# As in a film: src/render/renderer.cc.
COLORS = ("#e69f00", "#56b4e9", "#009e73", "#cc79a7", "#f0e442", "#0072b2", "#d55e00")
QUANTITIES = {  # task: name and entry of the observation; docs/environments.md
    "HalfCheetah-v2": {"height [m]": 0, "speed [m/s]": 8},
    "Walker2d-v2": {"height [m]": 0, "speed [m/s]": 8},
    "Hopper-v2": {"height [m]": 0, "speed [m/s]": 5},
    "Ant-v2": {"height [m]": 0, "speed [m/s]": 13},
    "Humanoid-v2": {"height [m]": 0, "speed [m/s]": 22},
    "HumanoidStandup-v2": {"height [m]": 0, "speed upwards [m/s]": 24},
    "Swimmer-v2": {"speed [m/s]": 3},
}


class Information(NamedTuple):
    """[bit] Between the option and something; `shuffled` is the mean, `high` the 95 % quantile of
    what the same options give in random order: the bias of the estimate, and what chance allows."""
    bits: float
    shuffled: float
    high: float


def entropy(x: np.ndarray) -> float:
    """[bit] Of the frequencies of the values of x."""
    p = np.unique(x, return_counts=True)[1] / len(x)
    return float(-(p * np.log2(p)).sum())


def mutual_information(x: np.ndarray, y: np.ndarray) -> float:
    """[bit] H(x) + H(y) - H(x, y) of the frequencies of two sequences of whole numbers."""
    both = np.unique(np.stack([x, y]), axis=1, return_inverse=True)[1]
    return entropy(x) + entropy(y) - entropy(np.ravel(both))


def information(o: np.ndarray, y: np.ndarray, shuffles: int = SHUFFLES) -> Information:
    """Shuffling takes every order from the options, that of time included."""
    rng = np.random.default_rng(STREAM)
    chance = [mutual_information(rng.permutation(o), y) for _ in range(shuffles)]
    return Information(mutual_information(o, y), float(np.mean(chance)),
                       float(np.quantile(chance, 0.95)))


def phase(x: np.ndarray, bins: int = BINS) -> np.ndarray:
    """The bin of each value, 0, 1, ...; bins are equally full."""
    return np.searchsorted(np.quantile(x, np.arange(1, bins) / bins), x, side="right")


def explain(task: str, steps: dict[str, np.ndarray]) -> dict[str, Information]:
    """Of a trajectory: with the option before, in the same episode, and with phases of the state:
    of each quantity and of all together."""
    o = steps["o"].astype(int)
    later = np.flatnonzero(steps["step"] > 0)
    found = {"option before": information(o[later], o[later - 1])}
    phases = {name: phase(steps[f"obs{i}"]) for name, i in QUANTITIES.get(task, {}).items()}
    found |= {name.partition(" [")[0]: information(o, bins) for name, bins in phases.items()}
    if len(phases) > 1:
        together = sum(bins * BINS**i for i, bins in enumerate(phases.values()))
        found[phase_of(task)] = information(o, together)
    return found


def phase_of(task: str) -> str:
    """What explain calls the phase that all quantities of a task make together."""
    only, *more = QUANTITIES[task]
    return "both" if more else only.partition(" [")[0]


def draw(name: str, task: str, steps: dict[str, np.ndarray]) -> Drawing:
    """The first episode: quantities of the state above the options."""
    first = steps["episode"] == 0
    time, o = steps["step"][first], steps["o"][first].astype(int)
    K = sum(column.startswith("P") for column in steps)
    quantities = QUANTITIES.get(task, {})
    figure, axes = new_figure(7, 0.9, len(quantities) + 1, 1, sharex=True)
    for (panel,), (what, entry) in zip(axes, quantities.items()):
        panel.plot(time, steps[f"obs{entry}"][first], color="#1a1a1a", linewidth=0.8)
        panel.set_ylabel(what)
    line, = axes[-1]
    edges = np.append(time, time[-1] + 1)
    line.grid(False)
    line.pcolormesh(edges, [0, 1], o[None, :], cmap=ListedColormap(COLORS[:K]), vmin=-0.5,
                    vmax=K - 0.5)
    line.set(yticks=[], xlabel="step", ylabel="option")
    for k in range(K):
        line.plot([], [], color=COLORS[k], linewidth=6, label=f"{k}: {(o == k).mean():.0%}")
    line.legend(ncols=K, loc="lower center", bbox_to_anchor=(0.5, 1))
    axes[0][0].set_title(name)
    return Drawing(f"timeline_{name}", f"Options of {name} over an episode.", figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trajectories", type=Path, nargs="+",
                        help="<task>-<fidelity>.csv of option2vec eval --trajectory")
    parser.add_argument("--out", type=Path, required=True, help="folder of figures, options.csv")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    fresh = options.out / "options.csv.new"
    try:
        with fresh.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["policy", "steps", "entropy_bits", "with", "bits", "shuffled_bits",
                            "shuffled_95_bits"])
            for path in options.trajectories:
                name, steps = path.stem, read_numbers(path)
                task = name.rpartition("-")[0]
                save(draw(name, task, steps), options.out)
                for what, found in explain(task, steps).items():
                    table.writerow([name, len(steps["o"]), f"{entropy(steps['o']):.4f}", what,
                                    *(f"{x:.4f}" for x in found)])
    except (DamagedFile, KeyError, OSError) as error:
        fresh.unlink(missing_ok=True)
        sys.exit(f"timeline: {error}")
    fresh.replace(options.out / "options.csv")
    print(options.out / "options.csv")


if __name__ == "__main__":
    main()
