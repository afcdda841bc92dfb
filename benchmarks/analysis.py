"""Analyses of maps compared with real logs.

``python -m benchmarks analyze``

At the pose of each real scan the virtual scanner takes one of its own in the map of the log. Reality has people,
furniture that moved and walls that are on no map; the analysis includes none of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from map_quality import Analysis, Robot, Standing
from registration import Segments

from .outcomes import progress
from .queries import logs
from .ranges import Log, find
from .table import Row, at_least, mean

GOAL = 0.8
SIGMA = 0.02  # m
SPACING = 1.0  # m; stands for nothing here


@dataclass(frozen=True, slots=True)
class Comparison:
    """The prediction of an analysis for the place of a scan (None: not a free place), and the real result."""

    log: str
    expected: bool | None
    usable: bool


def compare(stride: int) -> list[Comparison]:
    """Go through the good scans of all logs, one in `stride`."""
    out = []
    for collection in logs(stride):
        log, key = Log.load(collection.name), (collection.name, collection.name)
        index, queries = collection.index(key), collection.queries
        poses = np.array([[q.pose.x, q.pose.y, q.pose.theta] for q in queries])
        standing = Standing(SPACING, poses, np.arange(len(poses)))
        step = float(log.angles[1] - log.angles[0])
        robot = Robot(min(step * (len(log.angles) - 1), math.tau), len(log.angles), log.reach, SIGMA)
        analysis = Analysis(index, Segments.derived(index.segments.endpoints), robot, standing)
        for k, query in enumerate(queries):
            expected = analysis.look(k)
            real = find(index, log.laser(query.number), None)[0]
            out.append(Comparison(collection.name, None if expected is None else expected.usable, real.usable))
            progress(f"{collection.name}, analysis", k + 1, len(queries))
    return out


def analysis(stride: int) -> list[Row]:
    """Return the rows of the table; none without data."""
    found = compare(stride)
    if not found:
        return []
    rows = []
    for name in dict.fromkeys(one.log for one in found):
        of_log = [one for one in found if one.log == name]
        agreed = mean(one.expected == one.usable for one in of_log)
        rows.append(at_least(f"{name}: agreement, of all {len(of_log)} scans", agreed))
        for said, word in ((True, "usable"), (False, "not usable")):
            group = [one for one in of_log if one.expected is said]
            share = mean(one.usable for one in group)
            rows.append(at_least(f"  said {word}, {len(group)} scans: share that was usable", share))
        silent = sum(one.expected is None for one in of_log)
        rows.append(at_least("  taken for no free place, share", silent / len(of_log)))
    title = f"all logs: agreement, of all {len(found)} good scans"
    rows.append(at_least(title, mean(one.expected == one.usable for one in found), GOAL))
    always = mean(one.usable for one in found)
    rows.append(at_least("  for comparison: an analysis that reports usable of every place", always))
    failed = [one for one in found if not one.usable]
    foretold = mean(one.expected is False for one in failed)
    rows.append(at_least(f"  of the {len(failed)} scans that were not usable: share of which it was said", foretold))
    return rows
