"""Workers that end early, by a real kill."""

from __future__ import annotations

from pathlib import Path

import pytest

from batch import Lost, Processes
from batch.engine import ATTEMPTS, WorkerError
from tests.batch.work import Noting, begun, raising


def test_a_killed_worker_costs_what_it_was_at(tmp_path: Path) -> None:
    found = list(Processes(2).run(Noting(str(tmp_path), deadly=(3,)), range(7)))
    assert sorted(found) == [(item, (item * item, "1")) for item in range(7)]
    assert [begun(tmp_path, item) for item in range(7)] == [1, 1, 1, 2, 1, 1, 1]


@pytest.mark.long
def test_an_item_that_ends_every_worker_is_lost_and_no_other(tmp_path: Path) -> None:
    found = dict(Processes(1).run(Noting(str(tmp_path), deadly=(1,), times=99), range(3)))
    assert found == {0: (0, "1"), 1: Lost(), 2: (4, "1")}
    assert begun(tmp_path, 1) == ATTEMPTS


def test_what_the_function_raises_ends_the_run() -> None:
    with pytest.raises(WorkerError, match="ZeroDivisionError"):
        list(Processes(1).run(raising, [1, 0, 2]))
