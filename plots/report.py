"""Writes results/REPORT.md, report.html, claims.json and figures/, and the box in README.md, from
records and reference numbers only."""

import argparse
import math
import sys
from collections.abc import Mapping, Sequence, Set
from pathlib import Path

import numpy as np

from plots import (beyond, fig_aggregate, fig_cost, fig_embedding, fig_learning_curves, fig_options,
                   fig_options_count, fig_parameters, fig_transfer, ledger, mine)
from plots.claims import (APART, AUTHORS_PARAMETERS, CHECKS, FAILS, GRADIENT_BOUND, HOLDS, OURS,
                          UNDECIDED, UNMEASURED, Finding)
from plots.inputs import Inputs
from plots.ledger import ALL_TASKS, GRID, NAMES, Judged
from plots.records import (FIDELITIES, GRID_METHODS, METHODS, PAIRS, SEEDS, TASKS, Cell,
                           DamagedFile, Key, Rows, joined)
from plots.samples import Sample, Samples, original_code, our_samples
from plots.statistics import (CONFIDENCE, Moments, bootstrap, holm, improvement, iqm,
                              mean_improvement, one_sample, welch)
from plots.style import RESULTS, Drawing, inline_svg, save
from plots.tables import COUNTERS
from plots.text import (Block, Coverage, Details, Heading, Items, Lights, Paragraph, Picture,
                        Screen, Table, interval, moments, number, p_clause, p_value, ranges, slug,
                        to_html, to_markdown)

TITLE = "Option2Vec: does the paper replicate?"
FIGURES = "figures"  # folder beside the report
FEW = 3  # parts that are told in a line
SINGLE_NOTE = (
    "The authors' scripts pick PPO's logs by a name that PPOC's match, too, so that the curve of "
    "PPO in their figures may be the mean of both; here the two are apart. Their logs have no "
    "DAC-OneStep, and IOPG on four tasks.")
ORIGINAL_NOTE = (
    "Option2Vec as the authors' code computes it, run on this project's tasks "
    "(`results/reference/README.md` says which version), beside our `released` and their logs: "
    "what it shares with ours and not with their logs speaks against an error of ours. Return at "
    "one million steps, and mean return on the way there, which depends less on where a run "
    "happens to end. The deviation of the latter in their logs is an upper bound.")
TRANSFER_NOTE = (
    "OC is the option-critic with four workers; the curve of that name in the authors' figure is "
    "IOPG's. The authors' Option2Vec has embeddings of 20 or 30 dimensions on these pairs. Values "
    "are those at the end of the second task.")



def build(inputs: Inputs) -> tuple[list[Block], list[Drawing], dict]:
    """The report's blocks, the figures among them, and what claims.json says."""
    cells, sources = inputs.cells, inputs.sources
    judged, answers = ledger.judge(inputs), beyond.by_question(inputs)
    found = ledger.claims_json(judged, inputs, answers)
    drawings: list[Drawing] = []

    def drawn(module) -> list[Block]:
        new = module.draw(inputs)
        drawings.extend(d for d in new if d.figure is not None)
        return [_picture(d) for d in new]

    options, embedding = drawn(fig_options), drawn(fig_embedding)
    blocks = [
        *(Paragraph(sentence, lead=True) for sentence in ledger.sentences(found)),
        _first_screen(judged, answers, cells),
        Heading("All tasks at a glance", short="Glance"), *drawn(fig_aggregate),
        Details("What the words mean: `paper`, `released`, return, ±, n, p", _definitions(cells)),
        Heading("Claims of the paper", short="Claims"), *_claims(judged),
        Heading("Beyond the paper", short="Beyond"), *_beyond(inputs, answers),
        *drawn(fig_options_count),
        Heading("Single tasks"), *drawn(fig_learning_curves),
        *_comparison("Single tasks", TASKS, sources, cells),
        Details("About the authors' logs of the single tasks", [Paragraph(SINGLE_NOTE)]),
        *_original(original_code(inputs.results / "reference"), sources),
        Heading("Transfer"), *drawn(fig_transfer),
        *_comparison("Transfer", tuple(PAIRS), sources, cells),
        Details("About the authors' logs of the pairs", [Paragraph(TRANSFER_NOTE)]),
        Heading("Options"), *options[:1],
        Details("Figure 7 of the pairs, and of `released`", options[1:]), *embedding[:1],
        Details("Figure 6 of all runs that were examined", embedding[1:]),
        Heading("Parameters"), *drawn(fig_parameters),
        Details("Table of parameters", _parameters(inputs.params)),
        Heading("Cost"), *drawn(fig_cost), Details("Table of costs", _cost(inputs.bench)),
        Heading("Checks of our own", short="Checks"),
        *_own_checks(ledger.judge(inputs, CHECKS)),
        Details("Gradients and physics by group", _checks(inputs.gradcheck, inputs.parity)),
        Heading("Theory"), Details("Every statement and reading", _theory(inputs.theory)),
        Heading("Deviations"),
        Details("Every switch between the paper and the released code",
                _deviations(inputs.switches, cells, sources["authors"])),
        Heading("Missing runs", short="Missing"),
        Details("What is missing of the grid", _missing(cells)),
    ]
    return blocks, drawings, found


