"""The usual scan searched, explained and judged in one compiled call: objects are made of what it wrote, as asked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from registration.layout import Records
from registration.values import value

from .answering_tables import Answering, Told
from .candidates import Begun, Candidates, Effort, orders_of, segments_of_bases
from .context import SearchContext
from .explanations import Weighing
from .layout import JUDGED
from .models import MODELS, USUAL
from .ranking import Ranked
from .scan_lines import variances_of
from .settling import Settled
from .significance import EXPONENTS
from .tuning import KEPT, KEPT_SLIDES, LATE_CROWD, LEAST_DISTINCT, NULL_SAMPLES, RANKED_AT_ONCE


@value(frozen=True, slots=True)
class AtOnce:
    """What came of it.

    Attributes
    ----------
    ranked : sequence of Ranked
    settled : Settled
        The best of them.
    agreement, significance : float
        Of the best, as in `Answer`.
    weighing : Weighing or None
        None where it has to be judged step by step.
    """

    ranked: Sequence[Ranked]
    settled: Settled
    agreement: float
    significance: float
    weighing: Weighing | None


class RankedRecords(Sequence[Ranked]):
    """Explanations as a kernel wrote them, best first, each made an object when somebody asks for it.

    Parameters
    ----------
    estimates : (k,) of `ESTIMATE`
    merits : (k,) of `MERIT`
    matches : (k, n) of `MATCH`
    """

    def __init__(self, estimates: Records, merits: Records, matches: Records) -> None:
        self._records = estimates, merits, matches
        self._made: dict[int, Ranked] = {}

    def __len__(self) -> int:
        return len(self._records[0])

    @overload
    def __getitem__(self, place: int) -> Ranked: ...

    @overload
    def __getitem__(self, place: slice) -> Sequence[Ranked]: ...

    def __getitem__(self, place: int | slice) -> Ranked | Sequence[Ranked]:
        if isinstance(place, slice):
            return [self[k] for k in range(*place.indices(len(self)))]
        k = range(len(self))[place]
        if k not in self._made:
            estimates, merits, matches = self._records
            merit = merits[k].item()
            self._made[k] = Ranked.of(estimates[k : k + 1], merit, matches[k], value=merit[0], inside=True)
        return self._made[k]


def is_plain(context: SearchContext) -> bool:
    """Tell whether one call may answer: a scan from one place, segments alone, and nothing known before.

    And neither late, nor so much at one place that the clock has to be looked at while poses are scored.
    """
    scan, index = context.scan, context.index
    if scan.beams is not None or scan.views is not None or context.prior is not None or context.deadline.passed:
        return False
    tests = (KEPT + KEPT_SLIDES) * len(context.lines.rows) * max(1.0, index.crowd)
    return 0 < tests <= RANKED_AT_ONCE and index.crowd <= LATE_CROWD


def answer_at_once(context: SearchContext) -> tuple[Candidates, AtOnce | None]:
    """Return what a search found, and what came of it; None of nothing, and where the search went on beyond the call.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    begun = Begun.of(context, Effort.of(context))
    given = given_of(context)
    stopped, plan = begun.search(context, given)
    candidates = begun.go_on(context, stopped, plan)
    told = given.told
    if plan is not None:
        return candidates, None
    stage, count, walls = told.reached.item()
    if not count:
        return candidates, None
    *_, agreement, _, _, significance, _, _ = told.facts.item()
    return candidates, AtOnce(
        ranked=RankedRecords(told.estimates[:count], told.merits[:count], told.matches[:count]),
        settled=Settled.of(told.settled.item(), told.hinges[:walls]),
        agreement=agreement,
        significance=significance,
        weighing=Weighing(told.chances, told.features) if stage == JUDGED else None,
    )


def given_of(context: SearchContext) -> Answering:
    """Return what the kernel goes by beside the search."""
    index, scan, lines, options = context.index, context.scan, context.lines, context.options
    n, most = len(lines.rows), max(LEAST_DISTINCT, options.max_alternatives + 1)
    assert lines.given is not None  # of a scan from one place
    return Answering(
        context.sights,
        lines.sightings,
        context.known_walls,
        index.wall_lengths,
        context.gates,
        EXPONENTS,
        lines.given,
        variances_of(index.sigma or 0.0, options, with_beams=False)[0],
        *orders_of(segments_of_bases(n), NULL_SAMPLES),
        MODELS["probability"].odds,
        MODELS["cautious"].odds,
        USUAL.deviation,
        scan.measured.counted,
        index.sigma is None and options.estimator == "joint",
        Told.room(1, most, n),
    )
