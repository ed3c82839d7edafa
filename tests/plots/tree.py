"""Writes small results trees for the tests."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

from plots.records import PAIRS
from option2vec_results.standard import settings_of

ROOT = Path(__file__).parents[2]
REGISTRY = json.dumps({"switches": [{
    "id": "timelimit", "paper": "paper", "released": "released", "takes": "paper, released",
    "methods": ["ppo", "oc"], "effect": "bootstrap | terminal"}]})


def with_reference(results: Path) -> Path:
    """A results folder that has the authors' tables only."""
    shutil.copytree(ROOT / "results" / "reference", results / "reference")
    return results


def write_run(results: Path, task: str, algorithm: str, seed: int, returns: Sequence[float],
              fidelity: str = "paper", experiment: str = "single_task", options: str = "",
              status: str = "done", **more) -> Path:
    """A record with one return every 10 000 steps; the .json file. options: cells of the option
    columns, the same in every row. more: steps, settings, and further keys of the .json file."""
    steps = more.pop("steps", 10_000 * len(returns))
    wanted = more.pop("wanted", steps)
    settings = more.pop("settings", "hidden = 64")
    folder = results / experiment / fidelity / task / algorithm
    timelimit = settings_of(fidelity).get("timelimit")
    fidelity = fidelity.partition("-")[0]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"seed-{seed:03d}.json"
    config = (f'[run]\ntask = "{PAIRS.get(task, task)}"\nalgorithm = "{algorithm}"\n'
              f'fidelity = "{fidelity}"\nseed = {seed}\nsteps = {wanted}\n'
              f'[switches]\ntimelimit = "{timelimit or fidelity}"\n[algo.{algorithm}]\n{settings}\n')
    path.write_text(json.dumps({
        "status": status, "steps": steps, "commit": "0" * 40, "compiler": "GNU 12", "flags": "-O3",
        "versions": {"eigen": "3.4.0"}, "config": config} | more))
    K = (options.count(",") + 1) // 2
    header = ["step", "return_20"] + [f"usage_{k}" for k in range(K)]
    header += [f"duration_{k}_steps" for k in range(K)]
    rows = [f"{10_000 * (i + 1)},{x}" + (f",{options}" if options else "")
            for i, x in enumerate(returns)]
    path.with_suffix(".csv").write_text("\n".join([",".join(header)] + rows) + "\n")
    return path


def write_flat(results: Path, task: str, algorithm: str, finals: Sequence[float], **more) -> None:
    """Whole runs, seeds 0, 1, ..., whose return is the same from the first row to the last."""
    for seed, final in enumerate(finals):
        write_run(results, task, algorithm, seed, [final] * (200 if task in PAIRS else 100), **more)
