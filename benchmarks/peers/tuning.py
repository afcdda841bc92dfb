"""Find each peer's best settings for each level, on queries of their own: ``python -m benchmarks.peers.tuning``.

Coordinate search: one setting after another takes each of its values, twice around. The objective is the fraction of
right answers; ten times the processor time must buy two points of it. Prints what is to be pasted into `settings`.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import time
from typing import Any

from .adapters import PEERS, OfCorners
from .corners import CornerOptions
from .race import is_right
from .scenes import DRAWN_LEVELS, KINDS, PeerQuery, drawn_cell, plan_cells
from .settings import PLANS

SEED = 4711  # the comparison has another
CORNERS: dict[str, list[Any]] = {
    "seen_reach": [0.3, 0.7, 1.5, 3.0],
    "known_reach": [0.05, 0.5, 1.0, 2.0],
    "slack": [0.1, 0.15, 0.25],
    "turn": [3.0, 5.0, 8.0, 12.0],
    "most": [1000, 3000, 10_000],
    "headings": [0, 1, 4, 8],
}
OWN: dict[str, dict[str, list[Any]]] = {
    "kiss": {"bound": [0.08, 0.15, 0.25, 0.4], "gain": [0.5, 1.0], "tips": [False, True]},
    "opencv": {"threshold": [0.08, 0.15, 0.25, 0.4], "trials": [500, 2000, 10_000]},
    "open3d": {"threshold": [0.1, 0.2, 0.3], "trials": [5000, 20_000, 100_000]},
    "skimage": {"threshold": [0.1, 0.2, 0.3, 0.5], "trials": [300, 1000, 3000]},
    "clipper": {"reach": [0.04, 0.08, 0.15], "twist": [2.0, 4.0, 8.0]},
    "gicp": {"spacing": [0.05, 0.1, 0.2], "rounds": [(1.0, 0.3), (1.0, 0.5, 0.2), (2.0, 1.0, 0.3), (0.5,), (1.0,)],
             "kind": ["PLANE_ICP", "GICP", "ICP"]},
}  # fmt: skip
SLOW = {"clipper": [300, 1000, 2000], "open3d": [1000, 3000], "skimage": [1000, 3000, 10_000]}
WORTH = 0.02
PATIENCE = 0.5  # s a query, on average, beyond which a setting is out


def queries_of(level: str, count: int) -> list[PeerQuery]:
    """Return queries of a level, of all kinds and of the two greater sizes."""
    if level == PLANS:
        return [q for cell in plan_cells(count, SEED) for q in cell.queries][::-1]
    (chosen,) = (x for x in DRAWN_LEVELS if x.name == level)
    return [
        q for kind in KINDS for size in (50, 200, 1000) for q in drawn_cell(kind, size, chosen, count, SEED).queries
    ]


def worth(key: str, options: dict[str, Any], queries: list[PeerQuery]) -> float:
    """Return what settings score: the share of right answers, less something for the time."""
    peer = PEERS[key].make(**options)
    right, spent, prepared = 0, 0.0, {}
    for k, query in enumerate(queries):
        if id(query.map) not in prepared:
            prepared[id(query.map)] = peer.prepare(query.map)
        start = time.process_time()
        right += is_right(peer.locate(prepared[id(query.map)], query), query.pose)
        spent += time.process_time() - start
        if spent > PATIENCE * max(10, k + 1):
            return -1.0
    return right / len(queries) - WORTH * math.log10(1e3 * spent / len(queries))


def tune(key: str, level: str, count: int) -> dict[str, Any]:
    """Return the best settings found."""
    queries = queries_of(level, count)
    made = PEERS[key].make()
    chosen = {f: getattr(made, f) for f in OWN[key]}
    grid = dict(OWN[key])
    if isinstance(made, OfCorners):
        chosen |= dataclasses.asdict(made.options)
        grid = CORNERS | grid | ({"most": SLOW[key]} if key in SLOW else {})
        chosen["most"] = grid["most"][0]
    best = worth(key, split(key, chosen), queries)
    for _ in range(2):
        before = dict(chosen)
        for name, values in grid.items():
            for value in values:
                if value != chosen[name]:
                    found = worth(key, split(key, chosen | {name: value}), queries)
                    if found > best:
                        best, chosen = found, chosen | {name: value}
        if chosen == before:
            break
    print(f"    # {key}, {level}: {best:.3f}", flush=True)
    return chosen


def split(key: str, flat: dict[str, Any]) -> dict[str, Any]:
    """Return keyword arguments of a peer, those of the corners gathered."""
    if not isinstance(PEERS[key].make(), OfCorners):
        return flat
    own = {name: value for name, value in flat.items() if name in OWN[key]}
    corners = {name: value for name, value in flat.items() if name not in OWN[key]}
    return own | {"options": CornerOptions(**corners)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peers", nargs="*", default=list(OWN), help=f"of {', '.join(OWN)}")
    parser.add_argument("--queries", type=int, default=5, help="a cell")
    args = parser.parse_args()
    for key in args.peers:
        for level in [*(x.name for x in DRAWN_LEVELS), PLANS]:
            print(f'("{key}", "{level}"): {split(key, tune(key, level, args.queries))!r},', flush=True)


if __name__ == "__main__":
    main()
