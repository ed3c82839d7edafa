"""What the figures draw, by value: from the artists, not from the code that made them."""

import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np

from plots import fig_aggregate, fig_cost, fig_options, fig_parameters, fig_transfer
from plots.claims import CLAIMS, HOLDS, OURS, RIVALS, ROTATIONS, Evidence, parameter_counts
from plots.curves import NOTE, draw_curves
from plots.inputs import Inputs
from plots.records import METHODS, load_cells
from plots.samples import Curve, Sample, our_samples
from plots.statistics import Moments
from plots.style import INK, LOOKS, PAPER
from tree import with_reference, write_flat, write_run

TASK = "Hopper-v2"


def line_with(panel, color: str, **more):
    """The only line of this colour (and these properties) in a panel: its points (n, 2). Single
    points and vertical lines are none."""
    line, = (x for x in panel.lines if x.get_color() == color and len(set(x.get_xdata())) > 1
             and all(getattr(x, f"get_{name}")() == value for name, value in more.items()))
    return np.column_stack([np.asarray(c, dtype=float) for c in line.get_data()])


def bands(panel, color: str) -> list[dict[float, tuple[float, float]]]:
    """Of each band of this colour: lower and upper edge by step."""
    found = []
    for collection in panel.collections:
        rgb = [rgba[:3] for rgba in collection.get_facecolor()[:1]]  # of a line none
        if not rgb or not np.allclose(rgb, [int(color[i:i + 2], 16) / 255 for i in (1, 3, 5)]):
            continue
        edges: dict[float, list[float]] = {}
        for path in collection.get_paths():
            for x, y in path.vertices:
                edges.setdefault(round(float(x), 9), []).append(float(y))
        found.append({x: (min(y), max(y)) for x, y in edges.items()})
    return found


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.results = Path(folder.name) / "results"
        self.results.mkdir()

    def curve_panel(self, method: str, task: str = TASK):
        samples = our_samples(load_cells(self.results), "paper")
        return draw_curves((task,), tuple(METHODS), {"paper": samples}, {}).axes[0]

    def without_rows(self, path: Path, rows: int) -> None:
        """Takes the first rows of a record away, as of a run whose 20th episode came later."""
        lines = path.with_suffix(".csv").read_text().splitlines(keepends=True)
        path.with_suffix(".csv").write_text("".join(lines[:1] + lines[1 + rows:]))