def _picture(drawing: Drawing) -> Block:
    if drawing.figure is None:
        return Paragraph(drawing.caption)
    return Picture(drawing.name, drawing.caption, inline_svg(drawing))


# ---- The first screen


def _first_screen(judged: Sequence[Judged], answers: Sequence, cells: Mapping[Key, Cell]) -> Block:
    lights = Lights(
        ["claim of the paper", *(NAMES[s] for s in ledger.SOURCES)],
        [(j.claim.text, j.claim.place, j.anchor,
          [(j.verdict(s), _beside(j, s)) for s in ledger.SOURCES]) for j in judged])
    own = Lights(
        ["our own questions", "`released`", "`paper`"],
        [(q.text, "", slug(q.text),
          [(a.word, a.small) for a in (q.answer(parts[s]) for s in ledger.SOURCES[1:])])
         for q, parts in answers])
    return Screen(
        [lights, Paragraph("Words in quotation marks are the paper's. 4/6: by mean alone, whatever "
                           "the spread, it is so on 4 of the 6 tasks where all rivals have runs. "
                           "n: seeds per method that a verdict rests on. Each verdict leads to "
                           "its evidence.")],
        [own, _coverage(cells)])


def _beside(j: Judged, source: str) -> str:
    """What stands small behind a verdict; the tasks of n are with the evidence."""
    n = j.n(source).partition(" (")[0] if j.verdict(source) in (HOLDS, FAILS) else ""
    return ", ".join(filter(None, [j.count(source), f"n = {n}" if n else ""]))


def _coverage(cells: Mapping[Key, Cell]) -> Block:
    def count(fidelity: str, task: str, method: str) -> int:
        cell = cells.get(Key(fidelity, "", task, method))
        return sum(run.seed in SEEDS for run in cell.runs) if cell else 0

    def name(task: str) -> str:
        return f"pair {task}" if task in PAIRS else task.removesuffix("-v2")

    found, order = ledger.done(cells), ledger.SOURCES[1:]
    return Coverage(
        f"**{found} of {GRID} runs are done ({100 * found / GRID:.0f} %).** "
        f"Below: seeds done, at most {len(SEEDS)}.",
        found / GRID, [NAMES[f] for f in order], [METHODS[m] for m in GRID_METHODS],
        [(name(task), [[count(f, task, m) for m in GRID_METHODS] for f in order])
         for task in ALL_TASKS], len(SEEDS))


