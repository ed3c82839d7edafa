import csv
import json
import tempfile
import unittest
from pathlib import Path

import numpy as np

from plots.records import METHODS, DamagedFile, Key, load_cells
from plots.samples import author_samples, mean_duration, original_code, our_samples
from plots.tables import read_bench, read_interpretations, read_rows, read_switches
from tree import REGISTRY, ROOT, write_run

TASK = "Hopper-v2"


def strictly(results: Path):
    """load_cells, but the first record that is left out is an error."""
    refused = []
    cells = load_cells(results, refused=refused)
    if refused:
        raise DamagedFile(refused[0])
    return cells


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.results = Path(folder.name) / "results"
        self.results.mkdir()

    def refuses(self, message: str, read=strictly):
        with self.assertRaisesRegex(DamagedFile, message):
            read(self.results)


class RecordsTest(InFolder):
    def run_of(self, *args, **more):
        return write_run(self.results, TASK, "ppo", *args, **more)

    def test_returns_are_those_at_or_before_a_step(self):
        self.run_of(0, [1, 2, 3])
        run = load_cells(self.results)[Key("paper", "", TASK, "ppo")].runs[0]
        self.assertEqual([run.return_at(s) for s in (9_999, 10_000, 29_999, 30_000, 99_000)],
                         [None, 1, 2, 3, 3])

    def test_quick_and_ci_are_read_only_when_asked_for(self):
        self.run_of(0, [1], experiment="ci")
        self.run_of(1, [1], experiment="mine")
        found = [load_cells(self.results, e) for e in (None, ["ci"])]
        self.assertEqual([[r.seed for c in cells.values() for r in c.runs] for cells in found],
                         [[1], [0]])

    def test_older_revisions_are_counted_not_mixed(self):
        self.run_of(0, [1] * 3)  # without a revision: the first
        self.run_of(1, [2] * 3, revision=2)
        cell, = load_cells(self.results).values()
        self.assertEqual(([r.seed for r in cell.runs], cell.older), ([1], 1))

    def test_diverged_runs_are_counted_and_have_no_return(self):
        self.run_of(0, [1] * 3)
        self.run_of(1, [9], status="diverged", steps=10_000, wanted=30_000)
        cells = load_cells(self.results)
        sample = our_samples(cells, "paper")[TASK, "ppo"]
        self.assertEqual((list(sample.final), sample.diverged), ([1], 1))

    def test_damaged_curves_are_refused_with_file_and_line(self):
        path = self.run_of(0, [1, 2, 3]).with_suffix(".csv")
        good = path.read_text()
        for old, new, message in (
                ("20000,2", "20000,x", r"seed-000\.csv:3: return_20"),
                ("20000,2", "20000,nan", r"seed-000\.csv:3: return_20: not finite"),
                ("20000,2", "20000", r"seed-000\.csv:3: 1 cells, not 2"),
                ("30000,3", "20000,3", r"seed-000\.csv:4: step 20000 does not increase"),
                ("30000,3", "40000,3", r"seed-000\.csv:4: a step after the last"),
                ("return_20", "return_20,lives", r"seed-000\.csv:1: columns step,return_20,lives"),
                ("return_20", "return_20,usage_1", r"seed-000\.csv:1: columns")):
            path.write_text(good.replace(old, new, 1))
            with self.subTest(message):
                self.refuses(message)
        path.unlink()
        self.refuses(r"seed-000\.csv:1: missing")

    def test_damaged_meta_data_are_refused(self):
        path = self.run_of(0, [1, 2, 3])
        good = json.loads(path.read_text())
        for change, message in (
                ({"moon": "full"}, "unknown 'moon'"),
                ({"status": "running"}, "status 'running'"),
                ({"steps": "30000"}, "'steps': 30000"),
                ({"steps": 20_000}, "done after 20000 of 30000 steps"),
                ({"config": "[run"}, "config: "),
                ({"config": good["config"].replace("seed = 0", "seed = 1")}, "config is of")):
            path.write_text(json.dumps(good | change))
            with self.subTest(message):
                self.refuses(r"seed-000\.json:1: .*" + message)
        path.write_text(json.dumps(good)[:-40])
        self.refuses(r"seed-000\.json:1: ")
        del good["commit"]
        path.write_text(json.dumps(good))
        self.refuses("no 'commit'")

    def test_the_same_run_twice_is_refused(self):
        self.run_of(0, [1])
        self.run_of(0, [1], experiment="other")
        self.refuses("the same run as")

    def test_settings_that_differ_within_a_cell_are_refused(self):
        self.run_of(0, [1])
        self.run_of(1, [1], settings="hidden = 128")
        self.refuses(r"seed-001\.json:1: .*hidden = 128, not hidden = 64")
        self.run_of(3, [1], experiment="mine", settings="hidden = 32")
        self.run_of(4, [1], experiment="mine", settings="hidden = 32")
        self.run_of(0, [1], experiment="mine", settings="hidden = 16")
        refused = []
        cell, = load_cells(self.results, ["mine"], refused).values()
        self.assertEqual([run.seed for run in cell.runs], [3, 4])
        self.assertRegex(refused[0], r"seed-000\.json:1: hidden = 16, but 32 in .*seed-003\.json")

    def test_verdicts_are_those_of_the_program(self):
        folder = ROOT / "tests" / "data" / "records"
        with (folder / "verdicts.csv").open() as file:
            reasons = {row["file"]: row["reason"] for row in csv.DictReader(file)}
        for experiment in ("single_task", "mine"):
            refused = []
            cells = load_cells(folder, [experiment], refused)
            for message in refused:
                path = message[:message.index(".json:") + 5] if ".json:" in message else \
                    message[:message.index(".csv:")] + ".json"
                name = str(Path(path).relative_to(folder))
                self.assertTrue(reasons[name], message)
                self.assertIn(reasons[name], message)
            good = {f for f, reason in reasons.items() if f.startswith(experiment) and not reason}
            found = {str(r.path.relative_to(folder)) for c in cells.values() for r in c.runs}
            self.assertEqual(found, good)

    def test_records_of_format_1_of_every_method_stay_readable(self):
        refused = []
        cells = load_cells(ROOT / "tests" / "data" / "records", ["format-1"], refused)
        self.assertEqual(refused, [])
        self.assertEqual({key.algorithm for key in cells}, set(METHODS))

    def test_unknown_places_are_refused(self):
        write_run(self.results, "Hopper-v3", "ppo", 0, [1])
        self.refuses("unknown task 'Hopper-v3'")


