"""Explain a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from association import (
    AnswerExplanation,
    AssociationOptions,
    AssociationResult,
    Deadline,
    KnownOfMaps,
    MapIndex,
    Prior,
    Scan,
    VerdictExplanation,
    explain_verdict,
)
from registration import Segments
from vectorization import LaserScan

from .driving import search_drive
from .locating import prepared, scan_of
from .ranges import MountedScan

if TYPE_CHECKING:
    from formats import ImportedMap, LineMap


@dataclass(frozen=True, slots=True)
class Explanation:
    """An answer, and how its verdict came about.

    Attributes
    ----------
    result : AssociationResult
        As `locate` returns it.
    verdict : VerdictExplanation
        On the scan as a whole.
    last_view : VerdictExplanation or None
        On the last view of a drive alone, if it was searched.
    """

    result: AssociationResult
    verdict: VerdictExplanation
    last_view: VerdictExplanation | None


def explain(
    map: MapIndex | LineMap | ImportedMap | Segments | ArrayLike,
    scan: Scan | MountedScan | LaserScan | Segments | ArrayLike,
    angles: tuple[float, float] | None = None,
    *,
    prior: Prior | None = None,
    options: AssociationOptions | None = None,
    deadline: Deadline | None = None,
) -> Explanation:
    """Locate a scan, and return how the verdict on the answer came about, number by number.

    Parameters
    ----------
    map, scan, angles, prior, options, deadline
        As of `locate`.

    Returns
    -------
    Explanation
        `result` is the answer of `locate`. `verdict` has the features with their contributions, the alternatives with
        their weights, the null score, each veto, the probabilities and their thresholds. `last_view` is that of the
        last view of a drive, if that was searched alone.

    Raises
    ------
    InputError
        When map, scan or options are not valid; the message names the argument.

    Examples
    --------
    Of two equal rooms each explains the scan:

    >>> import linefix
    >>> room = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
    >>> other = [[x1 + 9, y1, x2 + 9, y2] for x1, y1, x2, y2 in room]
    >>> seen = [[-1, 1, -1, -5], [-1, -5, 1, -5], [1, -5, 1, -3], [1, -3, 4, -3], [4, -3, 4, 1], [4, 1, -1, 1]]
    >>> verdict = linefix.explain(room + other, seen).verdict
    >>> verdict.usable, [reason.code for reason in verdict.reasons]
    (False, ['similar_place'])
    >>> len(verdict.alternatives), round(verdict.among, 3)
    (1, 0.5)
    """
    index, how = prepared(map, options)
    return explain_search(index, scan_of(scan, angles), KnownOfMaps(prior), how, deadline)


def explain_search(
    index: MapIndex, scan: Scan, known: KnownOfMaps, options: AssociationOptions, deadline: Deadline | None
) -> Explanation:
    """Search a scan on one map as `linefix.associate`, and return how the verdict came about."""
    found: list[AnswerExplanation] = []

    def search(seen: Scan) -> AssociationResult:
        found.append(explain_verdict(index, seen, known.prior, options, deadline))
        return found[-1].result

    result = search_drive(search, scan)
    return Explanation(result, found[0].verdict, found[1].verdict if len(found) > 1 else None)
