import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

import plots.records  # noqa: F401  (which puts python/ into the path)
from tree import ROOT

from option2vec_results import act, forward, load_policy
from option2vec_results.records import read_numbers

POLICIES = ROOT / "tests" / "data" / "policies"
PROGRAM = Path(os.environ.get("O2V_PROGRAM", ROOT / "build" / "release" / "option2vec"))
S, A, K = 11, 2, 4


def columns(table: dict, name: str, n: int) -> np.ndarray:
    return np.stack([table[f"{name}{i}"] for i in range(n)], axis=1)


class PolicyTest(unittest.TestCase):
    def compare(self, checkpoint: Path, inputs: Path, outputs: Path):
        policy, given, expected = load_policy(checkpoint), read_numbers(inputs), read_numbers(outputs)
        s = columns(given, "s", S)
        found = [forward(policy, s[row], *(int(given[name][row]) for name in ("o_prev", "init", "o")))
                 for row in range(len(s))]
        for what, name, n in zip(zip(*found), ("P", "mu", "sigma"), (K, A, A)):
            np.testing.assert_allclose(what, columns(expected, name, n), rtol=0, atol=1e-5)

    def test_networks_are_those_that_the_program_had(self):
        for fidelity in ("paper", "released"):
            with self.subTest(fidelity):
                self.compare(POLICIES / f"{fidelity}.safetensors", POLICIES / "in.csv",
                             POLICIES / f"{fidelity}.csv")

    @unittest.skipUnless(PROGRAM.is_file(), "the program is not built")
    def test_networks_are_those_of_the_program(self):
        rng = np.random.default_rng(1)
        with tempfile.TemporaryDirectory() as name:
            inputs, outputs = Path(name) / "in.csv", Path(name) / "out.csv"
            names = [f"s{i}" for i in range(S)] + ["o_prev", "init", "o"]
            rows = [[*rng.normal(0, 3, S), *rng.integers(0, [K, 2, K])] for _ in range(200)]
            inputs.write_text("\n".join([",".join(names)] + [",".join(map(repr, map(float, row)))
                                                             for row in rows]) + "\n")
            for fidelity in ("paper", "released"):
                checkpoint = POLICIES / f"{fidelity}.safetensors"
                subprocess.run([PROGRAM, "forward", "--checkpoint", checkpoint, "--input", inputs,
                                "--out", outputs], check=True)
                with self.subTest(fidelity):
                    self.compare(checkpoint, inputs, outputs)

    def test_options_and_actions_are_drawn_from_the_policy(self):
        # Frequencies within 5 standard errors; so are mean and deviation of the actions.
        policy, s = load_policy(POLICIES / "released.safetensors"), np.linspace(-1, 1, S)
        rng, n = np.random.default_rng(2), 4000
        P, _, _ = forward(policy, s, 3, False, 0)
        drawn = [act(policy, s, 3, False, rng) for _ in range(n)]
        options, actions = np.array([o for o, _ in drawn]), np.array([a for _, a in drawn])
        for o in range(K):
            count = (options == o).sum()
            self.assertLess(abs(count / n - P[o]), 5 * np.sqrt(P[o] / n))
            if count > 200:
                _, mu, sigma = forward(policy, s, 3, False, o)
                error = sigma / np.sqrt(count)
                self.assertTrue((abs(actions[options == o].mean(axis=0) - mu) < 5 * error).all())
                self.assertTrue((abs(actions[options == o].std(axis=0) - sigma) < 5 * error).all())

    def test_mean_actions_are_those_of_the_option(self):
        policy, s = load_policy(POLICIES / "paper.safetensors"), np.linspace(1, -1, S)
        o, a = act(policy, s, 0, True, np.random.default_rng(3), mean=True)
        np.testing.assert_array_equal(a, forward(policy, s, 0, True, o)[1])

    def test_another_method_is_refused_by_name(self):
        policy = load_policy(POLICIES / "paper.safetensors")
        del policy.tensors["embed.W_o"]
        with self.assertRaisesRegex(ValueError, r"paper\.safetensors: has no embed\.W_o"):
            act(policy, np.zeros(S), 0, True, np.random.default_rng(0))

    def test_tensors_are_those_of_the_package_safetensors(self):
        try:
            from safetensors.numpy import load_file
        except ImportError:
            self.skipTest("safetensors is not installed")
        for fidelity in ("paper", "released"):
            path = POLICIES / f"{fidelity}.safetensors"
            ours, theirs = load_policy(path).tensors, load_file(path)
            self.assertEqual(set(ours), set(theirs))
            for name, tensor in theirs.items():
                self.assertEqual(ours[name].dtype, tensor.dtype)
                np.testing.assert_array_equal(ours[name], tensor)


@unittest.skipUnless(PROGRAM.is_file(), "the program is not built")
class TensorboardTest(unittest.TestCase):
    def test_the_package_reads_what_was_exported(self):
        try:
            from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
        except ImportError:
            self.skipTest("tensorboard is not installed")
        with tempfile.TemporaryDirectory() as name:
            run, out = Path(name) / "run", Path(name) / "out"
            run.mkdir()
            (run / "episodes.csv").write_text("step,return\n5,1.5\n4294967296,-0.1\n")
            (run / "updates.csv").write_text("step,usage_0\n8,\n16,0.25\n")
            (run / "timing.csv").write_text("step,wall_s\n8,3.5\n16,7\n")
            subprocess.run([PROGRAM, "export", "--tensorboard", run, "--out", out], check=True)
            events = EventAccumulator(str(out))
            events.Reload()
            self.assertEqual(sorted(events.Tags()["scalars"]),
                             ["episodes/return", "timing/wall_s", "updates/usage_0"])

            def scalars(tag: str) -> list:
                return [(e.wall_time, e.step, e.value) for e in events.Scalars(tag)]
            self.assertEqual(scalars("episodes/return"),
                             [(3.5, 5, 1.5), (7, 2**32, float(np.float32(-0.1)))])
            self.assertEqual(scalars("updates/usage_0"), [(7, 16, 0.25)])


if __name__ == "__main__":
    unittest.main()
