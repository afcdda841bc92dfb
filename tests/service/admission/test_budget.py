"""Bytes of all requests together."""

from __future__ import annotations

import pytest

from service.admission.budget import ByteBudget
from service.admission.errors import TooMuchHeldError


def test_all_together_hold_no_more_than_allowed() -> None:
    budget = ByteBudget(10)
    with budget.account() as one, budget.account() as other:
        one.take(4)
        other.take(5)
        one.take(1)
        assert budget.held == 10
        for account in (one, other):
            with pytest.raises(TooMuchHeldError):
                account.take(1)
        assert (one.taken, other.taken, budget.held) == (5, 5, 10)
    assert budget.held == 0


def test_what_one_gives_back_another_may_take() -> None:
    budget = ByteBudget(10)
    with budget.account() as one:
        one.take(10)
    with pytest.raises(TooMuchHeldError), budget.account() as failing:
        failing.take(11)
    with pytest.raises(ZeroDivisionError), budget.account() as failing:
        failing.take(10 // budget.held)
    with budget.account() as other:
        other.take(10)
        assert budget.held == 10
