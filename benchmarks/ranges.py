"""Real logs with their raw ranges: vectorized, searched, every beam weighed.

``python -m benchmarks ranges``
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from association import AssociationResult, MapIndex, Prior, Scan, SoftPrior, Status, associate
from registration import RigidTransform
from vectorization import LaserScan, vectorize

from .outcomes import is_right, progress
from .queries import DATA, logs
from .table import Row, at_least, at_most, mean, quantile

GOALS = {
    "intel": 0.92,
    "seattle": 0.96,
    "freiburg-079": 0.98,
    "fhw": 0.96,
    "acapulco": 0.78,
    "edmonton": 0.69,
}
EASY = ("intel", "seattle", "freiburg-079", "fhw")
NOTHING_MET = 0.1  # m; readings up to here, as those from the log's greatest range on, are no returns
PRIOR_DISTANCE, PRIOR_ANGLE = 1.0, math.radians(20.0)  # standard deviations


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of one scan: without a prior, and with the previous scan's pose as a soft one."""

    log: str
    right: bool
    usable: bool
    status: Status
    right_with_prior: bool
    usable_with_prior: bool
    vectorize_ms: float
    search_ms: float


@dataclass(frozen=True, slots=True)
class Log:
    """The raw scans of a log."""

    angles: np.ndarray
    ranges: np.ndarray
    poses: np.ndarray
    reach: float

    @classmethod
    def load(cls, name: str) -> Log:
        """Read it from the data folder."""
        with np.load(DATA / "lidar" / f"{name}.npz") as file:
            return cls(file["angles"], file["ranges"], file["poses_refined"], float(file["range_max_valid"]))

    def laser(self, number: int) -> LaserScan:
        """Return a scan as a robot would send it."""
        ranges = self.ranges[number].astype(float)
        ranges[(ranges >= self.reach) | (ranges <= NOTHING_MET)] = np.inf
        return LaserScan(float(self.angles[0]), float(self.angles[1] - self.angles[0]), ranges, NOTHING_MET, self.reach)


def find(index: MapIndex, laser: LaserScan, prior: Prior | None) -> tuple[AssociationResult, float, float]:
    """Search one scan; return the answer and the processor time of both steps, milliseconds."""
    start = time.thread_time()
    found = vectorize(laser)
    between = time.thread_time()
    scan = Scan(found.measured, (0.0, 0.0), found.beams)
    result = associate(index, scan, prior)
    return result, (between - start) * 1e3, (time.thread_time() - between) * 1e3


def answers(stride: int) -> list[Answer]:
    """Search all query scans of all logs, one in `stride`."""
    out = []
    for collection in logs(stride):
        log, index = Log.load(collection.name), collection.index((collection.name, collection.name))
        find(index, log.laser(0), None)
        for k, query in enumerate(collection.queries):
            laser = log.laser(query.number)
            free, vectorize_ms, search_ms = find(index, laser, None)
            x, y, theta = (float(v) for v in log.poses[max(0, query.number - 1)])
            spread = np.diag([PRIOR_DISTANCE**2, PRIOR_DISTANCE**2, PRIOR_ANGLE**2])
            led = find(index, laser, SoftPrior(RigidTransform(x, y, theta), spread))[0]
            out.append(
                Answer(
                    log=collection.name,
                    right=is_right(free.pose, query.pose, collection),
                    usable=free.usable,
                    status=free.status,
                    right_with_prior=is_right(led.pose, query.pose, collection),
                    usable_with_prior=led.usable,
                    vectorize_ms=vectorize_ms,
                    search_ms=search_ms,
                )
            )
            progress(f"{collection.name}, ranges", k + 1, len(collection.queries))
    return out


def ranges(stride: int) -> list[Row]:
    """Return the rows of the table; none without data."""
    found = answers(stride)
    if not found:
        return []
    rows = []
    for log, goal in GOALS.items():
        of_log = [a for a in found if a.log == log]
        rows.append(at_least(f"{log}: right first, of all {len(of_log)} scans", mean(a.right for a in of_log), goal))
    easy = [a.right for a in found if a.log in EASY]
    rows.append(Row("first four: right first", f"{mean(easy):.3f} ({sum(easy)} of {len(easy)})"))
    for names, usable, wrong in ((EASY, 0.60, 0.5), (("acapulco", "edmonton"), 0.40, 2.0)):
        group = [a for a in found if a.log in names]
        taken = [a for a in group if a.usable]
        title = ", ".join(names)
        rows.append(at_least(f"{title}: usable", mean(a.usable for a in group), usable))
        rows.append(_wrong(f"{title}: usable but wrong, % of usable", [not a.right for a in taken], wrong))
    led = [a for a in found if a.log in EASY]
    rows.append(
        at_least("first four, soft prior from the scan before: right", mean(a.right_with_prior for a in led), 0.98)
    )
    with_prior = [not a.right_with_prior for a in led if a.usable_with_prior]
    rows.append(_wrong("first four, soft prior: usable but wrong, % of usable", with_prior, None))
    vectorized, searched = [a.vectorize_ms for a in found], [a.search_ms for a in found]
    rows.append(at_most("vectorize, median ms", quantile(vectorized, 0.5), form=".2f"))
    rows.append(at_most("vectorize, p95 ms", quantile(vectorized, 0.95), form=".2f"))
    rows.append(at_most("associate, median ms", quantile(searched, 0.5), None, 2.0, ".2f"))
    rows.append(at_most("associate, p95 ms", quantile(searched, 0.95), None, 15.0, ".2f"))
    return rows


def _wrong(what: str, wrong: list[bool], goal: float | None) -> Row:
    """Return the row of the fraction of usable answers that are wrong, with the counts."""
    per_cent = 100.0 * sum(wrong) / max(1, len(wrong))
    return replace(at_most(what, per_cent, goal), measured=f"{per_cent:.2f} % ({sum(wrong)} of {len(wrong)})")
