"""Twin of the verdict: one number after the other, from the explanations and the file of the models."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import association
from association import HardPrior, Status, tuning
from association.context import SearchContext
from association.explain import Explanations
from association.ranking import Ranked

Numbers = dict[str, float]


def models() -> dict[str, Numbers]:
    text = (Path(association.__file__).parent / "models.json").read_text()
    return cast("dict[str, Numbers]", json.loads(text)["models"])


def evidence(best: Ranked, rivals: list[Ranked], temperature: float) -> float:
    """Sum what the rivals weigh beside the best, at most one each."""
    return sum(min(1.0, math.exp((rival.value - best.value) / temperature)) for rival in rivals)


def features(context: SearchContext, best: Ranked, rivals: list[Ranked], agreement: float) -> Numbers:
    matched = [wall >= 0 for wall in best.matches["wall"]]
    clutter = [length for length, on in zip(context.segments.rows["length"], matched, strict=True) if not on]
    count = sum(matched)
    crowd = evidence(best, rivals, tuning.CROWD_TEMPERATURE) + math.exp(tuning.LEAST_CROWD)
    misfit = math.log(sorted((tuning.LEAST_MISFIT, best.misfit, tuning.MOST_MISFIT))[1])
    return {
        "constant": 1.0,
        "lead": min(tuning.MAX_LEAD, best.value - (rivals[0].value if rivals else 0.0)),
        "solitude": -math.log(crowd),
        "share": best.share,
        "root_count": count**0.5,
        "root_length": best.length**0.5,
        "deviation": min(best.deviation, tuning.MOST_DEVIATION),
        "misfit": misfit,
        "inverse_count": 1.0 / count if count else 1.0,
        "longest_unmatched": min(max([0.0, *clutter]), tuning.LONGEST_UNMATCHED),
        "agreement": agreement,
        "misfit_of_many": misfit * min(1.0, count / tuning.MANY),
        "beyond_nearly_all": max(0.0, best.share - tuning.NEARLY_ALL),
        "root_unmatched": min(sum(clutter), tuning.MOST_UNMATCHED) ** 0.5,
        "squared_solitude": math.log(crowd) ** 2,
    }


def logistic(x: float) -> float:
    return math.exp(x) / (1.0 + math.exp(x)) if x < 0.0 else 1.0 / (1.0 + math.exp(-x))


@dataclass(frozen=True)
class Judged:
    """What the verdict should say, and the chances behind it; see `association.verdict`."""

    status: Status
    usable: bool
    probability: float
    contradicted: bool
    margin: float | None
    runner_up: float | None
    right: float = 0.0
    careful: float = 0.0
    explained: float = 0.0


def judge(context: SearchContext, explanations: Explanations, *, degenerate: bool) -> Judged:
    """Judge an answer of which it is known whether it is degenerate; without one there is no match."""
    answer, window = explanations.answer, context.prior if isinstance(context.prior, HardPrior) else None
    if answer is None:
        return Judged(Status.NO_MATCH, False, 0.0, len(explanations.ranked) > 0, None, None)
    best = answer.best
    others = [one for one in explanations.ranked if one is not best]
    rivals = [one for one in others if one.inside]
    right, careful, explained = chances(context, explanations)
    elsewhere = max((other.score for other in others), default=-math.inf) > best.score + tuning.CONTRADICTION
    status = _status(context, explanations, (right, careful, explained), degenerate=degenerate, capped=elsewhere)
    contradicted = elsewhere or best.value < best.score + tuning.FAR_FROM_PRIOR
    pose = answer.registered.pose
    if status is not Status.NO_MATCH and window is not None and pose is not None and not window.contains(pose):
        contradicted = True
    return Judged(
        status,
        status is Status.OK and explanations.search.complete and not contradicted,
        min(right, tuning.CONTRADICTED) if contradicted else right,
        contradicted,
        best.value - rivals[0].value if rivals else None,
        max(0.0, rivals[0].value / best.value) if rivals and best.value > 0.0 else None,
        right,
        careful,
        explained,
    )


def chances(context: SearchContext, explanations: Explanations) -> tuple[float, float, float]:
    """Return that the pose is right, the same with strangers about, and that it or a twin of it explains the scan."""
    answer = explanations.answer
    assert answer is not None
    rivals = [one for one in explanations.ranked if one is not answer.best and one.inside]
    numbers = features(context, answer.best, rivals, answer.agreement)
    names = ("with_beams", "with_beams") if context.scan.beams is not None else ("probability", "cautious")
    alone, of_position = [], []
    for name in names:
        terms = {term: factor * numbers[term] for term, factor in models()[name].items()}
        alone.append(sum(terms.values()))
        of_position.append(sum(value for term, value in terms.items() if term != "deviation"))
    share = 1.0 / (1.0 + evidence(answer.best, rivals, tuning.TWIN_TEMPERATURE))
    counted = of_position if answer.significance > tuning.CHANCE else of_position[:1]
    return logistic(alone[0]) * share, logistic(alone[1]) * share, min(map(logistic, counted))


def _status(
    context: SearchContext,
    explanations: Explanations,
    chances: tuple[float, float, float],
    *,
    degenerate: bool,
    capped: bool,
) -> Status:
    answer = explanations.answer
    assert answer is not None
    right, careful, explained = chances
    bar = tuning.USABLE_PROBABILITY if context.scan.beams is not None else tuning.USABLE_CAUTIOUS
    if answer.significance > tuning.LIKELY_BY_CHANCE:
        bar = tuning.USABLE_BY_CHANCE
    few = sum(wall >= 0 for wall in answer.best.matches["wall"]) < tuning.FEWEST
    if explained < tuning.NO_MATCH_PROBABILITY:
        return Status.NO_MATCH
    if degenerate:
        return Status.DEGENERATE
    if capped or right < tuning.USABLE_PROBABILITY or careful < bar or (few and answer.best.share < tuning.MOSTLY):
        return Status.AMBIGUOUS
    return Status.OK
