"""Tables of what came of the drawn worlds, by condition and by world."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.special import chdtri

from association import Status

from ...table import mean, print_table, quantile
from ..buildings import FAMILIES
from ..conditions import CONDITIONS
from .outcomes import WorldOutcome
from .questions import FORMS, in_map, kept_for_report

TOLD = 0.98  # of the beams; where as many read what the map shows, no scan could tell the answer from the truth
WALL_ERRORS = ("clean", "walls_5mm", "walls_2cm", "walls_5cm", "cut", "bias", "noisier")
MAP_ERRORS = (*WALL_ERRORS, "scaled_1")  # a scale moves all walls together, of which a residual shows next to nothing
MANY = 1000
WALLS = ((1, 2), (3, 3), (4, 5), (6, 8), (9, MANY))
BINS = 10

Outcomes = Sequence[WorldOutcome]


def of_form(outcomes: Iterable[WorldOutcome], form: str) -> list[WorldOutcome]:
    """Return the answers to one form of the scans."""
    return [o for o in outcomes if o.form == form]


def could_be_told(outcome: WorldOutcome) -> bool:
    """Tell whether the scan shows that the answer is not where it was taken."""
    return outcome.read is not None and outcome.read < TOLD


def _both(outcomes: Outcomes, figure: Callable[[Outcomes], str]) -> str:
    """Return a figure for each form, with a stroke between."""
    return " / ".join(figure(of_form(outcomes, form)) for form in FORMS)


def _percent(values: Iterable[bool], digits: int = 0) -> str:
    share = mean(values)
    return "" if math.isnan(share) else f"{100.0 * share:.{digits}f}"


def _wrong(outcomes: Outcomes) -> str:
    """Return how many answers are usable but wrong, and in brackets how many of these no scan could tell."""
    wrong = [o for o in outcomes if o.wrong]
    untold = sum(not could_be_told(o) for o in wrong)
    return f"{len(wrong)}" + (f" ({untold})" if untold else "")


def print_in_map(outcomes: Outcomes) -> None:
    """Print right, usable and wrong of the scans whose truth is in their map, by condition and by world."""
    here = [o for o in outcomes if not o.stranger]
    head = ("", "scans", "right first %", "within 0.1 m %", "usable and right %", "usable but wrong", "of usable",
            "told to be elsewhere %")  # fmt: skip

    def cells(name: str, group: Outcomes) -> tuple[str, ...]:
        return (
            name,
            str(len(of_form(group, FORMS[0]))),
            _both(group, lambda g: _percent(o.right for o in g)),
            _both(group, lambda g: _percent(o.fine for o in g)),
            _both(group, lambda g: _percent(o.usable and o.right for o in g)),
            _both(group, _wrong),
            _both(group, lambda g: str(sum(o.usable for o in g))),
            _both(group, lambda g: _percent((o.said_elsewhere for o in g), 1)),
        )

    _by(here, "In the map, ranges / segments", head, cells)


def print_strangers(outcomes: Outcomes) -> None:
    """Print how often a scan that has no place in its map gets a usable answer, by condition and by world."""
    away = [o for o in outcomes if o.stranger]
    head = ("", "scans", "usable %", "usable", "could be told, %", "told to be elsewhere %",
            *(f"{s} %" for s in Status if s is not Status.OK))  # fmt: skip

    def cells(name: str, group: Outcomes) -> tuple[str, ...]:
        return (
            name,
            str(len(of_form(group, FORMS[0]))),
            _both(group, lambda g: _percent((o.usable for o in g), 1)),
            _both(group, _wrong),
            _both(group, lambda g: _percent((o.wrong and could_be_told(o) for o in g), 2)),
            _both(group, lambda g: _percent((o.said_elsewhere for o in g), 1)),
            *(
                _both(group, lambda g, s=s: _percent(o.status == s for o in g))  # type: ignore[misc]
                for s in Status
                if s is not Status.OK
            ),
        )

    _by(away, "Strangers, ranges / segments; in brackets those that no scan could tell", head, cells)


def _by(
    outcomes: Outcomes, title: str, head: tuple[str, ...], cells: Callable[[str, Outcomes], tuple[str, ...]]
) -> None:
    """Print the same columns for each condition, for each world, for both halves and for all."""
    conditions = [name for name in CONDITIONS if any(o.condition == name for o in outcomes)]
    worlds = [name for name in FAMILIES if any(o.world == name for o in outcomes)]
    if not outcomes:
        return
    rows = [cells(name, [o for o in outcomes if o.condition == name]) for name in conditions]
    print_table(f"{title}, by condition", ("condition", *head[1:]), [*rows, cells("all", outcomes)])
    rows = [cells(_world(name), [o for o in outcomes if o.world == name]) for name in worlds]
    halves = [
        (told, [o for o in outcomes if o.held_out == out])
        for told, out in (("all for fitting", False), ("all for reporting *", True))
    ]
    rows += [cells(told, group) for told, group in halves if group]
    print_table(f"{title}, by world (*: for reporting only)", ("world", *head[1:]), rows)


def _world(name: str) -> str:
    return f"{name} *" if kept_for_report(name) else name


def print_statuses(outcomes: Outcomes) -> None:
    """Count the statuses, of usable answers and of the others."""
    rows = []
    for told, group in (("in the map", in_map), ("strangers", lambda c: not in_map(c))):
        for form in FORMS:
            counts = Counter(o.status for o in of_form(outcomes, form) if group(o.condition))
            rows.append((f"{told}, {form}", *(str(counts[s]) for s in Status)))
    print_table("Statuses", ("", *Status), rows)


def print_covariances(outcomes: Outcomes) -> None:
    """Print by condition and number of walls what share of the truths lies within the ellipsoids of right answers."""
    rows = []
    for condition in MAP_ERRORS:
        for low, high in WALLS:
            group = [o for o in outcomes if o.condition == condition and low <= o.walls <= high and judged(o)]
            if group:
                walls = f"{low} and more" if high == MANY else f"{low} to {high}" if low < high else f"{low}"
                held_share = _both(group, lambda g: _percent((held(o) for o in g), 1))
                rows.append(
                    (condition, walls, _both(group, lambda g: str(len(g))), _both(group, _mean_nees), held_share)
                )
    head = ("condition", "walls", "right answers", "mean NEES (3)", "within 95 %, %")
    print_table("Covariance, ranges / segments", head, rows)


def _mean_nees(outcomes: Outcomes) -> str:
    return f"{mean(o.nees for o in outcomes if o.nees is not None):.1f}" if outcomes else ""


def judged(outcome: WorldOutcome) -> bool:
    """Tell whether an answer's covariance can be judged: it is right, and states one."""
    return outcome.right and outcome.nees is not None


