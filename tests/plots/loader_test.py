import json
import struct
import tempfile
import unittest
from pathlib import Path

import numpy as np

from plots.records import METHODS, DamagedFile
from tree import ROOT, write_run

from option2vec_results import load_policy, load_records, load_run
from option2vec_results.standard import standard

RECORDS = ROOT / "tests" / "data" / "records"


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)


class RecordsTest(InFolder):
    def test_records_are_one_long_table(self):
        write_run(self.folder, "Hopper-v2", "ppo", 3, [1.5, 2])
        write_run(self.folder, "Hopper-v2", "oc", 1, [-3], fidelity="paper-timelimit=released",
                  experiment="mine", options="0.75,0.25,8,", status="diverged", revision=2)
        columns = load_records(self.folder)
        self.assertEqual({name: columns[name].tolist() for name in list(columns)[:9]}, {
            "fidelity": ["paper"] * 3, "variant": ["", "", "timelimit=released"],
            "task": ["Hopper-v2"] * 3, "method": ["ppo", "ppo", "oc"], "seed": [3, 3, 1],
            "revision": [1, 1, 2], "diverged": [False, False, True],
            "step": [10_000, 20_000, 10_000], "return": [1.5, 2, -3]})
        np.testing.assert_array_equal(columns["usage_0"], [np.nan, np.nan, 0.75])
        np.testing.assert_array_equal(columns["usage_1"], [np.nan, np.nan, 0.25])
        np.testing.assert_array_equal(columns["duration_0"], [np.nan, np.nan, 8])
        np.testing.assert_array_equal(columns["duration_1"], [np.nan] * 3)

    def test_an_experiment_wins_over_the_methods_own_numbers(self):
        # paper_configs/algo/ppo.toml has rollouts of 2048 steps, ci.toml of 512.
        for experiment, rollout in (("single_task", 2048), ("ci", 512)):
            self.assertEqual(standard(experiment, "paper", "Hopper-v2", "ppo", False)["rollout"],
                             rollout)

    def test_a_folder_may_be_all_results_or_an_experiment(self):
        write_run(self.folder, "Hopper-v2", "ppo", 0, [1])
        write_run(self.folder, "Hopper-v2", "oc", 0, [2], experiment="quick")
        self.assertEqual(load_records(self.folder)["return"].tolist(), [1])
        self.assertEqual(load_records(self.folder / "quick")["return"].tolist(), [2])
        self.assertEqual(len(load_records(self.folder / "single_task" / "paper")["step"]), 0)
        with self.assertRaisesRegex(FileNotFoundError, "nowhere: not a folder"):
            load_records(self.folder / "nowhere")

    def test_a_bad_record_fails_alone_and_by_name(self):
        write_run(self.folder, "Hopper-v2", "ppo", 0, [1])
        bad = write_run(self.folder, "Hopper-v2", "ppo", 1, [1, 2])
        hidden = write_run(self.folder, "Hopper-v2", "ppo", 2, [7])
        hidden.rename(hidden.with_name(".seed-002.json"))
        bad.with_suffix(".csv").write_text("step,return_20\n10000,?\n")
        refused = []
        self.assertEqual(load_records(self.folder, refused)["return"].tolist(), [1])
        self.assertEqual(len(refused), 1)
        self.assertRegex(refused[0], r"seed-001\.csv:2: return_20: .*'\?'")

    def test_verdicts_are_those_of_the_program(self):
        refused = []
        columns = load_records(RECORDS / "format-1", refused)
        self.assertEqual((set(columns["method"]), refused), (set(METHODS), []))


