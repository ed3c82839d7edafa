"""The paper's claims, judged from samples by definitions that are fixed here and printed with them.

Every claim is a list of parts, most often one a task. A part holds, fails, is undecided, or is not
measured. A claim holds when at least `needed` of its parts hold, and fails when so many fail that
`needed` is out of reach.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy import stats

from plots import fig_parameters as count
from plots.records import FINITE, INFINITE, METHODS, PAIRS, TASKS, Rows
from plots.samples import Sample, Samples
from plots.statistics import (CONFIDENCE, STREAM, Difference, Moments, one_sample, seeds_needed,
                              welch)
from plots.text import interval, number, p_clause
from plots.timeline import QUANTITIES, phase_of

HOLDS, FAILS, UNDECIDED, UNMEASURED = "holds", "fails", "undecided", "not measured"
APART = "-"  # the source cannot say anything about it

OURS = "option2vec"
RIVALS = ("dac_ppo", "ahp_ppo", "ppoc", "oc", "ppo")  # needed; the authors have all on every task
MORE_RIVALS = ("dac_onestep", "iopg")  # compared wherever they have runs
MARGIN = 0.2  # of "comparable", the customary one of bioequivalence
FLAT = 0.05  # of "converged": share of all progress
GRADIENT_BOUND = 1e-6  # tests/grad_check.h
SHARE = 0.158  # the paper's 15.8 %
ROTATIONS = 1000
ALIGNED = 0.05  # of "interpretable": share of the effect that would not be worth the name
TOLD, UNTOLD = 0.5, 0.1  # of "coincide": share of the option's entropy that the phase tells
ONE_OPTION = 0.1  # [bit] of entropy, below which one option acts nearly always
CHEAPER = 0.9  # of "less computational cost": of the rival's
TIMED = ("HalfCheetah-v2", "Humanoid-v2")  # tasks on which `make bench` times every method
EMBEDDING, THOUSANDS = 40, 19  # the paper's parameters an option: its own, DAC's in thousands


@dataclass(frozen=True)
class Evidence:
    """All that is known from one source: paper, released, or authors."""
    source: str
    samples: Samples
    parameters: Mapping[str, int] = field(default_factory=dict)  # see parameter_counts
    costs: Rows = field(default_factory=list)  # of `make bench`
    gradcheck: Rows = field(default_factory=list)
    theory: Rows = field(default_factory=list)
    effects: Mapping[Path, np.ndarray] = field(default_factory=dict)  # (D, A), by file
    information: Rows = field(default_factory=list)  # of `make timelines`


@dataclass(frozen=True)
class Finding:
    """A part of a claim."""
    part: str
    verdict: str
    measured: str
    n: tuple[int, ...] = ()  # seeds of Option2Vec and of the method it is compared with
    literal: bool | None = None  # the means alone say so; None where a rival has no runs


@dataclass(frozen=True)
class Claim:
    """text: as on the first screen; words in quotation marks are the paper's own."""
    id: str  # anchor and key, never changed
    place: str  # in the paper
    text: str
    short: str  # in a sentence
    literally: str  # what is true of so many parts
    definition: str
    needed: int
    judge: Callable[[Evidence], Sequence[Finding]]
    unit: str = ""  # of n, where it is not seeds


def verdict_of(claim: Claim, findings: Sequence[Finding]) -> str:
    """Of the whole claim."""
    for nothing in (APART, UNMEASURED):
        if all(f.verdict == nothing for f in findings):
            return nothing
    held, failed = (sum(f.verdict == v for f in findings) for v in (HOLDS, FAILS))
    if held >= claim.needed:
        return HOLDS
    return FAILS if len(findings) - failed < claim.needed else UNDECIDED


# ---- Parts that compare samples


def _usable(evidence: Evidence, task: str, method: str) -> Sample | None:
    sample = evidence.samples.get((task, method))
    return None if sample is None or sample.shortened else sample


def _rivals(evidence: Evidence, task: str) -> dict[str, Sample]:
    found = {m: _usable(evidence, task, m) for m in RIVALS + MORE_RIVALS}
    return {m: s for m, s in found.items() if s is not None}


