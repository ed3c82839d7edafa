"""The campaign of faults: kills, full disks, limits, signals, closed streams, races.

Every case trains with the real program on a cheap task, disturbs it, goes on with --resume, and
compares the bytes with those of the undisturbed run. The seed fixes configurations, delays and
limits; where exactly a fault strikes is up to the machine, which is the point.

    make torture                          # the whole campaign
    make torture TORTURE="--scale 0.02"   # a quick look
"""

import argparse
import collections
import concurrent.futures
import csv
import itertools
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

TASKS = ["InvertedPendulum-v2", "Swimmer-v2", "CartPole"]  # the last is a pair: a change of task
METHODS = ["option2vec", "dac_onestep", "dac_ppo", "ahp_ppo", "iopg", "ppoc", "oc", "ppo"]
FIDELITIES = ["paper", "released"]
ONE_STEP = {"oc", "iopg"}  # methods without rollouts of a length to choose
STEPS = 3000  # [environment steps] about 0.5 s
PROMISED = ["config.toml", "episodes.csv", "updates.csv", "evals.csv", "last.ckpt"]
LONGEST = 300  # [s] a process that takes longer hangs
KILLS = 4  # of one run
STARTS = 10  # in one folder at a time
CHANCES = 40  # starts of a run until it must be done


class Failure(Exception):
    """What a case found."""


Ended = collections.namedtuple("Ended", "code error seconds")


class Campaign:
    """The program, a folder for its runs, and the undisturbed runs."""

    def __init__(self, program, folder, seed):
        self.program = program
        self.folder = folder
        self.seed = seed
        self.whole = {}  # run -> (folder, seconds)

    def command(self, run, folder):
        task, method, fidelity = run
        sets = [f"checkpoint_every={STEPS // 8}", f"eval_every={STEPS // 3}", "eval_episodes=1"]
        if method not in ONE_STEP:
            sets += ["rollout=64", "workers=2", "epochs=2"]
        return [self.program, "train", "--task", task, "--algo", method, "--fidelity", fidelity,
                "--seed", "1", "--steps", str(STEPS), "--out", str(folder), "--resume",
                *itertools.chain(*(["--set", s] for s in sets))]

    def start(self, run, folder, wrap=(), **options):
        options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL,
                   "stderr": subprocess.PIPE, **options}
        return subprocess.Popen([*wrap, *self.command(run, folder)], text=True, **options)

    def end(self, process):
        """Waits; a process that hangs is a failure."""
        begin = time.monotonic()
        try:
            _, error = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise Failure(f"hangs for {LONGEST} s") from None
        return Ended(process.returncode, error or "", time.monotonic() - begin)

    def undisturbed(self, run):
        folder = self.folder / "whole" / "-".join(run)
        ended = self.end(self.start(run, folder))
        if ended.code != 0:
            raise Failure(f"undisturbed run: exit {ended.code}: {ended.error}")
        self.whole[run] = folder, ended.seconds

    def finish(self, run, folder):
        """Goes on with a run to its end, and compares."""
        ended = self.end(self.start(run, folder))
        if not finished(ended):
            raise Failure(f"cannot be resumed: exit {ended.code}: {ended.error.strip()}")
        self.compare(run, folder)

    def compare(self, run, folder):
        whole, _ = self.whole[run]
        pairs = [(folder / name, whole / name) for name in PROMISED]
        pairs.append((folder.with_name(folder.name + ".csv"), whole.with_name(whole.name + ".csv")))
        for mine, other in pairs:
            if not mine.exists() or mine.read_bytes() != other.read_bytes():
                raise Failure(f"other bytes: {mine.name}")


def complains(ended):
    """Whether a process ended as one that met an error must: exit code 1 and its reason."""
    return ended.code == 1 and "option2vec: " in ended.error


def finished(ended):
    """Whether the run is done: by this process, or by one that was killed on its way out."""
    return ended.code == 0


