"""The table of the drawn worlds."""

from __future__ import annotations

from collections.abc import Sequence

from ...table import Row, print_rows, print_table
from ..buildings import FAMILIES
from ..conditions import CONDITIONS
from .goals import rows
from .outcomes import WorldOutcome
from .questions import FORMS, HALVES, in_map
from .running import Choice, run
from .tables import (
    print_calibration,
    print_covariances,
    print_in_map,
    print_statuses,
    print_strangers,
    print_times,
)


def worlds(quick: int) -> list[Row]:
    """Draw and search one in `quick` of everything, print all tables, return the rows of the worlds for reporting."""
    return report(run(Choice(quick=quick)))


def report(outcomes: Sequence[WorldOutcome]) -> list[Row]:
    """Print all tables of some outcomes; return the rows of the worlds for reporting."""
    _print_legend()
    print_in_map(outcomes)
    print_strangers(outcomes)
    print_statuses(outcomes)
    print_covariances(outcomes)
    print_calibration(outcomes)
    print_times(outcomes)
    judged: dict[str, list[Row]] = {}
    for half, held_out in HALVES.items():
        group = [o for o in outcomes if o.held_out == held_out]
        if group:
            here = sum(not o.stranger for o in group) // len(FORMS)
            counts = f"{here:,} scans in their map and {len(group) // len(FORMS) - here:,} out-of-map scans"
            judged[half] = rows(group, half)
            print_rows(f"Drawn worlds for {half}, {counts}", judged[half])
    return judged.get("reporting", [])


def _print_legend() -> None:
    """Say what was drawn and what it is for."""
    print_table(
        "Worlds", ("world", "what", "for"),
        [(name, f.what, "reporting only" if f.held_out else "fitting") for name, f in FAMILIES.items()],
    )  # fmt: skip
    print_table(
        "Conditions", ("condition", "what", "truth"),
        [(name, c.what, "in the map" if in_map(name) else "none") for name, c in CONDITIONS.items()],
    )  # fmt: skip