def _compare(part: str, d: Difference, x: Moments, y: Moments, rival: str, verdict: str
             ) -> Finding:
    if math.isnan(d.p):
        return Finding(part, verdict, f"{number(d.mean, '+')} against {METHODS[rival]}, too few "
                       "runs for an interval", (x.n, y.n))
    return Finding(part, verdict, f"{number(d.mean, '+')} {interval(d.interval, '+')} against "
                   f"{METHODS[rival]}, {p_clause(d.p)}", (x.n, y.n))


def _more_seeds(finding: Finding, d: Difference, x: Moments, y: Moments) -> Finding:
    """Says, of an undecided comparison, how many seeds the difference seen would take."""
    if finding.verdict != UNDECIDED or d.p < 1 - CONFIDENCE or min(x.n, y.n) < 2:
        return finding
    needed = seeds_needed(x, y)
    return replace(finding, measured=f"{finding.measured}; would take "
                   + (f"{needed} seeds" if needed else "over 1000 seeds"))


def _unmeasured(part: str, what: str) -> Finding:
    return Finding(part, UNMEASURED, f"no whole runs of {what}")


def _above(rival: str) -> Callable[[Evidence, str], Finding]:
    def judge(evidence: Evidence, task: str) -> Finding:
        ours, other = (_usable(evidence, task, m) for m in (OURS, rival))
        if ours is None or other is None:
            return _unmeasured(task, METHODS[OURS if ours is None else rival])
        d = welch(ours.moments, other.moments)
        verdict = HOLDS if d.above else FAILS if d.below else UNDECIDED
        x, y = ours.moments, other.moments
        finding = replace(_compare(task, d, x, y, rival, verdict), literal=d.mean > 0)
        return _more_seeds(finding, d, x, y)
    return judge


def _first(quantity: Callable[[Sample], Moments]) -> Callable[[Evidence, str], Finding]:
    def judge(evidence: Evidence, task: str) -> Finding:
        ours, rivals = _usable(evidence, task, OURS), _rivals(evidence, task)
        if ours is None or not rivals:
            return _unmeasured(task, METHODS[OURS] if ours is None else "rivals")
        x = quantity(ours)
        differences = {m: welch(x, quantity(s)) for m, s in rivals.items()}
        failed = [m for m, d in differences.items() if d.below]
        if failed:
            verdict, shown = FAILS, max(failed, key=lambda m: quantity(rivals[m]).mean)
        else:
            # What decides is the rival that is hardest to tell from a better one.
            shown = max(differences, key=lambda m: _one_sided(differences[m]))
            verdict = HOLDS if all(d.above for d in differences.values()) else UNDECIDED
        d, y = differences[shown], quantity(rivals[shown])
        finding = _more_seeds(_compare(task, d, x, y, shown, verdict), d, x, y)
        finding = replace(finding, literal=all(d.mean > 0 for d in differences.values()))
        return _with_missing(finding, rivals, refuted=bool(failed))
    return judge


def _with_missing(finding: Finding, rivals: Mapping[str, Sample], refuted: bool = False) -> Finding:
    """While one of RIVALS is missing, the means say nothing and the part is undecided; `refuted`:
    unless it fails whatever that rival does."""
    missing = ", ".join(METHODS[m] for m in RIVALS if m not in rivals)
    return finding if not missing else replace(
        finding, verdict=finding.verdict if refuted else UNDECIDED, literal=None,
        measured=f"{finding.measured}; no runs of {missing}")


def _one_sided(d: Difference) -> float:
    """p of "not above"; 1 where there is none."""
    return 1.0 if math.isnan(d.p) else d.p / 2 if d.mean > 0 else 1 - d.p / 2


def _against_best(judge: Callable[[str, Sample, str, Sample], Finding]
                  ) -> Callable[[Evidence, str], Finding]:
    """A part about the rival with the highest mean."""
    def whole(evidence: Evidence, task: str) -> Finding:
        ours, rivals = _usable(evidence, task, OURS), _rivals(evidence, task)
        if ours is None or not rivals:
            return _unmeasured(task, METHODS[OURS] if ours is None else "rivals")
        best = max(rivals, key=lambda m: rivals[m].moments.mean)
        return _with_missing(judge(task, ours, best, rivals[best]), rivals)
    return whole


