import tempfile
import unittest
from pathlib import Path

import numpy as np

from plots.style import save
from plots.timeline import draw, entropy, explain, information, mutual_information, phase


class TimelineTest(unittest.TestCase):
    def test_entropy_is_in_bits(self):
        self.assertEqual(entropy(np.array([3, 3, 3])), 0)
        self.assertEqual(entropy(np.array([0, 1, 2, 3])), 2)
        # -3/4 log2 3/4 - 1/4 log2 1/4 = 2 - 3/4 log2 3
        self.assertAlmostEqual(entropy(np.array([0, 0, 0, 5])), 2 - 0.75 * np.log2(3), places=12)

    def test_mutual_information_is_what_one_tells_of_the_other(self):
        x = np.array([0, 0, 1, 1, 2, 2, 3, 3])
        self.assertAlmostEqual(mutual_information(x, x), 2)
        self.assertAlmostEqual(mutual_information(x, x // 2), 1)
        self.assertAlmostEqual(mutual_information(x, np.array([0, 1] * 4)), 0)
        # (x, y) is 00, 00, 01, 11: H(x) = 2 - 3/4 log2 3, H(y) = 1, H(x, y) = 3/2.
        self.assertAlmostEqual(mutual_information(np.array([0, 0, 0, 1]), np.array([0, 0, 1, 1])),
                               1.5 - 0.75 * np.log2(3))

    def test_chance_is_the_bias_of_the_estimate(self):
        # Independent: about (K - 1)(M - 1) / (2 n ln 2) bits of bias, Miller 1955.
        rng = np.random.default_rng(1)
        o, y = rng.integers(0, 4, 2000), rng.integers(0, 16, 2000)
        found = information(o, y)
        self.assertAlmostEqual(found.shuffled, 3 * 15 / (2 * 2000 * np.log(2)), delta=0.001)
        self.assertLess(found.shuffled, found.high)
        self.assertLess(abs(found.bits - found.shuffled), 0.01)
        self.assertEqual(information(o, y), found)

    def test_phases_are_equally_full(self):
        bins = phase(np.array([5, 1, 7, 3, 8, 2, 6, 4]))
        self.assertEqual(bins.tolist(), [2, 0, 3, 1, 3, 0, 2, 1])
        self.assertEqual(set(phase(np.zeros(9))), {3})

    def steps(self, o: np.ndarray, **observed: np.ndarray) -> dict[str, np.ndarray]:
        n = len(o)
        steps = {"episode": np.arange(n) // 100, "step": np.arange(n) % 100, "o": o,
                 **{f"P{k}": np.full(n, 0.5) for k in range(2)}}
        return steps | {f"obs{i}": np.zeros(n) for i in range(17)} | observed

    def test_an_option_that_follows_the_height_says_so(self):
        # Speed is independent; the option is height > median, in blocks of 10 steps.
        height = np.tile(np.repeat([1.0, 2.0], 10), 40) + np.linspace(0, 0.1, 800)
        speed = np.random.default_rng(2).normal(size=800)
        found = explain("Walker2d-v2", self.steps((height > 1.5) * 1.0, obs0=height, obs8=speed))
        self.assertEqual(list(found), ["option before", "height", "speed", "both"])
        self.assertAlmostEqual(found["height"].bits, 1, places=3)
        self.assertLess(found["speed"].bits, found["speed"].high + 0.005)
        self.assertAlmostEqual(found["both"].bits, 1, places=3)
        # In an episode of 100 steps 9 of 99 change: 1 - H(1/11), up to the ends.
        p = 1 / 11
        expected = 1 + p * np.log2(p) + (1 - p) * np.log2(1 - p)
        self.assertAlmostEqual(found["option before"].bits, expected, delta=0.005)

    def test_chance_is_shown_by_its_95th_percentile(self):
        # Of the 28 places of two among eight one (3.6 %) is o's, 15 share none with it: then
        # H(1/4) + H(1/4) - H(1/4, 1/4, 1/2) = 0.1226 bit. The twelve that share one have less.
        o = np.repeat([0, 1], (2, 6))
        expected = 2 * entropy(o) - 1.5
        self.assertAlmostEqual(information(o, o, shuffles=2000).high, expected)

    def test_a_new_episode_has_no_option_before(self):
        # 1 in the first half of 100 steps, then 0: were ends counted, 0 -> 1 would be there, too.
        o = np.tile(np.repeat([1.0, 0.0], 50), 2)
        before, after = o[:-1], o[1:]
        inside = np.arange(1, 200) % 100 > 0
        self.assertAlmostEqual(explain("Reacher-v2", self.steps(o))["option before"].bits,
                               mutual_information(after[inside], before[inside]))

    def test_figures_are_drawn_with_and_without_quantities(self):
        with tempfile.TemporaryDirectory() as name:
            for task in ("Walker2d-v2", "Reacher-v2"):
                drawing = draw(f"{task}-paper", task, self.steps(np.arange(200.0) // 7 % 2))
                save(drawing, Path(name))
                self.assertTrue((Path(name) / f"timeline_{task}-paper.png").is_file())


if __name__ == "__main__":
    unittest.main()
