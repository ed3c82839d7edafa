"""The folder of a run, as docs/formats.md describes it."""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from option2vec_results.records import DamagedFile, read_numbers


@dataclass(frozen=True)
class RunFolder:
    """Tables are columns by name; empty cells are NaN. A table that is not there is {}."""
    path: Path
    config: dict[str, Any]
    manifest: dict[str, Any]
    episodes: dict[str, np.ndarray]
    updates: dict[str, np.ndarray]
    evals: dict[str, np.ndarray]
    timing: dict[str, np.ndarray]


def load_run(folder: str | Path) -> RunFolder:
    """A run that has ended, or as far as its last checkpoint."""
    path = Path(folder)
    tables = {name: read_numbers(path / f"{name}.csv") if (path / f"{name}.csv").is_file() else {}
              for name in ("episodes", "updates", "evals", "timing")}
    try:
        config = tomllib.loads((path / "config.toml").read_text(encoding="utf-8"))
        manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))
    except ValueError as error:
        raise DamagedFile(f"{path}: {error}") from None
    return RunFolder(path, config, manifest, **tables)