def _definitions(cells: Mapping[Key, Cell]) -> list[Block]:
    runs = [run for key, cell in cells.items() if not key.variant and key not in joined
            for run in cell.runs]
    folders = ", ".join(f"`{name}`" for name in sorted({run.path.parts[-5] for run in runs}))
    revisions = [f"{_name(key)}: revision {cell.runs[0].revision} is used, {cell.older} runs of "
                 "older revisions are left out" for key, cell in cells.items() if cell.older]
    newest: dict[str, int] = {}
    for key, cell in cells.items():
        newest[key.algorithm] = max(newest.get(key.algorithm, 0), cell.runs[0].revision)
    revisions += [f"{_name(key)}: revision {cell.runs[0].revision} is used, there is none of "
                  f"revision {newest[key.algorithm]}" for key, cell in cells.items()
                  if cell.runs[0].revision < newest[key.algorithm]]
    blocks: list[Block] = [Items([
        "`paper` is a method as it is written, `released` as the authors' code computes it. The "
        "authors' logs were made with their code and belong beside `released`.",
        f"This page is made from the records of {ledger.done(cells)} of the grid's {GRID} runs "
        f"(folders of `results/`: {folders or 'none'}), and from the authors' learning curves in "
        "`results/reference/`. `make report` makes it again.",
        "A return is the mean of the last 20 training episodes at one million steps, on transfer "
        "pairs at two. A run that diverged has no return; it is counted in the remarks.",
        "± is the standard deviation over seeds with divisor n, as in the authors' tables. n is in "
        "parentheses: of Option2Vec and of the method where two are compared.",
        "IQM is the mean of the middle half of the seeds. Brackets are 95 % intervals: of "
        "differences by Welch's t, of IQM and of the probability of improvement by a bootstrap of "
        "2000 resamples, stratified by task and method, with a fixed stream.",
        "p is Welch's, two-sided, not corrected for the number of tests."])]
    if revisions:
        blocks += [Paragraph("**Records of several revisions of a method's code:**"),
                   Items(revisions)]
    return blocks


# ---- Claims


def _claims(judged: Sequence[Judged]) -> list[Block]:
    tests = sum(bool(f.n) for j in judged for findings in j.findings.values() for f in findings)
    blocks: list[Block] = [Details("How a claim is judged", [Paragraph(
        "Definitions are fixed in `plots/claims.py` before the verdicts. The verdict on a claim, "
        f"and on each of its parts, is \"{HOLDS}\", \"{FAILS}\", \"{UNDECIDED}\" at so many seeds, "
        f"or \"{UNMEASURED}\"; \"{APART}\" stands where a source cannot say anything. A claim "
        "about several tasks holds when it holds on as many as it names, and fails when that has "
        "become impossible. n is then that of the tasks that decide it, and their names stand "
        "behind it where they are few. Rivals are DAC+PPO, AHP+PPO, PPOC, OC and PPO, and "
        "DAC-OneStep and IOPG where they have runs. While one of the first five has no runs on a "
        "task, nothing holds there, no rival counts as the best, and the means are not counted. "
        "Shortened runs decide nothing. Only the paper's main text was available. Its words are in "
        "quotation marks where we have them; the rest sums them up. The letters of Figure 4 follow "
        "the order of the questions."),
        Paragraph(
        f"Multiplicity: {tests} parts are tests, each at 5 % and uncorrected. \"Holds\" "
        "needs every one of several tests, which makes it harder than 5 %; \"fails\" "
        "needs one shortfall among them, so that some would appear by chance "
        "where methods are equal, though rarely where the claim is true. The authors' "
        "Option2Vec runs share initial weights and environment seeds on all single tasks "
        "but HalfCheetah and Swimmer: their p are too small.")])]
    for j in judged:
        blocks += [Heading(j.heading, 3),
                   Items([f"{NAMES[s]}: {_summary(j, s)}" for s in ledger.SOURCES]),
                   Details("Definition, parts", [Paragraph(j.claim.definition), *_parts(j)])]
    return blocks


def _parts(j: Judged) -> list[Block]:
    if max(map(len, j.findings.values())) == 1:
        return []  # all of it is in the summary
    parts: dict[str, list[str]] = {}
    for place, source in enumerate(ledger.SOURCES):
        for finding in j.findings[source]:
            parts.setdefault(finding.part, ["-"] * len(ledger.SOURCES))[place] = _finding(finding)
    return [Table(["part", *(NAMES[s] for s in ledger.SOURCES)],
                  [[part, *texts] for part, texts in parts.items()])]


def _summary(j: Judged, source: str) -> str:
    """The literal verdict and the statistical one, and the parts that fail, if they are few."""
    findings, verdict = j.findings[source], j.verdict(source)
    n = j.n(source)
    at = f" at n = {n}" if n else ""
    reasons = "; ".join(dict.fromkeys(f.measured for f in findings))
    if verdict == APART:
        return f"{APART} ({reasons})"
    if len(findings) == 1 or verdict == UNMEASURED:
        return f"**{verdict}**{at}: {reasons}"
    counts = {v: sum(f.verdict == v for f in findings)
              for v in (HOLDS, FAILS, UNDECIDED, UNMEASURED)}
    literal = j.literally(source)
    failed = [f"{f.part} {f.measured}" for f in findings if f.verdict == FAILS]
    return ((f"{literal}; " if literal else "") + f"**{verdict}**{at}: "
            + ", ".join(f"{v} on {count}" for v, count in counts.items() if count)
            + (f" ({'; '.join(failed)})" if 0 < len(failed) <= FEW else ""))


