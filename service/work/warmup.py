"""Compiling, or loading from the cache, the kernels for which the first request would otherwise wait."""

from __future__ import annotations

import os
import threading

import numpy as np

from association import (
    AssociationOptions,
    Deadline,
    HardPrior,
    MapIndex,
    Prior,
    Scan,
    SoftPrior,
    View,
    assemble,
    associate,
)
from association.consensus.sight import missing_segments
from association.consensus.similarity import fit_similarity
from association.context import SearchContext
from association.layout import FOUND
from association.rank_and_estimate import estimate_at
from association.search.branch_and_bound import match_points
from association.verdict.chance import symmetry_of
from association.verdict.inconsistencies import absences
from association.verdict.verdict import judge
from map_quality import Analysis, Robot, check_map, standing_places, try_sample
from map_quality.analyze.standing import is_free
from registration import (
    IDENTITY,
    Beams,
    Correspondences,
    MeasuredSegments,
    OneStepSums,
    RegistrationOptions,
    RigidTransform,
    Segments,
    register,
)
from simulation import scan
from vectorization import LaserScan, vectorize

# A room with a niche, seen from inside: free space on the left of every wall.
ROOM = np.array(
    [
        [-4.0, -3.0, 4.0, -3.0],
        [4.0, -3.0, 4.0, 1.0],
        [4.0, 1.0, 2.5, 1.0],
        [2.5, 1.0, 2.5, 3.0],
        [2.5, 3.0, -4.0, 3.0],
        [-4.0, 3.0, -4.0, -3.0],
    ]
)
# As another, but symmetric about an axis: seen from there, the mirrored scan is found as well.
SYMMETRIC_ROOM = np.array(
    [
        [-4.0, -3.0, 4.0, -3.0],
        [4.0, -3.0, 4.0, 3.0],
        [4.0, 3.0, 1.0, 3.0],
        [1.0, 3.0, 1.0, 1.5],
        [1.0, 1.5, -1.0, 1.5],
        [-1.0, 1.5, -1.0, 3.0],
        [-1.0, 3.0, -4.0, 3.0],
        [-4.0, 3.0, -4.0, -3.0],
    ]
)


STANDARD_INPUT = 0
TURN = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def warm_up() -> None:
    """Register, vectorize, associate, check and analyze a map once in each way that has kernels of its own."""
    warm_up_registering()
    warm_up_vectorizing()
    warm_up_searching()
    warm_up_analyzing()
    room = Segments.from_array(ROOM)
    index = MapIndex.build(room, 0.0)
    for sample in (_with_beams(), _one_wall()):
        try_sample(index, sample, Deadline(), oriented=True)


def warm_up_first_half() -> None:
    """Compile about half of the kernels: those of the search and of the analysis of maps."""
    warm_up_searching()
    warm_up_analyzing()


def warm_up_second_half() -> None:
    """Compile the other kernels, in an order in which the two halves seldom meet at the same kernel."""
    warm_up_indexing()
    warm_up_registering()
    warm_up_vectorizing()
    warm_up_explaining()
    warm_up_simulating()


def warm_up_analyzing() -> None:
    """Check a map, and look from its places, once."""
    room = Segments.from_array(ROOM)
    index, robot = MapIndex.build(room, 0.0), Robot(beams=360)
    check_map(index)
    analysis = Analysis(index, room, robot, standing_places(room, robot, 3.0))
    for number in range(len(analysis.standing.poses)):
        analysis.look(number)


def warm_up_simulating() -> None:
    """Take a scan of a map, from where a robot can stand."""
    room, pose, robot = Segments.from_array(ROOM), IDENTITY, Robot(beams=360)
    assert is_free(room, pose, robot.range_max, oriented=True)
    scan(room, pose, robot.scanner, np.random.default_rng(0))


def warm_up_registering() -> None:
    """Register once in each way that has kernels of its own."""
    room = Segments.from_array(ROOM)
    pairs = np.repeat(np.arange(len(room))[:, None], 2, axis=1)
    for options in (
        RegistrationOptions(),
        RegistrationOptions(weighting="uniform"),
        RegistrationOptions(estimator="one_step", rotation="mitsuta", oriented=False),
        RegistrationOptions(estimator="one_step", evaluate_at=IDENTITY),
    ):
        register(room, MeasuredSegments.from_segments(room), pairs, 0.0, options)
    # No request needs it, but kernels count as compiled once something of each module is cached.
    one_by_one = Correspondences.of(room, MeasuredSegments.from_segments(room), pairs)
    assert OneStepSums.of_set(one_by_one, np.ones(len(pairs))).reliability > 0.0


