import unittest

from plots import ledger
from plots.claims import APART, CLAIMS, FAILS, HOLDS, UNDECIDED, UNMEASURED, Finding
from plots.ledger import BEGIN, END, Judged


def judged(id: str, **verdicts: str) -> Judged:
    """A claim whose parts all have the verdict of their source."""
    claim, = (c for c in CLAIMS if c.id == id)
    return Judged(claim, {s: [Finding("part", v, "", (3, 5), True)] * claim.needed
                          for s, v in verdicts.items()})


class LedgerTest(unittest.TestCase):
    def test_words(self):
        for verdict, word in ((HOLDS, "holds"), (FAILS, "fails"), (UNDECIDED, "undecided"),
                              (UNMEASURED, "unmeasured"), (APART, "-")):
            self.assertEqual(judged("q3", paper=verdict).word("paper"), word)
        self.assertEqual(judged("proposition", paper=FAILS).word("paper"), "false")

    def test_count_and_seeds(self):
        j = judged("q3", paper=UNDECIDED)
        self.assertEqual((j.count("paper"), j.literally("paper"), j.seeds("paper")),
                         ("5/5", "first by mean on 5 of 5", (3, 5)))

    def test_the_sentence_says_what_held_what_failed_and_where(self):
        text = ledger.sentence([
            judged("theory", authors=APART, released=HOLDS, paper=HOLDS),
            judged("q1", authors=UNMEASURED, released=HOLDS, paper=UNDECIDED),
            judged("q3", authors=HOLDS, released=FAILS, paper=FAILS),
            judged("proposition", authors=APART, released=FAILS, paper=FAILS),
            judged("q5", authors=UNMEASURED, released=UNDECIDED, paper=UNMEASURED)])
        self.assertEqual(
            text, "**Held:** the theorems and propositions in the sense that is true; Option2Vec "
            "above DAC-OneStep. **Failed:** first on five of six pairs (`released`, `paper`; holds in "
            "authors' logs); "
            "Proposition 3.2 as printed. **Undecided:** growing option durations.")

    def test_anchors_are_the_same_for_good(self):
        anchors = [Judged(c, {}).anchor for c in CLAIMS]
        self.assertEqual(len(anchors), len(set(anchors)))
        self.assertEqual(Judged(CLAIMS[1], {}).anchor,
                         "best-on-the-four-infinite-horizon-tasks-q2-fig-4b")

    def test_the_box_goes_between_its_markers_and_nowhere_else(self):
        page = f"a\n{BEGIN}\nold\n{END}\nb\n"
        self.assertEqual(ledger.put_box(page, "new"), f"a\n{BEGIN}\nnew\n{END}\nb\n")
        again = ledger.put_box(ledger.put_box(page, "x"), "new")
        self.assertEqual(again, ledger.put_box(page, "new"))
        for broken in ("a", f"a {BEGIN}", f"a {END}"):
            with self.assertRaises(ValueError):
                ledger.put_box(broken, "new")

    def test_a_line_of_the_box(self):
        verdicts = {s: {"word": word, "literally": "", "seeds": seeds} for s, word, seeds in (
            ("authors", "unmeasured", []), ("released", "holds", [3, 10]),
            ("paper", "fails", [5, 5]))}
        found = {"runs_done": 640, "runs_of_grid": 2560, "beyond_the_paper": [
            {"question": "Why?", "report": "why", "answers": {"released": "yes", "paper": "no"}}],
            "claims": [{"claim": "C", "report": "c", "verdicts": verdicts}]}
        lost = {"claim": "D", "report": "d", "verdicts": verdicts | {
            "released": {"word": "false", "literally": "", "seeds": [3]}}}
        lines = ledger.box(found).splitlines()
        self.assertEqual(lines[0], "640 of the grid's 2560 runs are done (25 %). Of 1 claims, "
                         "`released` confirms 1, contradicts 0 and leaves 0 open.")
        both = found | {"claims": [lost, *found["claims"], lost | {"claim": "E"}]}
        self.assertIn("contradicts 2 and leaves 0 open. Contradicted: D; E.\n", ledger.box(both))
        self.assertEqual(lines[-2:], [
            "| [C](results/REPORT.md#c) | unmeasured | holds | fails | - · 3-10 · 5 |",
            "| *Ours:* [Why?](results/REPORT.md#why) | - | yes | no | - |"])


if __name__ == "__main__":
    unittest.main()