class LearningCurvesTest(InFolder):
    def test_line_is_the_mean_and_band_one_standard_deviation(self):
        # Returns 10 i, 10 i + 3 and 10 i + 9: mean 10 i + 4; deviations -4, -1, 5, squares 42 in
        # all, so sqrt(14) with the divisor n. (Not sqrt(21), and not sqrt(14 / 3), an error.)
        for seed, more in enumerate((0, 3, 9)):
            write_run(self.results, TASK, "ppoc", seed, [10 * i + more for i in range(1, 21)])
        panel = self.curve_panel("ppoc")
        i = np.arange(1, 21)
        points = line_with(panel, LOOKS["ppoc"].color)
        np.testing.assert_allclose(points[:, 0], i * 0.01)  # [millions]
        np.testing.assert_allclose(points[:, 1], 10 * i + 4)
        band, = bands(panel, LOOKS["ppoc"].color)
        self.assertEqual(len(band), 20)
        for k, (x, edges) in enumerate(sorted(band.items()), 1):
            self.assertAlmostEqual(x, k * 0.01)
            np.testing.assert_allclose(edges, (10 * k + 4 - 14**0.5, 10 * k + 4 + 14**0.5))
        self.assertIn("n = 3", panel.get_title(loc="left"))
        self.assertIn("a band of one standard deviation", NOTE)

    def test_long_curves_keep_their_last_point_and_their_steps(self):
        write_run(self.results, TASK, "ppoc", 0, [7 * i for i in range(1, 101)])
        points = line_with(self.curve_panel("ppoc"), LOOKS["ppoc"].color)
        self.assertEqual(tuple(points[-1]), (1, 700))
        np.testing.assert_allclose(points[:, 1], 700 * points[:, 0])
        self.assertEqual(len(points), 50)

    def test_runs_whose_first_values_differ_are_aligned_by_step(self):
        # The second run has no row before 50 000 steps; there its first value, 105, is held.
        write_run(self.results, TASK, "oc", 0, [i for i in range(1, 11)])
        late = write_run(self.results, TASK, "oc", 1, [100 + i for i in range(1, 11)])
        self.without_rows(late, 4)
        panel = self.curve_panel("oc")
        points = line_with(panel, LOOKS["oc"].color)
        second = [105] * 5 + [106, 107, 108, 109, 110]
        np.testing.assert_allclose(points[:, 0], np.arange(1, 11) / 100)
        np.testing.assert_allclose(points[:, 1], [(i + x) / 2 for i, x in enumerate(second, 1)])
        band, = bands(panel, LOOKS["oc"].color)
        np.testing.assert_allclose(band[0.01], (1, 105))  # of two values the band spans them
        np.testing.assert_allclose(band[0.1], (10, 110))

    def test_the_authors_curve_is_theirs(self):
        steps = np.array([0.0, 500_000, 1_000_000])
        curve = Curve(steps, np.array([1.0, 2, 5]), np.array([0.5, 0.25, 2]), 10)
        sample = Sample(1_000_000, 1_000_000, np.array([5.0] * 10), np.array([]), curve,
                        Moments(2, 0, 10), Moments(0, 0, 10), 4.0, np.empty((2, 0)))
        figure = draw_curves((TASK,), ("ppo",), {"authors": {(TASK, "ppo"): sample}}, {})
        panel = figure.axes[0]
        np.testing.assert_allclose(line_with(panel, LOOKS["ppo"].color), [[0, 1], [0.5, 2], [1, 5]])
        band, = bands(panel, LOOKS["ppo"].color)
        self.assertEqual(band, {0: (0.5, 1.5), 0.5: (1.75, 2.25), 1: (3, 7)})

    def test_option2vec_and_the_best_rival_stand_out(self):
        for method, final in ((OURS, 3), ("ppo", 9), ("oc", 5)):
            write_flat(self.results, TASK, method, [final, final + 2])
        panel = self.curve_panel(OURS)
        for method, width, number in ((OURS, 2, 1), ("ppo", 2, 1), ("oc", 0.7, 0)):
            color = LOOKS[method].color
            line, = (x for x in panel.lines
                     if x.get_color() == color and len(set(x.get_xdata())) > 1)
            areas = [b for b in bands(panel, color) if len(b) > 1]
            self.assertEqual((line.get_linewidth(), len(areas)), (width, number))

    def test_end_points_have_the_interval_of_their_mean(self):
        # 10, 12 and 14: mean 12, error 2 / sqrt 3, t of two degrees of freedom 4.3027.
        write_flat(self.results, TASK, "ppoc", [10, 12, 14])
        panel = self.curve_panel("ppoc")
        dot, = (x for x in panel.lines if len(x.get_xdata()) == 1)
        self.assertGreater(dot.get_xdata()[0], 1)
        self.assertEqual(dot.get_ydata()[0], 12)
        bar, = (c for c in panel.collections if len(c.get_paths()[0].vertices) == 2)
        ends = bar.get_paths()[0].vertices[:, 1]
        np.testing.assert_allclose(ends, (12 - 4.3027 * 2 / 3**0.5, 12 + 4.3027 * 2 / 3**0.5), 1e-4)

    def test_the_second_task_of_a_pair_begins_at_a_million(self):
        with_reference(self.results)
        write_run(self.results, "Cheetah", "ppo", 0, list(range(1, 201)))
        drawing, = fig_transfer.draw(Inputs(self.results))
        panel = next(p for p in drawing.figure.axes if "Cheetah" in p.get_title(loc="left"))
        points = line_with(panel, LOOKS["ppo"].color, marker=LOOKS["ppo"].marker)
        self.assertEqual((points[-1, 0], points[-1, 1]), (2, 200))
        self.assertEqual(dict(points)[1], 100)
        dotted = [line for line in panel.lines if line.get_linestyle() == ":"]
        self.assertEqual([list(line.get_xdata()) for line in dotted], [[1, 1]])


