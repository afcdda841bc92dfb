"""Slots for searches: the queue and its shares, deadlines, callers that leave; long searches give way to short ones."""

from __future__ import annotations

import asyncio
import gc
import sys
import threading
import time
import weakref
from contextlib import suppress
from functools import partial

import pytest

from association import CancelledError, Deadline
from linefix.documents.errors import DeadlinePassedError
from service.admission.gate import HEARING_SECONDS, LONG_NICE, LONG_SECONDS, Gate, Ticket
from service.errors import QueueFullError, ShareUsedError

from .gates import A, B, gate_of, in_loop, nice, until, within

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="threads have no priority of their own elsewhere")


@in_loop
async def test_searches_of_one_caller_have_their_slot_in_order() -> None:
    async with gate_of(1) as gate:
        order: list[int] = []
        first = await gate.block()
        calls = [gate.ask(partial(order.append, number)) for number in range(5)]
        await until(lambda: gate.waiting == 5)
        gate.release.set()
        await asyncio.gather(first, *calls)
        assert order == [*range(5)]


@in_loop
async def test_full_places_are_shared_between_keys() -> None:
    async with gate_of(1, 4) as gate:
        greedy = [await gate.block(b"greedy")]
        greedy += [gate.ask(lambda: True, b"greedy") for _ in range(3)]
        await until(lambda: gate.waiting == 3)
        # Alone it may have everything, and beyond that the service is busy.
        with pytest.raises(QueueFullError):
            gate.require_place(b"greedy")
        gate.require_place(b"modest")
        for _ in range(2):
            gate.ask(lambda: "modest", b"modest")
        # The youngest have to go.
        for given_up in (greedy[3], greedy[2]):
            with pytest.raises(ShareUsedError):
                await given_up
        # Now each has its half: neither gets more, and both are refused.
        for holder in (b"greedy", b"modest"):
            with pytest.raises(ShareUsedError):
                gate.require_place(holder)
            with pytest.raises(ShareUsedError):
                await gate.ask(lambda: None, holder)
        # A third has a share of one and a third, so one place is its own; a fourth to sixth find it full.
        third = gate.ask(lambda: "third", b"third")
        await until(lambda: sum(asked.done() for asked in gate.asked) == 5)
        gate.release.set()
        assert await third == "third"


@in_loop
async def test_parts_of_what_had_a_slot_are_never_taken_away() -> None:
    async with gate_of(1, 2) as gate:
        batch = Ticket(b"batch")
        await gate.ask(lambda: 0, ticket=batch)
        first = gate.ask(gate.release.wait, ticket=batch)
        parts = [gate.ask(lambda: 1, ticket=batch) for _ in range(4)]
        single = gate.ask(lambda: "single", b"single")
        await until(lambda: gate.waiting == 5)
        with pytest.raises(QueueFullError):
            await gate.ask(lambda: 2, b"other")
        gate.release.set()
        assert await asyncio.gather(first, *parts, single) == [True, 1, 1, 1, 1, "single"]
        gate.leave(batch)
        gate.leave(batch)
        gate.require_place(None)


@in_loop
async def test_slots_go_to_the_key_that_has_used_the_least_time() -> None:
    async with gate_of(1) as gate:
        order: list[str] = []
        await gate.block(b"long")
        calls = [gate.ask(lambda: order.append("long"), b"long") for _ in range(4)]
        calls += [gate.ask(lambda: order.append("short"), b"short") for _ in range(8)]
        await until(lambda: gate.waiting == 12)
        await asyncio.sleep(1.0)
        gate.release.set()
        await asyncio.gather(*calls)
        # One by one the short ones would be done after 12; together they take no second, as the first did.
        assert order == ["short"] * 8 + ["long"] * 4


@in_loop
async def test_a_newcomer_starts_where_the_least_served_is() -> None:
    async with gate_of(1) as gate:
        stays = Ticket(A)
        gate.enter(stays)
        await gate.ask(lambda: time.sleep(0.2), A)
        new = Ticket(B)
        gate.enter(new)
        await gate.ask(lambda: time.sleep(0.05), B)
        await gate.block(b"c")
        order: list[str] = []
        calls = [gate.ask(lambda: order.append("b"), B), gate.ask(lambda: order.append("a"), A)]
        await until(lambda: gate.waiting == 2)
        gate.release.set()
        await asyncio.gather(*calls)
        assert order == ["a", "b"], "from nothing, the newcomer would be first for a long time"
        for ticket in (stays, new):
            gate.leave(ticket)


