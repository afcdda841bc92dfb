"""Records the answers to 1,000 varied requests, and compares them with those of other code or another machine.

For changes that must not change an answer: record before, compare after.

``python -m benchmarks.answers record FILE``, then ``python -m benchmarks.answers compare FILE``; ``--one-in 5`` takes
200 of the requests.
"""

from __future__ import annotations

import argparse
import math
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np

from association import (
    AssociationOptions,
    HardPrior,
    MapIndex,
    Prior,
    Scan,
    SoftPrior,
    associate,
)
from linefix import scan_of
from registration import RigidTransform

from .collection import Collection, MapKey, Query
from .outcomes import other_map, progress
from .queries import floor_plans, logs
from .ranges import Log

REQUESTS = 1000
ROUNDING = 1e-12  # relative to the larger of the two and 1; differences up to here may come from the order of additions
VARIANTS: tuple[AssociationOptions, ...] = (
    AssociationOptions(max_alternatives=20),
    AssociationOptions(oriented=False),
    AssociationOptions(exhaustive=True),
    AssociationOptions(min_overlap=0.0),
    AssociationOptions(min_overlap=0.9, confidence=0.99),
    AssociationOptions(offset_tolerance=0.3, angle_tolerance=0.15),
    AssociationOptions(estimator="one_step", rotation="mitsuta", max_alternatives=50),
    AssociationOptions(seed=7, max_alternatives=0),
)


@dataclass(frozen=True, slots=True)
class Request:
    """One call of `associate`."""

    name: str
    index: MapIndex
    scan: Scan
    prior: Prior | None
    options: AssociationOptions


def requests() -> Iterator[Request]:
    """Yield plans and logs, as segments and as ranges, in their own map and in others, under all kinds of options."""
    plans = floor_plans()
    away = other_map(plans)
    rng = np.random.default_rng(20190901)
    chosen = [int(k) for k in rng.permutation(len(plans.queries))]
    strange = (_request(plans, plans.queries[k], "stranger", away[k]) for k in chosen[::6])
    small = [k for k in chosen if len(plans.maps[plans.queries[k].map]) <= 400]
    varied = (
        _request(plans, plans.queries[k], "varied", options=options, prior=prior, viewpoint=k % 3 != 0, sigma=sigma)
        for k, options, prior, sigma in zip(
            small, cycle(VARIANTS), cycle(_priors(plans, small)), cycle((0.0, 0.02, 0.1)), strict=False
        )
    )
    kinds: list[tuple[int, Iterator[Request]]] = [
        (400, (_request(plans, plans.queries[k], "plan") for k in chosen)),
        (100, strange),
        (300, varied),
    ]
    collections = logs()
    if collections:
        kinds += [(100, _of_logs(collections)), (100, _of_ranges(collections))]
    for count, some in kinds:
        yield from islice(some, count)


def _priors(plans: Collection, chosen: list[int]) -> Iterator[Prior | None]:
    """Yield no prior, right and wrong soft ones, and windows that hold the truth or do not."""
    covariance = np.diag([0.25, 0.25, 0.04])
    for k in chosen:
        truth = plans.queries[k].pose
        near = RigidTransform(truth.x + 0.3, truth.y - 0.4, truth.theta + 0.1)
        far = RigidTransform(truth.x + 4.0, truth.y, truth.theta + 1.0)
        every: list[Prior | None] = [
            None,
            SoftPrior(near, covariance),
            SoftPrior(far, covariance),
            HardPrior(near, 2.0, 0.5),
            HardPrior(far, 2.0, 0.5),
        ]
        yield every[k % len(every)]


def _request(
    plans: Collection,
    query: Query,
    name: str,
    key: MapKey | None = None,
    *,
    options: AssociationOptions = VARIANTS[0],
    prior: Prior | None = None,
    viewpoint: bool = True,
    sigma: float = 0.0,
) -> Request:
    place = key or query.map
    index = MapIndex.build(plans.maps[place], sigma) if sigma else plans.index(place)
    scan = query.scan if viewpoint else Scan(query.scan.measured, None)
    return Request(f"{name} {query.map} {query.number} {query.level}", index, scan, prior, options)


def _of_logs(collections: list[Collection]) -> Iterator[Request]:
    for number in range(0, 10**6, 7):
        for log in collections:
            if number < len(log.queries):
                yield _request(log, log.queries[number], "log")


def _of_ranges(collections: list[Collection]) -> Iterator[Request]:
    raw = {log.name: Log.load(log.name) for log in collections}
    for number in range(0, 10**6, 11):
        for log in collections:
            if number < len(log.queries):
                query = log.queries[number]
                scan = scan_of(raw[log.name].laser(query.number))
                yield Request(f"ranges {log.name} {query.number}", log.index(query.map), scan, None, VARIANTS[0])


def plain(value: Any) -> Any:
    """Return an answer as dictionaries, lists and scalars, to be compared with one of another version."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


def difference(one: Any, other: Any) -> float:
    """Return the greatest relative difference of two plain answers; inf where they differ in more than numbers."""
    if isinstance(one, dict) and isinstance(other, dict):
        return max((difference(one[k], other[k]) for k in one.keys() & other.keys()), default=0.0)
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return max((difference(a, b) for a, b in zip(one, other, strict=True)), default=0.0)
    if isinstance(one, float) and isinstance(other, float):
        same = one == other or (math.isnan(one) and math.isnan(other))
        return 0.0 if same else abs(one - other) / max(1.0, abs(one), abs(other))
    return 0.0 if one == other and type(one) is type(other) else math.inf


def answers(one_in: int = 1) -> dict[str, Any]:
    """Answer one in so many requests; their names with their answers."""
    found: dict[str, Any] = {}
    for k, asked in enumerate(requests()):
        if k % one_in:
            continue
        result = associate(asked.index, asked.scan, asked.prior, asked.options)
        found[f"{k} {asked.name}"] = plain(result)
        progress("answers", k + 1, REQUESTS)
    return found


def compare(before: dict[str, Any], after: dict[str, Any], rounding: float = ROUNDING) -> int:
    """Print how many answers differ and by how much; return how many differ by more than rounding."""
    found = {name: difference(before[name], after[name]) for name in before.keys() & after.keys()}
    missing = len(before.keys() ^ after.keys())
    rounded = [name for name, off in found.items() if 0.0 < off <= rounding]
    changed = [name for name, off in found.items() if off > rounding]
    print(f"{len(found)} answers: {len(found) - len(rounded) - len(changed)} equal to the bit, {len(rounded)} to")
    print(f"{rounding:g}, {len(changed)} changed; {missing} on one side only")
    for name in changed[:20]:
        print(f"- {name}: {found[name]:.3g}")
    return len(changed) + missing


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("record", "compare"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--one-in", type=int, default=1, metavar="N", help="answer one in N of the requests")
    parser.add_argument(
        "--rounding",
        type=float,
        default=ROUNDING,
        help="relative difference that counts as equal; by default %(default)s",
    )
    args = parser.parse_args()
    after = answers(args.one_in)
    if args.what == "record":
        args.file.write_bytes(pickle.dumps(after))
        return 0
    before = pickle.loads(args.file.read_bytes())
    return 1 if compare(before, after, args.rounding) else 0


if __name__ == "__main__":
    raise SystemExit(main())
