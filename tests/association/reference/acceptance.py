"""Twins of the kernels that report a consensus set in the map's own pieces."""

from __future__ import annotations

from typing import Any

import numpy as np

from association.consensus.tuning import BLOCKING_RAYS, MAX_OTHERS
from association.tables import Lines, Pieces
from registration import RigidTransform
from registration.layout import Floats, Records

from .geometry import Vector, direction
from .sight import count_blockers

SAMPLES = 20_000  # points of a segment, to measure how much of it is covered

Pair = tuple[int, int, float, list[int]]  # scan index, piece, overlap, other pieces


def pieces_of(pieces: Pieces, wall: int) -> list[int]:
    return [int(piece) for piece in pieces.items[pieces.starts[wall] : pieces.starts[wall + 1]]]


def chain_of(walls: Records, first: int) -> list[int]:
    """List the walls of a chain from its first on, by the neighbours that they name."""
    chain = [first]
    while walls[chain[-1]]["after"] >= 0:
        chain.append(int(walls[chain[-1]]["after"]))
    return chain


def accept_matches(
    matched: Any, lines: Lines, scan_ends: Floats, pose: RigidTransform, walls: Records, pieces: Pieces
) -> list[Pair]:
    """List the pairs by scan index; `matched` (n,) is the wall of each line."""
    found = []
    piece_ends = pieces.ends.view(np.float64).reshape(-1, 2, 2)
    for i, row in enumerate(lines.row_of.tolist()):
        wall = int(matched[row])
        if wall < 0:
            continue
        chain = chain_of(walls, int(pieces.firsts[wall]))
        d = direction(walls[chain[0]])
        low, high = sorted(pose.apply(scan_ends[i].reshape(2, 2)) @ d)
        spans = {p: sorted(piece_ends[p] @ d) for w in chain for p in pieces_of(pieces, w)}
        lies_on = {p: min(last, high) - max(first, low) for p, (first, last) in spans.items()}
        own = {p for p in pieces_of(pieces, wall) if lies_on[p] > 0.5 * (high - low)}
        most = max(own or spans, key=lambda p: (lies_on[p], -p))
        points = low + (high - low) * (np.arange(SAMPLES) + 0.5) / SAMPLES
        on_any = np.any([(points >= first) & (points <= last) for first, last in spans.values()], axis=0)
        others = [p for p in spans if p != most and lies_on[p] > 0.0]
        # A line as a whole lies on its wall; one of several segments may be the one that does not.
        if on_any.mean() >= lines.least_overlap or (lines.row_of == row).sum() == 1:
            found.append((i, most, float(on_any.mean()), others[:MAX_OTHERS]))
    return found


def missing_pieces(
    scan: Records, matched: Any, viewpoint: Vector, pose: RigidTransform, walls: Records, pieces: Pieces
) -> list[int]:
    """List the pieces of walls that at least half of the rays that count fully pass, and on which nothing was seen."""
    on = np.asarray(matched)
    counts = count_blockers(scan, on >= 0, viewpoint, pose, walls)
    passed = [w for w, (to_matched, _) in counts.items() if to_matched >= BLOCKING_RAYS / 2 and w not in on]
    return sorted(p for w in passed for p in pieces_of(pieces, w))
