import tempfile
import unittest
from pathlib import Path

from plots import beyond, fig_options_count, report
from plots.beyond import NO, YES, Part
from plots.claims import UNDECIDED, UNMEASURED
from plots.inputs import Inputs
from plots.records import load_cells
from plots.samples import persistence
from plots.style import LOOKS
from plots.text import to_markdown
from tree import with_reference, write_flat, write_run

TASK, OURS = "Hopper-v2", "option2vec"


class AnswerTest(unittest.TestCase):
    def answer(self, *effects):
        question = beyond.QUESTIONS[0]
        return question.answer([Part(str(i), "", x) for i, x in enumerate(effects)])

    def test_tasks_are_the_units(self):
        # 0.4, 0.5 and 0.6: error 0.1 / sqrt 3, t 4.3027, half the interval 0.248.
        answer = self.answer(0.4, 0.5, 0.6, None)
        self.assertEqual((answer.word, answer.small), (YES, "+50 %"))
        self.assertEqual(answer.reason, "+50 % [+25 %, +75 %] in the mean of 3 of 16 tasks")

    def test_an_effect_that_is_small_for_sure_is_a_no(self):
        self.assertEqual(self.answer(0.01, 0.02, 0.03).word, NO)
        self.assertEqual(self.answer(-0.5, -0.6, -0.4).word, NO)

    def test_undecided_and_not_measured(self):
        self.assertEqual(self.answer(0.9, -0.5, 0.6).word, UNDECIDED)
        self.assertEqual(self.answer(0.9).word, UNDECIDED)
        self.assertEqual(self.answer(None).word, UNMEASURED)
        question = beyond.QUESTIONS[0]
        parts = [Part(task, "no whole runs with one option") for task in ("a", "b")]
        self.assertEqual(question.answer(parts).reason, "no whole runs with one option")

    def test_switches_are_corrected_for_their_number(self):
        # Holm: 0.02 times 2 is below 0.05, 0.02 times 3 is not.
        few = [Part("a", "", 1.0, 0.02), Part("b", "", 1.0, 0.6)]
        self.assertEqual(beyond.over_switches(few).word, YES)
        self.assertEqual(beyond.over_switches(few).reason, "1 of 2 comparisons: a")
        self.assertEqual(beyond.over_switches([*few, Part("c", "", 1.0, 0.7)]).word, UNDECIDED)
        self.assertEqual(beyond.over_switches([Part("a", "", -1.0, 0.001)]).word, UNDECIDED)
        self.assertEqual(beyond.over_switches([]).word, UNMEASURED)


class QuestionsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.results = with_reference(Path(folder.name))

    def parts(self, start: str):
        question, = (q for q in beyond.QUESTIONS if q.text.startswith(start))
        found = {p.name: p for p in question.ask(Inputs(self.results), "paper")}
        return found, question

    def write(self, K: int, finals, task=TASK):
        variant = "" if K == 4 else f"-options={K}"
        write_flat(self.results, task, OURS, finals, fidelity=f"paper{variant}",
                   settings=f"options = {K}", options=",".join([f"{1 / K}"] * K + ["2"] * K),
                   experiment="single_task" if K == 4 else "ablation")

    def test_four_options_against_one(self):
        self.write(4, [150, 160])
        self.write(1, [100, 100])
        parts, question = self.parts("Does Option2Vec need")
        self.assertAlmostEqual(parts[TASK].effect, 0.55)
        self.assertIsNone(parts["Ant-v2"].effect)
        self.assertEqual(question.answer(list(parts.values())).small, "+55 %")

    def test_the_figure_has_a_point_for_each_number_of_options(self):
        self.write(4, [150, 160])
        self.write(1, [100, 104])
        self.write(16, [90, 94])
        drawing, = fig_options_count.draw(Inputs(self.results))
        panel = drawing.figure.axes[0]
        line, = (x for x in panel.lines if x.get_color() == LOOKS[OURS].color)
        self.assertEqual((list(line.get_xdata()), list(line.get_ydata())),
                         ([1, 4, 16], [102, 155, 92]))

    def test_without_such_runs_the_figure_says_so(self):
        self.write(4, [150, 160])
        drawing, = fig_options_count.draw(Inputs(self.results))
        self.assertIsNone(drawing.figure)
        self.assertIn("not measured yet", drawing.caption)

    def test_one_option_against_ppo(self):
        self.write(1, [120, 120])
        write_flat(self.results, TASK, "ppo", [80, 120])
        parts, _ = self.parts("With one option")
        self.assertAlmostEqual(parts[TASK].effect, 0.2)

    def test_the_section_of_the_report_fills_from_the_ablations(self):
        def changed(variant, method, finals, settings, duration=2):
            write_flat(self.results, TASK, method, finals, fidelity=f"paper-{variant}",
                       settings=settings, experiment="ablation",
                       options=",".join(["0.25"] * 4 + [str(duration)] * 4))

        self.write(4, [150, 160])
        self.write(1, [100, 100])
        write_flat(self.results, TASK, "ppo", [60, 100])
        changed("options=1-workers=1", OURS, [70, 80], "options = 1\nworkers = 1")
        changed("o2v_critic=released", OURS, [1, 1], "options = 4", duration=4)
        changed("activation=relu", "ppo", [85, 95], 'activation = "relu"')
        inputs = Inputs(self.results)
        text = to_markdown("", report._beyond(inputs, beyond.by_question(inputs)), "")
        # Against 100 and 80. Chance is 1 / (1 - 4/16) = 4/3 steps: ratios 3 and 1.5.
        self.assertIn("- `paper`: **undecided**: +55 % in the mean of 1 of 16 tasks", text)
        self.assertIn("- `paper`: **undecided**: +25 % in the mean of 1 of 16 tasks", text)
        self.assertIn("- `paper`: **yes**: 1 of 1 comparisons: o2v_critic=released, Hopper-v2", text)
        self.assertIn("- `released`: **not measured**: no whole runs with one option", text)
        self.assertIn("| Hopper-v2 | paper | PPO | activation=relu | 90.00 ± 5.000 (2) |", text)
        self.assertIn("| Hopper-v2 | paper | Option2Vec, one option | workers=1 | 75.00 ± 5.000 (2) |",
                      text)

    def test_persistence_is_the_duration_over_that_of_independent_draws(self):
        # Shares 0.5 and 0.5, 3 steps each: chance is 1 / (1 - 0.5) = 2. Shares 0.9 and 0.1, 10 and
        # 10/9 steps: executions 0.09 + 0.09, so 1 / 0.18 steps, which chance has: 1 / (1 - 0.82).
        for seed, (options, ratio) in enumerate((("0.5,0.5,3,3", 1.5),
                                                 (f"0.9,0.1,10,{10 / 9}", 1))):
            write_run(self.results, TASK, OURS, seed, [1] * 100, options=options)
            run = [r for c in load_cells(self.results).values() for r in c.runs][seed]
            self.assertAlmostEqual(persistence(run), ratio)
        parts, _ = self.parts("Do its options last")
        self.assertAlmostEqual(parts[TASK].effect, 0.25)

    def test_rows_of_the_last_tenth_count_by_their_steps(self):
        # Rows of shares 1/2, 1/2 with 3 steps each, and of 0.9, 0.1 with 10 and 10/9, 1 / 0.18 steps
        # together. Equally many steps of both: durations 2 / (1/3 + 0.18), chance 2 / (0.5 + 0.18).
        path = write_run(self.results, TASK, OURS, 0, [1] * 20, options="0.5,0.5,3,3")
        csv = path.with_suffix(".csv")
        lines = csv.read_text().splitlines()
        lines[-1] = f"200000,1,0.9,0.1,10,{10 / 9}"
        csv.write_text("\n".join(lines) + "\n")
        run, = (r for c in load_cells(self.results).values() for r in c.runs)
        self.assertAlmostEqual(persistence(run), (0.5 + 0.18) / (1 / 3 + 0.18))

    def test_switches_are_compared_over_whole_runs(self):
        # 4 steps an option with the switch, 3 without; chance is 2. The run that broke off, with
        # 40, says nothing.
        for seed in range(2):
            for variant, steps in (("", 3), ("-o2v_query=released", 4)):
                write_run(self.results, TASK, OURS, seed, [1] * 20, fidelity=f"paper{variant}",
                          options=f"0.5,0.5,{steps},{steps}", settings="options = 4")
        write_run(self.results, TASK, OURS, 2, [1] * 19, fidelity="paper-o2v_query=released",
                  options="0.5,0.5,40,40", settings="options = 4", status="diverged",
                  steps=195_000, wanted=200_000)
        parts, _ = self.parts("Does one switch")
        self.assertAlmostEqual(parts[f"o2v_query=released, {TASK}"].effect, 0.5)

    def test_one_option_alone_has_no_persistence(self):
        self.write(1, [1])
        run, = (r for c in load_cells(self.results).values() for r in c.runs)
        self.assertNotEqual(persistence(run), persistence(run))  # NaN


if __name__ == "__main__":
    unittest.main()
