import json
import tempfile
import unittest
from pathlib import Path

import numpy as np

from plots import fig_aggregate, mine, records
from plots.claims import OURS, RIVALS
from plots.curves import draw_curves
from plots.inputs import Inputs
from plots.long_table import long_table
from plots.records import METHODS, PAIRS, TASKS, DamagedFile, Key, load_cells
from plots.samples import our_samples
from plots.style import LOOKS
from tree import with_reference, write_flat, write_run

TASK = "Hopper-v2"


class MineTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        for table in (METHODS, LOOKS, records.joined):  # as they were
            self.addCleanup(lambda table=table, kept=dict(table): (table.clear(),
                                                                   table.update(kept)))

    def table(self, rows: list, header: str = "method,task,seed,step,return") -> Path:
        path = self.folder / "mine.csv"
        path.write_text("\n".join([header] + [",".join(map(str, row)) for row in rows]) + "\n")
        return path

    def run_folder(self, name: str, returns: list, algorithm: str = "ppo", seed: int = 0,
                   status: str = "done", task: str = TASK) -> None:
        folder = self.folder / name
        folder.mkdir(parents=True)
        (folder / "config.toml").write_text(
            f'[run]\ntask = "{task}"\nalgorithm = "{algorithm}"\nseed = {seed}\nsteps = 30000\n')
        (folder / "manifest.json").write_text(json.dumps({"status": status, "steps": 30_720}))
        (folder / "episodes.csv").write_text("step,return\n" + "".join(
            f"{1000 * (i + 1)},{x}\n" for i, x in enumerate(returns)))

    def test_returns_are_those_of_twenty_episodes(self):
        # Returns 1..30 at steps 1000..30000: at step 20 000 the mean of 1..20, at 30 000 of 11..30.
        for seed in (0, 1):
            rows = [("SAC", TASK, seed, 1000 * i, i + 100 * seed) for i in range(30, 0, -1)]
            self.table(rows).rename(self.folder / f"{seed}.csv")
        self.assertEqual(mine.join([self.folder / "0.csv", self.folder / "1.csv"]), [])
        cells = load_cells(self.folder)
        for fidelity in ("paper", "released"):
            sample = our_samples(cells, fidelity)[TASK, "SAC"]
            self.assertEqual(list(sample.final), [20.5, 120.5])
            self.assertEqual([m.tolist() for m in (sample.curve.step, sample.curve.mean)],
                             [[10_000, 20_000, 30_000], [60.5, 60.5, 70.5]])
        self.assertEqual((METHODS["SAC"], "SAC" in LOOKS), ("SAC", True))

    def test_smoothed_returns_stay_as_they_are(self):
        rows = [(7, 1000, "A", TASK, 2.5), (7, 19_999, "A", TASK, 3)]
        self.assertEqual(mine.join([self.table(rows, "seed,step,method,task,return_20")]), [])
        run, = load_cells(self.folder)[Key("paper", "", TASK, "A")].whole
        self.assertEqual((run.seed, run.wanted, run.return_at(18_000), run.return_at(20_000)),
                         (7, 20_000, 2.5, 3))

    def test_they_stand_beside_the_records(self):
        write_run(self.folder, TASK, "ppo", 0, [1])
        mine.join([self.table([("PPO", TASK, 0, 10_000, 5)], "method,task,seed,step,return_20")])
        cells = load_cells(self.folder)
        self.assertEqual({k.algorithm for k in cells}, {"ppo", "PPO (mine)"})
        lines = long_table(cells).splitlines()
        self.assertEqual(lines[0], "fidelity,variant,task,method,seed,diverged,step,return_20")
        self.assertEqual(lines[1:], ["paper,,Hopper-v2,ppo,0,0,10000,1.0",
                                     "paper,,Hopper-v2,PPO (mine),0,0,10000,5.0",
                                     "released,,Hopper-v2,PPO (mine),0,0,10000,5.0"])

    def test_they_are_measured_against_the_rival_of_option2vec(self):
        # Best rival 8: Option2Vec's 12 is 0.5 above it. Mine has 16 and 8: 12 in the mean, IQM of
        # 0 and 1 the same 0.5. It is above PPO, and yet no rival.
        with_reference(self.folder)
        finals = dict.fromkeys(RIVALS, [6, 6]) | {OURS: [10, 14], "ppo": [8, 8]}
        for method, final in finals.items():
            write_flat(self.folder, TASK, method, final)
        rows = [("SAC", TASK, seed, 1_000_000, ret) for seed, ret in ((0, 16), (1, 8))]
        mine.join([self.table(rows, "method,task,seed,step,return_20")])
        drawing, = fig_aggregate.draw(Inputs(self.folder))
        place = list(fig_aggregate.ORDER).index("paper")
        panel, profile = drawing.figure.axes[place::len(fig_aggregate.ORDER)]
        self.assertEqual([t.get_text() for t in panel.texts], ["PPO", "+0.50", "+0.50"])
        dots = {line.get_color(): line.get_xydata().tolist()
                for line in panel.lines if len(line.get_xdata()) == 1 and line.get_ydata()[0] > 0}
        row = float(len((*TASKS, *PAIRS)) - TASKS.index(TASK))
        self.assertEqual(dots, {LOOKS[OURS].color: [[0.5, row]],
                                LOOKS["SAC"].color: [[0.5, row - 0.3]]})
        # The mean of a resample of 1 and 0 is each of them a quarter of the times.
        bar, = (c for c in panel.collections if c.get_paths()[0].vertices[0, 1] == row - 0.3)
        self.assertEqual(bar.get_paths()[0].vertices[:, 0].tolist(), [0, 1])
        # Option2Vec's runs are at 0.25 and 0.75, mine at 1 and 0.
        for method, shares in ((OURS, (1, 0.5, 0)), ("SAC", (0.5, 0.5, 0.5))):
            line, = (x for x in profile.lines if x.get_color() == LOOKS[method].color)
            self.assertEqual(np.interp((0.2, 0.4, 0.9), *line.get_data()).tolist(), list(shares))
        self.assertIn("SAC", [t.get_text() for t in drawing.figure.legends[0].get_texts()])

    def test_their_curves_stand_out_beside_the_best_rival(self):
        for method, final in ((OURS, [5]), ("ppo", [3]), ("oc", [2])):
            write_flat(self.folder, TASK, method, final)
        rows = [("SAC", TASK, 0, step, 4) for step in (500_000, 1_000_000)]
        mine.join([self.table(rows, "method,task,seed,step,return_20")])
        samples = our_samples(load_cells(self.folder), "paper")
        panel = draw_curves((TASK,), tuple(METHODS), {"paper": samples}, {}).axes[0]
        widths = {line.get_color(): line.get_linewidth() for line in panel.lines
                  if len(line.get_xdata()) > 2}
        self.assertEqual(widths, {LOOKS[OURS].color: 2, LOOKS["SAC"].color: 2,
                                  LOOKS["ppo"].color: 2, LOOKS["oc"].color: 0.7})

    def test_folders_of_runs_need_no_layout(self):
        self.run_folder("a", list(range(1, 31)))
        self.run_folder("deep/er/b", list(range(1, 31)), "new_method", seed=4)
        self.run_folder(".hidden/c", list(range(1, 31)), seed=9)
        self.run_folder("pair", list(range(1, 31)), task="dm-cheetah-run,dm-cheetah-backward")
        self.assertEqual(mine.join([self.folder]), [])
        found = {(k.task, k.algorithm): [(r.seed, r.ret[-1], r.wanted) for r in c.whole]
                 for k, c in records.joined.items() if k.fidelity == "paper"}
        self.assertEqual(found, {(TASK, "ppo (mine)"): [(0, 20.5, 30_000)],
                                 (TASK, "new_method"): [(4, 20.5, 30_000)],
                                 ("Cheetah", "ppo (mine)"): [(0, 20.5, 30_000)]})

    def test_bad_runs_are_left_out_by_name(self):
        self.run_folder("running", [1] * 30, status="running")
        self.run_folder("short", [1] * 19, seed=1)
        self.run_folder("good", [1] * 30, seed=2)
        self.run_folder("twice", [1] * 30, seed=2)
        self.run_folder("moon", [1] * 30, task="Moon-v0")
        self.run_folder("broken", [1] * 30, seed=3)
        (self.folder / "broken" / "manifest.json").write_text("{")
        refused = sorted(mine.join([self.folder]))
        for message, part in zip(refused, ("broken: ", "moon: ppo on Moon-v0, seed 0: unknown task",
                                           "running: running",
                                           "short: ppo on Hopper-v2, seed 1: fewer than 20",
                                           "twice: ppo on Hopper-v2, seed 2: is there twice")):
            self.assertIn(part, message)
        self.assertEqual(len(refused), 5)
        cell = records.joined[Key("paper", "", TASK, "ppo (mine)")]
        self.assertEqual([run.seed for run in cell.runs], [2])

    def test_a_run_that_ends_early_is_none_of_the_others(self):
        rows = [("A", TASK, seed, step, 1) for seed, end in ((0, 100_000), (1, 96_000), (2, 90_000))
                for step in (1000, end)]
        refused = mine.join([self.table(rows, "method,task,seed,step,return_20")])
        self.assertEqual([m.partition(": ")[2] for m in refused],
                         ["A on Hopper-v2, seed 2: ends at step 90000, not 100000"])

    def test_damaged_tables_are_refused_with_file_and_line(self):
        good = ("A", TASK, 0, 1000, 1)
        for header, row, message in (
                ("method,task,seed,step", good[:4], r"mine\.csv:1: columns method,task,seed,step, "),
                ("method,task,seed,step,return,x", (*good, 0), r"mine\.csv:1: columns"),
                ("method,task,seed,step,return", (*good[:4], "nan"), r"mine\.csv:2: return: not"),
                ("method,task,seed,step,return", (*good[:2], "x", 1, 1), r"mine\.csv:2: seed"),
                ("method,task,seed,step,return", ("", *good[1:]), r"mine\.csv:2: method: no name")):
            with self.subTest(message), self.assertRaisesRegex(DamagedFile, message):
                mine.join([self.table([row], header)])
        with self.assertRaisesRegex(DamagedFile, "holds no folder of a run"):
            (self.folder / "empty").mkdir()
            mine.join([self.folder / "empty"])

    def test_smoothing_is_the_mean_of_the_window(self):
        step, ret = mine.smoothed(np.arange(21.0), np.arange(21.0))
        self.assertEqual((step.tolist(), ret.tolist()), ([19, 20], [9.5, 10.5]))


if __name__ == "__main__":
    unittest.main()
