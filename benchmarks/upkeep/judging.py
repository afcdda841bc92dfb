"""Which changes of a building the scans show, which of them are proposed, and which proposals are false."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from map_quality import Change, MapUpdate
from registration import RigidTransform, Segments
from simulation import Building, scan

from .scenes import SCANNER, Scene

LEAST_SCANS, LEAST_BEAMS = 4, 8  # a change is shown by so many scans of two visits, with so many beams each
NEAR, PARALLEL = 0.12, 0.97  # m, cosine; a proposed wall on one of today's
STEP = 0.05  # m


@dataclass(frozen=True, slots=True)
class Judged:
    """Changes of a building: all, those that scans show, and of these the ones found.

    `right` and `false` have the confidence of each proposed change.
    """

    all: int
    shown: int
    found: int
    right: tuple[float, ...] = ()
    false: tuple[float, ...] = ()

    def and_also(self, other: Judged) -> Judged:
        """Return the changes of two buildings."""
        return Judged(
            self.all + other.all,
            self.shown + other.shown,
            self.found + other.found,
            self.right + other.right,
            self.false + other.false,
        )


def outlines(building: Building) -> dict[tuple[float, ...], np.ndarray]:
    """Return the outline of each thing, by its rounded coordinates."""
    sides = [building.segments.endpoints[building.things == k] for k in range(len(building.kinds))]
    return {tuple(np.round(one, 4).ravel().tolist()): one for one in sides}


def judge(scene: Scene, poses: Sequence[tuple[str, RigidTransform]], update: MapUpdate) -> Judged:
    """Compare a proposal with what has changed; `poses` are visits and true poses of the scans."""
    before, after = outlines(scene.mapped), outlines(scene.today)
    gone = [one for key, one in before.items() if key not in after]
    new = [one for key, one in after.items() if key not in before]
    old_hits, new_hits = (_hits(walls.segments, poses) for walls in (scene.mapped, scene.today))
    shown = found = 0
    removed = {k for one in update.changes for k in one.segments if one.code in ("removed", "moved", "shortened")}
    for outline in gone:
        indices = _indices(scene.mapped.segments, outline)
        if _is_shown(indices, [(v, np.where(old < today - 0.15, hit, -1)) for (v, hit, old), (_, _, today)
                               in zip(old_hits, new_hits, strict=True)]):  # fmt: skip
            shown += 1
            found += bool(removed & set(indices))
    added = [one.new for one in update.changes if len(one.new)]
    proposed = Segments.derived(np.concatenate(added)) if added else Segments.from_array([])
    for outline in new:
        if _is_shown(_indices(scene.today.segments, outline), [(v, hit) for v, hit, _ in new_hits]):
            shown += 1
            found += any(_fraction_on(side, proposed) > 0.4 for side in outline)
    wrong = [is_false(one, scene) for one in update.changes]
    by_truth = [
        tuple(c.confidence for c, w in zip(update.changes, wrong, strict=True) if w == of) for of in (False, True)
    ]
    return Judged(len(gone) + len(new), shown, found, *by_truth)


def is_false(change: Change, scene: Scene, old: Segments | None = None) -> bool:
    """Return whether a change takes away a wall that is there, or makes one that is not; `old` is the map before it."""
    today, mapped = scene.today.segments, scene.mapped.segments if old is None else old
    kept = Segments.derived(change.new) if len(change.new) else Segments.from_array([])
    for side in mapped.endpoints[list(change.segments)]:
        lost = _on(side, today, SAME) & ~_on(side, kept, NEAR)
        if lost.sum() * STEP > 0.35:
            return True
    for side in change.new:
        wrong = ~_on(side, today, NEAR) & ~_on(side, scene.mapped.segments, SAME)
        if wrong.sum() * STEP > 0.35:
            return True
    return False


SAME = 0.01  # m; the same wall


def _hits(walls: Segments, poses: Sequence[tuple[str, RigidTransform]]) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return visit, wall and range of each beam, by scan; without noise and people."""
    from dataclasses import replace

    exact = replace(SCANNER, sigma=0.0)
    seen = [(visit, scan(walls, at, exact)) for visit, at in poses]
    return [(visit, one.hits, one.true_ranges) for visit, one in seen]


def _is_shown(indices: Sequence[int], hits: Sequence[tuple[str, np.ndarray]]) -> bool:
    scans = [visit for visit, hit in hits if np.isin(hit, indices).sum() >= LEAST_BEAMS]
    return len(scans) >= LEAST_SCANS and len(set(scans)) >= 2


def _indices(walls: Segments, outline: np.ndarray) -> list[int]:
    return [int(np.argmin(np.abs(walls.endpoints - side).max(axis=1))) for side in outline]


def _fraction_on(side: np.ndarray, walls: Segments) -> float:
    return float(_on(side, walls, NEAR).mean())


def _on(side: np.ndarray, walls: Segments, near: float) -> np.ndarray:
    """Return which points along a segment lie on a wall that faces the same way."""
    along = side[2:] - side[:2]
    length = float(np.hypot(*along))
    count = max(2, round(length / STEP))
    points = side[:2] + (np.arange(count) + 0.5)[:, None] / count * along
    if not len(walls):
        return np.zeros(count, dtype=bool)
    same = walls.take(np.flatnonzero(walls.directions @ (along / length) >= PARALLEL))
    off = points[:, None, :] - same.endpoints[None, :, :2]
    s = np.einsum("kij,ij->ki", off, same.directions)
    across = np.abs(np.einsum("kij,ij->ki", off, same.normals))
    return np.asarray(((across <= near) & (s >= -near) & (s <= same.lengths + near)).any(axis=1))