def warm_up_vectorizing() -> None:
    """Vectorize once in each way that has kernels of its own."""
    ranges = room_ranges(TURN)
    vectorize(LaserScan(-np.pi, TURN[1] - TURN[0], ranges, 0.1, 30.0))
    points = np.stack([ranges * np.cos(TURN), ranges * np.sin(TURN)], axis=1)
    vectorize(points)
    vectorize(points, viewpoint=None)


def warm_up_indexing() -> None:
    """Index a map."""
    MapIndex.build(Segments.from_array(ROOM), 0.0)


def warm_up_explaining() -> None:
    """Compute the answer to scans at a given pose, without a search, and the results that are derived from it."""
    index = MapIndex.build(Segments.from_array(ROOM), 0.0)
    for seen, prior, options in _asked():
        context = SearchContext.of(index, seen, prior, options, Deadline())
        answer = estimate_at(context, RigidTransform(0, 0, 0)).answer
        assert answer is not None
        missing_segments(context, answer.best)
        symmetry_of(context, answer.best, answer.best)
        fit_similarity(context, answer.best)
    # It is nothing that would have to stand up to a null, which costs a search.
    context = SearchContext.of(index, _one_wall(), None, AssociationOptions(), Deadline())
    assert not judge(context, estimate_at(context, RigidTransform(0, 0, 0))).usable


def warm_up_searching() -> None:
    """Associate once in each way that has kernels of its own."""
    index = MapIndex.build(Segments.from_array(ROOM), 0.0)
    for seen, prior, options in _asked():
        associate(index, seen, prior, options, Deadline())
    context = SearchContext.of(index, _with_beams(), None, AssociationOptions(), Deadline())
    answer = estimate_at(context, RigidTransform(0, 0, 0)).answer
    assert answer is not None
    absences(context, answer.best, [answer.best])
    match_points(context, np.zeros(0, FOUND), np.zeros(0, FOUND))
    symmetric = Segments.from_array(SYMMETRIC_ROOM)
    alone = Scan(MeasuredSegments.from_segments(symmetric), (0.0, 0.0))
    associate(MapIndex.build(symmetric, 0.0), alone, None, AssociationOptions(), Deadline())
    # This map, which is not to scale, states no sigma.
    too_large = Segments.from_array(1.02 * SYMMETRIC_ROOM)
    associate(MapIndex.build(too_large), alone, None, AssociationOptions(), Deadline())


def _asked() -> list[tuple[Scan, Prior | None, AssociationOptions]]:
    """Return the scan, the prior and the options of requests in each way that has kernels of its own."""
    measured, pose = MeasuredSegments.from_segments(Segments.from_array(ROOM)), RigidTransform(0, 0, 0)
    views = assemble([View(Scan(measured)), View(Scan(measured), pose, 1e-4 * np.eye(3))])
    return [
        (Scan(measured), None, AssociationOptions()),
        (_with_beams(), SoftPrior(pose, np.eye(3)), AssociationOptions()),
        (Scan(measured, None), HardPrior(pose, 1.0, 1.0), AssociationOptions(oriented=False)),
        (views, None, AssociationOptions()),
    ]


def _with_beams() -> Scan:
    """Return the room as a laser in its middle sees it."""
    beams = Beams(TURN, room_ranges(TURN), 30.0)
    return Scan(MeasuredSegments.from_segments(Segments.from_array(ROOM)), (0.0, 0.0), beams)


def _one_wall() -> Scan:
    """Return a scan that is never usable, so that mistakes of the map are looked for."""
    return Scan(MeasuredSegments.from_segments(Segments.from_array(ROOM).take([0])))


def room_ranges(angles: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the distance from the origin to the room's walls along each angle, metres."""
    nearest = np.full(len(angles), np.inf)
    for x1, y1, x2, y2 in ROOM:
        ex, ey = x2 - x1, y2 - y1
        cross = np.cos(angles) * ey - np.sin(angles) * ex
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (x1 * ey - y1 * ex) / cross
            share = (x1 * np.sin(angles) - y1 * np.cos(angles)) / cross
        hit = (np.abs(cross) > 1e-12) & (along > 0.0) & (share >= 0.0) & (share <= 1.0)
        nearest = np.where(hit, np.minimum(nearest, along), nearest)
    return nearest


def _end_with_the_other() -> None:
    """End when the parent process has ended and so closed this one's standard input, however that went."""
    while os.read(STANDARD_INPUT, 1):
        pass
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_end_with_the_other, daemon=True).start()
    warm_up_second_half()
