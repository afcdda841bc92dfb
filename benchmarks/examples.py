"""Answers with what is known of them, for fitting the verdict: as far as `association.explain` goes, and the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from association import Beams, Deadline, MapIndex, Scan
from association.context import SearchContext
from association.explain import explain
from association.families import is_degenerate
from association.features import Features, features_of
from vectorization import vectorize

from .collection import Collection, MapKey, Query, fold
from .outcomes import OPTIONS, is_right, other_map, progress
from .queries import floor_plans, logs
from .ranges import Log

SEGMENTS, RANGES = "segments", "ranges"
STRANGERS = "strangers"


@dataclass(frozen=True, slots=True)
class Example:
    """An answer: what is known of it, and whether it is right.

    Attributes
    ----------
    form : str
        `SEGMENTS` or `RANGES`: how the scan was sent.
    group : str
        What kind of scan it is; `STRANGERS` for one that was searched in the map of another building.
    fold : int
        It is reported on by a fit without that one.
    features : Features
    gaps : (n,) how much less than the best the rivals are worth, nats, 0 or less
    right, degenerate : bool
    """

    form: str
    group: str
    fold: int
    features: Features
    gaps: np.ndarray
    right: bool
    degenerate: bool


@dataclass(frozen=True, slots=True)
class Case:
    """A scan to be searched in a map, its own or that of another building."""

    collection: Collection
    query: Query
    scan: Scan
    index: MapIndex
    group: str
    own: bool

    def example(self) -> Example | None:
        """Search up to where the verdict is due; None where there is no explanation."""
        context = SearchContext.of(self.index, self.scan, None, OPTIONS, Deadline())
        found = explain(context)
        if found.answer is None:
            return None
        best, rivals = found.answer.best, found.rivals
        return Example(
            form=RANGES if context.with_beams else SEGMENTS,
            group=self.group if self.own else STRANGERS,
            fold=fold(self.query.map),
            features=features_of(context, found.answer, rivals),
            gaps=np.minimum(0.0, [rival.value - best.value for rival in rivals]),
            right=self.own and is_right(found.answer.registered.pose, self.query.pose, self.collection),
            degenerate=is_degenerate(found.answer.registered),
        )


def segment_cases(stride: int) -> Iterator[Case]:
    """Yield floor plans and logs as segments, one in `stride`, and some of them in the maps of others."""
    plans = floor_plans(stride)
    away = other_map(plans)
    for k, query in enumerate(plans.queries):
        yield Case(plans, query, query.scan, plans.index(query.map), query.level, True)
        yield Case(plans, query, query.scan, plans.index(away[k]), query.level, False)
        progress(plans.name, k + 1, len(plans.queries))
    yield from _log_cases(stride, lambda _, query: query.scan)


def range_cases(stride: int) -> Iterator[Case]:
    """Yield the logs with their raw ranges, one scan in `stride`, and every fourth of them in the map of another."""
    raw: dict[str, Log] = {}

    def scan_of(log: Collection, query: Query) -> Scan:
        if log.name not in raw:
            raw[log.name] = Log.load(log.name)
        found = vectorize(raw[log.name].laser(query.number))
        return Scan(found.measured, (0.0, 0.0), Beams(found.angles, found.ranges, found.range_max))

    yield from _log_cases(stride, scan_of)


def _log_cases(stride: int, scan_of: Callable[[Collection, Query], Scan]) -> Iterator[Case]:
    of_logs = logs(stride)
    for k, log in enumerate(of_logs):
        other = of_logs[(k + 1) % len(of_logs)]
        key: MapKey = next(iter(other.maps))
        for n, query in enumerate(log.queries):
            scan = scan_of(log, query)
            yield Case(log, query, scan, log.index(query.map), "logs", True)
            if n % 4 == 0:
                yield Case(log, query, scan, other.index(key), "logs", False)
        progress(log.name, len(log.queries), len(log.queries))


def collect(cases: Iterator[Case]) -> list[Example]:
    """Search everything."""
    return [example for example in (case.example() for case in cases) if example is not None]