def _finding(finding: Finding) -> str:
    seeds = f" (n = {', '.join(map(str, finding.n))})" if finding.n else ""
    text = f"{finding.measured}{seeds}"
    return f"{APART} ({text})" if finding.verdict == APART else f"{finding.verdict}: {text}"


def _own_checks(judged: Sequence[Judged]) -> list[Block]:
    return [Items([f"{j.claim.text}, {NAMES[s]}: {_summary(j, s)}. {j.claim.definition}"
                   for j in judged for s in FIDELITIES])]


# ---- Beyond the paper


def _beyond(inputs: Inputs, answers: Sequence[tuple[beyond.Question, Mapping]]) -> list[Block]:
    blocks: list[Block] = [Paragraph(
        "Our own questions, with the same statistics. A table fills as its runs arrive in "
        "`results/ablation`; what is missing says so.")]
    for question, parts in answers:
        lines = []
        for fidelity in ledger.SOURCES[1:]:
            answer = question.answer(parts[fidelity])
            lines.append(f"{NAMES[fidelity]}: **{answer.word}**: {answer.reason}")
        names = list(dict.fromkeys(p.name for found in parts.values() for p in found))
        table = [[name, *(next((p.measured for p in parts[f] if p.name == name), "-")
                          for f in ledger.SOURCES[1:])] for name in names]
        measured = [Table(["on", "`released`", "`paper`"], table)] if table else []
        blocks += [Heading(question.text, 3), Items(lines),
                   Details("Definition, parts", [Paragraph(question.definition), *measured])]
    rows = beyond.one_factor_rows(inputs)
    blocks.append(Details("From PPO to one option, one factor at a time", [
        Table(["task", "fidelity", "method", "changed", "return", "at step"], rows) if rows
        else Paragraph("Not measured yet: no runs of PPO, or of Option2Vec with one option, with a "
                       "further factor changed.")]))
    return blocks


# ---- Returns


def _comparison(title: str, tasks: Sequence[str], sources: Mapping[str, Samples],
                cells: Mapping[Key, Cell]) -> list[Block]:
    blocks: list[Block] = []
    for source in ledger.SOURCES:
        samples = sources[source]
        rows = [[task, *(_entry(samples.get((task, m)), cells.get(Key(source, "", task, m)))
                         for m in METHODS)] for task in tasks]
        table = Table(["task", *METHODS.values()], rows)
        blocks += [Heading(f"{title}: returns, {NAMES[source]}", 3),
                   table if source == "released" else Details("Table", [table])]
    blocks += [Heading(f"{title}: probability of improvement", 3),
               Paragraph("Chance that a run of Option2Vec beats one of the method, over tasks."),
               Details("Table", [Table(["over", *(NAMES[s] for s in ledger.SOURCES)], [
                   [METHODS[m], *(_mean_improvement(tasks, m, sources[s]) for s in ledger.SOURCES)]
                   for m in METHODS if m != OURS])])]
    for fidelity in ("released", "paper"):
        rows = [_row(task, m, sources[fidelity], sources["authors"])
                for task in tasks for m in METHODS if (task, m) in sources[fidelity]]
        blocks.append(Heading(f"{title}: ours in detail, {NAMES[fidelity]}", 3))
        if not rows:
            blocks.append(Paragraph("No runs yet."))
            continue
        if fidelity == "released":
            blocks += _agreement(tasks, sources[fidelity], sources["authors"])
        header = ["task", "method", "ours", "IQM [95 %]", "authors", "p, ours = authors",
                  "P(Option2Vec > method) [95 %]", "Option2Vec - method [95 %]", "p", "remarks"]
        if tasks[0] in PAIRS:
            header += ["first task, ours", "first task, authors"]
        blocks.append(Details("Table", [Table(header, rows)]))
    return blocks


