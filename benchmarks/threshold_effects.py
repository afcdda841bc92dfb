"""A sample of scans, answered with a threshold as it is and moved, and what differs."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest

import numpy as np

from association import AssociationResult, HardPrior, MapIndex, Prior, SoftPrior, associate
from registration import RigidTransform

from .examples import RANGES, SEGMENTS, Case, range_cases, segment_cases, world_cases
from .outcomes import OPTIONS, offset
from .table import print_table
from .thresholds import Threshold

MOVED = (0.8, 1.2)
SLOWEST = 0.2  # s; scans that take longer are left out of the sample
SAME_POSE = 1e-6  # m, rad; poses that differ by less are equal
STRIDES = {SEGMENTS: 16, RANGES: 16}
STEP = 3  # one case in three of the four kinds in turn: some of each kind


@dataclass(frozen=True, slots=True)
class Told:
    """The part of an answer that is compared, and whether it is right."""

    status: str
    usable: bool
    pose: RigidTransform | None
    probability: float | None
    right: bool


@dataclass(frozen=True, slots=True)
class Effect:
    """The difference that a moved threshold makes.

    Attributes
    ----------
    changed : int
        Answers with another status, flag, pose or probability.
    right, usable, wrong : int
        By how many more answers are right; usable; usable and wrong.
    time : float
        Of all answers over that with the thresholds as they are.
    failed : str
        The error, where the value is not possible; else empty.
    """

    changed: int = 0
    right: int = 0
    usable: int = 0
    wrong: int = 0
    time: float = 1.0
    failed: str = ""


@dataclass(frozen=True, slots=True)
class Sampled:
    """A case with a prior, and its number in the order in which cases are drawn."""

    case: Case
    prior: Prior | None
    number: int

    @property
    def with_beams(self) -> bool:
        """Return whether the scan comes with its ranges."""
        return self.case.scan.beams is not None

    def answer(self, *, index_again: bool = False) -> Told:
        """Search the scan; with `index_again`, index the map before."""
        index = self.case.index
        if index_again:
            index = MapIndex.build(index.segments, index.sigma, oriented=len(index.segments) == index.directed)
        return self._told(associate(index, self.case.scan, self.prior, OPTIONS))

    def _told(self, result: AssociationResult) -> Told:
        right = False
        if self.case.truth is not None and result.pose is not None:
            distance, angle = offset(result.pose, self.case.truth)
            right = distance < self.case.distance and angle < self.case.angle
        return Told(str(result.status), result.usable, result.pose, result.probability, right)


def sample(count: int) -> list[Sampled]:
    """Return scans of plans, logs and drawn worlds, half of them as segments and half as ranges, some with a prior.

    Scans that take longer than `SLOWEST` are left out, so that all thresholds can be moved.
    """
    found: dict[bool, list[Sampled]] = {False: [], True: []}
    for one in draw():
        same = found[one.with_beams]
        if len(same) < (count + 1) // 2:
            one.answer()
            if timed([one])[1] <= SLOWEST:
                same.append(one)
        if len(found[False]) + len(found[True]) >= count:
            break
    return sorted((*found[False], *found[True]), key=lambda one: one.number)


def sample_of(numbers: Sequence[int]) -> list[Sampled]:
    """Return the scans with some numbers, in ascending order: the same in any process."""
    wanted = set(numbers)
    return [one for one in islice(draw(), max(wanted) + 1) if one.number in wanted]


def draw() -> Iterator[Sampled]:
    """Yield scans of all kinds in turn."""
    kinds: list[Iterator[Case]] = [
        segment_cases(STRIDES[SEGMENTS]),
        range_cases(STRIDES[RANGES]),
        world_cases(SEGMENTS, 128, kept_for_report=True),
        world_cases(RANGES, 128, kept_for_report=True),
    ]
    some_of_each = (islice(cases, 0, None, STEP) for cases in kinds)
    mixed = (case for some in zip_longest(*some_of_each) for case in some if case is not None)
    for number, case in enumerate(mixed):
        yield Sampled(case, _prior(case, number), number)


def _prior(case: Case, number: int) -> Prior | None:
    """Return no prior for two scans of three; for the others one that is right or wrong, soft or a window."""
    if case.truth is None or number % 3:
        return None
    near = RigidTransform(case.truth.x + 0.3, case.truth.y - 0.2, case.truth.theta + 0.1)
    far = RigidTransform(case.truth.x + 4.0, case.truth.y, case.truth.theta + 1.0)
    pose = far if number % 4 == 0 else near
    if number % 2:
        return SoftPrior(pose, np.diag([0.25, 0.25, 0.04]))
    return HardPrior(pose, 1.5, 0.5)


def timed(some: Sequence[Sampled], *, index_again: bool = False) -> tuple[list[Told], float]:
    """Answer some scans; return the answers, and the processor time of all, seconds."""
    began = time.process_time()
    answers = [one.answer(index_again=index_again) for one in some]
    return answers, time.process_time() - began


def effect_of(before: Sequence[Told], after: Sequence[Told], ratio: float) -> Effect:
    """Compare the answers of one sample."""
    pairs = list(zip(before, after, strict=True))
    return Effect(
        sum(_differ(a, b) for a, b in pairs),
        sum(b.right - a.right for a, b in pairs),
        sum(b.usable - a.usable for a, b in pairs),
        sum((b.usable and not b.right) - (a.usable and not a.right) for a, b in pairs),
        ratio,
    )


def _differ(one: Told, other: Told) -> bool:
    if (one.status, one.usable) != (other.status, other.usable) or (one.pose is None) != (other.pose is None):
        return True
    if (one.probability is None) != (other.probability is None):
        return True
    if abs((one.probability or 0.0) - (other.probability or 0.0)) > SAME_POSE:
        return True
    if one.pose is None or other.pose is None:
        return False
    away = math.hypot(one.pose.x - other.pose.x, one.pose.y - other.pose.y)
    return away > SAME_POSE or abs(one.pose.theta - other.pose.theta) > SAME_POSE


def print_effects(title: str, found: Sequence[tuple[Threshold, list[Effect]]]) -> None:
    """Print a table of thresholds, those that change most first."""
    rows = []
    for threshold, both in sorted(found, key=lambda one: -max(effect.changed for effect in one[1])):
        place = threshold.module.removeprefix("association.").removesuffix("tuning").strip(".") or "association"
        cells = [f"{place}.{threshold.name}", str(threshold.value)]
        for one in both:
            if one.failed:
                cells += [one.failed[:40], ""]
            else:
                cells += [f"{one.changed}: {one.right:+d} {one.usable:+d} {one.wrong:+d}", f"{one.time:.2f}"]
        rows.append(cells)
    columns = (
        "threshold",
        "value",
        "x 0.8 changed: right usable wrong",
        "time",
        "x 1.2 changed: right usable wrong",
        "time",
    )
    print_table(title, columns, rows)
