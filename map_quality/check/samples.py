"""Search a sample scan in a map as both are, and under each hypothesis of what may be wrong with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

from association import (
    AssociationOptions,
    AssociationResult,
    Deadline,
    IndexingEndedError,
    MapIndex,
    Scan,
    associate,
    mirrored,
    turned_round,
)
from registration import RigidTransform

from . import tuning

Mistake = Literal["mirrored", "reversed"]
UNDONE: Mapping[Mistake | None, Callable[[Scan], Scan]] = {
    None: lambda scan: scan,
    "mirrored": mirrored,
    "reversed": turned_round,
}
"""The change of a scan that undoes each mistake."""
OPTIONS = AssociationOptions(max_alternatives=0, confidence=tuning.CONFIDENCE, on_map=1.0)  # under a hypothesis


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """An assumption about a map and its scans.

    Attributes
    ----------
    oriented : bool
        True when directions mean something.
    sigma : float or None
        Of the map's lines, metres.
    mistake : Mistake or None
        That all scans were sent with.
    """

    oriented: bool
    sigma: float | None
    mistake: Mistake | None = None


def score_of(result: AssociationResult) -> float:
    """Return the score of an answer, nats; 0 where nothing fits."""
    return 0.0 if result.diagnostics is None else max(0.0, result.diagnostics.score)


@dataclass(frozen=True, slots=True)
class Sample:
    """Results for one scan.

    Attributes
    ----------
    result : AssociationResult
        In the map as it is.
    trials : dict of Hypothesis to AssociationResult
        As far as there was time; that of `result` is always among them.
    moved : RigidTransform or None
        From its stated pose to the pose where it was found, in the map frame. None where either is not known.
    """

    result: AssociationResult
    trials: Mapping[Hypothesis, AssociationResult]
    moved: RigidTransform | None


def try_sample(
    index: MapIndex, scan: Scan, deadline: Deadline, *, oriented: bool, said: RigidTransform | None = None
) -> Sample:
    """Search a scan in a map as both are, and under each hypothesis.

    Parameters
    ----------
    index : MapIndex
        Built with its directions, whatever they mean; its sigma is the map's.
    scan : Scan
    deadline : Deadline
        A trial that does not fit before it is skipped.
    oriented : bool
        True when the map states that directions mean something.
    said : RigidTransform, optional
        Pose of the scan as its sender states it, map_from_scan.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    IndexingEndedError
        When it passed before the map was indexed without its directions.
    """
    if not oriented:
        index.undirected_by(deadline)  # the search takes it from there
    result = associate(index, scan, None, AssociationOptions(oriented=oriented, on_map=1.0), deadline)
    trials = {Hypothesis(oriented, index.sigma): result}
    # In another unit no hypothesis but that of the scale says anything, and searches take seconds.
    for one in hypotheses(oriented, index.sigma) if index.diagonal <= tuning.LARGEST else ():
        if not deadline.passed:
            with suppress(IndexingEndedError):
                place = replace(index if one.oriented else index.undirected_by(deadline), sigma=one.sigma)
                options = replace(OPTIONS, oriented=one.oriented)
                trials[one] = associate(place, UNDONE[one.mistake](scan), None, options, deadline)
    moved = None if said is None or not result.usable or result.pose is None else result.pose.compose(said.inverse())
    return Sample(result, trials, moved)


def hypotheses(oriented: bool, sigma: float | None) -> Iterator[Hypothesis]:
    """Yield the hypotheses that a scan is tried with, except the one that map and scan are right."""
    for directed in (True, False) if oriented else (False,):
        for other in (sigma, *tuning.SIGMAS):
            if (directed, other) != (oriented, sigma):
                yield Hypothesis(directed, other)
    mistakes: tuple[Mistake, ...] = ("mirrored", "reversed") if oriented else ("mirrored",)
    for mistake in mistakes:
        for other in dict.fromkeys((sigma, tuning.WIDEST)):
            yield Hypothesis(oriented, other, mistake)
