"""Compare drives with their last scans alone: a drive should not lose a usable answer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from association import MapIndex, Scan
from registration import RigidTransform
from simulation import SimulationError

from ..outcomes import progress
from ..queries import logs
from ..ranges import Log
from ..table import Row, at_most
from ..worlds import FAMILIES, draw_case
from .drives import Look, before, drive, looks_of, world_looks
from .trials import NEAR, TURNED, Trial, tried, wrong_share

LENGTH = 10.0  # m
OWN = ("clean", "changed")
STRANGERS = ("sister", "other_type", "unmapped")
FORMS = ("ranges", "segments")


@dataclass(frozen=True, slots=True)
class Drive:
    """Looks of a drive, and the map to search.

    Attributes
    ----------
    looks : list of Look
        The latest first.
    index : MapIndex
    truth : RigidTransform or None
        Of the latest; None where the map does not show the place.
    seed : int
        Of the drift.
    """

    looks: list[Look]
    index: MapIndex
    truth: RigidTransform | None
    seed: int

    def scans(self, form: str) -> tuple[Scan, Scan]:
        """Return the last scan, and the drive, as ranges or as segments only."""
        looks = self.looks
        if form == "segments":
            looks = [replace(one, scan=replace(one.scan, beams=None)) for one in looks]
        return looks[0].scan, drive(looks, np.random.default_rng([self.seed, 23]))


def drives_and_last_scans(quick: int) -> list[Row]:
    """Search drives of 10 m, and the last scan of each alone: what was usable alone is not to be lost."""
    rows = []
    for what, drives in (
        ("logs", list(_in_logs(quick))),
        *((condition, list(_in_worlds(condition, quick))) for condition in (*OWN, *STRANGERS)),
    ):
        for form in FORMS if drives else ():
            alone, together = [], []
            for number, one in enumerate(drives):
                last, whole = one.scans(form)
                alone.append(tried(one.index, last, one.truth, NEAR, TURNED))
                together.append(tried(one.index, whole, one.truth, NEAR, TURNED))
                progress(f"{what}, {form}", number + 1, len(drives))
            rows += _rows(f"{what}, {form}", alone, together)
    return rows


def _rows(what: str, alone: list[Trial], together: list[Trial]) -> list[Row]:
    had = sum(one.usable and one.right for one in alone)
    lost = sum(one.usable and one.right and not drive.usable for one, drive in zip(alone, together, strict=True))
    usable = sum(one.usable for one in alone), sum(one.usable for one in together)
    wrong = [sum(one.usable and not one.right for one in some) for some in (alone, together)]
    return [
        Row(
            f"{what}: usable of {len(alone)}, alone and as drives",
            f"{usable[0]} ({wrong[0]} wrong), {usable[1]} ({wrong[1]} wrong)",
        ),
        at_most(
            f"  usable alone and right, and lost by the drive, % ({lost} of {had})", 100.0 * lost / max(1, had), 1.0
        ),
        wrong_share(together),
    ]


def _in_logs(quick: int) -> Iterator[Drive]:
    for collection in logs(5 * quick):
        log, index = Log.load(collection.name), collection.index((collection.name, collection.name))
        for query in collection.queries:
            numbers = before(log, query.number, LENGTH)
            if len(numbers) > 1:
                yield Drive(looks_of(log, numbers), index, query.pose, query.number)


def _in_worlds(condition: str, quick: int) -> Iterator[Drive]:
    for world in FAMILIES:
        for number in range(max(1, 40 // quick)):
            try:
                case = draw_case(world, condition, number)
            except (SimulationError, KeyError):
                continue
            looks = world_looks(case, LENGTH)
            if len(looks) > 1:
                yield Drive(looks, MapIndex.build(case.map), case.truth, number)
