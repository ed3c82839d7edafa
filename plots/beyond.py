"""Questions that the paper does not ask, answered with the statistics of its claims."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from plots.claims import MARGIN, OURS, UNDECIDED, UNMEASURED
from plots.inputs import Inputs
from plots.records import FIDELITIES, METHODS, PAIRS, TASKS, Cell
from plots.samples import Sample, our_samples, persistence
from plots.statistics import CONFIDENCE, Difference, Moments, holm, one_sample, welch
from plots.text import interval, moments, number, p_clause

YES, NO = "yes", "no"
ALL_TASKS = (*TASKS, *PAIRS)
USUAL = 4  # options
LEAST = MARGIN  # effect, relative, that is worth a yes
LEVEL = 1 - CONFIDENCE


@dataclass(frozen=True)
class Part:
    """What one task says, or one switch on one task. effect: relative; of a switch's, p."""
    name: str
    measured: str
    effect: float | None = None
    p: float = math.nan


@dataclass(frozen=True)
class Answer:
    word: str
    small: str = ""  # beside it
    reason: str = ""


@dataclass(frozen=True)
class Question:
    text: str
    definition: str
    ask: Callable[[Inputs, str], Sequence[Part]]
    answer: Callable[[Sequence[Part]], Answer]


def over_tasks(shown: Callable[[float], str]) -> Callable[[Sequence[Part]], Answer]:
    """Mean effect with tasks as units (t). No: the interval ends below LEAST. Yes: else, if it
    begins above 0. shown: an effect in words."""
    def answer(parts: Sequence[Part]) -> Answer:
        effects = [p.effect for p in parts if p.effect is not None]
        if not effects:
            return Answer(UNMEASURED, reason="; ".join(dict.fromkeys(p.measured for p in parts)))
        d = one_sample(Moments.of(effects))
        low, high = d.interval
        word = NO if high < LEAST else YES if low > 0 else UNDECIDED  # not where they are NaN
        range_ = f" [{shown(low)}, {shown(high)}]" if low <= high else ""
        return Answer(word, shown(d.mean), f"{shown(d.mean)}{range_} in the mean of "
                      f"{len(effects)} of {len(ALL_TASKS)} tasks")
    return answer


def over_switches(parts: Sequence[Part]) -> Answer:
    """Yes: one switch at least has a positive effect, p < 0.05 by Holm's correction for their
    number. It cannot say no."""
    known = [p for p in parts if not math.isnan(p.p)]
    if not known:
        return Answer(UNMEASURED, reason="no whole runs with one switch turned")
    sure = [part.name for part, p in zip(known, holm([p.p for p in known]))
            if p < LEVEL and part.effect > 0]
    return Answer(YES if sure else UNDECIDED, f"{len(sure)}/{len(known)}",
                  f"{len(sure)} of {len(known)} comparisons{': ' if sure else ''}{'; '.join(sure)}")


def _percent(effect: float) -> str:
    return f"{100 * effect:+.0f} %"


def _times(effect: float) -> str:
    return f"{1 + effect:.2f} times"


def options_of(inputs: Inputs, fidelity: str, task: str) -> dict[int, Sample]:
    """Option2Vec's runs by number of options K, all with the same number of steps."""
    found = {}
    for key, cell in inputs.cells.items():
        K = re.fullmatch(r"(?:options=(\d+))?", key.variant)
        if K and (key.fidelity, key.task, key.algorithm) == (fidelity, task, OURS):
            sample = our_samples({key: cell}, fidelity, key.variant).get((task, OURS))
            if sample is not None and not sample.shortened:
                found[int(K[1] or USUAL)] = sample
    return dict(sorted(found.items()))


def _needs_options(inputs: Inputs, fidelity: str) -> list[Part]:
    parts = []
    for task in ALL_TASKS:
        found = options_of(inputs, fidelity, task)
        if not {1, USUAL} <= found.keys():
            parts.append(Part(task, "no whole runs with one option"))
            continue
        one, usual = found[1].moments, found[USUAL].moments
        d = welch(usual, one)
        parts.append(Part(task, f"{moments(usual)} with {USUAL} options, {moments(one)} with one: "
                          + _difference(d), d.mean / abs(one.mean), d.p))
    return parts


def _lasts(inputs: Inputs, fidelity: str) -> list[Part]:
    parts = []
    for task in ALL_TASKS:
        sample = inputs.sources[fidelity].get((task, OURS))
        if sample is None or not len(sample.persistence):
            parts.append(Part(task, "no records of option durations"))
            continue
        ratio = Moments.of(sample.persistence)
        d = one_sample(ratio)
        text = f"{number(ratio.mean)} {interval(d.interval)}".removesuffix(" -")
        parts.append(Part(task, f"{text} times chance (n = {ratio.n})", ratio.mean - 1))
    return parts


