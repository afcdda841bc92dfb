"""The error of the sums after a million additions and removals: ``python -m benchmarks sums``."""

from __future__ import annotations

import numpy as np

from registration import Correspondences, JointSums, MeasuredSegments, OneStepSums, RigidTransform, Segments

from .table import Row, at_most

KEPT = 40
AROUND = 50  # pairs that come and go are in the sums together
PLACES = {"near": (0.0, 0.0), "UTM": (5e5, 5.4e6)}
Sums = JointSums | OneStepSums


def sums(changes: int) -> list[Row]:
    """Measure both estimators' sums, near the origin and at UTM's offsets, without and with a distant transient."""
    rows = []
    for kind in (JointSums, OneStepSums):
        for place, offset in PLACES.items():
            for far in (False, True):
                left = residue(kind, np.array(offset), far, changes)
                what = f"{kind.__name__}, {place}{', a pair at 1e8 m meanwhile' if far else ''}"
                rows.append(at_most(what, left, 1e-12, None, ".1e"))
    return rows


def residue(kind: type[Sums], offset: np.ndarray, far: bool, changes: int) -> float:
    """Return the largest difference from fresh sums, relative to the fresh one."""
    rng = np.random.default_rng(5)
    pairs = drawn(rng, offset)
    weights = rng.uniform(0.1, 5.0, len(pairs))
    fresh = found = kind.of_set(pairs.take(slice(0, KEPT)), weights[:KEPT])
    distant = pairs.about(np.array([1e8, -1e8]), np.array([1e8, 0.0]))
    if far:
        found = found.add(distant, 0, 1.0)
    for _ in range(changes // (2 * AROUND)):
        for i in KEPT + rng.permutation(AROUND):
            found = found.add(pairs, int(i), float(weights[i]))
        for i in KEPT + rng.permutation(AROUND):
            found = found.remove(pairs, int(i), float(weights[i]))
    if far:
        found = found.remove(distant, 0, 1.0)
    return float(np.max(np.abs(found.values - fresh.values) / np.abs(fresh.values)))


def drawn(rng: np.random.Generator, offset: np.ndarray) -> Correspondences:
    """Return pairs of a map at an offset and a noisy scan."""
    count = KEPT + AROUND
    begins = rng.uniform(-30.0, 30.0, (count, 2))
    angles = rng.uniform(-np.pi, np.pi, count)
    ends = begins + rng.uniform(1.0, 6.0, (count, 1)) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rows = np.hstack([begins, ends])
    pose = RigidTransform(3.0, -2.0, 0.4).inverse()
    seen = pose.apply(rows.reshape(-1, 2, 2)).reshape(-1, 4) + rng.normal(0.0, 0.02, rows.shape)
    scan = MeasuredSegments.from_segments(Segments.from_array(seen), 0.02)
    pairs = np.repeat(np.arange(count)[:, None], 2, axis=1)
    return Correspondences.of(Segments.from_array(rows + np.tile(offset, 2)), scan, pairs)