def _agreement(tasks: Sequence[str], ours: Samples, authors: Samples) -> list[Block]:
    """How often our returns differ from the authors', beside how often chance would have it."""
    p: dict[str, float] = {}
    for task in tasks:
        for method, name in METHODS.items():
            sample, published = ours.get((task, method)), authors.get((task, method))
            if sample is None or published is None or sample.shortened:
                continue
            end = welch(sample.moments, published.moments).p
            if task in PAIRS:
                first = welch(Moments.of(sample.first), Moments.of(published.first)).p
                p |= {f"{name} on {task}'s first task": first,
                      f"{name} on {task}'s second task": end}
            else:
                p[f"{name} on {task}"] = end
    p = {what: value for what, value in p.items() if not math.isnan(value)}
    if not p:
        return []
    level = 1 - CONFIDENCE
    below = sum(value < level for value in p.values())
    left = [what for what, value in zip(p, holm(list(p.values()))) if value < level]
    return [Paragraph(
        f"Ours against the authors', Welch's test: of {len(p)} comparisons {below or 'none'} "
        f"{'has' if below < 2 else 'have'} p < {level:.2f}; were there no difference at all, "
        f"{number(level * len(p))} would be expected. With Holm's correction for their number "
        f"{len(left) or 'none'} {'remains' if len(left) < 2 else 'remain'}"
        f"{': ' if left else ''}{', '.join(left)}.")]


def _original(runs: Mapping[str, tuple[Moments, Moments]],
              sources: Mapping[str, Samples]) -> list[Block]:
    """Option2Vec by the authors' own code, between ours and their logs."""
    if not runs:
        return []
    rows = []
    for task, (final, area) in runs.items():
        ours, logs = (sources[s].get((task, OURS)) for s in ("released", "authors"))
        rows.append([task, moments(_moments(ours)), moments(final), moments(_moments(logs)),
                     moments(ours and ours.area), moments(area), moments(logs and logs.area)])
    return [Heading("The authors' code on our simulator", 3),
            Details("Note and table", [Paragraph(ORIGINAL_NOTE), Table([
                "task", "ours, `released`", "their code here", "their logs",
                   "mean over all steps, ours", "their code here", "their logs"], rows)])]


def _entry(sample: Sample | None, cell: Cell | None) -> str:
    lost = cell.diverged if cell else 0
    text = moments(_moments(sample)) if sample or not lost else ""
    return ", ".join(filter(None, [text, f"{lost} diverged" if lost else ""]))


def _moments(sample: Sample | None) -> Moments | None:
    return None if sample is None else sample.moments


def _row(task: str, method: str, ours: Samples, authors: Samples) -> list[str]:
    sample, published = ours[task, method], authors.get((task, method))
    theirs = _moments(published)
    if published is not None and sample.shortened:
        theirs = published.curve.at(sample.step)
    best = ours.get((task, OURS))
    beside = ["-"] * 3
    if best is not None and method != OURS and best.step == sample.step:
        d = welch(best.moments, sample.moments)
        seeds = f"({best.moments.n}, {sample.moments.n})"
        beside = [_with_interval(improvement(best.final, sample.final),
                                 bootstrap(improvement, best.final, sample.final)) + f" {seeds}",
                  f"{number(d.mean, '+')} {interval(d.interval, '+')}".removesuffix(" -")
                  + f" {seeds}", p_value(d.p)]
    row = [task, METHODS[method], moments(sample.moments),
           _with_interval(iqm(sample.final), bootstrap(iqm, sample.final)), moments(theirs),
           p_value(welch(sample.moments, theirs).p) if theirs else "-", *beside,
           _remarks(sample, sample)]
    if task in PAIRS:
        row += [moments(Moments.of(s.first)) if s is not None and len(s.first) else "-"
                for s in (sample, published)]
    return row


def _remarks(sample: Sample | None, runs: Sample | Cell) -> str:
    remarks = [f"at {sample.step} steps"] if sample is not None and sample.shortened else []
    remarks += [f"{runs.diverged} diverged"] if runs.diverged else []
    remarks += [f"{runs.older} of older revisions left out"] if runs.older else []
    return ", ".join(remarks)


def _mean_improvement(tasks: Sequence[str], method: str, samples: Samples) -> str:
    both = [(samples[t, OURS], samples[t, method]) for t in tasks
            if (t, OURS) in samples and (t, method) in samples]
    finals = [s.final for pair in both for s in pair]
    if not finals:
        return "-"
    text = _with_interval(mean_improvement(*finals), bootstrap(mean_improvement, *finals))
    return f"{text} ({len(both)} of {len(tasks)} tasks)"


