"""Evidence of beams, against slow and simple references."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from association import Deadline, MapIndex
from map_quality import finished
from map_quality.update.beams import Chunks, beams_in_map, follow
from map_quality.update.evidence import gather
from map_quality.update.scans import Localized, search
from map_quality.update.tuning import DEVIATIONS, LEAST_SLANT, LEAST_TOLERANCE, THROUGH

from .hall import PILLAR, RACK, segments, visit

SIGMA = 0.005


def localized() -> list[Localized]:
    """Return scans of a hall in which the rack is gone."""
    index = MapIndex.build(segments(PILLAR, RACK), SIGMA)
    taken = visit(segments(PILLAR), "monday", 1)
    return [Localized(0, one, search(index, one, Deadline()), False) for one in taken]


def counted(chunks: Chunks, one: Localized, *, oriented: bool) -> np.ndarray:
    """Count the beams through, on and near each chunk, one beam and one wall after the other; (3, c)."""
    assert one.result.covariance is not None
    out, walls = np.zeros((3, len(chunks)), dtype=int), chunks.walls
    position = np.linalg.eigvalsh(one.result.covariance[:2, :2]).max()
    noise = np.median(one.scan.measured.sigma)
    for origin, ray, reach in zip(*beams_in_map(one), strict=True):
        met = []
        for k in range(len(walls)):
            slant, begin = ray @ walls.normals[k], walls.endpoints[k, :2]
            distance = (walls.offsets[k] - origin @ walls.normals[k]) / slant
            at = (origin + distance * ray - begin) @ walls.directions[k]
            if abs(slant) < LEAST_SLANT or distance <= 0.0 or not 0.0 <= at <= walls.lengths[k]:
                continue
            deviation = math.sqrt(noise**2 + SIGMA**2 + position + one.result.covariance[2, 2] * distance**2)
            tolerance, gap = max(LEAST_TOLERANCE, DEVIATIONS * deviation), (reach - distance) * abs(slant)
            deep = at + THROUGH * tolerance / abs(slant) * (ray @ walls.directions[k])
            chunk = chunks.first[k] + min(int(at / walls.lengths[k] * chunks.counts[k]), chunks.counts[k] - 1)
            near = abs(gap) <= tolerance and (slant < 0.0 or not oriented)
            out[0, chunk] += gap > THROUGH * tolerance and 0.0 <= deep <= walls.lengths[k]
            met.append((chunk, gap, tolerance, near))
        nearest = min((abs(gap) for _, gap, _, near in met if near), default=math.inf)
        for chunk, gap, tolerance, near in met:
            ended = near and abs(gap) == nearest
            out[1, chunk] += ended
            out[2, chunk] += abs(gap) <= tolerance and not ended
    return out


def test_beams_are_counted_as_one_by_one() -> None:
    chunks = Chunks.of(segments(PILLAR, RACK))
    for one in localized():
        for oriented in (False, True):
            seen, expected = (
                follow(chunks, one, SIGMA, Deadline(), oriented=oriented),
                counted(chunks, one, oriented=oriented),
            )
            assert seen.chunks.tolist() == np.flatnonzero(expected.sum(axis=0)).tolist()
            assert np.array_equal(seen.counts.T, expected[:, seen.chunks])
            assert expected.any(axis=1).all()


def test_a_scan_sees_a_wall_if_a_beam_meets_it_and_any_wall_if_its_pose_is_not_known() -> None:
    walls = segments(PILLAR, RACK, [[13.5, 2.0, 13.5, 3.0]])
    one = localized()[0]
    lost = replace(one, result=replace(one.result, covariance=None))
    evidence = finished(gather(walls, [one, lost], {one}, SIGMA, Deadline(), oriented=True))
    first = evidence.chunks.first
    saw = [evidence.seen_by(np.arange(first[wall], first[wall + 1])).tolist() for wall in (0, 16, 20)]
    assert saw == [[True, True], [True, True], [False, True]]
    silent = finished(gather(walls, [one], set(), SIGMA, Deadline(), oriented=True))
    assert (len(evidence.chunk) > 0, len(silent.chunk)) == (True, 0)