def held(outcome: WorldOutcome) -> bool:
    """Tell whether the truth lies within the ellipsoid of 95 %."""
    return outcome.nees is not None and outcome.nees <= float(chdtri(3, 0.05))


def quantile_bins(outcomes: Outcomes, size: int) -> list[tuple[int, float, float]]:
    """Return answers with a probability in bins of equal count by it: the count, its mean, the share that is right.

    That of a place that is not found is none, as is that of a position that is open along a direction.

    Parameters
    ----------
    outcomes : sequence of WorldOutcome
    size : int
        Answers in a bin; what is left over goes to the last.
    """
    answered = sorted(
        ((o.probability, o.right) for o in outcomes if o.pose is not None and o.probability is not None),
        key=lambda one: one[0],
    )
    if not answered:
        return []
    starts = list(range(0, max(1, len(answered) - size + 1), size))
    bins = []
    for start, end in zip(starts, [*starts[1:], len(answered)], strict=True):
        group = answered[start:end]
        bins.append((len(group), mean(p for p, _ in group), mean(right for _, right in group)))
    return bins


def print_calibration(outcomes: Outcomes) -> None:
    """Print stated probabilities next to the share that is right, for scans in their map."""
    here = [o for o in outcomes if not o.stranger]
    rows = []
    for form in FORMS:
        answered = of_form(here, form)
        for count, p, share in quantile_bins(answered, max(1, len(answered) // BINS)):
            rows.append((form, str(count), f"{p:.3f}", f"{share:.3f}", f"{100.0 * (share - p):+.1f}"))
    print_table("Probability, scans in their map", ("form", "answers", "stated", "right", "points off"), rows)
    by_world: list[tuple[str, ...]] = []
    for world in FAMILIES:
        group = [o for o in here if o.world == world]
        if group:
            size = max(50, len(group) // 10)
            by_world.append((_world(world), *(_worst(quantile_bins(of_form(group, form), size)) for form in FORMS)))
    print_table(
        "Probability, by world: stated, right, greatest distance of a bin in points", ("world", *FORMS), by_world
    )


def _worst(bins: Sequence[tuple[int, float, float]]) -> str:
    total = sum(count for count, _, _ in bins)
    if not total:
        return ""
    p = sum(count * p for count, p, _ in bins) / total
    share = sum(count * share for count, _, share in bins) / total
    return f"{p:.3f}  {share:.3f}  {worst_gap(bins):.1f}"


def worst_gap(bins: Sequence[tuple[int, float, float]]) -> float:
    """Return the greatest distance between stated and observed, percentage points; nan without answers."""
    return max((100.0 * abs(p - share) for _, p, share in bins), default=math.nan)


def print_times(outcomes: Outcomes) -> None:
    """Print processor times of `associate`."""
    rows = []
    for told, stranger in (("in the map", False), ("strangers", True)):
        for form in FORMS:
            times = [o.milliseconds for o in of_form(outcomes, form) if o.stranger == stranger]
            if times:
                figures = (quantile(times, 0.5), quantile(times, 0.95), float(np.max(times)))
                rows.append((f"{told}, {form}", *(f"{ms:.1f}" for ms in figures)))
    print_table("Processor time of a search, ms", ("", "median", "p95", "greatest"), rows)