def _with_interval(value: float | np.ndarray, i: tuple[float, float]) -> str:
    return f"{number(float(value))} {interval(i)}".removesuffix(" -")


# ---- Tables of checks


def _parameters(params: Rows) -> list[Block]:
    if not params:
        return [Paragraph("No results/params.csv yet (`make report` writes it).")]
    theirs = {("option2vec", 64): 30598, ("dac_onestep", 64): 57321, ("dac_onestep", 128): 195049,
              ("ppo", 64): 11085, ("ppo", 128): 38541}  # spec 2.2 to 2.6
    theirs |= {(m, h): AUTHORS_PARAMETERS[f"width {h}"] for h in (64, 128)
               for m in ("dac_ppo", "ahp_ppo", "iopg", "ppoc", "oc")}
    rows = []
    for r in params:
        if r["task"] != "HalfCheetah-v2":
            continue
        shares = [p["share"] for p in params if not math.isnan(p["share"]) and all(
            p[name] == r[name] for name in ("method", "fidelity", "width"))]
        rows.append([METHODS[r["method"]], r["fidelity"], str(r["width"]), str(r["counted"]),
                     str(theirs.get((r["method"], r["width"]), "-"))
                     if r["fidelity"] == "released" else "-", str(r["used"]),
                     f"{100 * r['share']:.1f} %" if shares else "-",
                     f"{100 * min(shares):.1f} to {100 * max(shares):.1f} %" if shares else "-"])
    return [Paragraph("HalfCheetah-v2: S = 17, A = 6, K = 4. Width is that of both hidden layers. "
                      "Used: parameters that some loss can reach. Share: Option2Vec's count over "
                      "the line's."),
            Table(["method", "fidelity", "width", "parameters", "authors' code", "used", "share",
                   "share, all tasks"], rows)]


def _cost(costs: Rows) -> list[Block]:
    if not costs:
        return [Paragraph("No results/bench.json yet (`make bench`).")]
    rows = [[r["task"], METHODS[r["method"]], r["fidelity"],
             *(number(r[name]) for name in COUNTERS)] for r in costs]
    return [Paragraph("CPU microseconds an environment step, the least of five measurements, on "
                      "one machine; the bound is what no implementation avoids. The authors "
                      "published no such numbers."),
            Table(["task", "method", "fidelity", *(_unit(name) for name in COUNTERS)], rows)]


def _unit(counter: str) -> str:
    name = counter.removesuffix("_us")
    return name.replace("_", " ") + (" [µs]" if name != counter else "")


def _checks(gradcheck: Rows, parity: Rows) -> list[Block]:
    groups: dict[str, list[float]] = {}
    for row in gradcheck:
        method = row["name"].split()[0]
        groups.setdefault(METHODS.get(method, "layers, densities, losses"), []).append(
            row["largest_error"])
    blocks: list[Block] = [Paragraph("No results/gradcheck.csv yet (`make gradcheck`).")]
    if groups:
        blocks = [Paragraph("Analytic against numeric gradients in double precision, error "
                            f"relative to the gradient, bound {GRADIENT_BOUND:.0e}."),
                  Table(["of", "checks", "below the bound", "largest error"],
                        [[name, str(len(e)), str(sum(x < GRADIENT_BOUND for x in e)),
                          f"{max(e):.2g}"] for name, e in groups.items()])]
    if not parity:
        return [*blocks, Paragraph("No results/parity.csv yet (`make parity`).")]
    kinds = dict.fromkeys(row["check"] for row in parity)
    lines = []
    for kind in kinds:
        rows = [row for row in parity if row["check"] == kind]
        worst = max(rows, key=lambda r: r["deviation"] / r["bound"])
        lines.append([kind, str(len(rows)), str(sum(r["deviation"] <= r["bound"] for r in rows)),
                      f"{worst['deviation']:.2g} of {worst['bound']:.2g} ({worst['name']})"])
    return [*blocks, Paragraph("Physics, observations and rewards against the reference numbers."),
            Table(["check", "files", "within the bound", "worst"], lines)]


