"""The records of results/ for the scripts here; their reader is python/option2vec_results."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "python"))  # of the checkout, before others

from option2vec_results.records import (  # noqa: E402,F401
    FIDELITIES, FINITE, FORMAT, INFINITE, INTERPRETATIONS, LEFT_OUT, METHODS, MILLION, PAIRS, SEEDS,
    TASKS, Cell, Columns, DamagedFile, Key, Rows, Run, finite, load_cells, number_or_nan, read_run,
    read_table)
