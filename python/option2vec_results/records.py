"""Reads records of finished runs and the tables of results/.

Strict: an unknown column, a number that is none, a file that contradicts its place or its
neighbours is a DamagedFile error that names file and line. A record with one is left out, by name.

A record is results/<experiment>/<fidelity>[-<switch>=<value>]/<task>/<algorithm>/seed-NNN.json
(status, versions, resolved configuration) and .csv beside it (smoothed return and, of methods with
options, their usage and durations). For a run over two tasks <task> is the pair's name.
"""

import csv
import json
import math
import re
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from option2vec_results.standard import differences, registry, settings_of, standard, toml

INFINITE = ("HalfCheetah-v2", "Swimmer-v2", "HumanoidStandup-v2", "Reacher-v2")  # never terminate
FINITE = ("Walker2d-v2", "Hopper-v2", "InvertedPendulum-v2", "InvertedDoublePendulum-v2", "Ant-v2",
          "Humanoid-v2")
TASKS = INFINITE + FINITE
PAIRS = {p["name"]: f"{p['first']},{p['second']}" for p in registry()["pairs"]}
METHODS = {m["id"]: m["name"] for m in registry()["algorithms"]}  # names in the authors' tables
FIDELITIES = ("paper", "released")
SEEDS = range(10)  # of a whole grid
MILLION = 1_000_000  # [environment steps] of training on a task
LEFT_OUT = ("quick", "ci")  # experiments that are no evidence
INTERPRETATIONS = "interpret"  # beside the experiments; plots/tables.py reads them
FORMAT = 1  # of records; those that do not say it are of 1
NO_SETTINGS = ("run.seed", "run.checkpoint_every", "run.eval_every", "run.eval_episodes")


Columns = Mapping[str, Callable[[str], Any]]  # what converts a cell of each
Rows = list[dict[str, Any]]


class DamagedFile(Exception):
    """A file that cannot be used; the message begins with its name and line."""


class Key(NamedTuple):
    """What a cell of the grid is: all but the seed. variant is "" or "switch=value"."""
    fidelity: str
    variant: str
    task: str
    algorithm: str


@dataclass(frozen=True)
class Run:
    """A record. Arrays have one row a grid step; K is the number of options, 0 without columns."""
    path: Path
    key: Key
    seed: int
    diverged: bool
    steps: int  # made
    wanted: int  # of its configuration
    revision: int  # of the method's code; 1 where the record does not say
    settings: Mapping[str, Any]  # "section.key": value, of what changes training, but the seed
    step: np.ndarray  # (R)
    ret: np.ndarray  # (R) mean return of the last 20 episodes
    usage: np.ndarray  # (R, K) share of the steps with the option
    duration: np.ndarray  # (R, K) [steps], NaN where the option was not used

    def return_at(self, step: int) -> float | None:
        """The last smoothed return at or before `step`; None for fewer than 20 episodes."""
        row = int(np.searchsorted(self.step, step, side="right")) - 1
        return None if row < 0 else float(self.ret[row])


@dataclass(frozen=True)
class Cell:
    """The runs of a cell by seed, of its newest revision only."""
    runs: tuple[Run, ...]
    older: int  # runs of older revisions, left out

    @property
    def wanted(self) -> int:
        """Steps of its runs, the same for all."""
        return self.runs[0].wanted

    @property
    def whole(self) -> tuple[Run, ...]:
        """Runs that reached the end with at least 20 episodes."""
        return tuple(r for r in self.runs if r.steps >= self.wanted and len(r.step))

    @property
    def diverged(self) -> int:
        """Runs that diverged before the end: results, shown and counted, without a final return."""
        return sum(r.diverged and r.steps < self.wanted for r in self.runs)


def read_table(path: Path, columns: Columns) -> Rows:
    """Rows of a CSV file that has exactly these columns, each converted by its function."""
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.reader(file)
        header = next(reader, [])
        if header != list(columns):
            raise DamagedFile(f"{path}:1: columns {','.join(header)}, not {','.join(columns)}")
        rows = []
        for cells in reader:
            where = f"{path}:{reader.line_num}"
            if len(cells) != len(columns):
                raise DamagedFile(f"{where}: {len(cells)} cells, not {len(columns)}")
            rows.append({name: _convert(where, name, convert, cell)
                         for (name, convert), cell in zip(columns.items(), cells)})
        return rows