def _theory(theory: Rows) -> list[Block]:
    if not theory:
        return [Paragraph("No results/theory.csv yet (`make theory`).")]
    return [Paragraph("The paper's statements on small random decision processes. A reading of a "
                      "statement that is false says so, and its gap has to be large."),
            Table(["statement", "gap", "has to be", "check", "compared"],
                  [[r["name"], f"{r['gap']:.2g}", f"{r['relation']} {r['tolerance']:g}",
                    r["verdict"], r["compared"]] for r in theory])]


# ---- Deviations, missing runs


def _methods(ids: Sequence[str]) -> str:
    return "all" if set(ids) == set(METHODS) else ", ".join(ids)


def _deviations(switches: Rows, cells: Mapping[Key, Cell], authors: Samples) -> list[Block]:
    if not switches:
        return [Paragraph("No results/registry.json yet (`make report` writes it).")]
    rows = []
    for s in switches:
        meanings = s["effect"].split(" | ")  # of paper, released, further values; or of the switch
        paper, released, *others = meanings if len(meanings) > 1 else (
            f"{s['paper']} ({meanings[0]})", s["released"])
        rows.append([s["id"], _methods(s["methods"]), paper, released,
                     "; ".join(others) or "-",
                     *(_ran(s["id"], f, cells) for f in FIDELITIES),
                     "; ".join(_effects(s["id"], cells)) or "not measured"])
    return [Paragraph("Every difference between the paper and the released code in what is "
                      "computed is a switch; differences in sizes are in the second table. Runs: "
                      "the values in the records, with their number. Effect: return with the "
                      "switch turned less that of the same seed without, other switches as the "
                      "fidelity has them (Student's t of the pairs)."),
            Table(["switch", "methods", "the paper", "the released code", "other values",
                   "our `paper` runs", "our `released` runs", "measured effect"], rows),
            *_sizes(cells), *_numbers({s["id"] for s in switches}, cells, authors)]


def _sizes(cells: Mapping[Key, Cell]) -> list[Block]:
    """Numbers of the methods that differ between the fidelities, as the records have them."""
    settings = {key: cell.runs[0].settings for key, cell in cells.items() if not key.variant}
    tasks: dict[tuple[str, ...], list[str]] = {}  # by method, number and its two values
    for key, ours in settings.items():
        released = settings.get(key._replace(fidelity="released"), {})
        for name in sorted(ours.keys() & released.keys()) if key.fidelity == "paper" else ():
            if not name.startswith("switches.") and name != "run.fidelity" and (
                    ours[name] != released[name]):
                line = (METHODS[key.algorithm], name.rpartition(".")[2], str(ours[name]),
                        str(released[name]))
                tasks.setdefault(line, []).append(key.task)
    if not tasks:
        return [Paragraph("No task has runs of both fidelities whose sizes differ yet.")]
    return [Table(["method", "number", "our `paper` runs", "our `released` runs", "on"],
                  [[*line, ", ".join(on)] for line, on in sorted(tasks.items())])]


def _numbers(switches: Set[str], cells: Mapping[Key, Cell], authors: Samples) -> list[Block]:
    """Runs with a number of the method changed and all else as in the fidelity."""
    sources = {f: our_samples(cells, f) for f in FIDELITIES}
    changed = [key for key in cells
               if key.variant and key.variant.partition("=")[0] not in switches]
    rows = []
    for key in sorted(changed, key=lambda k: (k.variant, k.fidelity, k.algorithm,
                                              ALL_TASKS.index(k.task))):
        turned, base = cells[key], cells.get(key._replace(variant=""))
        where = key.task, key.algorithm
        name = f"algo.{key.algorithm}.{key.variant.partition('=')[0]}"
        usual = f", not {base.runs[0].settings[name]}" if base else ""
        sample = our_samples({key: turned}, key.fidelity, key.variant).get(where)
        gains = _gains(turned, base)
        rows.append([
            METHODS[key.algorithm], key.fidelity, key.variant + usual, key.task,
            _ends(sample), _ends(sources[key.fidelity].get(where)), _ends(authors.get(where)),
            _paired(gains) if gains else "-", _remarks(sample, turned)])
    if not rows:
        return []
    return [Paragraph("A number of the method changed on its own. Return at the end; of a pair at "
                      "the end of the first and of the second task. Difference: at the end, by "
                      "seed (Student's t). Which number a log of the authors has is inferred from "
                      "dates."),
            Table(["method", "fidelity", "number", "task", "with it", "without", "authors",
                   "with less without [95 %]", "remarks"], rows)]