def _switches(inputs: Inputs, fidelity: str) -> list[Part]:
    parts = []
    for key, cell in inputs.cells.items():
        one = key.variant.startswith("o2v_") and key.variant.count("=") == 1
        if not one or (key.fidelity, key.algorithm) != (fidelity, OURS):
            continue
        base = inputs.cells.get(key._replace(variant=""))
        x, y = (_persistences(c, cell.wanted) for c in (cell, base))
        if len(x) and len(y):
            d = welch(Moments.of(x), Moments.of(y))
            parts.append(Part(f"{key.variant}, {key.task}", f"{moments(Moments.of(x))} times "
                              f"chance with it, {moments(Moments.of(y))} without: {_difference(d)}",
                              d.mean, d.p))
    return parts


def _above_ppo(inputs: Inputs, fidelity: str) -> list[Part]:
    parts = []
    for task in ALL_TASKS:
        one = options_of(inputs, fidelity, task).get(1)
        ppo = inputs.sources[fidelity].get((task, "ppo"))
        if one is None or ppo is None or ppo.shortened:
            parts.append(Part(task, "no whole runs with one option, or of PPO"))
            continue
        d = welch(one.moments, ppo.moments)
        parts.append(Part(task, f"{moments(one.moments)} with one option, PPO "
                          f"{moments(ppo.moments)}: {_difference(d)}",
                          d.mean / abs(ppo.moments.mean), d.p))
    return parts


RULE = (f"Mean over tasks, with tasks as units (t). No: the 95 % interval ends below "
        f"{100 * LEAST:.0f} %. Yes: else, if it begins above 0. Undecided otherwise.")
QUESTIONS = (
    Question("Does Option2Vec need options?",
             f"Return at the end with {USUAL} options less that with one option (`options=1`), "
             f"over the latter. {RULE}", _needs_options, over_tasks(_percent)),
    Question("Do its options last longer than chance?",
             "Mean duration of an option in the last tenth of the steps over that of independent "
             "draws with the same shares u, 1/(1 - sum of u^2); less 1. " + RULE, _lasts,
             over_tasks(_times)),
    Question("Does one switch make options persist?",
             "The same ratio with one `o2v_` switch turned less that without, other switches as "
             f"the fidelity has them. Yes: larger with p < {LEVEL:.2f} (Welch, with Holm's "
             "correction for the number of comparisons). Undecided otherwise.", _switches,
             over_switches),
    Question("With one option, is Option2Vec above PPO?",
             "Return at the end with one option less that of PPO, over the latter. What is left "
             "then is not the options: two stages that train the critic twice, standard deviations "
             f"that depend on the state, ReLU. {RULE}", _above_ppo, over_tasks(_percent)),
)


def _persistences(cell: Cell | None, steps: int) -> np.ndarray:
    """Of the runs with so many steps."""
    runs = cell.whole if cell is not None and cell.wanted == steps else ()
    found = np.array([persistence(run) for run in runs])
    return found[~np.isnan(found)]


def _difference(d: Difference) -> str:
    if math.isnan(d.p):
        return number(d.mean, "+")
    return f"{number(d.mean, '+')} {interval(d.interval, '+')}, {p_clause(d.p)}"


def one_factor_rows(inputs: Inputs) -> list[list[str]]:
    """Runs of PPO and of Option2Vec with one option, with whatever else was changed in them."""
    rows = []
    for fidelity in FIDELITIES:
        for key, cell in inputs.cells.items():
            changed = [part for part in re.split(r"-(?=[^-=]+=)", key.variant)
                       if part not in ("", "options=1")]
            of_ppo = key.algorithm == "ppo" and key.variant
            of_ours = key.algorithm == OURS and key.variant.startswith("options=1-")
            if key.fidelity == fidelity and (of_ppo or of_ours):
                sample = our_samples({key: cell}, fidelity, key.variant).get(
                    (key.task, key.algorithm))
                if sample is not None:
                    rows.append([key.task, fidelity, METHODS[key.algorithm]
                                 + (", one option" if of_ours else ""), ", ".join(changed),
                                 moments(sample.moments), f"{sample.step}"])
    return rows


def by_question(inputs: Inputs) -> list[tuple[Question, Mapping[str, Sequence[Part]]]]:
    """Every question with its parts by fidelity."""
    return [(q, {f: q.ask(inputs, f) for f in FIDELITIES}) for q in QUESTIONS]
