"""The figure of README.md: what it draws, and that it stays small."""

import random
import tempfile
import unittest
from pathlib import Path

import numpy as np

from plots import front
from plots.records import METHODS, TASKS
from plots.style import LOOKS
from tree import with_reference, write_flat, write_run


def line_of(panel, color: str) -> np.ndarray:
    line, = (x for x in panel.lines if x.get_color() == color)
    return np.column_stack([np.asarray(c, dtype=float) for c in line.get_data()])


class FrontTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.results = with_reference(Path(folder.name) / "results")

    def panels(self):
        panels = front.draw(self.results).axes
        return {panel.get_title().split("\n")[0]: panel for panel in panels}

    def test_shows_means_of_released_runs(self):
        for seed, final in enumerate((1000, 2000)):
            write_run(self.results, "Hopper-v2", "option2vec", seed, [0] * 99 + [final], "released")
        write_run(self.results, "Hopper-v2", "ppo", 0, [300] * 100, "released")
        write_run(self.results, "Hopper-v2", "ppo", 0, [700] * 100, "paper")
        write_flat(self.results, "Hopper-v2", "oc", [10, 20, 30], fidelity="released",
                   experiment="mine")
        panel = self.panels()["Hopper-v2"]
        self.assertEqual(line_of(panel, LOOKS["option2vec"].color)[-1].tolist(), [1, 1500])
        self.assertEqual(line_of(panel, LOOKS["ppo"].color)[-1].tolist(), [1, 300])
        self.assertEqual(panel.get_title(), "Hopper-v2\nn = 2, others 1-3")

    def test_a_task_without_runs_says_so_and_shows_the_authors_curve(self):
        panel = self.panels()["Ant-v2"]
        self.assertEqual(panel.get_title(), "Ant-v2\nno runs yet")
        self.assertEqual(len(panel.lines), 1)
        curve = front.author_samples(self.results / "reference")["Ant-v2", "option2vec"].curve
        self.assertEqual(line_of(panel, front.GREY)[-1].tolist(),
                         [curve.step[-1] / 1e6, curve.mean[-1]])

    def test_a_whole_grid_has_at_most_200_kilobytes_and_the_same_bytes_twice(self):
        rng = random.Random(7)
        for task in TASKS:
            for method in METHODS:
                write_run(self.results, task, method, 0, [rng.gauss(0, 1e4) for _ in range(100)],
                          "released", experiment="mine")  # any width will do
        text = front.svg(self.results)
        self.assertNotIn("no runs yet", text)
        self.assertLessEqual(len(text.encode()), 200_000)
        self.assertEqual(front.svg(self.results), text)


if __name__ == "__main__":
    unittest.main()