class OptionsTest(InFolder):
    def panels(self):
        paper, *_ = fig_options.draw(Inputs(self.results))
        return paper.figure.axes[:3]

    def test_options_are_shown_by_index_beside_chance(self):
        # One run, shares 0.75 and 0.25: drawn independently they last 4 and 4/3 steps.
        write_run(self.results, TASK, OURS, 0, [1, 2, 3], options="0.75,0.25,4,8")
        write_run(self.results, TASK, OURS, 1, [1, 2, 3], options="0.1,0.9,8,8")  # not shown
        usage, duration, _ = self.panels()
        steps = [0.01, 0.02, 0.03]
        for (color, marker), share, lasts, by_chance in zip(
                fig_options.OPTIONS, (0.75, 0.25), (4, 8), (4, 4 / 3)):
            np.testing.assert_allclose(line_with(usage, color), [[x, share] for x in steps])
            for line, y in (("-", lasts), (":", by_chance)):
                np.testing.assert_allclose(line_with(duration, color, linestyle=line),
                                           [[x, y] for x in steps])

    def test_chance_is_unknown_for_an_option_that_is_never_or_always_used(self):
        np.testing.assert_allclose(fig_options.chance(np.array([0, 0.5, 1])), [np.nan, 2, np.nan])

    def test_mean_durations_are_over_seeds_with_a_band_of_one_deviation(self):
        # Durations 4 and 8: mean 6, deviation 2.
        write_run(self.results, TASK, OURS, 0, [1, 2, 3], options="0.7,0.3,4,4")
        write_run(self.results, TASK, OURS, 1, [1, 2, 3], options="0.1,0.9,8,8")
        mean, color, steps = self.panels()[2], LOOKS[OURS].color, [0.01, 0.02, 0.03]
        np.testing.assert_allclose(line_with(mean, color), [[x, 6] for x in steps])
        band, = bands(mean, color)
        for x in steps:
            np.testing.assert_allclose(band[x], (4, 8))

    def test_a_duration_is_at_least_a_step(self):
        # Durations 1, 1 and 4: mean 2, deviation sqrt 2; the band ends at 1.
        for seed, duration in enumerate((1, 1, 4)):
            write_run(self.results, TASK, OURS, seed, [1, 2], options=f"1,{duration}")
        band, = bands(self.panels()[2], LOOKS[OURS].color)
        np.testing.assert_allclose(band[0.02], (1, 2 + 2**0.5))

    def test_runs_whose_first_rows_differ_are_aligned_by_step(self):
        # Durations 10, 20, ..., 60 by row of one run; of the other 1, ..., 6, without rows 1 and 2.
        for seed, scale in ((0, 10), (1, 1)):
            path = write_run(self.results, TASK, OURS, seed, [1] * 6, options="1,99")
            csv = path.with_suffix(".csv")
            lines = csv.read_text().splitlines()
            lines[1:] = [line.removesuffix("99") + str(scale * i)
                         for i, line in enumerate(lines[1:], 1)]
            csv.write_text("\n".join(lines) + "\n")
        self.without_rows(path, 2)
        points = line_with(self.panels()[2], LOOKS[OURS].color)
        np.testing.assert_allclose(points, [[i / 100, 5.5 * i] for i in (3, 4, 5, 6)])


class AggregateTest(InFolder):
    def test_a_rival_that_ended_early_is_not_the_best(self):
        write_flat(self.results, "Hopper-v2", "ppo", [5, 6])
        write_flat(self.results, "Hopper-v2", "dac_ppo", [3, 4])
        write_run(self.results, "Hopper-v2", "oc", 0, [900] * 50)
        samples = our_samples(load_cells(self.results), "paper")
        self.assertTrue(samples["Hopper-v2", "oc"].shortened)
        self.assertEqual(fig_aggregate.best_rival(samples, "Hopper-v2")[0], "ppo")

    def test_dots_are_differences_in_units_of_the_best_rival(self):
        # Option2Vec 12, rivals 8 and 6: (12 - 8) / 8 = 0.5 above the better one. Reacher's returns
        # are negative: (-6 - -4) / 4 = -0.5; there rivals are missing.
        with_reference(self.results)
        finals = dict.fromkeys(RIVALS, [6, 6]) | {OURS: [12, 12], "ppo": [8, 8]}
        for method, final in finals.items():
            write_flat(self.results, TASK, method, final)
        for method, final in ((OURS, [-6, -6]), ("ppo", [-4, -4])):
            write_flat(self.results, "Reacher-v2", method, final)
        drawing, = fig_aggregate.draw(Inputs(self.results))
        panel = next(p for p in drawing.figure.axes if p.get_title(loc="left") ==
                     "ours, paper: all rivals on 1 of 16")
        names = [label.get_text() for label in drawing.figure.axes[0].get_yticklabels()]
        dots = {names[int(line.get_ydata()[0])]: (line.get_xdata()[0], line.get_markerfacecolor())
                for line in panel.lines if len(line.get_xdata()) == 1}
        self.assertEqual(dots, {TASK: (0.5, LOOKS[OURS].color), "Reacher-v2": (-0.5, PAPER),
                                "all tasks, IQM": (0.5, INK)})
        self.assertEqual([t.get_text() for t in panel.texts], ["PPO", "PPO", "+0.50"])


