"""CPU hours of the paper's whole grid, by task and by part, from results/bench.json.

Methods were timed on all tasks (PPO, Option2Vec) or on two. On the others a method's products, and
what is left beside products and physics, lie on the line through the two tasks over PPO's.
"""

import tomllib
from pathlib import Path

from plots.records import FIDELITIES, METHODS, PAIRS
from plots.tables import read_bench

ROOT = Path(__file__).resolve().parents[1]
PARTS = ("physics", "products", "rest")
# The tasks of a domain cost the same, and the bench times one of each.
DOMAINS = {"cartpole": "dm-cartpole-balance", "reacher": "dm-reacher-easy",
           "cheetah": "dm-cheetah-run", "fish": "dm-fish-upright", "walker": "dm-walker-walk"}


def cell_parts(cell: dict) -> dict[str, float]:
    """CPU microseconds a step by part; products at their rate in the bound."""
    physics, products = cell["physics_us"], cell["bound_products_us"]
    return {"physics": physics, "products": products,
            "rest": cell["total_us"] - physics - products}


def estimate(cells: dict, task: str, method: str, fidelity: str) -> dict[str, float]:
    """Parts of a cell, whether it was timed or not."""
    if (task, method, fidelity) in cells:
        return cells[task, method, fidelity]
    ppo = cells[task, "ppo", fidelity]
    parts = {"physics": ppo["physics"]}
    small, large = ((cells[t, "ppo", fidelity], cells[t, method, fidelity])
                    for t in ("HalfCheetah-v2", "Humanoid-v2"))
    for part in ("products", "rest"):
        slope = (large[1][part] - small[1][part]) / (large[0][part] - small[0][part])
        parts[part] = small[1][part] + slope * (ppo[part] - small[0][part])
    return parts


def grid_hours(cells: dict) -> list[tuple[str, dict[str, float]]]:
    """CPU hours by part for each task and pair of both suites."""
    hours = []
    for suite in ("single_task", "transfer"):
        config = tomllib.loads((ROOT / "paper_configs" / f"{suite}.toml").read_text("utf-8"))
        grid = config["experiment"]
        steps = config["run"]["steps"] * len(grid["seeds"])
        for task in grid["tasks"]:
            timed = DOMAINS[PAIRS[task].split("-")[1]] if task in PAIRS else task
            sums = dict.fromkeys(PARTS, 0.0)
            for method in grid["algorithms"]:
                for fidelity in grid["fidelities"]:
                    parts = estimate(cells, timed, method, fidelity)
                    for part in PARTS:
                        sums[part] += parts[part] * steps / 3.6e9
            hours.append((task, sums))
    return hours


def main() -> None:
    """Prints the table."""
    cells = {(r["task"], r["method"], r["fidelity"]): cell_parts(r)
             for r in read_bench(ROOT / "results")}
    wanted = {(task, method, fidelity) for fidelity in FIDELITIES
              for task in ("HalfCheetah-v2", "Humanoid-v2") for method in METHODS}
    if not wanted <= cells.keys():
        raise SystemExit("results/bench.json lacks cells: run make bench whole")
    hours = grid_hours(cells)
    hours.append(("all", {part: sum(h[part] for _, h in hours) for part in PARTS}))
    print("CPU hours of the whole grid, estimated from results/bench.json")
    print(f"{'task':28}" + "".join(f"{name:>10}" for name in (*PARTS, "total")))
    for task, parts in hours:
        values = [*parts.values(), sum(parts.values())]
        print(f"{task:28}" + "".join(f"{value:10.1f}" for value in values))


if __name__ == "__main__":
    main()
