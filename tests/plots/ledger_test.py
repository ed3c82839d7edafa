import unittest
from dataclasses import replace

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
        self.assertEqual((HOLDS, FAILS, UNDECIDED, UNMEASURED, APART),
                         ("holds", "fails", "undecided", "not measured", "-"))
        for verdict in (HOLDS, FAILS, UNDECIDED, UNMEASURED, APART):
            self.assertEqual(judged("q3", paper=verdict).verdict("paper"), verdict)

    def test_count_and_seeds(self):
        j = judged("q3", paper=UNDECIDED)
        self.assertEqual((j.count("paper"), j.literally("paper"), j.n("paper")),
                         ("5/5", "first by mean on 5 of 5", "3-5"))

    def test_tasks_that_lack_rivals_are_not_counted(self):
        claim, = (c for c in CLAIMS if c.id == "q3")
        known = [Finding(str(i), UNDECIDED, "", (3, 3), i > 0) for i in range(3)]
        j = Judged(claim, {"paper": known + [Finding("x", UNDECIDED, "", (3, 3))]})
        self.assertEqual((j.count("paper"), j.literally("paper")),
                         ("2/3", "first by mean on 2 of 3, the others of 4 lack runs"))

    def test_n_is_that_of_the_parts_that_decide(self):
        claim, = (c for c in CLAIMS if c.id == "q5")

        def n(*parts: Finding) -> str:
            rest = [Finding("-", UNMEASURED, "")] * (10 - len(parts))
            return Judged(claim, {"paper": [*parts, *rest]}).n("paper")

        open_ = Finding("Ant-v2", UNDECIDED, "", (10,))
        lost = [Finding(f"{task}-v2", FAILS, "", (seeds,)) for task, seeds in (
            ("Reacher", 2), ("Hopper", 3), ("Swimmer", 5), ("Walker2d", 4))]
        self.assertEqual(n(open_, lost[0]), "2 (Reacher)")
        self.assertEqual(n(open_, *lost[:2]), "2-3 (Reacher, Hopper)")
        self.assertEqual(n(open_, *lost), "2-5 (4 tasks)")
        self.assertEqual(n(open_, replace(open_, part="Swimmer-v2", n=(1,))), "1-10 (2 tasks)")
        self.assertEqual(n(), "")
        embeddings, = (c for c in CLAIMS if c.id == "q4")
        self.assertEqual(Judged(embeddings, {"paper": [Finding("embedding", FAILS, "", (15,))]})
                         .n("paper"), "15 runs")

    def test_a_sentence_for_each_version_says_what_holds_and_what_fails(self):
        claims = [{"short": short, "verdicts": {"released": {"word": released},
                                                "paper": {"word": paper}}}
                  for short, released, paper in (("a", HOLDS, HOLDS), ("b", HOLDS, FAILS),
                                                 ("c", FAILS, FAILS), ("d", UNDECIDED, FAILS),
                                                 ("e", UNDECIDED, UNMEASURED))]
        self.assertEqual(ledger.sentences({"claims": claims}), [
            "**`released`**, the authors' code: of 5 claims 2 **hold** (a; b), 1 **fails** (c), "
            "2 are undecided.",
            "**`paper`**, the text: of 5 claims 1 **holds** (a), 3 **fail** (b; c; d), 1 is not "
            "measured."])

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
        verdicts = {s: {"word": word, "literally": "", "seeds": [], "n": n} for s, word, n in (
            ("authors", UNMEASURED, ""), ("released", HOLDS, "3-10"), ("paper", FAILS, "2 (Ant)"))}
        claim = {"claim": "C", "short": "c", "report": "c", "verdicts": verdicts}
        found = {"runs_done": 640, "runs_of_grid": 2560, "claims": [claim], "beyond_the_paper": [
            {"question": "Why?", "report": "why", "answers": {"released": "yes", "paper": "no"}}]}
        lines = ledger.box(found).splitlines()
        self.assertEqual(lines[:4], [
            "**Open, so far**: neither most claims hold nor most fail. 640 of 2560 runs are done "
            "(25 %): each method on each task and pair, in both versions, with ten seeds. So far:",
            "",
            "- **`released`**, the authors' code: of 1 claims 1 **holds** (c).",
            "- **`paper`**, the text: of 1 claims 1 **fails** (c)."])
        self.assertEqual(lines[-2:], [
            "| [C](results/REPORT.md#c) | not measured | holds | fails | - · 3-10 · 2 (Ant) |",
            "| *Ours:* [Why?](results/REPORT.md#why) | - | yes | no | - |"])
        for verdict in verdicts.values():
            verdict["n"] = ""
        self.assertTrue(ledger.box(found).splitlines()[-2].endswith("| fails | - |"))

    def test_the_answer_in_short_counts_what_fails(self):
        def short(*rows: tuple[str, str, str]) -> str:
            return ledger.in_short({"claims": [
                {"short": f"c{i}",
                 "verdicts": {s: {"word": w} for s, w in zip(ledger.SOURCES, row)}}
                for i, row in enumerate(rows)]})

        self.assertEqual(short((FAILS, FAILS, FAILS), (FAILS, HOLDS, UNDECIDED),
                               (UNDECIDED, FAILS, FAILS)),
                         "**Mostly not, so far**: in both versions more claims fail than hold, and "
                         "the authors' own logs contradict 2 (c0; c1).")
        self.assertEqual(short((HOLDS, HOLDS, HOLDS), (HOLDS, UNDECIDED, HOLDS)),
                         "**Mostly, so far**: in both versions more claims hold than fail.")
        self.assertEqual(short((UNDECIDED, UNDECIDED, UNMEASURED)),
                         "**Open, so far**: neither most claims hold nor most fail.")
        self.assertEqual(short((HOLDS, FAILS, HOLDS)),
                         "**Open, so far**: neither most claims hold nor most fail.")


if __name__ == "__main__":
    unittest.main()
