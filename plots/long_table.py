"""Writes results/records.csv: one long table of all records, a row a point of a learning curve."""

import argparse
from collections.abc import Mapping
from pathlib import Path

from plots.records import Cell, Key, load_cells
from plots.style import RESULTS

COLUMNS = "fidelity,variant,task,method,seed,diverged,step,return_20"


def long_table(cells: Mapping[Key, Cell]) -> str:
    """Numbers are read back as they were."""
    lines = [COLUMNS]
    for key, cell in cells.items():
        for run in cell.runs:
            head = ",".join([*key, str(run.seed), str(int(run.diverged))])
            lines += [f"{head},{step:.0f},{float(ret)!r}" for step, ret in zip(run.step, run.ret)]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, default=RESULTS)
    options = parser.parse_args()
    path = options.results / "records.csv"
    fresh = path.with_name("records.csv.new")
    fresh.write_text(long_table(load_cells(options.results)), encoding="utf-8")
    fresh.replace(path)
    print(path)


if __name__ == "__main__":
    main()