class SamplesTest(InFolder):
    def test_a_sample_of_two_whole_runs(self):
        # Returns i and i + 10 in rows i = 1..100: at the end 100 and 110; areas 50.5 and 60.5;
        # windows 91..100 and 81..90 have means 95.5 and 85.5.
        for seed in (0, 1):
            write_run(self.results, TASK, "ppo", seed, [i + 10 * seed for i in range(1, 101)])
        sample = our_samples(load_cells(self.results), "paper")[TASK, "ppo"]
        self.assertEqual(list(sample.final), [100, 110])
        self.assertEqual((sample.area.mean, sample.area.std), (55.5, 5))
        self.assertEqual((sample.gain.mean, sample.gain.std), (10, 0))
        self.assertEqual(sample.progress, 95.5 + 5 - 6)
        self.assertFalse(sample.shortened)

    def test_a_run_is_judged_at_its_horizon(self):
        # 150 rows of a task that has 1 000 000 steps, which are the first 100.
        write_run(self.results, TASK, "ppo", 0, list(range(1, 151)))
        sample = our_samples(load_cells(self.results), "paper")[TASK, "ppo"]
        self.assertEqual((list(sample.final), sample.step), ([100], 1_000_000))
        self.assertEqual((sample.curve.step[-1], sample.area.mean), (1_000_000, 50.5))

    def test_jumps_are_those_of_the_second_half(self):
        # Steps beyond half of the last one: 9, 5, 9, 5, 9, whose changes -4, 4, -4, 4 have the
        # deviation 4. The first half jumps further.
        write_run(self.results, TASK, "ppo", 0, [0, 90, 0, 90, 0, 9, 5, 9, 5, 9])
        sample = our_samples(load_cells(self.results), "paper")[TASK, "ppo"]
        self.assertEqual(list(sample.jumps), [4])

    def test_a_run_that_diverges_after_its_last_step_is_whole(self):
        self.assertEqual(self.diverged(30_000), ([1, 9], 0))
        self.assertEqual(self.diverged(20_000), ([1], 1))

    def diverged(self, steps: int) -> tuple[list[float], int]:
        for seed, status, made, last in ((0, "done", 30_000, 1), (1, "diverged", steps, 9)):
            write_run(self.results, TASK, "ppo", seed, [last] * (made // 10_000), status=status,
                      steps=made, wanted=30_000)
        sample = our_samples(load_cells(self.results), "paper")[TASK, "ppo"]
        return list(sample.final), sample.diverged

    def test_the_first_value_is_held_before_it(self):
        path = write_run(self.results, TASK, "ppo", 0, [1, 2, 3, 4]).with_suffix(".csv")
        path.write_text(path.read_text().replace("10000,1\n20000,2\n", ""))
        sample = our_samples(load_cells(self.results), "paper")[TASK, "ppo"]
        self.assertEqual(list(sample.curve.mean), [3, 3, 3, 4])
        self.assertTrue(sample.shortened)

    def test_a_pair_has_two_ends(self):
        write_run(self.results, "Cheetah", "ppo", 0, list(range(1, 201)))
        sample = our_samples(load_cells(self.results), "paper")["Cheetah", "ppo"]
        self.assertEqual((list(sample.first), list(sample.final)), ([100], [200]))

    def test_durations_of_a_tenth_are_pooled(self):
        # Rows of 1 and 100 steps an execution, equally long: 2 / (1 + 1/100) steps by executions.
        path = write_run(self.results, "Hopper-v2", "option2vec", 0, [1] * 20, options="1,4")
        lines = path.with_suffix(".csv").read_text().splitlines()
        for row, duration in ((1, 1), (2, 100)):
            lines[row] = lines[row].removesuffix("4") + str(duration)
        path.with_suffix(".csv").write_text("\n".join(lines) + "\n")
        sample = our_samples(load_cells(self.results), "paper")["Hopper-v2", "option2vec"]
        np.testing.assert_allclose(sample.durations, [[2 / 1.01], [4]])

    def test_durations_are_steps_by_executions(self):
        # Shares 3/4 and 1/4 with durations 3 and 1: a step holds 1/4 + 1/4 executions, so 2 steps
        # each. An option that was not used counts nothing.
        write_run(self.results, TASK, "option2vec", 0, [1, 1], options="0.75,0.25,0,3,1,")
        cell, = load_cells(self.results).values()
        np.testing.assert_allclose(mean_duration(cell.runs[0]), [2, 2])

    def test_the_authors_numbers_are_those_of_their_figures(self):
        authors = author_samples(ROOT / "results" / "reference")
        for key, mean, std, n in (  # results/reference, mean and std of return_at_1M, task2_end
                (("HalfCheetah-v2", "option2vec"), 3461, 209, 10),
                (("Reacher-v2", "ppo"), -5.52, 0.76, 10),
                (("Walker2", "option2vec"), 419.4, 117, 10),
                (("CartPole", "oc"), 191.2, 272, 10)):
            m = authors[key].moments
            self.assertAlmostEqual(m.mean, mean, delta=abs(mean) * 1e-3)
            self.assertAlmostEqual(m.std, std, delta=std * 1e-2)
            self.assertEqual(m.n, n)
        self.assertNotIn(("HalfCheetah-v2", "dac_onestep"), authors)

    def test_the_authors_area_is_the_mean_of_their_curve(self):
        lines = (ROOT / "results/reference/single_task_curves.csv").read_text().splitlines()
        points = [line.split(",") for line in lines if line.startswith("Ant-v2,PPO,")]
        points = [(float(mean), float(std)) for _, _, step, mean, std, _ in points
                  if 0 < int(step) <= 1_000_000]
        area = author_samples(ROOT / "results" / "reference")["Ant-v2", "ppo"].area
        np.testing.assert_allclose((area.mean, area.std, area.n), (*np.mean(points, axis=0), 10))


class OriginalCodeTest(InFolder):
    def write(self, *rows: str) -> Path:
        folder = self.results / "reference" / "original_code"
        folder.mkdir(parents=True)
        header = "env,seed,step,return_20,usage_0,usage_1,usage_2,usage_3"
        lines = [header, *(f"{row},1,0,0,0" for row in rows)]
        (folder / "runs.csv").write_text("\n".join(lines) + "\n")
        return folder.parent

    def test_runs_that_went_to_one_million_steps_count_to_there(self):
        folder = self.write("A,0,500000,1", "A,0,990000,5", "A,0,1010000,9",
                            "A,1,1000000,2", "A,2,999999,7", "B,0,500000,3")
        (task, (final, area)), = original_code(folder).items()
        self.assertEqual(task, "A")
        self.assertEqual((final.mean, final.std, final.n), (3.5, 1.5, 2))  # of 5 and 2
        self.assertEqual((area.mean, area.std, area.n), (2.5, 0.5, 2))  # of 3 and 2

    def test_absent_and_damaged_files(self):
        self.assertEqual(original_code(self.results), {})
        folder = self.write("A,0,500000,x")
        self.refuses("runs.csv:2", lambda _: original_code(folder))


class TablesTest(InFolder):
    def test_absent_tables_are_empty(self):
        self.assertEqual(read_rows(self.results, "theory"), [])
        self.assertEqual(read_bench(self.results) + read_switches(self.results), [])

    def test_unknown_columns_are_refused(self):
        (self.results / "gradcheck.csv").write_text("name,entries,largest_error\nlinear,35,1e-8\n")
        self.refuses(r"gradcheck\.csv:1: columns", lambda r: read_rows(r, "gradcheck"))

    def test_an_interrupted_bench_is_refused(self):
        (self.results / "bench.json").write_text('{"benchmarks": [\n{"name": "step/A/ppo/paper/5"')
        self.refuses(r"bench\.json:2: ", read_bench)

    def test_switches_are_those_of_the_programs_list(self):
        (self.results / "registry.json").write_text(REGISTRY)
        row, = read_switches(self.results)
        self.assertEqual((row["id"], row["released"], row["methods"], row["effect"]),
                         ("timelimit", "released", ["ppo", "oc"], "bootstrap | terminal"))
        for damaged in ('{"switches": [{"id": "timelimit"}]}', '{"switches"', "[]"):
            (self.results / "registry.json").write_text(damaged)
            self.refuses(r"registry\.json: .*list --json", read_switches)

    def test_interpretations_are_matrices_by_file(self):
        path = self.results / "interpret/paper/Hopper-v2/option2vec/seed-000.csv"
        path.parent.mkdir(parents=True)
        good = ("dimension,embedding_0,embedding_1,embedding_2,effect_0,effect_1,perturbed_0,"
                "perturbed_1,delta\n0,1,2,3,4,5,6,7,0.5\n1,8,9,10,11,12,13,14,0.5\n")
        path.write_text(good)
        path.with_suffix(".json").write_text('{"episodes": 10}')  # how it was made; no record
        self.assertEqual(load_cells(self.results), {})
        (where, found), = read_interpretations(self.results).items()
        self.assertEqual((where, found.delta), (path, 0.5))
        np.testing.assert_array_equal(found.W_o, [[1, 2, 3], [8, 9, 10]])
        np.testing.assert_array_equal(found.effects, [[4, 5], [11, 12]])
        np.testing.assert_array_equal(found.perturbed, [[6, 7], [13, 14]])
        for old, new, message in (
                ("perturbed_1,delta", "delta", "columns"),  # fewer perturbed than effects
                ("\n1,8", "\n2,8", "not one row a dimension"),
                ("14,0.5", "14,0.25", "delta is not the same"),
                ("0.5\n", "0\n", "delta is not the same positive"),
                ("12", "nan", "seed-000.csv:3: effect_1: not finite")):
            path.write_text(good.replace(old, new))
            with self.subTest(message):
                self.refuses(message, read_interpretations)


if __name__ == "__main__":
    unittest.main()