def _smaller_spread(task: str, ours: Sample, rival: str, best: Sample) -> Finding:
    x, y = ours.moments, best.moments
    if min(x.n, y.n) < 2:
        return Finding(task, UNDECIDED, f"against {METHODS[rival]}, too few runs", (x.n, y.n))
    text = f"std {number(x.std)} against {number(y.std)} of {METHODS[rival]}"
    if min(x.n, y.n) < 3 or x.std + y.std == 0:
        return Finding(task, UNDECIDED, text, (x.n, y.n), x.std < y.std)
    with np.errstate(divide="ignore", invalid="ignore"):  # deviations from the medians all equal
        p = float(stats.levene(ours.final, best.final, center="median").pvalue)
    told_apart = p < 1 - CONFIDENCE  # not where p is NaN
    verdict = UNDECIDED if not told_apart else HOLDS if x.std < y.std else FAILS
    return Finding(task, verdict, f"{text}, {p_clause(p)}", (x.n, y.n), x.std < y.std)


def _smoother(task: str, ours: Sample, rival: str, best: Sample) -> Finding:
    if not len(ours.jumps) or not len(best.jumps):
        return Finding(task, UNMEASURED, "needs single runs, not mean curves")
    x, y = Moments.of(ours.jumps), Moments.of(best.jumps)
    d = welch(x, y)
    verdict = HOLDS if d.below else FAILS if d.above else UNDECIDED
    return Finding(task, verdict, f"std of a step's change {number(x.mean)} against "
                   f"{number(y.mean)} of {METHODS[rival]}"
                   + ("" if math.isnan(d.p) else f", {p_clause(d.p)}"), (x.n, y.n), d.mean < 0)


def _comparable(task: str, ours: Sample, rival: str, best: Sample) -> Finding:
    x, y = ours.moments, best.moments
    d, margin = welch(x, y), MARGIN * abs(y.mean)
    low = d.interval[0]
    verdict = FAILS if d.below else HOLDS if low >= -margin else UNDECIDED
    finding = _compare(task, d, x, y, rival, verdict)
    return replace(finding, measured=f"{finding.measured}, margin {number(margin)}",
                   literal=d.mean >= -margin)


# ---- Parts that look at Option2Vec alone


def _converged(evidence: Evidence, task: str) -> Finding:
    ours = _usable(evidence, task, OURS)
    if ours is None:
        return _unmeasured(task, METHODS[OURS])
    d, margin = one_sample(ours.gain), FLAT * abs(ours.progress)
    low, high = d.interval
    verdict = UNDECIDED
    if -margin <= low and high <= margin:
        verdict = HOLDS
    elif low > margin or high < -margin:
        verdict = FAILS
    gain = f"{number(d.mean, '+')} {interval(d.interval, '+')}".removesuffix(" -")
    return Finding(task, verdict, f"{gain} in the last "
                   f"tenth, margin {number(margin)}", (ours.gain.n,), abs(d.mean) <= margin)


def _growing(evidence: Evidence, task: str) -> Finding:
    ours = _usable(evidence, task, OURS)
    if ours is None or not ours.durations.size:
        return Finding(task, UNMEASURED, "no records of option durations")
    early, late = ours.durations
    d = one_sample(Moments.of(late - early))
    verdict = HOLDS if d.above else FAILS if d.below else UNDECIDED
    ratio = (f"; {number(ours.persistence.mean())} of chance at the end"
             if len(ours.persistence) else "")
    change = "" if math.isnan(d.p) else (
        f": {number(d.mean, '+')} {interval(d.interval, '+')}, {p_clause(d.p)}")
    return Finding(task, verdict,
                   f"{number(early.mean())} to {number(late.mean())} steps{change}{ratio}",
                   (len(early),), d.mean > 0)


# ---- Claims that are not about returns


