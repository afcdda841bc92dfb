"""Bytes of all requests together."""

from __future__ import annotations

import pytest

from service.admission.budget import ByteBudget
from service.errors import ShareHeldError, TooMuchHeldError


def test_all_together_hold_no_more_than_allowed() -> None:
    budget = ByteBudget(10, least_share=7)
    with budget.account(b"one") as one, budget.account(b"other") as other:
        one.take(4)
        other.take(5)
        one.take(1)
        one.take(-2)
        one.take(2)
        assert budget.held == 10
        for account in (one, other):
            with pytest.raises(TooMuchHeldError):
                account.take(1)
        assert (one.taken, other.taken, budget.held) == (5, 5, 10)
    assert budget.held == 0


def test_what_one_gives_back_another_may_take() -> None:
    budget = ByteBudget(10, least_share=10)
    with budget.account() as one:
        one.take(10)
    with pytest.raises(ShareHeldError), budget.account() as failing:
        failing.take(11)
    with pytest.raises(ZeroDivisionError), budget.account() as failing:
        failing.take(10 // budget.held)
    with budget.account() as other:
        other.take(10)
        assert budget.held == 10


def test_nobody_holds_more_than_half() -> None:
    budget = ByteBudget(10)
    with budget.account(b"one") as one, budget.account(b"one") as again, budget.account(b"other") as other:
        one.take(3)
        again.take(2)
        for account in (one, again):
            with pytest.raises(ShareHeldError):
                account.take(1)
        other.take(5)
        one.take(-1)
        with pytest.raises(ShareHeldError):
            other.take(1)
        again.take(1)
        for account in (one, again):  # the rest was held all the time
            with pytest.raises(ShareHeldError):
                account.take(1)
    with ByteBudget(1).account() as one, pytest.raises(ShareHeldError):
        one.take(1)


def test_the_largest_piece_may_always_come() -> None:
    budget = ByteBudget(10, least_share=8)
    with budget.account(b"one") as one, budget.account(b"other") as other:
        one.take(8)
        with pytest.raises(ShareHeldError):
            one.take(1)
        with pytest.raises(TooMuchHeldError):
            other.take(3)
        other.take(2)
