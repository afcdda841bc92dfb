"""The effect of each part of the score: the same scans without it, in one run.

The models of the verdict stay those of the whole score, so that `usable` without a part is no more than a hint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np

from association.scan import scan_lines
from registration.layout import Records

from .collection import LEVELS
from .outcomes import Outcome, run
from .queries import floor_plans, logs
from .table import mean, print_table, quantile

EVERY = 3  # of the queries one in so many
TINY = 1e-9


Terms = tuple[Records, Records]  # of lines, (1,) of `VARIANCES`, and of walls, (1,) of `MODEL`


@contextmanager
def changed(change: Callable[[Terms], None]) -> Iterator[None]:
    """Let the variances be changed that the search goes by."""
    variances = scan_lines.variances_of

    def other(*args: Any, **named: Any) -> Terms:
        lines, model = variances(*args, **named)
        terms = lines.copy(), model.copy()
        change(terms)
        return terms

    with patch.object(scan_lines, "variances_of", other):
        yield


def without_freedom(terms: Terms) -> None:
    """Charge no pose for the freedom that it takes up."""
    terms[1]["free_distance"] = terms[1]["free_angle"] = TINY


def without_common_error(terms: Terms) -> None:
    """Let every line have its wall's error again, as independent."""
    terms[0]["map"] += terms[1]["wall_variance"]
    terms[1]["wall_variance"] = TINY**2


def without_wall_error(terms: Terms) -> None:
    """Take the map for exact."""
    terms[0]["map"] = 0.0
    terms[1]["wall_variance"] = TINY**2


@contextmanager
def apart() -> Iterator[None]:
    """Let no segments be joined: no cosine is 2."""
    with patch.object(scan_lines, "JOINTS", np.array([[0.0, 2.0]])):
        yield


VARIANTS: dict[str, Callable[[], AbstractContextManager[Any]]] = {
    "as it is": nullcontext,
    "without the freedom taken": partial(changed, without_freedom),
    "each match with an error of its own": partial(changed, without_common_error),
    "walls without an error": partial(changed, without_wall_error),
    "no segments joined": apart,
}


def parts(quick: int) -> None:
    """Print what is right, usable and wrong, and how long it takes, with and without each part."""
    collections = [floor_plans(EVERY * quick), *logs(EVERY * quick)]
    cells = []
    for name, without in VARIANTS.items():
        with without():
            found = [run(one) for one in collections]
        plans = [[o for o in found[0] if o.query.level == level] for level in LEVELS]
        cells.append((name, *map(_figures, plans), *map(_figures, found[1:]), _times(found)))
    head = ("", *LEVELS, *(one.name for one in collections[1:]), "median ms, of plans and logs")
    print_table("Right first / usable / of these wrong, with the whole score and without a part of it", head, cells)


def _figures(outcomes: list[Outcome]) -> str:
    usable = [o for o in outcomes if o.usable]
    wrong = sum(not o.right for o in usable)
    return f"{mean(o.right for o in outcomes):.3f} / {mean(o.usable for o in outcomes):.2f} / {wrong}"


def _times(found: list[list[Outcome]]) -> str:
    plans, of_logs = found[0], [o for one in found[1:] for o in one]
    return " / ".join(f"{quantile([o.cpu for o in group], 0.5):.2f}" for group in (plans, of_logs) if group)
