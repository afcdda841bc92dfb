"""Twin of the verdict: one number after the other, from the explanations and models written as for the file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from association import HardPrior, Status
from association.consensus.consensus_set import ConsensusSet
from association.consensus.tuning import CONTRADICTION, USUAL_WALLS
from association.context import SearchContext
from association.explanations import Answer, Explanations
from association.tuning import RIVAL_SHARE
from association.verdict import alternatives, tuning
from association.verdict.chance import NullScore, find_null_score
from association.verdict.inconsistencies import absences
from registration.kernels import MAX_DEVIATION

Numbers = dict[str, float]
Document = Mapping[str, list[float]]  # for each feature its slope, then value and change of slope of each bend; pairs

LOG_RATIOS = np.linspace(-60.0, 60.0, 2_401)  # of variances; ten times as many change less than 1e-11
INVERSES = np.exp(-LOG_RATIOS)


def worth(one: ConsensusSet) -> float:
    """Return the value of an explanation with its residuals' likelihood averaged over how far the walls may be off.

    Their variance over the supposed one is a scaled inverse chi-square of so many degrees of freedom; the sum goes over
    its logarithm.
    """
    n, k = int((one.matches["wall"] >= 0).sum()), USUAL_WALLS
    density = 0.5 * k * (math.log(0.5 * k) - LOG_RATIOS - INVERSES) - math.lgamma(0.5 * k)
    logs = density - 0.5 * n * LOG_RATIOS - 0.5 * one.chi_square * INVERSES
    step = LOG_RATIOS[1] - LOG_RATIOS[0]
    return one.posterior + 0.5 * one.chi_square + float(logs.max() + np.log(np.exp(logs - logs.max()).sum() * step))


def evidence(answer: Answer, rivals: list[ConsensusSet], temperature: float) -> float:
    """Sum what the alternatives weigh next to the best, at most one each."""
    least = worth(answer.best)
    total = 0.0
    for rival in rivals:
        share = rival.posterior / answer.best.posterior
        counted = np.interp(share, [tuning.UNCOUNTED_FRACTION, RIVAL_SHARE], [0.0, 1.0])
        total += float(counted) * min(1.0, math.exp((worth(rival) - least) / temperature))
    return total


def shared(context: SearchContext, answer: Answer, rivals: list[ConsensusSet]) -> tuple[float, float]:
    """Compare as scored, by what is shown, and with loose walls: geometric mean and least of the probabilities."""
    as_scored = 1.0 / (1.0 + evidence(answer, rivals, 1.0))
    total = 0.0
    for rival in rivals:
        by_matches = sum(max(0.0, float(a)) for a in answer.best.matches["score"])
        by_matches -= sum(max(0.0, float(b)) for b in rival.matches["score"])
        by_prior = (answer.best.posterior - answer.best.score) - (rival.posterior - rival.score)
        rest = (answer.best.score - rival.score) - by_matches
        limit = max(tuning.ABSENCE, float(absences(context, answer.best, [rival])[0]))
        total += math.exp(-max(0.0, by_matches + by_prior + min(limit, rest)))
    loose = alternatives.probability_with_loose_walls(context, answer, rivals)
    compared = [as_scored, 1.0 / (1.0 + total), *([] if loose is None else [loose])]
    weights = tuning.COMPARISON_WEIGHTS[: len(compared)]
    return float(np.exp(np.average(np.log(compared), weights=weights))), min(compared)


def root(x: float) -> float:
    """Return the root of a number, with its sign."""
    return -math.sqrt(-x) if x < 0.0 else math.sqrt(x)


def features(
    context: SearchContext, answer: Answer, rivals: list[ConsensusSet], null: NullScore | None = None
) -> Numbers:
    """Return the features by name; without a null those of the least there is."""
    best, leverages = answer.best, answer.estimated.leverages.tolist()
    matched = [wall >= 0 for wall in best.matches["wall"]]
    clutter = [length for length, on in zip(context.lines.rows["length"], matched, strict=True) if not on]
    count = sum(matched)
    nearest = max((worth(rival) for rival in rivals), default=-math.inf)
    crowd = evidence(answer, rivals, tuning.CROWD_TEMPERATURE) + math.exp(tuning.LEAST_CROWD)
    misfit = math.log(sorted((tuning.LEAST_MISFIT, best.misfit, tuning.MOST_MISFIT))[1])
    share, counts = 0.0, 1.0
    if null is not None:
        share = min(tuning.MOST_NULL, null.score / best.score)
        alike = (null.symmetry - tuning.UNLIKE_SYMMETRY) / (tuning.SYMMETRIC - tuning.UNLIKE_SYMMETRY)
        counts = 1.0 - sorted((0.0, alike, 1.0))[1]
    counted = tuning.NULL_FRACTION + counts * max(0.0, share - tuning.NULL_FRACTION)
    gap = min(tuning.MAX_GAP, max(-tuning.MAX_GAP, (1.0 - counted) * best.score))
    return {
        "constant": 1.0,
        "lead": min(tuning.MAX_LEAD, worth(best) - nearest if rivals else best.posterior),
        "solitude": -math.log(crowd),
        "inlier_fraction": best.fraction,
        "root_length": best.length**0.5,
        "deviation": min(answer.estimated.weakest, tuning.MOST_DEVIATION),
        "misfit": misfit,
        "longest_unmatched": min(max([0.0, *clutter]), tuning.LONGEST_UNMATCHED),
        "agreement": answer.agreement,
        "root_passed": best.passed**0.5,
        "root_farther": answer.beams.farther**0.5,
        "root_nearer": answer.beams.nearer**0.5,
        "root_passed_any": answer.beams.passed**0.5,
        "critical_displacement": min(max([0.0, *(one[1] for one in leverages)]), tuning.MOST_DEVIATION),
        "critical_deviation": min(max([0.0, *(one[2] for one in leverages)]), tuning.MOST_DEVIATION),
        "null": counted,
        "null_gap": root(gap),
        "null_better": max(0.0, share - 1.0),
        "blocked": best.blocked**0.5,
        "walls": len(leverages) ** 0.5,
        "misfit_of_many": misfit * min(1.0, count / tuning.MANY),
        "root_unmatched_walls": min(
            sum(clutter * np.interp(clutter, tuning.LIKE_WALLS, (0.0, 1.0))), tuning.MOST_UNMATCHED
        )
        ** 0.5,
        "squared_solitude": math.log(crowd) ** 2,
    }


def logit(model: Document, numbers: Numbers) -> float:
    """Add up the curves: a line from 0 to the value, steeper or less steep beyond each bend. Then the pairs."""
    total = 0.0
    for name, (slope, *bends) in model.items():
        if name == "on_map":
            continue
        if " " in name:
            kind, *both = name.split()
            ends = [bends[:2], bends[2:]]
            shares = [
                float(np.interp(numbers[one], sorted(end), (0.0, 1.0) if end[0] < end[1] else (1.0, 0.0)))
                for one, end in zip(both, ends, strict=True)
            ]
            total += slope * {"least": min, "most": max}[kind](shares)
            continue
        total += slope * numbers[name]
        for start, more in zip(bends[::2], bends[1::2], strict=True):
            total += more * max(0.0, numbers[name] - start)
    return total


def logistic(x: float) -> float:
    return math.exp(x) / (1.0 + math.exp(x)) if x < 0.0 else 1.0 / (1.0 + math.exp(-x))


@dataclass(frozen=True)
class Judged:
    """The expected verdict with its probabilities; see `association.verdict`.

    `asked` says whether the scan had to be compared with the mirrored one, `mirrored` whether that fits better.
    """

    status: Status
    usable: bool
    probability: float | None
    contradicted: bool
    margin: float | None
    runner_up: float | None
    right: float = 0.0
    careful: float = 0.0
    explained: float = 0.0
    asked: bool = False
    mirrored: bool = False


def judge(
    context: SearchContext, explanations: Explanations, models: Mapping[str, Document], usual_deviation: float
) -> Judged:
    """Judge an answer; without one there is no match."""
    answer = explanations.answer
    if answer is None:
        return Judged(Status.NO_MATCH, False, 0.0, len(explanations.ranked) > 0, None, None)
    best = answer.best
    others = [one for one in explanations.ranked if one is not best]
    rivals = [one for one in others if one.inside]
    elsewhere = max((other.score for other in others), default=-math.inf) > best.score + CONTRADICTION
    free = answer.estimated.parallel or answer.estimated.weakest > MAX_DEVIATION
    leverages = answer.estimated.leverages
    thin = len(leverages) <= tuning.FEW_WALLS and max(leverages["deviation"], default=0.0) > MAX_DEVIATION
    off = [float(match["offset"]) for match in best.matches if match["wall"] >= 0]
    if (
        not context.with_beams
        and len(leverages) == tuning.FEW_WALLS
        and math.sqrt(np.mean(np.square(off))) <= tuning.OFFSET_OF_FEW
    ):
        thin = False
    chances = _chances(context, explanations, models, usual_deviation)
    likely = not elsewhere and not thin
    if likely and not free and chances.careful >= tuning.USABLE_CAUTIOUS:
        numbers = features(context, answer, rivals, find_null_score(context, best))
        careful = logistic(logit(model_of(context, models), numbers))
        better = numbers["null_better"] >= tuning.MIRRORED_BETTER
        _, least = shared(context, answer, rivals)
        chances = replace(chances, careful=least * careful, asked=True, mirrored=better)
        likely = likely and not chances.mirrored
    status = Status.OK if likely and chances.careful >= tuning.USABLE_CAUTIOUS else Status.AMBIGUOUS
    if free:
        status = Status.DEGENERATE
    if chances.explained < tuning.NO_MATCH_PROBABILITY:
        status = Status.NO_MATCH
    window, pose = context.prior, answer.registered.pose
    contradicted = elsewhere or best.posterior < best.score + tuning.FAR_FROM_PRIOR
    if isinstance(window, HardPrior) and status is not Status.NO_MATCH and pose is not None:
        contradicted = contradicted or not window.contains(pose)
    return replace(
        chances,
        status=status,
        usable=status is Status.OK and explanations.search.complete and not contradicted,
        probability=None
        if status is Status.DEGENERATE
        else min(chances.right, tuning.CONTRADICTED)
        if contradicted
        else chances.right,
        contradicted=contradicted,
        margin=best.posterior - rivals[0].posterior if rivals else None,
        runner_up=max(0.0, rivals[0].posterior / best.posterior) if rivals and best.posterior > 0.0 else None,
    )


def model_of(context: SearchContext, models: Mapping[str, Document]) -> Document:
    return models["segments" if context.scan.beams is None else "ranges"]


def _chances(
    context: SearchContext, explanations: Explanations, models: Mapping[str, Document], usual_deviation: float
) -> Judged:
    """Return the chances before the search of the mirrored scan; the rest is filled in later."""
    answer = explanations.answer
    assert answer is not None
    rivals = [one for one in explanations.ranked if one is not answer.best and one.inside]
    numbers, model = features(context, answer, rivals), model_of(context, models)
    (on_map,) = model["on_map"]
    mean, least = shared(context, answer, rivals)
    return Judged(
        Status.NO_MATCH,
        False,
        0.0,
        False,
        None,
        None,
        right=logistic(logit(model, numbers) + on_map) * mean,
        careful=logistic(logit(model, numbers)) * least,
        explained=logistic(logit(model, {**numbers, "deviation": usual_deviation})),
    )
