import contextlib
import io
import json
import re
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np

from plots import beyond, fig_cost, fig_embedding, fig_learning_curves, fig_options, ledger, report
from plots.inputs import Inputs
from plots.records import load_cells
from plots.samples import Curve, Sample, author_samples, our_samples
from plots.statistics import Moments
from plots.style import RESULTS, inline_svg, svg_of
from plots.text import Picture, moments, slug, to_html
from tree import REGISTRY, ROOT, with_reference, write_flat, write_run

COUNTERS = {"physics_us": 80.5, "inference_us": 5, "learning_us": 20, "total_us": 105.5,
            "bound_us": 99, "bound_products_us": 12, "bound_adam_us": 6.5, "MFLOP": 2,
            "ratio": 1.07}


def make(results: Path) -> dict[str, str]:
    """The files of a report, by name. To save time without the figures' own files, which are in
    the page, and without the learning curves, which are drawn as those of transfer are."""
    with tempfile.TemporaryDirectory() as out, contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.redirect_stdout(io.StringIO()))
        arguments = ["report", "--results", str(results), "--out", out]
        stack.enter_context(mock.patch.object(sys, "argv", arguments))
        stack.enter_context(mock.patch.object(report, "save"))
        stack.enter_context(mock.patch.object(fig_learning_curves, "draw", return_value=[]))
        report.main()
        return {path.name: path.read_text() for path in sorted(Path(out).iterdir())}


def cost_figure(results: Path):
    (results / "bench.json").write_text(str({"benchmarks": [
        {"name": f"step/Humanoid-v2/{m}/{f}/iterations:5"} | COUNTERS
        for m in ("option2vec", "ppo", "oc") for f in ("paper", "released")
    ]}).replace("'", '"'))
    drawing, = fig_cost.draw(Inputs(results))
    return drawing


class ReportTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.results = results = with_reference(Path(folder.name))
        write_flat(results, "HalfCheetah-v2", "option2vec", [100, 110, 120],
                   options="0.5,0.5,2,4", revision=2)
        write_flat(results, "HalfCheetah-v2", "ppo", [50, 60, 70])
        write_run(results, "HalfCheetah-v2", "ppo", 3, [1], status="diverged", steps=10_000,
                  wanted=1_000_000)
        write_run(results, "HalfCheetah-v2", "option2vec", 9, [0] * 100)  # revision 1
        for seed in range(2):
            write_run(results, "HalfCheetah-v2", "oc", seed, [1], status="diverged", steps=10_000,
                      wanted=1_000_000)
        write_flat(results, "Hopper-v2", "option2vec", [10])  # revision 1
        write_flat(results, "Cheetah", "ppo", [7, 8], settings="hidden = 64\nworkers = 1")
        write_flat(results, "Cheetah", "ppo", [7, 8], settings="hidden = 128\nworkers = 1",
                   fidelity="released", experiment="transfer")
        write_flat(results, "HalfCheetah-v2", "ppo", [55, 65, 76, 1, 1], experiment="ablation",
                   fidelity="paper-timelimit=released")
        write_flat(results, "Cheetah", "ppo", [9, 11], settings="hidden = 32",
                   fidelity="released-hidden=32", experiment="ablation")
        write_run(results, "Fish", "ppo", 0, [1], settings="hidden = 32", steps=10_000,
                  wanted=2_000_000, fidelity="released-hidden=32", experiment="ablation",
                  status="diverged")
        (results / "registry.json").write_text(REGISTRY)
        (results / "theory.csv").write_text(
            "name,gap,relation,tolerance,verdict,compared\nTheorem 3.3,1e-12,<,1e-9,PASS,both\n")
        cls.files = make(results)

    def rows(self, *cells: str) -> list[list[str]]:
        return [line.strip("| ").split(" | ") for line in self.files["REPORT.md"].splitlines()
                if line.startswith("| " + " | ".join(cells))]

    def row(self, *cells: str) -> list[str]:
        row, = self.rows(*cells)
        return row

    def test_means_deviations_and_numbers_of_seeds(self):
        # Option2Vec: mean 110, squares 100 + 0 + 100; the middle half of three is 3/4 of the way
        # of the outer values into the middle one: (0.25 * 100 + 110 + 0.25 * 120) / 1.5.
        row = self.row("HalfCheetah-v2", "Option2Vec", "110")
        self.assertEqual(row[2], "110.0 ± 8.165 (3)")
        self.assertTrue(row[3].startswith("110.0 ["))
        self.assertEqual(row[4], "3461 ± 209.5 (10)")
        self.assertIn("1 of older revisions left out", row[-1])

    def test_comparison_with_a_rival(self):
        # Sample variances 100 and 100: t = 50 / sqrt(200/3) with 4 degrees of freedom, p 0.0036;
        # half the interval is 2.776 * 8.165 = 22.67.
        row = self.row("HalfCheetah-v2", "PPO", "60")
        self.assertEqual(row[6:9], ["1.000 [1.000, 1.000] (3, 3)",
                                    "+50.00 [+27.33, +72.67] (3, 3)", "0.0036"])
        self.assertEqual(row[-1], "1 diverged")

    def test_one_run_has_no_deviation(self):
        self.assertEqual(self.row("Hopper-v2", "Option2Vec")[2], "10.00 ± - (1)")

    def test_diverged_runs_are_shown_even_where_none_is_whole(self):
        self.assertIn(" | 2 diverged | 60.00 ± 8.165 (3), 1 diverged |", self.files["REPORT.md"])

    def test_older_revisions_are_named(self):
        self.assertIn("paper/Hopper-v2/option2vec: revision 1 is used, there is none of revision 2",
                      self.files["REPORT.md"])

    def test_sizes_that_differ_between_the_fidelities(self):
        self.assertEqual(self.row("PPO", "hidden"), ["PPO", "hidden", "64", "128", "Cheetah"])

    def test_transfer_has_both_ends(self):
        paper, released = self.rows("Cheetah", "PPO", "7")
        self.assertEqual(released[2], "7.500 ± 0.500 (2)")
        self.assertEqual(released[-2], "7.500 ± 0.500 (2)")

    def test_agreement_with_the_authors_counts_both_ends_of_a_pair(self):
        # Ours of Cheetah are 7 and 8, the authors' 290 +- 49 and 73 +- 85 of ten runs: p far below
        # 0.001, and 65.4 / (85 / 3) = 2.31 with 9 degrees of freedom, p = 0.046.
        self.assertIn("of 2 comparisons 2 have p < 0.05; were there no difference at all, 0.100 "
                      "would be expected. With Holm's correction for their number 2 remain: PPO on "
                      "Cheetah's first task, PPO on Cheetah's second task.", self.files["REPORT.md"])

    def test_agreement_holds_p_against_the_number_of_comparisons(self):
        # Samples m -+ 1 of two runs each, deviation 1 (divisor n), error 1 of each mean: t of a
        # difference d is d / sqrt(2) with 2 degrees of freedom, where p = 1 - t / sqrt(2 + t^2):
        # d = 1000 has 2e-6, d = 8 has 0.0299, d = 2 has 0.293. Holm: 6e-6, 0.060, 0.293.
        def sample(mean: float) -> Sample:
            zero = Moments(0, 0, 2)
            return Sample(1, 1, np.array([mean - 1, mean + 1]), np.array([]),
                          Curve(np.array([1]), np.array([mean]), np.array([1]), 2), zero, zero, 0,
                          np.empty((2, 0)))

        keys = [("Hopper-v2", "ppo"), ("Ant-v2", "ppo"), ("Swimmer-v2", "ppo")]
        ours = {key: sample(mean) for key, mean in zip(keys, (8, 1000, 2))}
        paragraph, = report._agreement([task for task, _ in keys], ours,
                                       {key: sample(0) for key in keys})
        self.assertIn("of 3 comparisons 2 have p < 0.05", paragraph.text)
        self.assertIn("With Holm's correction for their number 1 remains: PPO on Ant-v2.",
                      paragraph.text)
        # A run that ended before its horizon is not one of the authors' runs cut short.
        ours["Walker2d-v2", "ppo"] = replace(sample(1000), horizon=2)
        theirs = {key: sample(0) for key in ours}
        self.assertIn("of 3 comparisons 2 have p < 0.05", report._agreement(
            [task for task, _ in ours], ours, theirs)[0].text)

    def test_shares_over_all_tasks_are_those_of_a_fidelity_and_a_width(self):
        rows = [{"task": task, "S": 1, "A": 1, "method": "oc", "fidelity": fidelity,
                 "width": width, "counted": 100, "used": 90, "share": share}
                for task, fidelity, width, share in (
                    ("HalfCheetah-v2", "paper", 64, 0.50), ("Hopper-v2", "paper", 64, 0.40),
                    ("Ant-v2", "paper", 64, 0.45), ("HalfCheetah-v2", "paper", 128, 0.20),
                    ("Hopper-v2", "paper", 128, 0.25), ("HalfCheetah-v2", "released", 64, 0.60),
                    ("Hopper-v2", "released", 64, 0.70))]
        *_, table = report._parameters(rows)
        self.assertEqual([(row[1], row[2], *row[6:]) for row in table.rows], [
            ("paper", "64", "50.0 %", "40.0 to 50.0 %"),
            ("paper", "128", "20.0 %", "20.0 to 25.0 %"),
            ("released", "64", "60.0 %", "60.0 to 70.0 %")])

    def test_runs_of_unequal_length_are_not_compared(self):
        # Hopper's Option2Vec ran to 1 000 000 steps, DAC+PPO to 500 000: its return there stands
        # alone, beside the authors' curve at that step.
        with tempfile.TemporaryDirectory() as folder:
            results = with_reference(Path(folder))
            write_flat(results, "Hopper-v2", "option2vec", [10, 20])
            for seed in range(2):
                write_run(results, "Hopper-v2", "dac_ppo", seed, [5 + seed] * 50)
            samples = our_samples(load_cells(results), "paper")
            authors = author_samples(results / "reference")
            row = report._row("Hopper-v2", "dac_ppo", samples, authors)
            there = authors["Hopper-v2", "dac_ppo"].curve
            self.assertEqual(row[2], "5.500 ± 0.500 (2)")
            self.assertEqual(row[4], moments(Moments(
                float(np.interp(500_000, there.step, there.mean)),
                float(np.interp(500_000, there.step, there.std)), there.n)))
            self.assertEqual(row[6:9], ["-"] * 3)
            self.assertEqual(row[-1], "at 500000 steps")

    def test_the_ablations_effect_is_in_the_deviations(self):
        # Without seeds 3 (diverged) and 4 (not run): differences 5, 5, 6 have the mean 5.333 with
        # an error of 1/3, t = 16 with 2 degrees of freedom; half the interval is 4.303 / 3.
        row = self.row("timelimit")
        self.assertEqual(row[2:4], ["bootstrap", "terminal"])
        self.assertEqual(row[-1], "paper with released, HalfCheetah-v2, PPO: "
                                  "+5.333 [+3.899, +6.768], p = 0.0039 (n = 3)")
        self.assertEqual(row[-3], "paper (12)")  # without the one of an older revision

    def test_runs_with_a_number_changed_stand_beside_those_without(self):
        # Differences 2 and 3: t = 2.5 / 0.5 with 1 degree of freedom, p 0.126.
        row = self.row("PPO", "released", "hidden=32, not 128", "Cheetah")
        self.assertEqual(row[4:6], ["10.00 ± 1.000 (2), 10.00 ± 1.000 (2)",
                                    "7.500 ± 0.500 (2), 7.500 ± 0.500 (2)"])
        self.assertRegex(row[6], r"^290\S* ± 4\S* \(10\), 72")
        self.assertEqual(row[7], "+2.500 [-3.853, +8.853], p = 0.13 (n = 2)")
        self.assertEqual(self.rows("PPO", "paper", "timelimit=released"), [])
        lost = self.row("PPO", "released", "hidden=32", "Fish")
        self.assertEqual((lost[4], lost[7:]), ("-", ["-", "1 diverged"]))

    def test_the_first_screen_has_a_word_for_each_claim_and_source(self):
        row = self.row('Best on the four "infinite horizon" tasks')
        place = "#best-on-the-four-infinite-horizon-tasks-q2-fig-4b"
        self.assertEqual(row[1:], [f"[fails]({place}) 3/4, n = 10", f"[not measured]({place})",
                                   f"[undecided]({place})"])  # only PPO of the rivals has runs
        self.assertEqual(self.row("As printed")[1:3], [
            "-", "[not measured](#as-printed-varv_bar--v-proposition-32)"])
        self.assertEqual(len(self.rows("Does Option2Vec need options?")), 1)

    def test_the_evidence_has_the_literal_verdict_beside_the_statistical_one(self):
        text = self.files["REPORT.md"]
        self.assertIn("- `paper`: **undecided** at n = 3 (1 task): undecided on 1, not measured "
                      "on 3", text)
        self.assertIn("- authors' logs: first by mean on 3 of 4; **fails** at n = 10 (Reacher): "
                      "holds on 3, fails on 1 (Reacher-v2 -0.944 [-1.741, -0.146] against "
                      "PPO, p = 0.023)", text)

    def test_every_link_of_the_text_leads_to_a_heading(self):
        text = self.files["REPORT.md"]
        headings = {slug(line.lstrip("# ")) for line in text.splitlines() if line.startswith("#")}
        links = set(re.findall(r"\]\(#([^)]+)\)", text))
        self.assertGreater(len(links), 15)
        self.assertFalse(links - headings)

    def test_the_ledger_for_programs_says_the_same(self):
        found = json.loads(self.files["claims.json"])
        self.assertEqual((found["runs_done"], found["runs_of_grid"]), (14, 2560))
        claim, = (c for c in found["claims"] if c["id"] == "q2-best")
        self.assertEqual(claim["verdicts"]["authors"], {
            "word": "fails", "literally": "first by mean on 3 of 4", "seeds": [10, 10],
            "n": "10 (Reacher)"})
        self.assertEqual(claim["verdicts"]["paper"]["seeds"], [3, 3])

    def test_something_changed_is_compared_by_seed_and_over_equally_many_steps(self):
        with tempfile.TemporaryDirectory() as folder:
            results, turned = Path(folder), "paper-timelimit=released"
            for seed, last in ((0, 1), (1, 20), (2, 300)):
                write_run(results, "Hopper-v2", "ppo", seed, [last] * 10)
            for seed, last in ((1, 25), (2, 306), (3, 9000)):
                write_run(results, "Hopper-v2", "ppo", seed, [last] * 10, fidelity=turned,
                          experiment="ablation")
            write_run(results, "Swimmer-v2", "ppo", 0, [1] * 10)
            write_run(results, "Swimmer-v2", "ppo", 0, [5] * 5, fidelity=turned,
                      experiment="ablation")
            gains = {}
            cells = load_cells(results)
            for key, cell in cells.items():
                if key.variant:
                    gains[key.task] = report._gains(cell, cells[key._replace(variant="")])
            self.assertEqual(gains, {"Hopper-v2": [5, 6], "Swimmer-v2": []})

    def test_missing_runs_are_named(self):
        self.assertEqual(self.row("HalfCheetah-v2", "seeds")[1],
                         "seeds 3-9 of Option2Vec; seeds 0-9 of DAC-OneStep, DAC+PPO, AHP+PPO, "
                         "IOPG, PPOC; seeds 2-9 of OC; seeds 4-9 of PPO")
        self.assertIn("14 of the grid's 2560 runs", self.files["REPORT.md"])

    def test_the_page_is_whole_by_itself(self):
        page = self.files["report.html"]
        self.assertIn("prefers-color-scheme: dark", page)
        self.assertIn('name="viewport"', page)
        self.assertFalse(re.findall(r'(?:src|href)="(?!#)[^"]*"', page))
        ids = re.findall(r'\bid="([^"]+)"', page)
        self.assertEqual(len(ids), len(set(ids)))
        self.assertFalse(set(re.findall(r'(?:url\(|href=")#([^")]+)', page)) - set(ids))
        for svg in re.findall(r"<svg.*?</svg>", page, re.DOTALL):
            ElementTree.fromstring(svg)
        self.assertEqual(page.count("<details>"), page.count("</details>"))

    def test_fills_and_strokes_are_colours_or_what_the_page_has(self):
        page = self.files["report.html"]
        ids = set(re.findall(r'\bid="([^"]+)"', page))
        pictures = "".join(re.findall(r"<svg.*?</svg>", page, re.DOTALL))
        paints = set(re.findall(r'\b(?:fill|stroke)(?:="|: ?)([^";]+)', pictures))
        references = {p for p in paints if p.startswith("url")}
        self.assertFalse({p[5:-1] for p in references} - ids)
        for paint in paints - references:
            self.assertRegex(paint, r"^(#[0-9a-f]{6}|none|var\(--(ink|paper)\))$")

    def test_a_page_keeps_the_colours_of_its_figures(self):
        with tempfile.TemporaryDirectory() as name:
            cost = cost_figure(Path(name))
            page = to_html("x", [Picture(cost.name, "", inline_svg(cost))])
            colours = {c for _, c, _ in fig_cost.FILLS}
            self.assertEqual(colours & set(re.findall("#[0-9a-f]{6}", svg_of(cost))), colours)
            # Hatched bars refer to a pattern, which has the colour.
            for pattern in re.findall(r"url\(#([^)]+)\)", page):
                self.assertEqual(page.count(f'id="{pattern}"'), 1)
            patterns = "".join(re.findall(r"<pattern.*?</pattern>", page, re.DOTALL))
            for colour in colours - {fig_cost.GREY}:
                self.assertIn(f'fill="{colour}"', patterns)

    def test_is_the_same_when_made_again(self):
        self.assertEqual(make(self.results), self.files)

    def test_learning_curves_say_what_they_show(self):
        onestep, *_ = fig_learning_curves.draw(Inputs(self.results))
        titles = [panel.get_title(loc="left") for panel in onestep.figure.axes]
        self.assertEqual(titles[0], "HalfCheetah-v2, ours, paper\n1 of 2 methods, n = 3")
        self.assertEqual(sum("no runs yet" in title for title in titles), 18)

    def test_figures_skip_what_is_not_there(self):
        for module in (fig_cost, fig_embedding):
            drawing, = module.draw(Inputs(self.results))
            self.assertIsNone(drawing.figure)
            self.assertIn("No figure", drawing.caption)
        paper, _, released, _ = fig_options.draw(Inputs(self.results))
        self.assertIsNotNone(paper.figure)
        self.assertIsNone(released.figure)

    def test_embedding_and_cost_are_drawn_from_their_files(self):
        with tempfile.TemporaryDirectory() as name:
            results = Path(name)
            folder = results / "interpret" / "paper" / "Hopper-v2" / "option2vec"
            folder.mkdir(parents=True)
            (folder / "seed-000.csv").write_text(
                "dimension,embedding_0,embedding_1,effect_0,effect_1,perturbed_0,perturbed_1,delta"
                "\n0,1,2,0.5,-1,0.25,-0.75,0.5\n1,0,-1,-0.25,0,0.5,-1,0.5\n")
            embedding, sheet = fig_embedding.draw(Inputs(results))
            self.assertEqual(embedding.figure.axes[0].get_title(loc="left"),
                             "Hopper-v2, seed 0, paper")
            self.assertEqual([p.get_title(loc="left") for p in sheet.figure.axes],
                             ["Hopper-v2, seed 0: ±1"])
            # Largest effects 1 (action 1), 0.25 (action 0); changes 0.75 and 1 (action 1) over 0.5.
            bars = embedding.figure.axes[6]
            self.assertEqual([b.get_height() for b in bars.patches], [1, 0.25, 1.5, 2])
            self.assertEqual([t.get_text() for t in bars.texts], ["1", "0", "1", "1"])
            cost = cost_figure(results)
            self.assertIn("var(--ink)", inline_svg(cost))
            self.assertNotIn("date", svg_of(cost))


class CommittedTest(unittest.TestCase):
    """What is committed is what `make report` writes."""

    def test_readme_has_the_box_of_the_ledger(self):
        found = json.loads((RESULTS / "claims.json").read_text(encoding="utf-8"))
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        self.assertEqual(ledger.put_box(readme, ledger.box(found)), readme, "make report")

    def test_the_ledger_is_that_of_the_records(self):
        inputs = Inputs(RESULTS)
        found = ledger.claims_json(ledger.judge(inputs), inputs, beyond.by_question(inputs))
        text = (RESULTS / "claims.json").read_text(encoding="utf-8")
        self.assertEqual(ledger.to_text(found), text, "make report")

    def test_figures_of_the_report_are_there_and_small(self):
        text = (RESULTS / "REPORT.md").read_text(encoding="utf-8")
        figures = {RESULTS / name for name in re.findall(r"\]\((figures/[^)]+\.svg)\)", text)}
        self.assertEqual(figures, set((RESULTS / "figures").iterdir()))
        self.assertLess(sum(f.stat().st_size for f in figures), 3_000_000)


if __name__ == "__main__":
    unittest.main()
