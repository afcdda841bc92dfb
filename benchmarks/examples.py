"""Answers with what is known of them, for fitting the verdict: the ranked poses and the truth."""

from __future__ import annotations

import math
import os
import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from association import Deadline, MapIndex, Scan
from association.context import SearchContext
from association.explanations import explain_scan
from association.verdict.alternatives import compare
from association.verdict.features import Features, describe, with_null
from association.verdict.null import find_null
from association.verdict.reasons import applied
from association.verdict.verdict import findings_of
from batch import Lost, Processes
from registration import MeasuredSegments, RigidTransform, Segments
from registration.segments import Beams
from vectorization import vectorize

from .collection import Collection, Query, fold
from .outcomes import OPTIONS, offset, progress
from .queries import floor_plans, logs
from .ranges import Log
from .worlds import CONDITIONS, FAMILIES
from .worlds import Case as DrawnCase
from .worlds.measured.outcomes import share_read
from .worlds.measured.questions import in_map, questions
from .worlds.measured.tables import TOLD

Item = TypeVar("Item")

SEGMENTS, RANGES = "segments", "ranges"
DRAWN, DRAWN_STRANGERS = "drawn", "drawn out-of-map scans"
# Of each drawn world and condition, of those worlds that are fitted on.
HERE, AWAY = 48, 160
VIEWS = (360.0, 120.0, 360.0, 45.0)  # degrees; fields of view of the drawn scans, in turn
ROOM_SIZE = 4.0  # m; of every other four drawn maps, what lies so near to one place is the whole map
BLOCKS = 32  # in which cases are searched
DRAWN_DISTANCE, DRAWN_ANGLE = 0.3, 3.0  # m, degrees
LEFT_OUT = ("window",)  # a window is a prior, of which the verdict has rules of its own
# A robot off its map is in another part of its building, or in a building of the same style. Scans from another
# kind of building are recognized without a fit, and these would seem rare among them; they are reported.
EASILY_TOLD = ("other_type", "rough_other_type")


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a sequence: one item in `count`, from the one with that number on."""

    number: int
    count: int

    def of(self, items: Sequence[Item]) -> Iterator[tuple[int, Item]]:
        """Yield the items of the part, with their positions."""
        yield from islice(enumerate(items), self.number, None, self.count)


ALL = Part(0, 1)


@dataclass(frozen=True, slots=True)
class Block:
    """The work of one process at a time: a part of the cases of a form, one in `stride`."""

    form: str
    stride: int
    part: Part
    kept_for_report: bool


@dataclass(frozen=True, slots=True)
class Example:
    """An answer: what is known of it, and whether it is right.

    Attributes
    ----------
    form : str
        `SEGMENTS` or `RANGES`: how the scan was sent.
    group : str
        The kind of the scan; `DRAWN_STRANGERS` for one that was taken elsewhere.
    condition : str
        Of a drawn world; the log or level of another.
    fold : str
        It is reported on by a fit without that one.
    features, before_null : Features
        With the null score, and with the least one there is.
    among : float
        Probability of the answer among its alternatives.
    right, degenerate : bool
    told : bool
        True if the scan shows that the answer is not where it was taken, where the answer is wrong.
    vetoes : tuple of str
        That apply, in the order of the table.
    gaps, posteriors : tuple of float
        Of the alternatives: nats of evidence by which the answer is better, thing by thing, and as scored.
    """

    form: str
    group: str
    condition: str
    fold: str
    features: Features
    before_null: Features
    among: float
    right: bool
    degenerate: bool
    told: bool
    vetoes: tuple[str, ...]
    gaps: tuple[float, ...] = ()
    posteriors: tuple[float, ...] = ()

    @property
    def stranger(self) -> bool:
        """Return whether no answer is right."""
        return self.group == DRAWN_STRANGERS


@dataclass(frozen=True, slots=True)
class Case:
    """A scan to be searched in a map.

    Attributes
    ----------
    scan : Scan
    index : MapIndex
    truth : RigidTransform or None
        map_from_scan; None where it was taken elsewhere.
    distance, angle : float
        Metres and degrees that an answer may be off.
    group, condition, fold : str
        As of `Example`.
    told : callable or None
        True if a pose is one that the scan speaks against; by default any wrong one is.
    """

    scan: Scan
    index: MapIndex
    truth: RigidTransform | None
    distance: float
    angle: float
    group: str
    condition: str
    fold: str
    told: Callable[[RigidTransform], bool] | None = None

    def example(self) -> Example | None:
        """Search up to where the verdict is due; None where there is no explanation."""
        context, found = explain_scan(SearchContext.of(self.index, self.scan, None, OPTIONS, Deadline()))
        answer = found.answer
        if answer is None:
            return None
        best, pose, right = answer.best, answer.pose, False
        others = [one for one in found.others if one.inside]
        described = describe(context, best, answer.estimate, compare(context, best, others, answer.estimate.wall_sigma))
        if self.truth is not None:
            distance, angle = offset(pose, self.truth)
            right = distance < self.distance and angle < self.angle
        return Example(
            form=RANGES if context.with_beams else SEGMENTS,
            group=self.group,
            condition=self.condition,
            fold=self.fold,
            features=with_null(described, best, find_null(context, best)).features,
            before_null=described.features,
            among=described.comparison.probability,
            right=right,
            degenerate=answer.estimate.degenerate,
            told=not right and (self.told is None or self.told(pose)),
            vetoes=tuple(one.name for one in applied(findings_of(found, answer))),
            gaps=tuple(described.comparison.gaps.tolist()),
            posteriors=tuple(best.posterior - one.posterior for one in described.comparison.others),
        )


def cases(block: Block) -> Iterator[Case]:
    """Yield the cases of a block: all that may be fitted on, or the drawn worlds that are kept for reports."""
    if not block.kept_for_report:
        yield from (segment_cases if block.form == SEGMENTS else range_cases)(block.stride, block.part)
    yield from world_cases(block.form, block.stride, block.part, kept_for_report=block.kept_for_report)


def segment_cases(stride: int, part: Part = ALL) -> Iterator[Case]:
    """Yield floor plans and logs as segments, one in `stride`."""
    plans = floor_plans(stride)
    for _, query in part.of(plans.queries):
        yield _case(plans, query, query.scan, query.level)
    yield from _log_cases(stride, part, lambda _, query: query.scan)


def range_cases(stride: int, part: Part = ALL) -> Iterator[Case]:
    """Yield the logs with their raw ranges, one scan in `stride`."""
    raw: dict[str, Log] = {}

    def scan_of(log: Collection, query: Query) -> Scan:
        if log.name not in raw:
            raw[log.name] = Log.load(log.name)
        found = vectorize(raw[log.name].laser(query.number))
        return Scan(found.measured, (0.0, 0.0), found.beams)

    yield from _log_cases(stride, part, scan_of)


def _log_cases(stride: int, part: Part, scan_of: Callable[[Collection, Query], Scan]) -> Iterator[Case]:
    for log in logs(stride):
        for _, query in part.of(log.queries):
            yield _case(log, query, scan_of(log, query), "logs")


def _case(collection: Collection, query: Query, scan: Scan, group: str) -> Case:
    return Case(
        scan, collection.index(query.map), query.pose, collection.distance, collection.angle, group,
        collection.name if group == "logs" else query.level, f"{query.family}{fold(query.map)}",
    )  # fmt: skip


def world_cases(form: str, stride: int, part: Part = ALL, *, kept_for_report: bool = False) -> Iterator[Case]:
    """Yield scans of those drawn worlds that may be fitted on, or of those that may not, in all conditions."""
    worlds = [name for name, family in FAMILIES.items() if family.held_out == kept_for_report]
    left_out = LEFT_OUT if kept_for_report else (*LEFT_OUT, *EASILY_TOLD)
    conditions = [name for name in CONDITIONS if name not in left_out]
    for world in worlds:
        for condition in conditions:
            own = in_map(condition)
            numbers = [number for _, number in part.of(range(0, HERE if own else AWAY, stride))]
            for number, question in zip(numbers, questions([world], [condition], numbers), strict=True):
                scan = question.scans[form]
                told: Callable[[RigidTransform], bool] | None = _told_by(question.case)
                # Scans for the report are as a caller would send them.
                turn, kind = (0, 0) if kept_for_report else divmod(number // stride, len(VIEWS))
                index = small_map(question.case) if turn % 2 else question.index
                if VIEWS[kind] < 360.0:
                    # A view of few walls fits elsewhere, too: their probability has to count with it.
                    scan, told = narrow(scan, VIEWS[kind]), told if "sister" in condition else None
                yield Case(
                    scan, index, question.case.truth, DRAWN_DISTANCE, DRAWN_ANGLE,
                    DRAWN if own else DRAWN_STRANGERS, condition, world, told,
                )  # fmt: skip


def small_map(case: DrawnCase) -> MapIndex:
    """Return the map of a few rooms: around the truth, or around some wall where there is none.

    That no other place is similar says less there.
    """
    ends = case.map.endpoints
    begin, along = ends[:, :2], ends[:, 2:] - ends[:, :2]
    at = begin[case.number % len(ends)] if case.truth is None else np.array([case.truth.x, case.truth.y])
    part = np.clip(((at - begin) * along).sum(axis=1) / (along * along).sum(axis=1), 0.0, 1.0)
    distance = np.hypot(*(begin + part[:, None] * along - at).T)
    return MapIndex.build(Segments.from_array(ends[distance < max(ROOM_SIZE, 1.01 * float(distance.min()))]))


def narrow(scan: Scan, view: float) -> Scan:
    """Return what a laser with a field of view of some degrees shows of a scan, around its longest segment."""
    ends = scan.measured.segments.endpoints
    if not len(ends):
        return scan
    middles = 0.5 * (ends[:, :2] + ends[:, 2:]) - np.array(scan.viewpoint or (0.0, 0.0))
    bearings = np.arctan2(middles[:, 1], middles[:, 0])
    ahead = bearings[np.hypot(*(ends[:, 2:] - ends[:, :2]).T).argmax()]

    def kept(angles: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(np.cos(angles - ahead) >= math.cos(math.radians(0.5 * view)))

    beams = scan.beams
    if beams is not None:
        ahead_of_it = kept(beams.angles)
        beams = Beams(beams.angles[ahead_of_it], beams.ranges[ahead_of_it], beams.range_max)
    seen, of = kept(bearings), scan.measured
    measured = MeasuredSegments(
        Segments.derived(ends[seen]), of.sigma[seen], of.point_counts[seen], of.centroids[seen], of.spreads[seen],
        of.counted,
    )  # fmt: skip
    return replace(scan, measured=measured, beams=beams)


def _told_by(case: DrawnCase) -> Callable[[RigidTransform], bool]:
    """Return the test of whether a scan speaks against a pose: some beams do not read what the map shows there."""
    return lambda pose: share_read(case, pose) < TOLD


def examples_of(block: Block) -> list[Example]:
    """Search the cases of a block; those without an explanation are left out."""
    return [example for example in (case.example() for case in cases(block)) if example is not None]


def collected(folder: Path | None, form: str, stride: int, *, kept_for_report: bool = False) -> list[Example]:
    """Search all cases of a form with a process a core, or read what an earlier run stored in a folder.

    Parameters
    ----------
    folder : Path or None
        The folder of the answers; None: they are not stored.
    form : str
        `SEGMENTS` or `RANGES`.
    stride : int
        One case in so many is searched.
    kept_for_report : bool
        True for the drawn worlds that nothing may be fitted on.

    Raises
    ------
    RuntimeError
        When a block ended every worker that had it.
    """
    path = None if folder is None else folder / f"{'report' if kept_for_report else 'fit'}-{form}-{stride}.pickle"
    if path is not None and path.exists():
        stored: list[Example] = pickle.loads(path.read_bytes())
        return stored
    blocks = [Block(form, stride, Part(k, BLOCKS), kept_for_report) for k in range(BLOCKS)]
    found: dict[Block, list[Example]] = {}
    for block, examples in Processes(os.cpu_count() or 1).run(examples_of, blocks):
        if isinstance(examples, Lost):
            raise RuntimeError(f"lost: {block}")
        found[block] = examples
        progress(f"answers to {form}", len(found), BLOCKS)
    together = [example for block in blocks for example in found[block]]
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(together))
    return together
