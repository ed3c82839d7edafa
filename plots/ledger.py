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
SAID = {"released": "the authors' code", "paper": "the text"}
VERBS = {HOLDS: ("**holds**", "**hold**"), FAILS: ("**fails**", "**fail**"),
         UNDECIDED: ("is undecided", "are undecided"),
         UNMEASURED: ("is not measured", "are not measured")}  # of one, of several
FEW = 3  # tasks that are named one by one
BEGIN, END = "<!-- results:begin -->", "<!-- results:end -->"


@dataclass(frozen=True)
class Judged:
    claim: Claim
    findings: Mapping[str, Sequence[Finding]]  # by source

    def verdict(self, source: str) -> str:
        return verdict_of(self.claim, self.findings[source])

    def count(self, source: str) -> str:
        """Of how many parts the claim is literally true, of those whose rivals all have runs:
        "4/6"."""
        known = [f.literal for f in self.findings[source] if f.literal is not None]
        return f"{sum(known)}/{len(known)}" if known and self.claim.literally else ""

    def literally(self, source: str) -> str:
        """The same in words, without regard to spread."""
        count, parts = self.count(source), len(self.findings[source])
        if not count:
            return ""
        text = self.claim.literally.format(count.replace("/", " of "))
        whole = count.endswith(f"/{parts}")
        return text if whole else f"{text}, the others of {parts} lack runs"

    def deciding(self, source: str) -> list[Finding]:
        """The parts that the verdict rests on: those with the claim's own verdict, of an undecided
        claim all that have runs."""
        verdict = self.verdict(source)
        return [f for f in self.findings[source]
                if f.verdict == verdict or (verdict == UNDECIDED and f.n)]

    def seeds(self, source: str) -> tuple[int, int] | None:
        """Least and largest n of the deciding parts."""
        seeds = [n for f in self.deciding(source) for n in f.n]
        return (min(seeds), max(seeds)) if seeds else None

    def n(self, source: str) -> str:
        """The same as text: "1-10", with the unit where it is not seeds; where some parts of
        several decide, which: "2 (Reacher)", "1-5 (4 tasks)"."""
        seeds = self.seeds(source)
        if seeds is None:
            return ""
        text = "-".join(map(str, sorted(set(seeds)))) + f" {self.claim.unit}".rstrip()
        parts = [f.part.removesuffix("-v2") for f in self.deciding(source)]
        if len(parts) == len(self.findings[source]):
            return text
        few = self.verdict(source) != UNDECIDED and len(parts) <= FEW
        count = f"{len(parts)} task{'s' * (len(parts) > 1)}"
        return f"{text} ({', '.join(parts) if few else count})"

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
                        {p: e for p, e in effects.items() if p.parts[-4] == f},
                        inputs.information)
            for f in FIDELITIES}
    return ours | {"authors": Evidence("authors", inputs.sources["authors"], AUTHORS_PARAMETERS)}


def judge(inputs: Inputs, claims: Sequence[Claim] = CLAIMS) -> list[Judged]:
    evidence = evidence_of(inputs)
    return [Judged(claim, {s: claim.judge(evidence[s]) for s in SOURCES}) for claim in claims]


def done(cells: Mapping[Key, Cell]) -> int:
    """Runs of the grid that have a record."""
    return sum(run.seed in SEEDS for key, cell in cells.items()
               if not key.variant and key not in joined for run in cell.runs)


def sentences(found: Mapping[str, Any]) -> list[str]:
    """From claims.json, a sentence on each version: what holds, what fails, how much is open."""
    lines = []
    for source in SOURCES[1:]:
        by_word: dict[str, list[str]] = {}
        for claim in found["claims"]:
            by_word.setdefault(claim["verdicts"][source]["word"], []).append(claim["short"])
        clauses = []
        for word, verb in VERBS.items():
            if names := by_word.get(word):
                listed = f" ({'; '.join(names)})" if word in (HOLDS, FAILS) else ""
                clauses.append(f"{len(names)} {verb[len(names) > 1]}{listed}")
        lines.append(f"**{NAMES[source]}**, {SAID[source]}: of {len(found['claims'])} claims "
                     + ", ".join(clauses) + ".")
    return lines


def claims_json(judged: Sequence[Judged], inputs: Inputs,
                answers: Sequence[tuple[beyond.Question, Mapping[str, Sequence[beyond.Part]]]]
                ) -> dict[str, Any]:
    """All of the first screen, for programs."""
    return {
        "runs_done": done(inputs.cells), "runs_of_grid": GRID,
        "claims": [{
            "id": j.claim.id, "claim": j.claim.text, "short": j.claim.short,
            "place": j.claim.place, "report": j.anchor,
            "verdicts": {s: {"word": j.verdict(s), "literally": j.literally(s),
                             "seeds": list(j.seeds(s) or []), "n": j.n(s)} for s in SOURCES}}
            for j in judged],
        "beyond_the_paper": [{
            "question": q.text, "report": slug(q.text),
            "answers": {f: q.answer(parts[f]).word for f in FIDELITIES}}
            for q, parts in answers]}


def in_short(found: Mapping[str, Any]) -> str:
    """Whether the paper replicates, in a sentence."""
    words = {s: [c["verdicts"][s]["word"] for c in found["claims"]] for s in SOURCES}
    surplus = [words[s].count(HOLDS) - words[s].count(FAILS) for s in SOURCES[1:]]
    answer = ("**Mostly not, so far**: in both versions more claims fail than hold"
              if max(surplus) < 0 else
              "**Mostly, so far**: in both versions more claims hold than fail"
              if min(surplus) > 0 else "**Open, so far**: neither most claims hold nor most fail")
    against = [c["short"] for c in found["claims"] if c["verdicts"]["authors"]["word"] == FAILS]
    logs = f", and the authors' own logs contradict {len(against)} ({'; '.join(against)})"
    return answer + (logs if against else "") + "."


def box(found: Mapping[str, Any], report: str = "results/REPORT.md") -> str:
    """The table of README.md, from claims.json."""
    runs, grid = found["runs_done"], found["runs_of_grid"]
    lines = [f"{in_short(found)} {runs} of {grid} runs are done ({100 * runs / grid:.0f} %): each "
             "method on each task and pair, in both versions, with ten seeds. So far:", "",
             *(f"- {line}" for line in sentences(found)), "",
             "n lists, for authors' logs · `released` · `paper`, the seeds per method behind the "
             "verdict. Tasks in parentheses, or their number, are those that decide it. For "
             "embeddings n is the number of runs. Words in quotation marks are the paper's.", "",
             "| claim of the paper | " + " | ".join(NAMES[s] for s in SOURCES) + " | n |",
             "|---|---|---|---|---|"]
    for claim in found["claims"]:
        verdicts = [claim["verdicts"][s] for s in SOURCES]
        n = " · ".join(v["n"] or "-" for v in verdicts) if any(v["n"] for v in verdicts) else "-"
        lines.append(f"| [{claim['claim']}]({report}#{claim['report']}) | "
                     + " | ".join(v["word"] for v in verdicts) + f" | {n} |")
    for q in found["beyond_the_paper"]:
        lines.append(f"| *Ours:* [{q['question']}]({report}#{q['report']}) | - | "
                     + " | ".join(q["answers"][f] for f in SOURCES[1:]) + " | - |")
    return "\n".join(lines)


def put_box(readme: str, text: str) -> str:
    """README.md with the box between its markers."""
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"no {BEGIN} and {END}")
    return f"{before}{BEGIN}\n{text}\n{END}{after}"


def to_text(found: Mapping[str, Any]) -> str:
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"
