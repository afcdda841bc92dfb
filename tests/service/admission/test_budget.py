"""Bytes of all requests together."""

from __future__ import annotations

from contextlib import ExitStack, nullcontext

import pytest

from service.admission.budget import ByteBudget
from service.errors import ShareHeldError, TooMuchHeldError

# Bytes of all, and of the largest piece; what is taken and given back in turn: by a, by A, which is of the same holder,
# or by b; whether all together (!) or the holder (?) would have too much then; and what is held at the end.
TAKEN = {
    "no more than there are": (10, 7, "a4 b5 a1 a-2 a2 a1! b1!", 10),
    "nobody has more than half": (10, 0, "a3 A2 a1? A1? b5 a-1 b1? A1 a1? A1?", 10),
    "nor is there half of one": (1, 0, "a1?", 0),
    "the largest piece may always come": (10, 8, "a8 a1? b3! b2", 10),
}


@pytest.mark.parametrize("kind", TAKEN)
def test_what_is_held(kind: str) -> None:
    most, least_share, steps, held = TAKEN[kind]
    budget = ByteBudget(most, least_share=least_share)
    with ExitStack() as stack:
        accounts = {name: stack.enter_context(budget.account(name.lower().encode())) for name in "aAb"}
        for step in steps.split():
            error = {"!": TooMuchHeldError, "?": ShareHeldError}.get(step[-1])
            with nullcontext() if error is None else pytest.raises(error):
                accounts[step[0]](int(step[1:].rstrip("!?")))
        assert budget.held == held
    assert budget.held == 0


def test_what_one_gives_back_another_may_take() -> None:
    budget = ByteBudget(10, least_share=10)
    for count, error in ((10, None), (11, ShareHeldError), (0, ZeroDivisionError), (10, None)):
        with nullcontext() if error is None else pytest.raises(error), budget.account() as take:
            take(count or 10 // budget.held)
            assert budget.held == 10
