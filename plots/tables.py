"""Reads the tables of results/ that are not records; where a file is absent, there are no rows."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plots.records import (INTERPRETATIONS, LEFT_OUT, Columns, DamagedFile, Rows, finite,
                           number_or_nan, read_table)

COLUMNS: dict[str, Columns] = {
    "params": {  # option2vec params --csv
        "task": str, "S": int, "A": int, "method": str, "fidelity": str, "width": int,
        "counted": int, "used": int, "share": number_or_nan},
    "gradcheck": {  # make gradcheck
        "name": str, "entries": int, "largest_gradient": finite, "largest_error": finite},
    "parity": {  # make parity
        "check": str, "name": str, "deviation": finite, "bound": finite, "where": str,
        "deviation_all_rows": finite},
    "theory": {  # make theory
        "name": str, "gap": finite, "relation": str, "tolerance": finite, "verdict": str,
        "compared": str},
    "policies/options": {  # make timelines
        "policy": str, "steps": int, "entropy_bits": finite, "with": str, "bits": finite,
        "shuffled_bits": finite, "shuffled_95_bits": finite},
}
PARTS = ("physics_us", "inference_us", "learning_us")  # of an environment step
COUNTERS = PARTS + ("total_us", "bound_us", "bound_products_us", "bound_adam_us", "MFLOP", "ratio")


def read_rows(results: Path, name: str) -> Rows:
    """Rows of results/<name>.csv, a key of COLUMNS."""
    path = results / f"{name}.csv"
    return read_table(path, COLUMNS[name]) if path.is_file() else []


def read_bench(results: Path) -> Rows:
    """Costs of an environment step from bench.json of `make bench`: task, method, fidelity and
    COUNTERS, CPU microseconds and 1e6 floating-point operations a step."""
    path = results / "bench.json"
    if not path.is_file():
        return []
    try:
        benchmarks = json.loads(path.read_text(encoding="utf-8"))["benchmarks"]
    except json.JSONDecodeError as error:
        raise DamagedFile(f"{path}:{error.lineno}: {error.msg}") from None
    except (KeyError, TypeError):
        raise DamagedFile(f"{path}:1: no list 'benchmarks'") from None
    rows = []
    for benchmark in benchmarks:
        kind, *names = benchmark.get("name", "").split("/")
        if kind != "step":
            continue
        try:
            task, method, fidelity, _ = names
            counters = {name: finite(benchmark[name]) for name in COUNTERS}
        except (KeyError, ValueError) as error:
            raise DamagedFile(f"{path}:1: {benchmark['name']}: {error}") from None
        rows.append({"task": task, "method": method, "fidelity": fidelity} | counters)
    return rows


def read_switches(results: Path) -> Rows:
    """The switches of results/registry.json, as `option2vec list --json` prints it."""
    path = results / "registry.json"
    if not path.is_file():
        return []
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["switches"]
        return [{key: row[key] for key in ("id", "paper", "released", "methods", "effect")}
                for row in rows]
    except (KeyError, TypeError, ValueError) as error:
        raise DamagedFile(f"{path}: not the output of `option2vec list --json`: {error!r}"
                          ) from None


@dataclass(frozen=True)
class Interpretation:
    """Of a run, a row an embedding dimension; columns: plots/fig_embedding.py."""
    W_o: np.ndarray  # (D, K)
    effects: np.ndarray  # (D, A)
    perturbed: np.ndarray  # (D, A)
    delta: float


def read_interpretations(results: Path, experiments: Sequence[str] | None = None
                         ) -> Mapping[Path, Interpretation]:
    """By file; all dimensions 0, 1, ..., and the same delta in every row. They are of whole runs:
    none where only experiments that are no evidence are asked for."""
    if experiments is not None and set(experiments) <= set(LEFT_OUT):
        return {}
    found = {}
    for path in sorted((results / INTERPRETATIONS).glob("*/*/*/seed-*.csv")):
        with path.open(encoding="utf-8") as file:
            header = file.readline().rstrip("\n").split(",")
        K = sum(name.startswith("embedding_") for name in header)
        A = sum(name.startswith("effect_") for name in header)
        names = [f"embedding_{k}" for k in range(K)] + [
            f"{quantity}_{a}" for quantity in ("effect", "perturbed") for a in range(A)]
        columns: Columns = {"dimension": int, **dict.fromkeys(names + ["delta"], finite)}
        table = np.array([list(row.values()) for row in read_table(path, columns)], dtype=float)
        if not len(table) or K == 0 or A == 0 or (table[:, 0] != np.arange(len(table))).any():
            raise DamagedFile(f"{path}:1: not one row a dimension 0, 1, ... with all quantities")
        delta = float(table[0, -1])
        if delta <= 0 or (table[:, -1] != delta).any():
            raise DamagedFile(f"{path}:1: delta is not the same positive number in every row")
        W_o, effects, perturbed = np.split(table[:, 1:-1], (K, K + A), axis=1)
        found[path] = Interpretation(W_o, effects, perturbed, delta)
    return found