def read_numbers(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV file of numbers, whatever their names; an empty cell is NaN."""
    with path.open(encoding="utf-8") as file:
        names = file.readline().rstrip("\n").split(",")
    rows = read_table(path, dict.fromkeys(names, number_or_nan))
    return {name: np.array([row[name] for row in rows], dtype=float) for name in names}


def finite(text: str) -> float:
    """A number that is one."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError("not finite")
    return value


def number_or_nan(text: str) -> float:
    """A number, or NaN for an empty cell."""
    return finite(text) if text else math.nan


def load_records(path: str | Path, refused: list[str] | None = None) -> dict[str, np.ndarray]:
    """Columns of one long table, a row a point of a learning curve: fidelity, variant, task,
    method, seed, revision, diverged, step, return, and usage_k and duration_k of options, NaN
    where there is none. `path`: results/ (all experiments but quick and ci) or a folder of it.
    Which records count, and where the others are named, is load_cells' business."""
    path = Path(path).resolve()
    if not path.is_dir():
        raise FileNotFoundError(f"{path}: not a folder")
    alone = any(path.glob("*/*/*/*.json"))  # an experiment
    cells = load_cells(*((path.parent, [path.name]) if alone else (path, None)), refused)
    runs = [run for cell in cells.values() for run in cell.runs]
    length = [len(run.step) for run in runs]

    def repeated(values: list, kind: type) -> np.ndarray:
        return np.repeat(np.array(values, dtype=kind), length)

    columns = {name: repeated([getattr(run.key, field) for run in runs], str) for name, field in (
        ("fidelity", "fidelity"), ("variant", "variant"), ("task", "task"), ("method", "algorithm"))}
    columns |= {name: repeated([getattr(run, name) for run in runs], kind)
                for name, kind in (("seed", int), ("revision", int), ("diverged", bool))}
    columns["step"] = np.concatenate([run.step for run in runs] or [[]]).astype(int)
    columns["return"] = np.concatenate([run.ret for run in runs] or [[]])
    K = max((run.usage.shape[1] for run in runs), default=0)
    for name in ("usage", "duration"):
        padded = [np.pad(x, ((0, 0), (0, K - x.shape[1])), constant_values=np.nan)
                  for x in (getattr(run, name) for run in runs)]
        columns |= {f"{name}_{k}": np.concatenate([x[:, k] for x in padded]) for k in range(K)}
    return columns


def load_cells(results: Path, experiments: Iterable[str] | None = None,
               refused: list[str] | None = None) -> dict[Key, Cell]:
    """Cells of `experiments`; by default of all folders of records but quick and ci. Experiments
    are pooled. Records that do not count are left out and named: in `refused`, without it on
    standard error. Such are damaged ones, those in a place that contradicts them, a run that is
    there twice, and settings that are not the most frequent ones of the cell."""
    bad: list[str] = [] if refused is None else refused
    if experiments is None:
        folders = [d.name for d in results.iterdir() if d.is_dir()] if results.is_dir() else []
        experiments = sorted(set(folders) - {*LEFT_OUT, INTERPRETATIONS})
    groups: dict[Key, dict[int, Run]] = {}
    for experiment in experiments:
        for path in sorted((results / experiment).glob("*/*/*/*.json")):
            if any(part.startswith(".") for part in path.parts[-4:]):
                continue
            try:
                run = read_run(path)
                group = groups.setdefault(run.key, {})
                if run.seed in group:
                    raise DamagedFile(f"{path}:1: the same run as {group[run.seed].path}")
                group[run.seed] = run
            except DamagedFile as error:
                bad.append(str(error))
    cells = {key: _cell([group[seed] for seed in sorted(group)], bad)
             for key, group in sorted(groups.items()) if group}
    if refused is None and bad:
        print(*bad, f"{len(bad)} records refused", sep="\n", file=sys.stderr)
    return cells


def read_run(path: Path) -> Run:
    """The record with this .json file."""
    try:
        meta = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise DamagedFile(f"{path}:{error.lineno}: {error.msg}") from None
    except (OSError, ValueError) as error:
        raise DamagedFile(f"{path}:1: {error}") from None
    kinds: dict[str, type | tuple[type, ...]] = {
        "status": str, "steps": int, "commit": str, "compiler": str, "flags": str,
        "versions": dict, "config": str}
    later: dict[str, type | tuple[type, ...]] = {
        "wall_seconds": (int, float), "cpu_seconds": (int, float), "revision": int,
        "format": int}
    _check(isinstance(meta, dict), path, "no JSON object")
    for name in sorted(set(kinds) - set(meta)):
        raise DamagedFile(f"{path}:1: no '{name}'")
    for name, value in meta.items():
        _check(name in kinds | later, path, f"unknown '{name}'")
        _check(isinstance(value, (kinds | later)[name]) and not isinstance(value, bool), path,
               f"'{name}': {value}")
    _check(meta.get("format", 1) == FORMAT, path,
           f"format {meta.get('format')}; these scripts read {FORMAT}")
    _check(meta["status"] in ("done", "diverged"), path, f"status '{meta['status']}'")
    try:
        config = tomllib.loads(meta["config"])
        head = config["run"]
        made = (head["fidelity"], head["task"], head["algorithm"], head["seed"])
        wanted = int(head["steps"])
    except (tomllib.TOMLDecodeError, KeyError, TypeError) as error:
        raise DamagedFile(f"{path}:1: config: {error}") from None

    fidelity, _, variant = path.parts[-4].partition("-")
    task, algorithm = path.parts[-3:-1]
    seed = made[3]
    place = (fidelity, PAIRS.get(task, task), algorithm, path.name)
    made = (*made[:3], f"seed-{seed:03d}.json")
    _check(made == place, path, f"config is of {made}, the place of {place}")
    _check(task in TASKS or task in PAIRS, path, f"unknown task '{task}'")
    _check(algorithm in METHODS, path, f"unknown method '{algorithm}'")
    _check(fidelity in FIDELITIES, path, f"unknown fidelity '{fidelity}'")
    _check(meta["status"] == "diverged" or meta["steps"] >= wanted, path,
           f"done after {meta['steps']} of {wanted} steps")

    own = dict(config.get("switches", {})) | dict(config.get("algo", {}).get(algorithm, {}))
    whole = standard(path.parts[-5], fidelity, task, algorithm, task in PAIRS) or own
    for difference in differences(own, whole | settings_of(path.parts[-4])):
        raise DamagedFile(f"{path}:1: another configuration than its place's: {difference}")

    settings = {name: value for name, value in _flat(config) if name not in NO_SETTINGS}
    step, ret, usage, duration = _read_curve(path.with_suffix(".csv"), meta["steps"])
    return Run(path, Key(fidelity, variant, task, algorithm), seed,
               meta["status"] == "diverged", meta["steps"], wanted, meta.get("revision", 1),
               settings, step, ret, usage, duration)


def _read_curve(path: Path, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    if not path.is_file():
        raise DamagedFile(f"{path}:1: missing")
    with path.open(encoding="utf-8") as file:
        header = file.readline().rstrip("\n").split(",")
    K = sum(name.startswith("usage_") for name in header)
    names = [f"usage_{k}" for k in range(K)] + [f"duration_{k}_steps" for k in range(K)]
    columns: Columns = {"step": int, "return_20": finite, **dict.fromkeys(names, number_or_nan)}
    table = np.array([list(row.values()) for row in read_table(path, columns)], dtype=float)
    table = table.reshape(-1, len(columns))
    step = table[:, 0]
    for row in np.flatnonzero(np.diff(step, prepend=0) <= 0):
        raise DamagedFile(f"{path}:{row + 2}: step {step[row]:.0f} does not increase")
    if len(step) and step[-1] > steps:
        raise DamagedFile(f"{path}:{len(step) + 1}: a step after the last, {steps}")
    return step, table[:, 1], table[:, 2:2 + K], table[:, 2 + K:]


def _cell(runs: list[Run], bad: list[str]) -> Cell:
    newest = [run for run in runs if run.revision == max(run.revision for run in runs)]
    most = max(newest, key=lambda run: sum(_unlike(run, other) is None for other in newest))
    kept = []
    for run in newest:
        if (name := _unlike(run, most)) is None:
            kept.append(run)
        else:
            bad.append(f"{run.path}:1: {toml(name.split('.')[-1], run.settings[name])}, but "
                       f"{most.settings[name]} in {most.path}")
    return Cell(tuple(kept), len(runs) - len(newest))


def _unlike(a: Run, b: Run) -> str | None:
    """A setting in which two runs differ. One that a record does not name is not compared."""
    names = sorted(a.settings.keys() & b.settings.keys())
    return next((name for name in names if a.settings[name] != b.settings[name]), None)


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _convert(where: str, name: str, convert: Callable[[str], Any], cell: str) -> Any:
    try:
        return convert(cell)
    except ValueError as error:
        raise DamagedFile(f"{where}: {name}: {error}: '{cell}'") from None


def _check(good: bool, path: Path, message: str) -> None:
    if not good:
        raise DamagedFile(f"{path}:1: {message}")