def _ends(sample: Sample | None) -> str:
    if sample is None:
        return "-"
    ends = (sample.first, sample.final) if len(sample.first) else (sample.final,)
    return ", ".join(moments(Moments.of(end)) for end in ends)


def _ran(switch: str, fidelity: str, cells: Mapping[Key, Cell]) -> str:
    counts: dict[str, int] = {}
    for key, cell in cells.items():
        for run in cell.runs if (key.fidelity, key.variant) == (fidelity, "") else ():
            if f"switches.{switch}" in run.settings:
                value = str(run.settings[f"switches.{switch}"])
                counts[value] = counts.get(value, 0) + 1
    return ", ".join(f"{value} ({n})" for value, n in sorted(counts.items())) or "-"


def _effects(switch: str, cells: Mapping[Key, Cell]) -> list[str]:
    texts = []
    for key in cells:
        name, _, value = key.variant.partition("=")
        if name != switch:
            continue
        gains = _gains(cells[key], cells.get(key._replace(variant="")))
        if gains:
            texts.append(f"{key.fidelity} with {value}, {key.task}, {METHODS[key.algorithm]}: "
                         + _paired(gains))
    return texts


def _gains(turned: Cell, base: Cell | None) -> list[float]:
    """Return at the end with something changed less that without. A seed's two runs share initial
    weights and random streams."""
    if base is None or turned.wanted != base.wanted:
        return []
    without = {run.seed: run.ret[-1] for run in base.whole}
    return [run.ret[-1] - without[run.seed] for run in turned.whole if run.seed in without]


def _paired(gains: Sequence[float]) -> str:
    d = one_sample(Moments.of(gains))
    return (f"{number(d.mean, '+')} {interval(d.interval, '+')}, {p_clause(d.p)} "
            f"(n = {len(gains)})")


def _missing(cells: Mapping[Key, Cell]) -> list[Block]:
    rows = [[task, *(_missing_seeds(task, f, cells) for f in FIDELITIES)] for task in ALL_TASKS]
    return [Paragraph(f"Of the whole grid: every method, seeds {ranges(SEEDS)}."),
            Table(["task", *(NAMES[f] for f in FIDELITIES)], rows)]


def _missing_seeds(task: str, fidelity: str, cells: Mapping[Key, Cell]) -> str:
    lacking: dict[str, list[str]] = {}
    for method in GRID_METHODS:
        cell = cells.get(Key(fidelity, "", task, method))
        seeds = set(SEEDS) - {run.seed for run in cell.runs if cell} if cell else set(SEEDS)
        if seeds:
            lacking.setdefault(ranges(sorted(seeds)), []).append(METHODS[method])
    return "; ".join(f"seeds {seeds} of {'all methods' if len(m) == len(GRID_METHODS) else ', '.join(m)}"
                     for seeds, m in lacking.items()) or "nothing"


def _name(key: Key) -> str:
    return "/".join(part for part in key if part)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--experiment", action="append",
                        help="folder of results/ (again for more; default: all but quick and ci)")
    parser.add_argument("--out", type=Path, help="folder of the report (default: --results)")
    parser.add_argument("--mine", type=Path, action="append", default=[],
                        help="runs of one's own: a folder of them, or a table (again for more)")
    options = parser.parse_args()
    inputs = Inputs(options.results, options.experiment)
    try:
        for message in mine.join(options.mine):
            print(f"report: left out: {message}", file=sys.stderr)
        blocks, drawings, found = build(inputs)
    except (DamagedFile, FileNotFoundError) as error:
        sys.exit(f"report: {error}")
    folder = options.out or options.results
    folder.mkdir(parents=True, exist_ok=True)
    for drawing in drawings:
        save(drawing, folder / FIGURES, png=False)
    for name, text in (("REPORT.md", to_markdown(TITLE, blocks, FIGURES)),
                       ("report.html", to_html(TITLE, blocks)),
                       ("claims.json", ledger.to_text(found))):
        (folder / name).write_text(text, encoding="utf-8")
        print(folder / name)
    if folder == RESULTS:
        readme = RESULTS.parent / "README.md"
        readme.write_text(ledger.put_box(readme.read_text(encoding="utf-8"), ledger.box(found)),
                          encoding="utf-8")


if __name__ == "__main__":
    main()