def parameter_counts(params: Rows, fidelity: str) -> dict[str, int]:
    """All parameters on HalfCheetah-v2 (S = 17, A = 6): Option2Vec's, and those of the option
    network at its two widths."""
    rows = [r for r in params if r["task"] == "HalfCheetah-v2" and r["fidelity"] == fidelity]
    return {OURS if r["method"] == OURS else f"width {r['width']}": r["counted"]
            for r in rows if r["method"] in (OURS, "dac_ppo")}


# Of the authors' code, which `released` counts; spec 2.3, 2.6.
AUTHORS_PARAMETERS = {OURS: 30598, "width 64": 55809, "width 128": 193473}
NOT_IN_LOGS = Finding("networks", APART, "logs have no networks; `released` counts the parameters "
                      "of the authors' code")


def _parameters(width: int) -> Callable[[Evidence], Sequence[Finding]]:
    def judge(evidence: Evidence) -> Sequence[Finding]:
        if evidence.source == "authors":
            return [NOT_IN_LOGS]
        ours, other = (evidence.parameters.get(name) for name in (OURS, f"width {width}"))
        if ours is None or other is None:
            return [Finding("S = 17, A = 6", UNMEASURED, "no results/params.csv")]
        verdict = HOLDS if round(ours / other, 3) == SHARE else FAILS
        return [Finding("S = 17, A = 6", verdict, f"{ours} / {other} = {100 * ours / other:.1f} %")]
    return judge


