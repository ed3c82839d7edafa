"""The records of results/ for the scripts here; their reader is python/option2vec_results."""

import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "python"))  # of the checkout, before others

from option2vec_results import records  # noqa: E402
from option2vec_results.records import (  # noqa: E402,F401
    FIDELITIES, FINITE, FORMAT, INFINITE, INTERPRETATIONS, LEFT_OUT, METHODS, MILLION, PAIRS,
    SEEDS, TASKS, Cell, Columns, DamagedFile, Key, Rows, Run, finite, number_or_nan,
    read_numbers, read_run, read_table)
from option2vec_results.run import load_run  # noqa: E402,F401

_SUITE = Path(__file__).parents[1] / "paper_configs" / "single_task.toml"
# METHODS also has those that are registered or joined without being part of the grid.
GRID_METHODS = tuple(m for m in METHODS if m in tomllib.loads(
    _SUITE.read_text(encoding="utf-8"))["experiment"]["algorithms"])
joined: dict[Key, Cell] = {}  # runs from elsewhere, by plots/mine.py


def load_cells(results: Path, experiments: Iterable[str] | None = None,
               refused: list[str] | None = None) -> dict[Key, Cell]:
    """Cells of the records, as the package reads them, and the joined ones."""
    return records.load_cells(results, experiments, refused) | joined