def kill(campaign, run, folder, rng):
    """SIGKILL at random moments, several in one run."""
    struck = 0
    for chance in range(CHANCES):
        place = folder / f"run-{chance}"
        while struck < KILLS:
            process = campaign.start(run, place)
            try:
                process.wait(rng.uniform(0, 0.7) * campaign.whole[run][1])
            except subprocess.TimeoutExpired:
                process.kill()
            ended = campaign.end(process)
            if finished(ended):
                break
            if ended.code != -signal.SIGKILL:
                raise Failure(f"exit {ended.code}: {ended.error.strip()}")
            struck += 1
        if struck == KILLS:
            campaign.finish(run, place)
            return struck, "same"
        campaign.compare(run, place)
    raise Failure("is done before it can be killed")


def mount_small(place, pages):
    """A disk in memory, of pages of 4 KiB."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={4 * pages}k", "torture", place],
                   check=True, stderr=subprocess.DEVNULL)


def can_mount():
    """Whether this user may; in a container not even root always may."""
    with tempfile.TemporaryDirectory(prefix="o2v-torture-") as place:
        try:
            mount_small(place, pages=1)
        except (OSError, subprocess.CalledProcessError):
            return False
        subprocess.run(["umount", place], check=True)
        return True


def disk(campaign, run, folder, rng):
    """A disk that is full at some moment, and has room again."""
    needed = sum(f.stat().st_size for f in campaign.whole[run][0].iterdir())
    place = folder / "disk"
    place.mkdir()
    size = int(rng.uniform(0.05, 1.6) * needed) // 4096 + 1
    mount_small(place, pages=size)
    try:
        ended = campaign.end(campaign.start(run, place / "run"))
        # A folder that cannot even be made is refused as a bad argument.
        if ended.code != 0 and not complains(ended) and ended.code != 2:
            raise Failure(f"exit {ended.code}: {ended.error.strip()}")
        subprocess.run(["mount", "-o", "remount,size=64m", place], check=True)
        campaign.finish(run, place / "run")
    finally:
        subprocess.run(["umount", place], check=True)
    return 1, "same"


def limit(campaign, run, folder, rng):
    """A limit on the size of files; half of the processes ignore its signal and see the error."""
    largest = max(f.stat().st_size for f in campaign.whole[run][0].iterdir())
    size = int(rng.uniform(0, 1.2) * largest)
    killed = rng.random() < 0.5
    ended = campaign.end(campaign.start(run, folder / "run", wrap=["prlimit", f"--fsize={size}"],
                                        restore_signals=killed))
    if ended.code != 0 and not complains(ended) and not (
            killed and ended.code == -signal.SIGXFSZ):
        raise Failure(f"limit of {size} bytes: exit {ended.code}: {ended.error.strip()}")
    campaign.finish(run, folder / "run")
    return 1, "same"


def stop(campaign, run, folder, rng):
    """TERM, INT or HUP at a random moment."""
    which = rng.choice([signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
    process = campaign.start(run, folder / "run")
    try:
        process.wait(rng.uniform(0, 1) * campaign.whole[run][1])
    except subprocess.TimeoutExpired:
        process.send_signal(which)
    ended = campaign.end(process)
    stopped = ended.code == 1 and "use --resume to continue" in ended.error
    if ended.code not in (0, -which) and not stopped:
        raise Failure(f"{which.name}: exit {ended.code}: {ended.error.strip()}")
    campaign.finish(run, folder / "run")
    return 1, "same"


def streams(campaign, run, folder, rng):
    """Standard streams that are closed."""
    closed = [i for i in range(3) if rng.random() < 0.5] or [rng.randrange(3)]
    close = " ".join(f"{i}{'<' if i == 0 else '>'}&-" for i in closed)
    ended = campaign.end(campaign.start(run, folder / "run",
                                        wrap=["sh", "-c", f'exec "$@" {close}', "sh"]))
    if ended.code != 0:
        raise Failure(f"{close}: exit {ended.code}: {ended.error.strip()}")
    try:
        campaign.compare(run, folder / "run")
    except Failure as failure:
        raise Failure(f"{close}: {failure}") from None
    return 1, "same"


def race(campaign, run, folder, rng):
    """Starts in one folder at the same time: one trains, the others are refused.

    One that comes when all is done is told so, or has nothing to do."""
    place = folder / "run"
    processes = [campaign.start(run, place) for _ in range(STARTS)]
    ends = [campaign.end(process) for process in processes]
    for ended in ends:
        refused = ended.code == 2 and "another process is training in this folder" in ended.error
        if not finished(ended) and not refused:
            raise Failure(f"exit {ended.code}: {ended.error.strip()}")
    if all(ended.code != 0 for ended in ends):
        raise Failure("nobody trains")
    with open(place / "timing.csv", encoding="utf-8") as file:
        steps = [int(row["step"]) for row in csv.DictReader(file)]
    if any(a >= b for a, b in zip(steps, steps[1:])):
        raise Failure("two processes train in one folder")
    campaign.compare(run, place)
    return STARTS, "refused"


# name: (case, faults of the whole campaign, faults of a case)
KINDS = {
    "kill": (kill, 1000, KILLS),
    "disk": (disk, 200, 1),
    "limit": (limit, 100, 1),
    "stop": (stop, 50, 1),
    "streams": (streams, 50, 1),
    "race": (race, 100, STARTS),
}


def plan(kind, scale):
    """The runs of a kind's cases: all tasks, methods and fidelities in turn."""
    _, faults, of_case = KINDS[kind]
    runs = [(task, method, fidelity) for fidelity in FIDELITIES for method in METHODS
            for task in TASKS]
    # Seven is coprime to the number of runs: even few cases are of many kinds.
    count = max(1, round(scale * faults / of_case))
    return [runs[7 * i % len(runs)] for i in range(count)]


