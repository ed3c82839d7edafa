"""Somebody's own runs beside these: `make report MINE=...`, see docs/compare.md.

What is joined is a further method of both fidelities, with the same statistics: its cells come with
those of every load_cells of plots.records.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plots.records import (FIDELITIES, METHODS, PAIRS, TASKS, Cell, DamagedFile, Key, Run, finite,
                           joined, load_run, read_table)
from plots.samples import GRID
from plots.style import LOOKS, Look

WINDOW = 20  # episodes that a return is the mean of, as in our records
WHOLE = 0.95  # of the longest run of a task: a table does not say how long a run should be
OWN_LOOKS = (Look("#7b3294", (0, (5, 1)), "*"), Look("#a6611a", (0, (3, 1, 1, 1)), "p"),
             Look("#005f5f", (0, (7, 1)), "h"), Look("#b2182b", (0, (1, 2)), "d"))


class Curve(NamedTuple):
    """Of a run: smoothed returns, and the steps that it should make."""
    path: Path
    method: str
    task: str
    seed: int
    step: np.ndarray
    ret: np.ndarray
    wanted: int
    made: int
    diverged: bool = False

    def __str__(self) -> str:
        return f"{self.path}: {self.method} on {self.task}, seed {self.seed}"


def join(paths: Iterable[Path]) -> list[str]:
    """Joins the runs of tables and folders. Returns a message for each run that is left out; a
    table that cannot be read is a DamagedFile."""
    refused: list[str] = []
    cells: dict[tuple[str, str], dict[int, Run]] = {}
    for path in paths:
        for curve in _of_folder(path, refused) if path.is_dir() else _of_table(path):
            runs = cells.setdefault((curve.method, curve.task), {})
            if problem := _problem(curve, runs):
                refused.append(f"{curve}: {problem}")
            else:
                runs[curve.seed] = Run(
                    curve.path, Key("mine", "", curve.task, curve.method), curve.seed,
                    curve.diverged, curve.made, curve.wanted, 1, {}, curve.step, curve.ret,
                    np.empty((len(curve.step), 0)), np.empty((len(curve.step), 0)))
    taken = {*METHODS, *METHODS.values()}
    for (name, task), runs in sorted(cells.items()):
        if not runs:
            continue
        method = f"{name} (mine)" if name in taken else name
        if method not in METHODS:
            LOOKS[method] = OWN_LOOKS[len(METHODS) % len(OWN_LOOKS)]
            METHODS[method] = method
        cell = Cell(tuple(run for _, run in sorted(runs.items())), 0)
        joined.update({Key(fidelity, "", task, method): cell for fidelity in FIDELITIES})
    return refused


def smoothed(step: np.ndarray, ret: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Episodes, by step -> the mean return of the last WINDOW ones, at the step of the last."""
    if len(step) < WINDOW:
        return step[:0], ret[:0]
    return step[WINDOW - 1:], np.lib.stride_tricks.sliding_window_view(ret, WINDOW).mean(axis=1)


def _problem(curve: Curve, runs: dict[int, Run]) -> str:
    if curve.task not in TASKS and curve.task not in PAIRS:
        return "unknown task"
    if curve.seed in runs:
        return "is there twice"
    if any(run.wanted != curve.wanted for run in runs.values()):
        return f"{curve.wanted} steps, others have {next(iter(runs.values())).wanted}"
    if not curve.diverged and curve.made < curve.wanted:
        return f"ends at step {curve.made}, not {curve.wanted}"
    return "" if len(curve.step) or curve.diverged else f"fewer than {WINDOW} episodes"


def _of_table(path: Path) -> Iterator[Curve]:
    """Columns method, task, seed, step and either return (a row an episode) or return_20 (smoothed
    already), in any order."""
    with path.open(encoding="utf-8") as file:
        header = file.readline().rstrip("\r\n").split(",")
    kinds = {"method": _name, "task": _name, "seed": int, "step": int}
    last = "return_20" if "return_20" in header else "return"
    if sorted(header) != sorted([*kinds, last]):
        raise DamagedFile(f"{path}:1: columns {','.join(header)}, not method,task,seed,step,return")
    kinds[last] = finite
    runs: dict[tuple[str, str, int], list[tuple[int, float]]] = {}
    for row in read_table(path, {name: kinds[name] for name in header}):
        runs.setdefault((row["method"], row["task"], row["seed"]), []).append(
            (row["step"], row[last]))
    longest: dict[tuple[str, str], int] = {}
    for (method, task, _), points in runs.items():
        longest[method, task] = max(longest.get((method, task), 0), *(s for s, _ in points))
    for (method, task, seed), points in runs.items():
        points.sort(key=lambda point: point[0])
        step, ret = np.array(points, dtype=float).T
        wanted = -(-longest[method, task] // GRID) * GRID
        made = wanted if step[-1] >= WHOLE * longest[method, task] else int(step[-1])
        if last == "return":
            step, ret = smoothed(step, ret)
        yield Curve(path, method, task, seed, step, ret, wanted, made)


def _of_folder(path: Path, refused: list[str]) -> Iterator[Curve]:
    """Of all folders of runs in it, wherever they lie, and whatever their method."""
    names = {task: name for name, task in PAIRS.items()}
    folders = [config.parent for config in sorted(path.glob("**/config.toml"))
               if not any(part.startswith(".") for part in config.relative_to(path).parts)]
    if not folders:
        raise DamagedFile(f"{path}: holds no folder of a run")
    for folder in folders:
        try:
            run = load_run(folder)
            head, status = run.config["run"], run.manifest["status"]
            step, ret = smoothed(run.episodes["step"], run.episodes["return"])
            curve = Curve(folder, head["algorithm"], names.get(head["task"], head["task"]),
                          head["seed"], step, ret, head["steps"], run.manifest["steps"],
                          status == "diverged")
        except (DamagedFile, OSError) as error:
            refused.append(str(error))
        except (KeyError, TypeError) as error:
            refused.append(f"{folder}: no {error}")
        else:
            if status in ("done", "diverged"):
                yield curve
            else:
                refused.append(f"{folder}: {status}")


def _name(text: str) -> str:
    if not text.strip() or "," in text:
        raise ValueError("no name")
    return text
