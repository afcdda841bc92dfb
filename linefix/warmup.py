"""Compiling, or loading from the cache, the kernels for which the first request would otherwise wait."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import map_quality
import simulation
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
from registration import IDENTITY, Beams, MeasuredSegments, RegistrationOptions, Segments, register
from vectorization import LaserScan, vectorize

# A convex room, and the ranges of a scanner at the origin: free space on the left of every wall. And a symmetric room.
ROOM = simulation.outline([(-4.0, -3.0), (4.0, -3.0), (4.0, 1.0), (2.5, 3.0), (-4.0, 3.0)])
SYMMETRIC_ROOM = simulation.outline([(-4.0, -3.0), (4.0, -3.0), (4.0, 1.0), (0.0, 3.0), (-4.0, 1.0)])
TURN = np.linspace(-math.pi, math.pi, 360, endpoint=False)
_X, _Y, _DX, _DY = *ROOM[:, :2].T, *(ROOM[:, 2:] - ROOM[:, :2]).T
_TOWARDS = np.outer(_DY, np.cos(TURN)) - np.outer(_DX, np.sin(TURN))
RANGES = np.where(_TOWARDS > 0.0, (_DY * _X - _DX * _Y)[:, None] / np.maximum(_TOWARDS, 1e-9), math.inf).min(axis=0)
THINGS = np.array([[1.0, 2.0], [-2.0, 1.0]])  # too small for walls


def warm_up() -> None:
    """Register, vectorize, associate, check and analyze a map once in each way that has kernels of its own."""
    warm_up_second_half()
    warm_up_searching()
    room = Segments.from_array(ROOM)
    index, robot = MapIndex.build(room, 0.0), map_quality.Robot(beams=360)
    map_quality.check_map(index)
    for sample in (_with_beams(), Scan(MeasuredSegments.from_segments(room.take([0])))):
        map_quality.try_sample(index, sample, Deadline(), oriented=True)
    analysis = map_quality.Analysis.over(index, robot, 3.0)
    for number in range(len(analysis.standing.poses)):
        map_quality.finished(analysis.looking(number))


def warm_up_second_half() -> None:
    """Compile other kernels than those of the search, so that two processes seldom meet at the same kernel."""
    room, pairs = Segments.from_array(ROOM), np.repeat(np.arange(len(ROOM))[:, None], 2, axis=1)
    for options in (
        RegistrationOptions(),
        RegistrationOptions(weighting="uniform"),
        RegistrationOptions(estimator="one_step", rotation="mitsuta", oriented=False),
        RegistrationOptions(estimator="one_step", evaluate_at=IDENTITY),
    ):
        register(room, MeasuredSegments.from_segments(room), pairs, 0.0, options)
    points = np.stack([RANGES * np.cos(TURN), RANGES * np.sin(TURN)], axis=1)
    vectorize(LaserScan(-math.pi, TURN[1] - TURN[0], RANGES, 0.1, 30.0))
    vectorize(points)
    vectorize(points, viewpoint=None)
    simulation.scan(room, IDENTITY, simulation.Scanner(), np.random.default_rng(0))


def warm_up_searching() -> None:
    """Associate once in each way that has kernels of its own."""
    room, symmetric = Segments.from_array(ROOM), Segments.from_array(SYMMETRIC_ROOM)
    index, with_things = (MapIndex.build(room, 0.0, points=MapPoints.of(some)) for some in (THINGS[:0], THINGS))
    whole, beams, step = Scan(MeasuredSegments.from_segments(room)), _with_beams(), 1e-4 * np.eye(3)
    for seen in (
        whole,
        beams,
        replace(whole, viewpoint=None),
        assemble([View(whole), View(whole, IDENTITY, step)]),
        assemble([View(beams), View(beams, IDENTITY, step)]),
        Scan(MeasuredSegments.from_segments(room.take([0]))),
        Scan(MeasuredSegments.from_segments(room.take([]))),
    ):
        associate(index, seen)
        associate(with_things, seen, SoftPrior(IDENTITY, np.eye(3)))
    window = HardPrior(IDENTITY, 1.0, 1.0)
    associate(index.undirected, whole, window, AssociationOptions(oriented=False))
    associate(index, whole, None, AssociationOptions(estimator="one_step"))
    # The mirrored scan is found as well; a map that is not to scale states no sigma.
    for other in (MapIndex.build(symmetric, 0.0), MapIndex.build(Segments.from_array(1.02 * SYMMETRIC_ROOM))):
        associate(other, Scan(MeasuredSegments.from_segments(symmetric)))
    maps = MapSet({"room": MapPart(room, 0.0), "symmetric": MapPart(symmetric, 0.0)})
    for known in (KnownOfMaps(), KnownOfMaps(window, "room", {"room": 0.5})):
        associate_on_maps(maps, beams, known)


def _with_beams() -> Scan:
    """Return the room as a laser in its middle sees it."""
    return Scan(MeasuredSegments.from_segments(Segments.from_array(ROOM)), (0.0, 0.0), Beams(TURN, RANGES, 30.0))