def attempt(campaign, kind, number, run):
    """(faults, outcome, message) of one case; its folder is removed."""
    rng = random.Random(f"{campaign.seed} {kind} {number}")
    folder = campaign.folder / f"{kind}-{number}"
    folder.mkdir()
    try:
        return (*KINDS[kind][0](campaign, run, folder, rng), "")
    except (Failure, OSError, subprocess.CalledProcessError) as failure:
        return 1, "failed", f"{' '.join(run)}: {failure}"
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--program", default="build/release/option2vec")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scale", type=float, default=1, help="of the numbers of faults")
    parser.add_argument("--only", choices=KINDS, help="one kind of faults")
    parser.add_argument("--case", type=int, help="one case of that kind")
    parser.add_argument("--jobs", type=int, default=2, help="cases at a time")
    options = parser.parse_args()
    if options.case is not None and not options.only:
        parser.error("--case needs --only")

    cases = [(kind, number, run) for kind in ([options.only] if options.only else KINDS)
             for number, run in enumerate(plan(kind, options.scale))
             if options.case in (None, number)]
    if any(kind == "disk" for kind, _, _ in cases) and not can_mount():
        print("disk: skipped, only root can mount a small disk")
        cases = [case for case in cases if case[0] != "disk"]

    row = "{:<9} {:>7} {:>7} {:>11} {:>16} {:>9}"
    repeat = f"{sys.argv[0]} --seed {options.seed} --scale {options.scale:g}"
    failures = []
    with tempfile.TemporaryDirectory(prefix="o2v-torture-") as folder, \
            concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        campaign = Campaign(os.path.abspath(options.program), pathlib.Path(folder), options.seed)
        list(pool.map(campaign.undisturbed, sorted({run for _, _, run in cases})))
        print(row.format("kind", "faults", "cases", "same bytes", "refused cleanly", "failures"))
        for kind, group in itertools.groupby(cases, key=lambda case: case[0]):
            group = list(group)
            ended = list(pool.map(lambda case: attempt(campaign, *case), group))
            count = collections.Counter(outcome for _, outcome, _ in ended)
            refused = sum(faults - 1 for faults, outcome, _ in ended if outcome == "refused")
            print(row.format(kind, sum(faults for faults, _, _ in ended), len(ended),
                             count["same"] + count["refused"], refused, count["failed"]),
                  flush=True)
            failures += [f"{repeat} --only {kind} --case {number}: {message}"
                         for (_, number, _), (_, outcome, message) in zip(group, ended)
                         if outcome == "failed"]
    for failure in failures:
        print(failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
