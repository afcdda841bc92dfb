"""The goals of the drawn worlds, with the measured values.

"Goal" is what must be reached whatever else pulls the other way, "aim" what is aimed at.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...table import Row, at_least, at_most, mean, within
from .outcomes import WorldOutcome
from .questions import FORMS, HALVES
from .tables import MAP_ERRORS, WALL_ERRORS, could_be_told, held, judged, of_form, quantile_bins, worst_gap

# Usable and right at commit 563ffea, percent of the scans, ranges and segments, by half of the worlds.
BEFORE = {
    "fitting": {
        "clean": (86.79, 86.43),
        "cluttered": (64.82, 73.21),
        "changed": (80.0, 81.43),
        "scaled": (81.79, 44.29),
    },
    "reporting": {
        "clean": (77.14, 77.14),
        "cluttered": (54.82, 64.46),
        "changed": (76.43, 78.21),
        "scaled": (70.36, 45.71),
    },
}
ADDED = frozenset({"dormitory", "terraces"})  # kinds of buildings that were added after that
KEPT = {
    "clean": (("clean",), 92.0, 96.0),
    "cluttered": (("clutter_33", "clutter_66"), 80.0, 90.0),
    "changed": (("changed",), 78.0, 88.0),
    "scaled": (("scaled_1",), 80.0, 90.0),
}

# Usable where it could be told that they are not, percent of the scans.
LET_IN = {"unmapped": (2.0, 0.7), "other_type": (0.2, 0.05), "sister": (2.5, 1.2), "mirrored": (0.5, 0.2)}

WRONG = (0.3, 0.15)  # usable but wrong, percent of usable, in the map over all,
WRONG_EACH = 0.7  # and in each world and each condition
EQUAL_UNITS = frozenset({"hotel", "mirrored_flats", "terraces", "dormitory"})
WRONG_UNIT = 0.5  # percent of usable, in these
TURNING = 25.0  # percent usable, turning, segments
CALIBRATION = (6.0, 4.0)  # points, in bins of
BIN = 1000
HELD = (90.0, 98.0)  # percent of the truths within the ellipsoid of 95 %
NEES = (2.5, 4.0)  # from this many walls on:
MANY_WALLS = 6
FEW = 20  # answers below which a covariance is not judged
ELSEWHERE, ELSEWHERE_HERE = 90.0, 2.0  # percent no_match or elsewhere: of other buildings, and in the map


def rows(outcomes: Sequence[WorldOutcome], half: str) -> list[Row]:
    """Judge one half of the worlds; figures of conditions that were left out are not measured."""
    found = []
    outcomes = [o for o in outcomes if o.held_out == HALVES[half]]
    for k, form in enumerate(FORMS):
        answers = of_form(outcomes, form)
        before = {name: shares[k] for name, shares in BEFORE[half].items()}
        found += _kept(answers, form, before) + _let_in(answers, form) + _wrong(answers, form)
        found += _covariance(answers, form)
        here = [o for o in answers if not o.stranger]
        bins = [b for b in quantile_bins(here, BIN) if b[0] >= BIN]
        found.append(at_most(f"{form}: probability, points off in bins of {BIN}", worst_gap(bins), *CALIBRATION, ".1f"))
        away = [o for o in answers if o.condition in ("other_type", "sister")]
        shares = [100.0 * mean(o.said_elsewhere for o in group) for group in (away, here)]
        found.append(
            at_least(f"{form}: in another building: told to be elsewhere, %", shares[0], None, ELSEWHERE, ".1f")
        )
        found.append(at_most(f"{form}: in the map: told to be elsewhere, %", shares[1], None, ELSEWHERE_HERE, ".1f"))
    turning = [o.usable for o in of_form(outcomes, "segments") if o.condition == "turning"]
    return [*found, at_least("segments: turning: usable, %", 100.0 * mean(turning), None, TURNING, ".1f")]


def _kept(answers: Sequence[WorldOutcome], form: str, before: dict[str, float]) -> list[Row]:
    """Judge what is usable and right next to what was so before, percent of the scans."""
    found = []
    for name, (conditions, least, aim) in KEPT.items():
        now = 100.0 * mean(o.usable and o.right for o in answers if o.condition in conditions and o.world not in ADDED)
        share = 100.0 * now / before[name]
        row = at_least(f"{form}: {name}: usable and right, % of what was", share, least, aim, ".1f")
        told = row.measured if math.isnan(now) else f"{row.measured} ({now:.1f} of {before[name]:.1f} % of the scans)"
        found.append(Row(row.what, told, row.goal, row.met, row.aim, row.aimed))
    return found


def _let_in(answers: Sequence[WorldOutcome], form: str) -> list[Row]:
    """Judge how many out-of-map scans get a usable answer although the scan shows that it is wrong."""
    found = []
    for condition, limits in LET_IN.items():
        told = [o.usable and could_be_told(o) for o in answers if o.condition == condition]
        what = f"{form}: {condition}: usable where it could be told, %"
        found.append(at_most(what, 100.0 * mean(told), *limits, ".2f"))
    return found


def _wrong(answers: Sequence[WorldOutcome], form: str) -> list[Row]:
    """Judge how many usable answers in the map are wrong, over all and where they are most."""
    here = [o for o in answers if not o.stranger]
    found = [_wrong_row(f"{form}: in the map: usable but wrong, % of usable", here, *WRONG)]
    units = [o for o in here if o.world in EQUAL_UNITS]
    if units:
        found.append(_wrong_row(f"{form}:   in buildings of equal units", units, WRONG_UNIT, None))
    for what in ("world", "condition") if here else ():
        groups = {name: [o for o in here if getattr(o, what) == name] for name in {getattr(o, what) for o in here}}
        worst = max(sorted(groups), key=lambda name: _wrong_share(groups[name]))
        found.append(_wrong_row(f"{form}:   in the worst {what}, {worst}", groups[worst], WRONG_EACH, None))
    return found


def _wrong_share(answers: Sequence[WorldOutcome]) -> float:
    usable = [o for o in answers if o.usable]
    return 100.0 * sum(o.wrong for o in usable) / len(usable) if usable else 0.0


def _wrong_row(what: str, answers: Sequence[WorldOutcome], goal: float, aim: float | None) -> Row:
    usable = sum(o.usable for o in answers)
    row = at_most(what, _wrong_share(answers) if usable else math.nan, goal, aim, ".2f")
    told = f"{row.measured} ({sum(o.wrong for o in answers)} of {usable})"
    return Row(row.what, told, row.goal, row.met, row.aim, row.aimed)


def _covariance(answers: Sequence[WorldOutcome], form: str) -> list[Row]:
    """Judge the covariances over all errors of single walls: the share held by number of walls, the mean NEES of many.

    Beside that the mean NEES with a map that is out of scale, too.
    """
    right = [o for o in answers if o.condition in WALL_ERRORS and judged(o)]
    found = []
    for told, group in (
        (f"fewer than {MANY_WALLS} walls", [o for o in right if o.walls < MANY_WALLS]),
        (f"{MANY_WALLS} walls and more", [o for o in right if o.walls >= MANY_WALLS]),
    ):
        if len(group) >= FEW:
            found.append(within(f"{form}: {told}: truths within 95 %, %", 100.0 * mean(map(held, group)), *HELD, ".1f"))
    many = [o.nees for o in right if o.walls >= MANY_WALLS and o.nees is not None]
    if len(many) >= FEW:
        found.append(within(f"{form}: {MANY_WALLS} walls and more: mean NEES", mean(many), *NEES, ".2f"))
    scaled = [o.nees for o in answers if o.condition in MAP_ERRORS and judged(o) and o.walls >= MANY_WALLS]
    if len(scaled) > len(many) >= FEW:
        told = f"{mean(nees for nees in scaled if nees is not None):.2f}"
        found.append(Row(f"{form}:   and with maps scaled by 1 %", told))
    return found