def _an_option(evidence: Evidence) -> Sequence[Finding]:
    if evidence.source == "authors":
        return [NOT_IN_LOGS]
    network = count.option2vec_paper if evidence.source == "paper" else count.option2vec_released
    S, A = count.S, count.A
    adds = network(S, A, 5, 64) - network(S, A, 4, 64)
    policy = {h: count.body(S, h) + h * A + A for h in (64, 128)}
    return [
        Finding("the embedding of an option", HOLDS if count.D == EMBEDDING else FAILS,
                f"{count.D} parameters", literal=count.D == EMBEDDING),
        Finding("one more option, all told", HOLDS if adds == EMBEDDING else FAILS,
                f"{adds} parameters more from K = 4 to 5", literal=adds == EMBEDDING),
        Finding("an action policy of DAC+PPO", HOLDS if policy[64] // 1000 == THOUSANDS else FAILS,
                f"{policy[64]} parameters at DAC's own width 64, {policy[128]} at 128",
                literal=policy[64] // 1000 == THOUSANDS)]


def _cost(evidence: Evidence) -> Sequence[Finding]:
    if evidence.source == "authors":
        return [Finding(task, UNMEASURED, "the authors published no times") for task in TIMED]
    rows = {(r["task"], r["method"]): r for r in evidence.costs
            if r["fidelity"] == evidence.source}
    findings = []
    for task in TIMED:
        ours, other = rows.get((task, OURS)), rows.get((task, "dac_ppo"))
        if ours is None or other is None:
            findings.append(Finding(task, UNMEASURED, "not timed"))
            continue
        x, y = (r["inference_us"] + r["learning_us"] for r in (ours, other))
        verdict = HOLDS if x <= CHEAPER * y else FAILS if x > y else UNDECIDED
        findings.append(Finding(
            task, verdict, f"{number(x)} µs a step, DAC+PPO {number(y)} (with physics "
            f"{number(ours['total_us'])}, {number(other['total_us'])})", literal=x < y))
    return findings


def _gradients(evidence: Evidence) -> Sequence[Finding]:
    other = {"paper": "released", "released": "paper"}.get(evidence.source)
    errors = [r["largest_error"] for r in evidence.gradcheck if other not in r["name"].split()]
    if not errors:
        return [Finding("all checks", UNMEASURED, "no table of gradient checks")]
    good = sum(e < GRADIENT_BOUND for e in errors)
    return [Finding("all checks", HOLDS if good == len(errors) else FAILS,
                    f"{good} of {len(errors)} below 1e-06, largest error {max(errors):.2g}")]


NO_LOGS = "it needs no runs"


def _theory(evidence: Evidence) -> Sequence[Finding]:
    findings = []
    for statement in ("Proposition 3.1", "Proposition 3.2", "Theorem 3.3", "Theorem 3.4"):
        rows = [r for r in evidence.theory if statement.split()[1] in r["name"]]
        if evidence.source == "authors":
            findings.append(Finding(statement, APART, NO_LOGS))
            continue
        if not rows:
            findings.append(Finding(statement, UNMEASURED, "no table of statements"))
            continue
        good = sum(r["verdict"] == "PASS" for r in rows)
        false = sum(": false" in r["name"] for r in rows)
        findings.append(Finding(
            statement, HOLDS if good == len(rows) else FAILS,
            f"{good} of {len(rows)} checks come out as said; {false} of them show a reading false"))
    return findings


AS_PRINTED = "Proposition 3.2 as Var(V_bar) <= V: false"  # a row of results/theory.csv


def _as_printed(evidence: Evidence) -> Sequence[Finding]:
    if evidence.source == "authors":
        return [Finding("Proposition 3.2", APART, NO_LOGS)]
    rows = [r for r in evidence.theory if r["name"] == AS_PRINTED]
    if not rows:
        return [Finding("Proposition 3.2", UNMEASURED, "no table of statements")]
    shown = all(r["verdict"] == "PASS" for r in rows)
    return [Finding("Proposition 3.2", FAILS if shown else UNDECIDED,
                    "counterexamples found: rewards times c scale the sides by c^2 and c" if shown
                    else "no counterexample found")]


def primary_share(effects: np.ndarray) -> np.ndarray:
    """Share of all effects (..., D, A) that each dimension has on its primary action."""
    size = np.abs(effects)
    return size.max(axis=-1).sum(axis=-1) / size.sum(axis=(-2, -1))


def _interpretable(evidence: Evidence) -> Sequence[Finding]:
    several = {path: x for path, x in evidence.effects.items() if x.shape[1] > 1}
    if not several:
        return [Finding("embedding", UNMEASURED, "needs the output of `option2vec interpret`")]
    rng = np.random.default_rng(STREAM)
    shares, rotated = [], []
    for effects in several.values():
        rotations = stats.ortho_group.rvs(len(effects), size=ROTATIONS, random_state=rng)
        shares.append(primary_share(effects))
        rotated.append(primary_share(rotations @ effects))
    share, others = np.mean(shares), np.mean(rotated, axis=0)
    p = (1 + int((others >= share).sum())) / (1 + ROTATIONS)
    excess = one_sample(Moments.of(np.array(shares) - np.mean(rotated, axis=1)))
    verdict = HOLDS if p < 1 - CONFIDENCE else FAILS if excess.interval[1] < ALIGNED else UNDECIDED
    tasks = sorted({path.parts[-3] for path in several})
    return [Finding("embedding", verdict,
                    f"{100 * share:.0f} % of the effect on primary actions, after rotation "
                    f"{100 * others.mean():.0f} %, {p_clause(p)}; {len(shares)} "
                    f"{'run' if len(shares) == 1 else 'runs'} on {', '.join(tasks)}",
                    (len(shares),), bool(share > others.mean()))]


def _coincides(evidence: Evidence, task: str) -> Finding:
    if evidence.source == "authors":
        return Finding(task, APART, "logs say nothing about it")
    rows = {r["with"]: r for r in evidence.information
            if r["policy"] == f"{task}-{evidence.source}"}
    if not {"option before", phase_of(task)} <= rows.keys():
        return Finding(task, UNMEASURED, "no policy in results/policies")
    phase, before = rows[phase_of(task)], rows["option before"]
    entropy = phase["entropy_bits"]
    share = (phase["bits"] - phase["shuffled_bits"]) / entropy if entropy > ONE_OPTION else 0.0
    chance = phase["bits"] <= phase["shuffled_95_bits"]
    verdict = FAILS if chance or share < UNTOLD else HOLDS if share >= TOLD else UNDECIDED
    told = ", ".join(f"{what} tells {row['bits']:.2f} (shuffled {row['shuffled_bits']:.2f})"
                     for what, row in (("the phase", phase), ("the option before", before)))
    return Finding(task, verdict, f"{told} of {entropy:.2f} bits", (1,), share >= TOLD)


# ---- The ledger


def _each(tasks: Sequence[str], judge: Callable[[Evidence, str], Finding]
          ) -> Callable[[Evidence], Sequence[Finding]]:
    return lambda evidence: [judge(evidence, task) for task in tasks]


FIRST = ("Option2Vec's mean is above that of every rival with p < 0.05 each (Welch, two-sided); it "
         "fails where a rival's is above Option2Vec's with p < 0.05")

CLAIMS = (
    Claim("q1", "Q1, Fig. 4a", "Option2Vec is above DAC-OneStep on all ten tasks",
          "above DAC-OneStep", "above by mean on {}",
          "Return at 1M steps; above: larger mean and p < 0.05 (Welch, two-sided); it fails on "
          "a task where it is below with p < 0.05.",
          10, _each(TASKS, _above("dac_onestep"))),
    Claim("q2-best", "Q2, Fig. 4b", "Best on the four \"infinite horizon\" tasks",
          "best without termination", "first by mean on {}",
          f"The tasks without termination. Return at 1M steps. {FIRST}.",
          4, _each(INFINITE, _first(lambda s: s.moments))),
    Claim("q2-variance", "Q2, Fig. 4b", "Smaller variance on these four",
          "smaller variance", "smaller on {}",
          "Standard deviation over seeds of the return at 1M steps, against the rival with the "
          "highest mean: smaller with p < 0.05 (Brown-Forsythe); it fails where larger with "
          "p < 0.05.",
          4, _each(INFINITE, _against_best(_smaller_spread))),
    Claim("q2-steps", "Q2, Fig. 4b", "Smaller \"variance between steps\" on these four",
          "smaller variance between steps", "smaller on {}",
          "Standard deviation, within a run, of the change of the return from one of the records' "
          "steps (10 000) to the next, in the second half of training; mean over runs against that "
          "of the rival with the highest return: smaller with p < 0.05 (Welch); it fails where "
          "larger with p < 0.05.",
          4, _each(INFINITE, _against_best(_smoother))),
    Claim("q2-faster", "Q2, Fig. 4b", "Faster convergence on these four",
          "faster convergence", "first by mean on {}",
          "Faster: first in the mean return over steps 0 to 1M, the area below the learning curve. "
          f"{FIRST}. Of the authors' logs the deviation of that area is an upper bound, the mean "
          "one of the points.",
          4, _each(INFINITE, _first(lambda s: s.area))),
    Claim("q2-comparable", "Q2, Fig. 4c", "Comparable on the six finite-horizon tasks",
          "comparable with termination", "within the margin by mean on {}",
          "The tasks with termination. Return at 1M steps against the rival with the highest mean: "
          "comparable when not below "
          "with p < 0.05 and the 95 % interval of the difference reaches no lower than "
          f"{100 * MARGIN:.0f} % of the rival's mean below it; it fails where below with p < 0.05.",
          6, _each(FINITE, _against_best(_comparable))),
    Claim("q3", "Q3, Fig. 5", "First on five of the six transfer pairs",
          "first on five of six pairs", "first by mean on {}",
          f"Return at the end of the second task, 2M steps. {FIRST}.",
          5, _each(tuple(PAIRS), _first(lambda s: s.moments))),
    Claim("share-64", "text", "\"15.8 %\" of the parameters of DAC, which \"remain unchanged\"",
          "15.8 % of DAC's parameters", "",
          "All parameters, used or not, S = 17, A = 6, K = 4, over those of the network of DAC+PPO "
          "with hidden layers of 64, which the paper says are unchanged; rounds to 15.8 %.",
          1, _parameters(64)),
    Claim("share-128", "text", "\"15.8 %\" of the parameters of DAC at width 128",
          "15.8 % at width 128", "",
          "The same with hidden layers of 128, as in the authors' later scripts.",
          1, _parameters(128)),
    Claim("option-size", "text", "An option costs 40 parameters, in DAC \"19K parameters\"",
          "40 parameters an option", "true of {}",
          "S = 17, A = 6, K = 4. An option's embedding has 40 parameters; one more option adds no "
          "others; an action policy of DAC+PPO has 19 thousand at DAC's own width of 64.",
          3, _an_option),
    Claim("cost", "text", "At \"significantly less computational cost\", on the two tasks timed",
          "lower cost", "less than DAC+PPO on {}",
          "CPU time of the learner per environment step, inference and learning, as `make bench` "
          f"measured it on two tasks: at most {100 * CHEAPER:.0f} % of that of DAC+PPO on both. It "
          "fails where it is more. Physics is left out: it is the same for both methods, and the "
          "noise of its measurement is as large as some differences. There is one number per task, "
          "the least of five measurements, and so no interval.",
          len(TIMED), _cost),
    Claim("converged", "text", "Converged after 1M steps, on all ten tasks",
          "converged after 1M steps", "within the margin by mean on {}",
          "Mean return over the last tenth of the steps less that over the tenth before: the 95 % "
          f"interval (t) lies within {100 * FLAT:.0f} % of all progress, from the first value to "
          "the last tenth; it fails when the interval lies outside. Of the authors' logs "
          "the deviation is an upper bound.",
          10, _each(TASKS, _converged)),
    Claim("proposition", "Proposition 3.2", "As printed: Var(V_bar) ≤ V",
          "Proposition 3.2 as printed", "",
          "False when `make theory` finds processes for which it is not so. The sides have "
          "different units: rewards times c scale them by c^2 and c.", 1, _as_printed),
    Claim("theory", "3.1 to 3.4", "Propositions and theorems in the sense that is true",
          "the theory in the sense that is true", "",
          "Every check of `make theory` on a statement comes out as said: its gap is within "
          "tolerance or, of a reading that is marked false, beyond it. Which readings are false is "
          "in the table of the theory.", 4, _theory),
    Claim("q4", "Q4, Fig. 6", "Embeddings are interpretable",
          "interpretable embeddings", "",
          "Share of the effect of the embedding's dimensions on the mean action that falls on each "
          "dimension's primary action, mean over runs on tasks with several actions: larger than "
          f"in {100 * CONFIDENCE:.0f} % of random rotations of the embedding space. It fails when "
          "the 95 % interval (t, over runs) of that share less its mean after rotation ends below "
          f"{100 * ALIGNED:.0f} percentage points. n is the number of runs, over all tasks.",
          1, _interpretable, "runs"),
    Claim("phases", "Q4, Q5, video", "Options coincide with phases of the movement",
          "options that coincide with phases", "half of the entropy or more on {}",
          "Mutual information between the option and the phase of the movement, the quarter that "
          "height and speed of the body are in, on the seven tasks with such a body; less that of "
          "the same options in random order (mean of 200 shuffles), over the option's entropy. It "
          f"holds on a task from {100 * TOLD:.0f} % and fails below {100 * UNTOLD:.0f} %, "
          "within the 95 % quantile of the shuffles, or where one option acts nearly always "
          f"(entropy below {ONE_OPTION:.1f} bit); on most of the tasks. One policy a task and "
          "fidelity, seed 0, five episodes: it is a statement about these policies, without an "
          "interval over seeds, and the bounds were chosen when the first of them were known. "
          "Any two slowly changing signals share some information, so that a small share is no "
          "evidence. The option before is shown beside it.",
          len(QUANTITIES) // 2 + 1, _each(tuple(QUANTITIES), _coincides)),
    Claim("q5", "Q5, Fig. 7", "Option durations grow, on all ten tasks",
          "growing durations", "longer by mean on {}",
          "Mean duration of an option (steps by executions, all options together; the end of an "
          "episode ends an execution, so that durations grow with episodes, too) in the last "
          "tenth of the steps less that in the first: positive with p < 0.05 (t, paired by run); "
          "it fails on a task where it is negative with p < 0.05. \"Of chance\": the mean "
          "duration in the last tenth over that of independent draws with the same shares u, "
          "1/(1 - sum of u^2).",
          10, _each(TASKS, _growing)),
)
CHECKS = (
    Claim("gradients", "own check", "Gradients are those of the losses", "gradients", "",
          "Relative error of analytic against numeric gradients below 1e-6 in every check.",
          1, _gradients),
)