@in_loop
async def test_a_deadline_passes_in_the_queue() -> None:
    async with gate_of(1) as gate:
        first = await gate.block()
        with pytest.raises(DeadlinePassedError):
            await gate.ask(lambda: 2, deadline=within(0.05))
        assert gate.waiting == 0
        waiting = gate.ask(lambda: 2, deadline=Deadline())  # has all the time
        gate.release.set()
        assert [await first, await waiting] == [True, 2]
        # One that has passed already is not even looked at, though there is room.
        with pytest.raises(DeadlinePassedError):
            await gate.ask(lambda: pytest.fail("searched"), deadline=within(0.0))


@in_loop
async def test_a_gate_may_wait_for_a_function_until_the_deadline_and_no_longer() -> None:
    """The function goes on and keeps its slot; other gates wait for the answer."""
    async with gate_of(1, waits=False) as impatient, gate_of(1) as patient:
        deadline = within(0.1)
        left = impatient.ask(impatient.release.wait, deadline=deadline)
        awaited = patient.ask(patient.release.wait, deadline=deadline)
        with pytest.raises(DeadlinePassedError):
            await left
        assert (impatient.running, awaited.done()) == (1, False)
        impatient.release.set()
        patient.release.set()
        assert await awaited
        await until(lambda: impatient.running == 0)


@in_loop
async def test_who_leaves_the_queue_frees_the_place_and_who_runs_keeps_the_slot() -> None:
    async with gate_of(1, 2) as gate:
        first = await gate.block()
        second = gate.ask(lambda: 2)
        await until(lambda: gate.waiting == 1)
        second.cancel()
        await until(lambda: gate.waiting == 0)
        first.cancel()
        await asyncio.wait({first})
        assert gate.running == 1
        gate.release.set()
        await until(lambda: gate.running == 0)
        assert await gate.ask(lambda: 3) == 3


@pytest.mark.parametrize("used", [0.0, 0.2])
@in_loop
async def test_a_slot_that_comes_as_its_caller_leaves_is_handed_on_and_costs_nothing(used: float) -> None:
    """Its holder has used as much as the other one, whose turn it then is, or less."""
    async with gate_of(1) as gate:
        order: list[str] = []
        tickets = [Ticket(b"one"), Ticket(b"other")]
        for ticket in tickets:
            gate.enter(ticket)
        await gate.ask(lambda: time.sleep(used), b"other") if used else None
        first = await gate.block(b"first")
        leaving = gate.ask(lambda: order.append("leaving"), b"one")
        await until(lambda: gate.waiting == 1)
        asked = [gate.ask(lambda: order.append("one"), b"one"), gate.ask(lambda: order.append("other"), b"other")]
        await until(lambda: gate.waiting == 3)
        gate.release.set()
        while gate.waiting == 3:
            await asyncio.sleep(0)
        leaving.cancel()
        await asyncio.gather(first, *asked)
        assert leaving.cancelled()
        assert order == ["one", "other"]
        for ticket in tickets:
            gate.leave(ticket)


