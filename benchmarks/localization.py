"""Localization of scans in their maps: correctness, stated probability, and time.

Every query counts, those without a single segment too. Times are the processor's for the searching thread, so that
other work on the machine does not count; next to them the time that passed.

``python -m benchmarks.localization [--only floor-plans,intel] [--stride 10] [--wrong]``
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Iterable, Sequence

from association import Status

from .collection import LEVELS
from .outcomes import Outcome, offset, other_logs, run, strangers
from .queries import LOGS, floor_plans, logs
from .reliability import print_reliability, reliability_row
from .table import Row, at_least, at_most, mean, print_rows, print_table, quantile

IDENTIFIABLE = 0.02  # of lead
LARGE = 400  # segments

# Goals and aims, by level or log.
RIGHT_FIRST = {"scan": (0.93, 0.95), "scan_30": (0.87, 0.92), "scan_50": (0.72, 0.80)}
AMONG = {"scan": (0.98, 0.99), "scan_30": (0.95, 0.98), "scan_50": (0.85, 0.92)}
USABLE = {"scan": (0.75, 0.80), "scan_30": (0.60, 0.70), "scan_50": (0.40, 0.50)}
LOG_RIGHT: dict[str, tuple[float | None, float]] = {
    "intel": (0.78, 0.82),
    "seattle": (0.92, 0.94),
    "freiburg-079": (0.86, 0.90),
    "fhw": (0.85, 0.90),
    "acapulco": (None, 0.55),
    "edmonton": (None, 0.42),
}


def level_rows(outcomes: Sequence[Outcome], *, goals: bool) -> list[Row]:
    """Judge the floor plans, level by level; without goals for drawn ones."""

    def asked(table: dict[str, tuple[float, float]], level: str) -> tuple[float | None, float | None]:
        return table[level] if goals else (None, None)

    by_level = {level: [o for o in outcomes if o.query.level == level] for level in LEVELS}
    rows = [
        at_least(f"{k}: right first", mean(o.right for o in v), *asked(RIGHT_FIRST, k)) for k, v in by_level.items()
    ]
    rows += [at_least(f"{k}: right among 21", mean(o.among for o in v), *asked(AMONG, k)) for k, v in by_level.items()]
    clear = [o for o in outcomes if o.query.lead is not None and o.query.lead > IDENTIFIABLE]
    for level in LEVELS if clear else ():
        rows.append(
            at_least(f"{level}: identifiable, right first", mean(o.right for o in clear if o.query.level == level))
        )
    if clear:
        rows.append(
            at_least(f"identifiable ({len(clear)}), right first", mean(o.right for o in clear), 0.995, 0.998, ".4f")
        )
    rows += [at_least(f"{k}: usable", mean(o.usable for o in v), *asked(USABLE, k)) for k, v in by_level.items()]
    rows += [wrong_row(f"{level}: usable but wrong", v) for level, v in by_level.items()]
    return [*rows, wrong_row("all levels: usable but wrong, % of usable", outcomes, 1.0, 0.2)]


def wrong_row(what: str, outcomes: Sequence[Outcome], goal: float | None = None, aim: float | None = None) -> Row:
    """Judge how many of the usable answers are wrong, in percent."""
    usable = [o for o in outcomes if o.usable]
    wrong = sum(not o.right for o in usable)
    row = at_most(what, 100.0 * wrong / len(usable) if usable else 0.0, goal, aim, ".2f")
    return Row(row.what, f"{row.measured} % ({wrong} of {len(usable)})", row.goal, row.met, row.aim, row.aimed)


def time_rows(outcomes: Sequence[Outcome], *, goals: bool) -> list[Row]:
    """Judge the times, and count hypotheses."""
    cpu = [o.cpu for o in outcomes]
    hypotheses = [o.result.search.hypotheses for o in outcomes]
    found = [
        at_most("search, median ms", quantile(cpu, 0.5), 2.0 if goals else None, form=".2f"),
        at_most("search, p95 ms", quantile(cpu, 0.95), 12.0 if goals else None, form=".2f"),
    ]
    pure = [o.search for o in outcomes if not math.isnan(o.search)]
    return [
        *found,
        Row("  as time passed, median / p95 ms", _two((o.wall for o in outcomes), ".2f")),
        Row("  without ranking and verdict, median / p95 ms", _two(pure, ".2f")),
        Row("  hypotheses, median / p95", _two(hypotheses, ".0f")),
        Row("  search complete", f"{mean(o.result.search.complete for o in outcomes):.4f}"),
    ]


def large_rows(outcomes: Sequence[Outcome]) -> list[Row]:
    """Judge the times of scans with clutter in large plans."""
    cpu, what = [o.cpu for o in outcomes], f"scan_30, plans of {LARGE} segments or more ({len(outcomes)}): search"
    return [
        at_most(f"{what}, median ms", quantile(cpu, 0.5), None, 1.6, ".2f"),
        at_most(f"{what}, p95 ms", quantile(cpu, 0.95), None, 12.0, ".2f"),
    ]


def _two(values: Iterable[float], form: str) -> str:
    listed = list(values)
    return f"{quantile(listed, 0.5):{form}} / {quantile(listed, 0.95):{form}}"


def log_rows(outcomes: dict[str, list[Outcome]]) -> list[Row]:
    """Judge the logs."""
    rows = []
    for name, found in outcomes.items():
        rows.append(at_least(f"{name}: right first", mean(o.right for o in found), *LOG_RIGHT[name]))
    for name, found in outcomes.items():
        rows.append(Row(f"{name}: right among 21", f"{mean(o.among for o in found):.3f}"))
    for name, found in outcomes.items():
        usable = f"{mean(o.usable for o in found):.3f} usable; of them wrong "
        rows.append(Row(f"{name}: usable", usable + wrong_row("", found).measured))
        rows.append(Row(f"{name}: search, median / p95 ms", _two((o.cpu for o in found), ".2f")))
    everything = [o for found in outcomes.values() for o in found]
    return [*rows, wrong_row("all logs: usable but wrong, % of usable", everything, 1.0)]


def stranger_row(what: str, outcomes: Sequence[Outcome]) -> Row:
    """Judge the scans of other buildings."""
    row = at_least(what, mean(not o.usable for o in outcomes), None, 0.995, ".4f")
    usable = sum(o.usable for o in outcomes)
    return Row(row.what, f"{row.measured} ({usable} usable of {len(outcomes)})", row.goal, row.met, row.aim, row.aimed)


def print_statuses(groups: dict[str, list[Outcome]]) -> None:
    cells = []
    for name, outcomes in groups.items():
        counts = Counter(o.result.status for o in outcomes)
        cells.append((name, *(str(counts[s]) for s in Status)))
    print_table("Statuses", ("", *(str(s) for s in Status)), cells)


def print_wrong(title: str, outcomes: Iterable[Outcome]) -> None:
    """List usable answers that are wrong."""
    cells = []
    for o in outcomes:
        if o.usable and not o.right and o.result.pose and o.result.diagnostics:
            d = o.result.diagnostics
            off = offset(o.result.pose, o.query.pose)
            name = f"{o.query.family} {o.query.map_id[:28]} #{o.query.number} {o.query.level}"
            matched = f"{len(o.result.correspondences)} of {len(o.query.segments)}"
            margin = "" if d.margin is None else f"{d.margin:.0f}"
            cells.append(
                (name, "yes" if o.among else "no", f"{off[0]:.2f} m {off[1]:.1f} deg", f"{o.result.probability:.3f}",
                 f"{d.score:.0f}", margin, f"{d.inlier_fraction:.2f}", matched)
            )  # fmt: skip
    head = ("query", "truth listed", "off", "probability", "score", "margin", "share", "matched")
    print_table(title, head, cells)


def localization(only: set[str], stride: int, *, listing: bool) -> list[Row]:
    """Run what is wanted, print its tables and return the rows that were judged."""
    groups: dict[str, list[Outcome]] = {}
    away: list[Outcome] = []
    rows: list[Row] = []

    def told(title: str, more: list[Row]) -> None:
        print_rows(title, more)
        rows.extend(more)

    if not only or "floor-plans" in only:
        plans = floor_plans(stride)
        real = plans.name == "floor plans"
        found, away = run(plans, steps=True), strangers(plans)
        groups |= {level: [o for o in found if o.query.level == level] for level in LEVELS}
        told(
            f"{plans.name.capitalize()}, {len(found)} scans",
            [
                *level_rows(found, goals=real),
                *time_rows(found, goals=real),
                *large_rows([o for o in found if o.query.level == "scan_30" and len(plans.maps[o.map]) >= LARGE]),
                stranger_row("another building: not usable", away),
            ],
        )
    chosen = [log for log in logs(stride) if not only or log.name in only]
    of_logs = {log.name: run(log) for log in chosen}
    if of_logs:
        groups |= of_logs
        told("Logs", log_rows(of_logs))
    if len(chosen) == len(LOGS):
        elsewhere = other_logs(chosen)
        told("Logs in the map of another", [stranger_row("another log: not usable", elsewhere)])
        away = away + elsewhere
    print_statuses(groups)
    everything = [o for outcomes in groups.values() for o in outcomes]
    print_reliability("Probability", everything)
    told(
        "Probability, greatest distance from the observed share in points",
        [reliability_row("probability, all answers", everything)],
    )
    if listing:
        print_wrong("Usable but wrong", everything)
        print_wrong("Usable in another building", away)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help=f"of floor-plans, {', '.join(LOGS)}; with commas")
    parser.add_argument("--stride", type=int, default=1, help="take every so many queries")
    parser.add_argument("--wrong", action="store_true", help="list usable answers that are wrong")
    args = parser.parse_args()
    localization({name for name in args.only.split(",") if name}, args.stride, listing=args.wrong)


if __name__ == "__main__":
    main()
