"""Compiling, or loading from the cache, the kernels for which the first request would otherwise wait."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from association import (
    AssociationOptions,
    Deadline,
    HardPrior,
    KnownOfMaps,
    MapIndex,
    MapPart,
    MapPoints,
    MapSet,
    Scan,
    SoftPrior,
    View,
    assemble,
    associate,
    associate_on_maps,
)
from map_quality import Analysis, Robot, check_map, standing_places, try_sample
from registration import (
    IDENTITY,
    Beams,
    Correspondences,
    MeasuredSegments,
    OneStepSums,
    RegistrationOptions,
    Segments,
    register,
)
from simulation import scan
from simulation.worlds import outline
from vectorization import LaserScan, vectorize

# A room with a niche, seen from inside: free space on the left of every wall. And another, symmetric about an axis.
ROOM = outline([(-4.0, -3.0), (4.0, -3.0), (4.0, 1.0), (2.5, 1.0), (2.5, 3.0), (-4.0, 3.0)])
_HALF = [(4.0, -3.0), (4.0, 3.0), (1.0, 3.0), (1.0, 1.5)]
SYMMETRIC_ROOM = outline([(-4.0, -3.0), *_HALF, *((-x, y) for x, y in _HALF[:0:-1])])
THINGS = np.array([[1.0, 2.0], [-2.0, 1.0]])  # too small for walls
TURN = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def warm_up() -> None:
    """Register, vectorize, associate, check and analyze a map once in each way that has kernels of its own."""
    warm_up_second_half()
    warm_up_searching()
    warm_up_analyzing()


def warm_up_second_half() -> None:
    """Compile other kernels than those of the search, so that two processes seldom meet at the same kernel."""
    warm_up_registering()
    warm_up_vectorizing()
    warm_up_simulating()


def warm_up_analyzing() -> None:
    """Check a map, alone and by samples, and look from its places, once."""
    room = Segments.from_array(ROOM)
    index, robot = MapIndex.build(room, 0.0), Robot(beams=360)
    check_map(index)
    for sample in (_with_beams(), Scan(MeasuredSegments.from_segments(room.take([0])))):
        try_sample(index, sample, Deadline(), oriented=True)
    analysis = Analysis(index, room, robot, standing_places(room, robot, 3.0))
    for number in range(len(analysis.standing.poses)):
        analysis.look(number)


def warm_up_simulating() -> None:
    """Take a scan of a map."""
    scan(Segments.from_array(ROOM), IDENTITY, Robot(beams=360).scanner, np.random.default_rng(0))


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


def warm_up_searching() -> None:
    """Associate once in each way that has kernels of its own."""
    room, symmetric = Segments.from_array(ROOM), Segments.from_array(SYMMETRIC_ROOM)
    index, with_things = (MapIndex.build(room, 0.0, points=MapPoints.of(some)) for some in (THINGS[:0], THINGS))
    for seen in _scans():
        associate(index, seen)
        associate(with_things, seen, SoftPrior(IDENTITY, np.eye(3)))
    window = HardPrior(IDENTITY, 1.0, 1.0)
    associate(index.undirected, _scans()[0], window, AssociationOptions(oriented=False))
    associate(index, _scans()[0], None, AssociationOptions(estimator="one_step"))
    # The mirrored scan is found as well; a map that is not to scale states no sigma.
    for other in (MapIndex.build(symmetric, 0.0), MapIndex.build(Segments.from_array(1.02 * SYMMETRIC_ROOM))):
        associate(other, Scan(MeasuredSegments.from_segments(symmetric)))
    maps = MapSet({"room": MapPart(room, 0.0), "symmetric": MapPart(symmetric, 0.0)})
    for known in (KnownOfMaps(), KnownOfMaps(window, "room", {"room": 0.5})):
        associate_on_maps(maps, _with_beams(), known)


def _scans() -> list[Scan]:
    """Return scans in each form that has kernels of its own."""
    room = Segments.from_array(ROOM)
    whole = Scan(MeasuredSegments.from_segments(room))
    drive = [View(_with_beams()), View(_with_beams(), IDENTITY, 1e-4 * np.eye(3))]
    return [
        whole,
        _with_beams(),
        replace(whole, viewpoint=None),
        assemble([View(whole), View(whole, IDENTITY, 1e-4 * np.eye(3))]),
        assemble(drive),
        Scan(MeasuredSegments.from_segments(room.take([0]))),
        Scan(MeasuredSegments.from_segments(room.take([]))),
    ]


def _with_beams() -> Scan:
    """Return the room as a laser in its middle sees it."""
    beams = Beams(TURN, room_ranges(TURN), 30.0)
    return Scan(MeasuredSegments.from_segments(Segments.from_array(ROOM)), (0.0, 0.0), beams)


def room_ranges(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance from the origin to the room's walls along each angle, metres."""
    x, y, ex, ey = (*ROOM[:, :2].T[:, :, None], *(ROOM[:, 2:] - ROOM[:, :2]).T[:, :, None])
    cross = np.cos(angles) * ey - np.sin(angles) * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        along, fraction = (x * ey - y * ex) / cross, (x * np.sin(angles) - y * np.cos(angles)) / cross
    hit = (np.abs(cross) > 1e-12) & (along > 0.0) & (fraction >= 0.0) & (fraction <= 1.0)
    nearest: NDArray[np.float64] = np.where(hit, along, np.inf).min(axis=0)
    return nearest
