"""Drives in logs."""

from __future__ import annotations

import time

import numpy as np

from association import associate

from ..outcomes import progress
from ..queries import logs
from ..ranges import Log
from ..table import Row, at_most, mean, quantile
from .drives import before, drive, log_drive, looks_of
from .trials import NEAR, TURNED, Trial, tried, usable_share, wrong_share

LENGTHS = (1.0, 2.0, 5.0, 10.0)  # m
USABLE = dict(zip(LENGTHS, (0.30, 0.50, 0.80, 0.90), strict=True))
TIMES = 3.0  # what one view takes


def drives_in_logs(quick: int) -> list[Row]:
    """Search scans that are not usable alone with the views of the last metres; and in the map of the next log."""
    found: dict[float, list[Trial]] = {length: [] for length in (0.0, *LENGTHS)}
    away: dict[float, list[Trial]] = {length: [] for length in (0.0, *LENGTHS)}
    unseen = dict.fromkeys(LENGTHS, 0)  # nothing else was seen on so many metres
    collections = logs(5 * quick)
    for k, collection in enumerate(collections):
        log, index = Log.load(collection.name), collection.index((collection.name, collection.name))
        other = collections[(k + 1) % len(collections)]
        elsewhere = other.index((other.name, other.name))
        for n, query in enumerate(collection.queries):
            alone = tried(index, log_drive(log, query, 0.0), query.pose, NEAR, TURNED)
            found[0.0].append(alone)
            for length in LENGTHS:
                asked = log_drive(log, query, length)
                if not alone.usable and asked.views is None:
                    unseen[length] += 1
                elif not alone.usable:
                    found[length].append(tried(index, asked, query.pose, NEAR, TURNED))
                if n % 2 == 0 and length >= 5.0:
                    away[length].append(tried(elsewhere, asked, None, NEAR, TURNED))
            progress(f"{collection.name}, drives", n + 1, len(collection.queries))
    if not found[0.0]:
        return []
    rows = [usable_share("usable alone", found[0.0])]
    for length in LENGTHS:
        trials = found[length]
        beside = f"; {unseen[length]} more have none" if unseen[length] else ""
        what = f"not usable alone, with the views of the last {length:g} m{beside}"
        rows.append(usable_share(what, trials, USABLE[length]))
        rows.append(wrong_share(trials))
    rows += [
        at_most(f"in another log's map, {length:g} m: usable of {len(trials)}", mean(t.usable for t in trials), 0.001)
        for length, trials in away.items()
        if trials
    ]
    one, many = (quantile([t.ms for t in found[length]], 0.5) for length in (0.0, 5.0))
    rows.append(Row("median ms of one, and of a drive of 5 m", f"{one:.2f}, {many:.2f}"))
    return rows


def time_of_views(quick: int) -> list[Row]:
    """Search one view and five of about 25 segments each, in turn, with the service's own options."""
    ratios, alone = [], []
    for collection in logs(5 * quick):
        log, index = Log.load(collection.name), collection.index((collection.name, collection.name))
        for query in collection.queries:
            numbers = before(log, query.number, 5.0)[:5]
            if len(numbers) < 5:
                continue
            looks = looks_of(log, numbers)
            many = drive(looks, np.random.default_rng(query.number))
            took = []
            for asked in (looks[0].scan, many):
                start = time.thread_time()
                associate(index, asked)
                took.append(1e3 * (time.thread_time() - start))
            alone.append(took[0])
            ratios.append(took[1] / took[0])
    if not ratios:
        return []
    return [
        Row(f"median ms of one view, {len(alone)} scans", f"{quantile(alone, 0.5):.2f}"),
        at_most("five views over one, median", quantile(ratios, 0.5), TIMES, form=".2f"),
    ]
