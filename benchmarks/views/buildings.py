"""Drives in drawn buildings: in the map of another, and where places look alike."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from association import AssociationOptions, MapIndex, associate
from registration import RigidTransform, Segments
from simulation import SimulationError, scan

from ..drawn import SCANNER
from ..outcomes import progress
from ..table import Row, at_most, mean
from ..worlds import FAMILIES, draw_case
from .drives import could_be_told, drive, look, way_back, world_looks
from .trials import NEAR, TURNED, Trial, is_near, tried, usable_share, wrong_share

WORLDS = tuple(FAMILIES)
STRANGERS = ("sister", "other_type", "unmapped")
ALIKE = ("hotel", "mirrored_flats", "hospital", "warehouse")  # kinds of buildings that repeat themselves
MANY = AssociationOptions(max_alternatives=50)
BESIDE = 1.0  # m; where a direction is free, a place so far along it reads the same


def drives_of_strangers(quick: int) -> list[Row]:
    """Drive 5 m through drawn buildings and search the map of another: usable is wrong. And in their own, changed."""
    rows = []
    for condition in (*STRANGERS, "changed"):
        trials: dict[str, list[Trial]] = {"one view": [], "drive": []}
        told = dict.fromkeys(trials, 0)
        for world in WORLDS:
            for number in range(max(1, 60 // quick)):
                try:
                    case = draw_case(world, condition, number)
                except (SimulationError, KeyError):
                    continue
                looks, index = world_looks(case, 5.0), MapIndex.build(case.map)
                if not looks:  # something of the map is seen from the very place
                    continue
                asked = {"one view": looks[0].scan, "drive": drive(looks, np.random.default_rng([number, 3]))}
                for form, scan_of_form in asked.items():
                    trial = tried(index, scan_of_form, case.truth, NEAR, TURNED)
                    trials[form].append(trial)
                    if trial.usable and not trial.right and trial.pose is not None:
                        seen = looks[:1] if form == "one view" else looks
                        told[form] += could_be_told(seen, case.scanner, case.map, trial.pose)
                progress(f"{condition}, {world}", number + 1, max(1, 60 // quick))
        for form, some in trials.items():
            if not some:
                continue
            if condition in STRANGERS:
                usable = sum(t.usable for t in some)
                what = f"{condition}, {form}: usable where it could be told, of {len(some)} ({usable} usable in all)"
                rows.append(at_most(what, told[form] / len(some), 0.001, form=".4f"))
            else:
                rows += [usable_share(f"own map, changed, {form}", some), wrong_share(some)]
    return rows


def lookalike_drives(quick: int) -> list[Row]:
    """Drive 10 m where places look alike: usable where the drive is of one place only, and not where it is not."""
    alone: list[Trial] = []
    shared: list[Trial] = []
    for number, (segments, pose) in enumerate(_places(quick)):
        rng, index = np.random.default_rng([number, 19]), MapIndex.build(segments)
        places = way_back(segments, pose, 10.0, rng)
        looks = [look(SCANNER, scan(segments, at, SCANNER, rng).ranges, at) for at in places]
        asked = drive(looks, rng)
        found = associate(index, asked, None, MANY)
        others = [one.pose for one in found.alternatives] + ([] if found.pose is None else [found.pose])
        beside = [pose.compose(RigidTransform(x, y, 0.0)) for x, y in ((BESIDE, 0.0), (0.0, BESIDE))]
        turned = [RigidTransform(pose.x + x, pose.y + y, pose.theta) for x, y in ((BESIDE, 0.0), (0.0, BESIDE))]
        unique = all(
            is_near(other, pose, NEAR, TURNED) or could_be_told(looks, SCANNER, segments, other)
            for other in (*others, *beside, *turned)
        )
        (alone if unique else shared).append(tried(index, asked, pose, NEAR, TURNED))
        progress("drives where places look alike", number + 1, number + 1)
    return [
        usable_share("of one place only", alone, 0.95), wrong_share(alone),
        at_most(f"of several: usable of {len(shared)}", mean(t.usable for t in shared), 0.0),
    ]  # fmt: skip


def _places(quick: int) -> Iterator[tuple[Segments, RigidTransform]]:
    """Draw places in worlds that repeat themselves, in some of which a drive shows which one it is."""
    count = max(1, 20 // quick)
    for world in ALIKE:
        for number in range(5 * count):
            case = draw_case(world, "clean", number)
            yield case.scene, case.pose