class ParametersTest(unittest.TestCase):
    def test_the_percentages_are_of_all_parameters(self):
        # Released Option2Vec allocates 30 598, of which it uses 30 484; the option network 193 473
        # with hidden layers of 128, 55 809 with 64.
        drawing, = fig_parameters.draw(Inputs(Path()))
        panel = drawing.figure.axes[0]
        self.assertEqual(sorted(text.get_text() for text in panel.texts),
                         ["30598 / 193473\n= 15.8 %", "30598 / 55809\n= 54.8 %"])
        at_four = {}
        for line in panel.lines:
            x, y = line.get_data()
            if len(x) == 7:
                at_four[float(y[list(x).index(4)])] = line.get_color()
        self.assertEqual(at_four, {
            193_473: LOOKS["dac_ppo"].color, 55_809: LOOKS["dac_ppo"].color,
            34_232: LOOKS["dac_onestep"].color, 31_615: LOOKS[OURS].color,
            30_598: LOOKS[OURS].color, 11_085: LOOKS["ppo"].color})

    def test_the_claim_is_about_what_is_allocated(self):
        # 30 / 190 rounds to 15.8 %; 24 / 190, what is used of it, does not.
        def row(method, width, counted, used):
            return {"task": "HalfCheetah-v2", "method": method, "fidelity": "released",
                    "width": width, "counted": counted, "used": used}
        rows = [row(OURS, 64, 30, 24), row("dac_ppo", 128, 190, 150), row("dac_ppo", 64, 60, 50),
                row("ppo", 128, 7, 7), row(OURS, 64, 1, 1) | {"fidelity": "paper"},
                row("dac_ppo", 128, 2, 2) | {"task": TASK}]
        counts = parameter_counts(rows, "released")
        self.assertEqual(counts, {OURS: 30, "width 128": 190, "width 64": 60})
        claim, = (c for c in CLAIMS if c.id == "share-128")
        finding, = claim.judge(Evidence("released", {}, counts))
        self.assertEqual((finding.verdict, finding.measured), (HOLDS, "30 / 190 = 15.8 %"))


class RotationsTest(unittest.TestCase):
    PATH = Path("paper/Hopper-v2/option2vec/seed-000.csv")

    def test_p_counts_the_measured_one_among_the_rotated_and_is_never_0(self):
        # Every dimension moves one action alone: the share is 1, which no rotation reaches.
        effects = np.zeros((12, 3))
        effects[np.arange(12), np.arange(12) % 3] = 2
        claim, = (c for c in CLAIMS if c.id == "q4")
        finding, = claim.judge(Evidence("paper", {}, effects={self.PATH: effects}))
        self.assertEqual(ROTATIONS, 1000)
        self.assertIn(f"p = {1 / 1001:.2g}; 1 run on Hopper-v2", finding.measured)
        self.assertTrue(finding.measured.startswith("100 % of the effect"), finding.measured)

    def test_p_counts_rotations_that_are_as_large(self):
        # Two dimensions with an action each have the share 1, turned by 45 degrees 1/2. Of 1000
        # rotations 250 turn by nothing: (1 + 250) / 1001.
        turned = np.array([[1, -1], [1, 1]]) / 2**0.5
        rotations = np.array([np.eye(2)] * 250 + [turned] * 750)
        claim, = (c for c in CLAIMS if c.id == "q4")
        with mock.patch("plots.claims.stats.ortho_group.rvs", return_value=rotations):
            finding, = claim.judge(Evidence("paper", {}, effects={self.PATH: 2 * np.eye(2)}))
        self.assertEqual(finding.measured, "100 % of the effect on primary actions, after rotation "
                         "62 %, p = 0.25; 1 run on Hopper-v2")


class CostTest(InFolder):
    def test_bars_are_the_parts_one_after_the_other_and_the_bound(self):
        def row(method, fidelity, physics):
            return {"name": f"step/Humanoid-v2/{method}/{fidelity}/iterations:5",
                    "physics_us": physics, "inference_us": 5, "learning_us": 20, "total_us": 1,
                    "bound_us": 99, "bound_products_us": 12, "bound_adam_us": 6.5, "MFLOP": 2,
                    "ratio": 1.07}
        rows = [row(m, f, 80) for m in (OURS, "ppo", "oc") for f in ("paper", "released")]
        (self.results / "bench.json").write_text(str({"benchmarks": rows}).replace("'", '"'))
        drawing, = fig_cost.draw(Inputs(self.results))
        panel = drawing.figure.axes[0]
        spans = sorted({(bar.get_x(), bar.get_width()) for bar in panel.patches})
        self.assertEqual(spans, [(0, 80), (80, 5), (85, 20)])
        bound, = panel.collections
        self.assertEqual({segment[0][0] for segment in bound.get_segments()}, {99})


if __name__ == "__main__":
    unittest.main()
