"""The verdicts on all claims in short: the first screen of the report, results/claims.json, and the
box in README.md."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from plots import beyond
from plots.claims import (APART, AUTHORS_PARAMETERS, CLAIMS, FAILS, HOLDS, UNDECIDED, UNMEASURED,
                          Claim, Evidence, Finding, parameter_counts, verdict_of)
from plots.inputs import Inputs
from plots.records import FIDELITIES, GRID_METHODS, PAIRS, SEEDS, TASKS, Cell, Key, joined
from plots.text import slug

SOURCES = ("authors", "released", "paper")  # columns, in this order
NAMES = {"authors": "authors' logs", "released": "`released`", "paper": "`paper`"}
ALL_TASKS = TASKS + tuple(PAIRS)
GRID = len(FIDELITIES) * len(ALL_TASKS) * len(GRID_METHODS) * len(SEEDS)
WORDS = {HOLDS: "holds", FAILS: "fails", UNDECIDED: "undecided", UNMEASURED: "unmeasured",
         APART: "-"}
BEGIN, END = "<!-- results:begin -->", "<!-- results:end -->"


@dataclass(frozen=True)
class Judged:
    claim: Claim
    findings: Mapping[str, Sequence[Finding]]  # by source

    def verdict(self, source: str) -> str:
        return verdict_of(self.claim, self.findings[source])

    def word(self, source: str) -> str:
        """The verdict in one word; a statement of theory that fails is false."""
        word = WORDS[self.verdict(source)]
        return "false" if word == "fails" and self.claim.id == "proposition" else word

    def count(self, source: str) -> str:
        """Of how many parts the claim is literally true, as "4/6"."""
        known = [f.literal for f in self.findings[source] if f.literal is not None]
        return f"{sum(known)}/{len(known)}" if known and self.claim.literally else ""

    def literally(self, source: str) -> str:
        """The same in words, without regard to spread."""
        count = self.count(source).replace("/", " of ")
        return self.claim.literally.format(count) if count else ""

    def seeds(self, source: str) -> tuple[int, int] | None:
        """Least and largest number of seeds that a part rests on."""
        seeds = [n for f in self.findings[source] for n in f.n]
        return (min(seeds), max(seeds)) if seeds else None

    @property
    def heading(self) -> str:
        return f"{self.claim.text} ({self.claim.place})"

    @property
    def anchor(self) -> str:
        return slug(self.heading)


def evidence_of(inputs: Inputs) -> dict[str, Evidence]:
    """By source."""
    effects = {path: found.effects for path, found in inputs.interpretations.items()}
    ours = {f: Evidence(f, inputs.sources[f], parameter_counts(inputs.params, f), inputs.bench,
                        inputs.gradcheck, inputs.theory,
                        {p: e for p, e in effects.items() if p.parts[-4] == f})
            for f in FIDELITIES}
    return ours | {"authors": Evidence("authors", inputs.sources["authors"], AUTHORS_PARAMETERS)}


def judge(inputs: Inputs, claims: Sequence[Claim] = CLAIMS) -> list[Judged]:
    evidence = evidence_of(inputs)
    return [Judged(claim, {s: claim.judge(evidence[s]) for s in SOURCES}) for claim in claims]


def done(cells: Mapping[Key, Cell]) -> int:
    """Runs of the grid that have a record."""
    return sum(run.seed in SEEDS for key, cell in cells.items()
               if not key.variant and key not in joined for run in cell.runs)


def sentence(judged: Sequence[Judged]) -> str:
    """What held, what failed and what is open. A claim with two verdicts stands where it failed."""
    held, failed, left = [], [], []
    for j in judged:
        words = {s: j.word(s) for s in SOURCES}
        lost = [NAMES[s] for s in SOURCES if words[s] in ("fails", "false")]
        known = [w for w in words.values() if w != "-"]
        if lost:
            kept = [NAMES[s] for s in SOURCES if words[s] == "holds"]
            where = ", ".join(lost) + (f"; holds in {', '.join(kept)}" if kept else "")
            failed.append(j.claim.short + ("" if len(lost) == len(known) else f" ({where})"))
        elif "holds" in known:
            held.append(j.claim.short)
        else:
            left.append(j.claim.short)
    parts = [f"**{title}:** {'; '.join(names)}." for title, names in (
        ("Held", held), ("Failed", failed), ("Undecided", left)) if names]
    return " ".join(parts)


def claims_json(judged: Sequence[Judged], inputs: Inputs,
                answers: Sequence[tuple[beyond.Question, Mapping[str, Sequence[beyond.Part]]]]
                ) -> dict[str, Any]:
    """All of the first screen, for programs."""
    return {
        "runs_done": done(inputs.cells), "runs_of_grid": GRID,
        "claims": [{
            "id": j.claim.id, "claim": j.claim.text, "place": j.claim.place, "report": j.anchor,
            "verdicts": {s: {"word": j.word(s), "literally": j.literally(s),
                             "seeds": list(j.seeds(s) or [])} for s in SOURCES}}
            for j in judged],
        "beyond_the_paper": [{
            "question": q.text, "report": slug(q.text),
            "answers": {f: q.answer(parts[f]).word for f in FIDELITIES}}
            for q, parts in answers]}


def box(found: Mapping[str, Any], report: str = "results/REPORT.md") -> str:
    """The table of README.md, from claims.json."""
    share = 100 * found["runs_done"] / found["runs_of_grid"]
    words = [claim["verdicts"]["released"]["word"] for claim in found["claims"]]
    held, lost = words.count("holds"), words.count("fails") + words.count("false")
    against = "; ".join(claim["claim"] for claim, word in zip(found["claims"], words)
                        if word in ("fails", "false"))
    runs, grid = found["runs_done"], found["runs_of_grid"]
    lines = [f"{runs} of the grid's {grid} runs are done ({share:.0f} "
             f"%). Of {len(words)} claims, `released` confirms {held}, contradicts {lost} and "
             f"leaves {len(words) - held - lost} open."
             + (f" Contradicted: {against}." if against else ""), "",
             "n is the number of seeds behind each verdict, in the order of the columns. Words in "
             "quotation marks are the paper's.", "",
             "| claim of the paper | " + " | ".join(NAMES[s] for s in SOURCES) + " | n |",
             "|---|---|---|---|---|"]
    for claim in found["claims"]:
        verdicts = [claim["verdicts"][s] for s in SOURCES]
        seeds = " · ".join(_range(v["seeds"]) for v in verdicts)
        lines.append(f"| [{claim['claim']}]({report}#{claim['report']}) | "
                     + " | ".join(v["word"] for v in verdicts)
                     + f" | {seeds if seeds.strip('- ·') else '-'} |")
    for q in found["beyond_the_paper"]:
        lines.append(f"| *Ours:* [{q['question']}]({report}#{q['report']}) | - | "
                     + " | ".join(q["answers"][f] for f in SOURCES[1:]) + " | - |")
    return "\n".join(lines)


def _range(seeds: Sequence[int]) -> str:
    return "-".join(map(str, sorted(set(seeds)))) or "-"


def put_box(readme: str, text: str) -> str:
    """README.md with the box between its markers."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"no {BEGIN} and {END}")
    return f"{before}{BEGIN}\n{text}\n{END}{after}"


def to_text(found: Mapping[str, Any]) -> str:
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"