class RunTest(InFolder):
    def test_the_folder_of_a_run_is_columns(self):
        (self.folder / "config.toml").write_text("[run]\nseed = 3\n")
        (self.folder / "manifest.json").write_text('{"status": "done"}')
        (self.folder / "episodes.csv").write_text("step,return\n7,-1.5\n9,2e3\n")
        (self.folder / "updates.csv").write_text("step,usage_0\n8,\n")
        run = load_run(self.folder)
        self.assertEqual((run.config, run.manifest), ({"run": {"seed": 3}}, {"status": "done"}))
        self.assertEqual({k: v.tolist() for k, v in run.episodes.items()},
                         {"step": [7, 9], "return": [-1.5, 2000]})
        np.testing.assert_array_equal(run.updates["usage_0"], [np.nan])
        self.assertEqual((run.evals, run.timing), ({}, {}))

    def test_damaged_folders_are_named(self):
        (self.folder / "config.toml").write_text("[run]\n")
        (self.folder / "manifest.json").write_text("{")
        with self.assertRaisesRegex(DamagedFile, str(self.folder)):
            load_run(self.folder)
        (self.folder / "episodes.csv").write_text("step,return\n7,x\n")
        with self.assertRaisesRegex(DamagedFile, r"episodes\.csv:2: return: .*'x'"):
            load_run(self.folder)


def safetensors(entries: dict, data: bytes) -> bytes:
    header = json.dumps(entries).encode()
    return struct.pack("<Q", len(header)) + header + data


class PolicyFileTest(InFolder):
    def write(self, text: bytes) -> Path:
        path = self.folder / "x.safetensors"
        path.write_bytes(text)
        return path

    def test_tensors_are_read_by_type_and_shape(self):
        data = struct.pack("<2d", 0.1, -2) + struct.pack("<3f", 1, 0.5, -4) + struct.pack("<q", 9)
        policy = load_policy(self.write(safetensors({
            "__metadata__": {"config": "[run]\nseed = 3\n"},
            "a": {"dtype": "F32", "shape": [3, 1], "data_offsets": [16, 28]},
            "b": {"dtype": "F64", "shape": [1, 2], "data_offsets": [0, 16]},
            "c": {"dtype": "I64", "shape": [1], "data_offsets": [28, 36]}}, data)))
        self.assertEqual({name: (t.dtype.name, t.tolist()) for name, t in policy.tensors.items()}, {
            "a": ("float32", [[1], [0.5], [-4]]), "b": ("float64", [[0.1, -2]]),
            "c": ("int64", [9])})
        self.assertEqual(policy.config, {"run": {"seed": 3}})

    def test_observations_are_normalised_and_clipped(self):
        data = struct.pack("<3d", 1, 2, 3) + struct.pack("<3d", 4, 0.25, 1e-20)
        policy = load_policy(self.write(safetensors({
            "normalizer.mean": {"dtype": "F64", "shape": [3, 1], "data_offsets": [0, 24]},
            "normalizer.var": {"dtype": "F64", "shape": [3, 1], "data_offsets": [24, 48]}}, data)))
        np.testing.assert_allclose(policy.normalise(np.array([5, 1, 4])), [2, -2, 10], rtol=1e-7)

    def test_a_variance_has_1e_8_added_below_its_root(self):
        data = struct.pack("<2d", 3, 1e-8)
        policy = load_policy(self.write(safetensors({
            "normalizer.mean": {"dtype": "F64", "shape": [1, 1], "data_offsets": [0, 8]},
            "normalizer.var": {"dtype": "F64", "shape": [1, 1], "data_offsets": [8, 16]}}, data)))
        np.testing.assert_allclose(policy.normalise(np.array([3.0002])), [2**0.5], rtol=1e-7)

    def test_cut_and_broken_files_are_refused_by_name(self):
        tensor = {"dtype": "F32", "shape": [2], "data_offsets": [0, 8]}
        good = safetensors({"a": tensor}, bytes(8))
        load_policy(self.write(good))
        for text in (b"", good[:7], good[:20], good[:-1], safetensors({"a": 3}, b""),
                     safetensors({"a": tensor | {"dtype": "F16"}}, bytes(8)),
                     safetensors({"a": tensor | {"shape": [3]}}, bytes(8)),
                     safetensors({"a": tensor | {"data_offsets": [4, 0]}}, bytes(8)),
                     safetensors([], bytes(8))):
            with self.subTest(text), self.assertRaisesRegex(DamagedFile, r"x\.safetensors: not a"):
                load_policy(self.write(text))


if __name__ == "__main__":
    unittest.main()
