"""Whatever the map and the scan, what comes after the deadline takes no longer than some looks at the clock."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from association import AssociationOptions, AssociationResult, Deadline, MapIndex, Scan, View, assemble, associate
from registration import RigidTransform
from registration.layout import Floats

from .scenes import index_of, scan_of

PIECES, SEEN = 50_000, 2_000  # of the map, of the scan
ALLOWED, MORE = 0.5, 2.0  # s, the deadline; processor time beyond it. Looked at one by one, all pairs take 4 to 12 s
OPTIONS = AssociationOptions(causes=True)
BOX = np.array([[0.0, 0.0, 8.0, 0.0], [8.0, 0.0, 8.0, 6.0], [8.0, 6.0, 0.0, 6.0], [0.0, 6.0, 0.0, 0.0]])
SCAN = BOX - np.array([3.0, 2.0, 3.0, 2.0])
Pair = tuple[Floats, Floats]


def repeated(rng: np.random.Generator) -> Pair:
    """Return one wall again and again, and a scan that is nothing else."""
    wall = np.array([[10.0, 20.0, 14.0, 23.0]])
    return np.tile(wall, (PIECES, 1)) + rng.normal(0.0, 1e-9, (PIECES, 4)), np.tile([[0.0, 0.0, 5.0, 0.0]], (SEEN, 1))


def cut_up(rng: np.random.Generator) -> Pair:
    """Return a room of which the walls are pieces that overlap one another, and a scan of its four walls."""
    walls, cuts = np.tile(BOX, (PIECES // 4, 1)), np.sort(rng.uniform(size=(PIECES, 2)), axis=1)
    along = walls[:, 2:] - walls[:, :2]
    return np.hstack([walls[:, :2] + cuts[:, :1] * along, walls[:, :2] + cuts[:, 1:] * along]), SCAN


def along_lines_of_sight(rng: np.random.Generator) -> Pair:
    """Return a hall with short walls all along the lines of sight, which none of these meets."""
    hall = np.array([[0, -8, 100, -8], [100, -8, 100, 8], [100, 8, 0, 8], [0, 8, 0, -8.0]])
    middles, half = np.stack([rng.uniform(0.0, 100.0, PIECES), rng.uniform(-0.6, 0.6, PIECES)], axis=1), [0.005, 0.0]
    x, y, lean = rng.uniform(90.0, 100.0, SEEN - 4), rng.uniform(-0.9, 0.9, SEEN - 4), rng.uniform(-0.2, 0.2, SEEN - 4)
    seen = np.stack([x, y - 0.25, x + lean, y + 0.25], axis=1)
    return np.vstack([hall, np.hstack([middles - half, middles + half])]), np.vstack([hall, seen])


def heap(rng: np.random.Generator) -> Pair:
    """Return walls of all directions in one place, and a scan of the like."""
    middles, angles = rng.uniform(0.0, 2.0, (PIECES, 2)), rng.uniform(-np.pi, np.pi, PIECES)
    half = 0.3 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    walls = np.hstack([middles - half, middles + half])
    return walls, walls[:SEEN] - 1.0


def far_apart(rng: np.random.Generator) -> Pair:
    """Return a row of dashes that a scan bridges."""
    x = 0.4 * np.arange(PIECES)
    begins = 4.0 * np.arange(SEEN)
    zero = np.zeros_like
    scan = np.stack([begins, zero(begins), begins + 3.5, zero(begins)], axis=1)
    return np.stack([x, zero(x), x + 0.05, zero(x)], axis=1), scan


def dashes(rng: np.random.Generator) -> Pair:
    """Return a line of dashes that wanders, and so consists of as many walls tied to one another; a scan of all."""
    x, y, lengths = np.arange(SEEN - 2.0), np.cumsum(rng.normal(0.0, 0.1, SEEN - 2)), rng.uniform(0.5, 0.95, SEEN - 2)
    across = np.array([[0.0, -3.0, 9.0, -3.0], [9.0, -3.0, 9.0, -6.0]])
    walls = np.vstack([np.stack([x, y - y.mean(), x + lengths, y - y.mean()], axis=1), across])
    return walls, walls + rng.normal(0.0, 0.003, walls.shape)


def steps(rng: np.random.Generator) -> Pair:
    """Return a line of dashes that goes to and fro by centimetres, and a scan of all, which are one line of it."""
    x, y = 0.5 * np.arange(SEEN - 2.0), 0.03 * (np.arange(SEEN - 2) % 2)
    across = np.array([[0.0, -3.0, 9.0, -3.0], [9.0, -3.0, 9.0, -6.0]])
    walls = np.vstack([np.stack([x, y, x + 0.45, y], axis=1), across])
    return walls, walls + rng.normal(0.0, 0.003, walls.shape)


@pytest.mark.parametrize("drawn", [dashes, steps])
def test_it_holds_where_all_that_is_seen_lies_on_walls_that_are_nearly_one(
    drawn: Callable[[np.random.Generator], Pair],
) -> None:
    """Whatever compares each pair, or each wall, with each other one took 2 to 3 s of processor time."""
    walls, seen = drawn(np.random.default_rng(0))
    index, scan = index_of(walls), scan_of(seen, sigma=0.0, viewpoint=(5.0, -1.0))
    found, took = within(index, scan, replace(OPTIONS, max_alternatives=50))
    assert len(found.correspondences) > SEEN // 2
    assert took < ALLOWED + 0.5 * MORE


@pytest.mark.parametrize(
    ("drawn", "viewpoint"),
    [(one, (0.0, 0.0)) for one in (repeated, cut_up, along_lines_of_sight, heap, far_apart)] + [(heap, None)],
)
def test_the_deadline_holds_for_every_stage(
    drawn: Callable[[np.random.Generator], Pair], viewpoint: tuple[float, float] | None
) -> None:
    walls, seen = drawn(np.random.default_rng(0))
    found, took = within(index_of(walls), scan_of(seen, viewpoint=viewpoint), OPTIONS)
    assert took < ALLOWED + MORE
    assert not found.usable or found.search.complete


def within(index: MapIndex, scan: Scan, options: AssociationOptions) -> tuple[AssociationResult, float]:
    """Return an answer within the deadline, and the processor time that it took, once all of it is compiled."""
    found, took = associate(index, scan, None, options, Deadline(time.monotonic() + ALLOWED)), math.inf
    for _ in range(2):
        began = time.thread_time()
        found = associate(index, scan, None, options, Deadline(time.monotonic() + ALLOWED))
        took = min(took, time.thread_time() - began)
    return found, took


def test_it_holds_for_uncertain_views_of_a_building_that_repeats_itself() -> None:
    """The pose of each alternative is solved with those of all views: fifty times 190 unknowns."""
    rooms = np.vstack([BOX + np.tile([12.0 * k, 0.0], 2) for k in range(60)])
    spread = 1e-4 * np.eye(3)
    views = [
        View(scan_of(SCAN, viewpoint=(0.0, 0.0)), RigidTransform(0, 0, 0), spread if k else None) for k in range(64)
    ]
    options = replace(OPTIONS, max_alternatives=50)
    found, took = within(index_of(rooms), assemble(views), options)
    assert took < ALLOWED + MORE
    assert not found.usable