@in_loop
async def test_a_failure_gives_the_slot_back_and_is_no_defect_where_the_caller_has_left() -> None:
    async with gate_of(1) as gate:
        with pytest.raises(ZeroDivisionError):
            await gate.ask(lambda: 1 // 0)

        def fail() -> None:
            gate.release.wait()
            raise ZeroDivisionError

        asked = gate.ask(fail)
        await until(lambda: gate.running == 1)
        asked.cancel()
        await asyncio.wait({asked})
        gate.release.set()
        await until(lambda: gate.running == 0)
        assert await gate.ask(lambda: 3) == 3
        gate.asked.clear()
        del asked
        gc.collect()


@in_loop
async def test_what_cannot_be_started_gives_the_slot_back() -> None:
    gate = Gate(1)
    gate.close()
    for _ in range(2):
        with pytest.raises(RuntimeError, match="closed"):
            await gate.run(lambda: 1, within(), Ticket())
    assert gate.running == 0


@in_loop
async def test_everything_that_runs_is_told_to_give_up_and_what_does_not_hear_is_not_waited_for() -> None:
    async with gate_of(2) as gate:
        gate.cancel_all()  # nothing has run yet
        deadline = within()

        def search() -> str:
            while not deadline.cancelled:
                time.sleep(0.001)
            time.sleep(HEARING_SECONDS / 10)
            return "best so far"

        hearing, deaf = gate.ask(search, deadline=deadline), await gate.block()
        gate.cancel_all()
        gate.cancel_all()
        assert await hearing == "best so far"
        with pytest.raises(CancelledError):
            await deaf
        assert gate.running == 1  # the thread is still at it
        gate.close()


@pytest.mark.parametrize("long_per_slot", [0, 1])
def test_an_error_keeps_nothing_that_the_function_worked_with(long_per_slot: int) -> None:
    """Refused requests kept 144 MB of maps until the garbage collector came by: an error was in a cycle."""

    class Worked:
        pass

    kept: list[weakref.ref[Worked]] = []

    def fail() -> None:
        worked = Worked()
        kept.append(weakref.ref(worked))
        time.sleep(2.0 * LONG_SECONDS * long_per_slot)
        raise ValueError

    async def refused(gate: Gate) -> None:
        with suppress(ValueError):  # pytest.raises keeps the error itself
            await gate.run(fail, within(), Ticket())

    async def scenario() -> None:
        async with gate_of(1, None, long_per_slot) as gate:
            await refused(gate)
            await until(lambda: kept[0]() is None)

    gc.disable()
    try:
        in_loop(scenario)()
    finally:
        gc.enable()


@in_loop
async def test_threads_may_go_behind_others() -> None:
    behind, usual = Gate(1, nice=3), Gate(1)
    before = nice()
    assert [await gate.run(nice, within(), Ticket()) for gate in (behind, usual)] == [before + 3, before]
    assert nice() == before
    for gate in (behind, usual):
        gate.close()


@in_loop
async def test_a_long_search_gives_its_slot_to_a_short_one_and_goes_on_with_a_lower_priority() -> None:
    """Its thread runs nothing else."""
    async with gate_of(1, 3, 4) as gate:
        for _ in range(2):
            release = threading.Event()
            found: list[int] = []

            def search(release: threading.Event = release, found: list[int] = found) -> None:
                release.wait()
                found.append(nice())

            long = gate.ask(search, A)
            assert await gate.ask(nice, B) == nice()
            assert not long.done()
            assert gate.running == 1
            release.set()
            await long
            assert found == [min(nice() + LONG_NICE, 19)]
            assert [await gate.ask(nice, A) for _ in range(3)] == [nice()] * 3


@in_loop
async def test_one_holder_has_half_of_the_long_ones_and_others_go_on() -> None:
    async with gate_of(1, None, 4) as gate:
        long = [gate.ask(gate.release.wait, A) for _ in range(4)]
        await until(lambda: gate.running == 2)
        assert await gate.ask(lambda: "short", B) == "short"
        # Further searches of A wait until one of its own ends.
        assert (gate.running, gate.waiting) == (2, 2)
        long[0].cancel()  # who leaves keeps them running until they end
        await until(long[0].done)
        assert (gate.running, gate.waiting) == (2, 2)
        gate.release.set()
        await asyncio.gather(*long[1:])


@in_loop
async def test_beyond_all_that_may_be_long_a_search_keeps_its_slot_until_one_ends() -> None:
    async with gate_of(1, None, 2) as gate:
        first = threading.Event()
        long = [gate.ask(first.wait, A), gate.ask(gate.release.wait, B), gate.ask(gate.release.wait, b"c")]
        await until(lambda: gate.running == 3)
        waiting = gate.ask(lambda: "short", b"d")
        await asyncio.sleep(2 * LONG_SECONDS)
        assert gate.waiting == 1
        first.set()
        assert await waiting == "short"
        gate.release.set()
        await asyncio.gather(*long)
