"""CPU time of our program beside that of others for the same work, see docs/performance.md.

make bench-peers installs the others' packages into build/peers. Each program runs at two lengths;
the difference of CPU times (user and system) over that of steps is free of start-up. Programs take
turns, so that a shared machine's good and bad minutes meet all of them. The table replaces the one
in docs/performance.md.
"""

import argparse
import os
import statistics
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[2]
PEERS = ROOT / "bench" / "peers"
PYTHON = ROOT / "build" / "peers" / "bin" / "python"
BEGIN, END = "<!-- make bench-peers: begin -->", "<!-- end -->"
OURS = ("HalfCheetah-v2", "Ant-v2")


@dataclass
class Program:
    """A command before a number of steps, and what is after it; `scale` lengthens fast ones."""

    work: str
    name: str
    command: list[str]
    scale: int
    after: tuple[str, ...] = ()

    def cpu_seconds(self, steps: int, folder: Path) -> float:
        """Of one run."""
        command = [part.format(folder=folder) for part in self.command]
        process = subprocess.Popen([*command, str(steps), *self.after], cwd=folder,
                                   env=os.environ | {"OMP_NUM_THREADS": "1",
                                                     "MKL_NUM_THREADS": "1",
                                                     "CUDA_VISIBLE_DEVICES": ""},
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        errors = process.stderr.read().decode()
        _, status, usage = os.wait4(process.pid, 0)
        if status != 0:
            sys.exit(f"{' '.join(command)}: {errors}")
        return usage.ru_utime + usage.ru_stime


def programs(task: str) -> list[Program]:
    """Those of a task of ours."""
    name = task.removesuffix("-v2")
    own, bench = ROOT / "build/release/option2vec", ROOT / "build/release/bench/o2v_bench"
    python = [str(PYTHON), "-W", "ignore"]
    # Of -v5 Ant computes contact forces, which ours does not.
    twin = f"{name}-v4"
    return [
        Program(f"PPO, {name}", "option2vec",
                [str(own), "train", "--task", task, "--algo", "ppo", "--out", "{folder}/run",
                 "--steps"], 10),
        Program(f"PPO, {name}", "Stable-Baselines3",
                [*python, str(PEERS / "train_sb3.py"), twin], 1),
        Program(f"steps alone, {name}", "option2vec", [str(bench), "--steps", task], 10),
        Program(f"steps alone, {name}", "gymnasium",
                [*python, str(PEERS / "step_gymnasium.py"), twin], 5),
        Program(f"steps alone, {name}", "EnvPool, 1 task",
                [*python, str(PEERS / "step_envpool.py"), twin], 5, ("1",)),
        Program(f"steps alone, {name}", "EnvPool, 64 tasks",
                [*python, str(PEERS / "step_envpool.py"), twin], 5, ("64",)),
    ]


def measure(all_programs: list[Program], short: int, long: int, turns: int) -> list[list[float]]:
    """CPU microseconds a step of each program in each turn."""
    costs: list[list[float]] = [[] for _ in all_programs]
    for _ in range(turns):
        for program, cost in zip(all_programs, costs):
            lengths = [program.scale * steps for steps in (short, long)]
            seconds = []
            for steps in lengths:
                with TemporaryDirectory() as folder:
                    seconds.append(program.cpu_seconds(steps, Path(folder)))
            cost.append(1e6 * (seconds[1] - seconds[0]) / (lengths[1] - lengths[0]))
            print(f"{program.work:24} {program.name:20} {cost[-1]:8.1f} us", flush=True)
    return costs


def table(all_programs: list[Program], costs: list[list[float]]) -> str:
    """Markdown: medians, least ones, and ratios to our median of the same work."""
    own = {program.work: statistics.median(cost)
           for program, cost in zip(all_programs, costs) if program.name == "option2vec"}
    lines = ["| work | program | CPU [µs a step], median | least | over ours |",
             "|---|---|---|---|---|"]
    for program, cost in zip(all_programs, costs):
        median = statistics.median(cost)
        lines.append(f"| {program.work} | {program.name} | {median:.1f} | {min(cost):.1f} | "
                     f"{median / own[program.work]:.1f} |")
    return "\n".join(lines)


def main() -> None:
    """Measures, and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=5)
    turns = parser.parse_args().turns
    all_programs = [program for task in OURS for program in programs(task)]
    costs = measure(all_programs, short=2 * 2048, long=5 * 2048, turns=turns)
    page = ROOT / "docs" / "performance.md"
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    after = rest.split(END)[1]
    model = next((line.split(": ")[1] for line in open("/proc/cpuinfo", encoding="utf-8")
                  if line.startswith("model name")), "unknown").strip()
    packages = ", ".join((PEERS / "requirements.txt").read_text(encoding="utf-8").split())
    text = (f"Processor: {model}. Turns: {turns}. Packages: {packages}.\n\n"
            f"{table(all_programs, costs)}")
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
