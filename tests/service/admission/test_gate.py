"""Slots for searches: queue, deadlines, and clients that leave."""

from __future__ import annotations

import asyncio
import gc
import os
import sys
import threading
import time
import weakref
from contextlib import suppress

import pytest

from association import CancelledError, Deadline
from service.admission.errors import DeadlinePassedError, QueueFullError
from service.admission.gate import HEARING_SECONDS, LONG_SECONDS, Gate
from service.admission.ticket import Ticket

from .gates import PATIENCE, gate_of, in_loop, soon, until


@in_loop
async def test_never_more_at_once_than_slots_and_the_rest_in_order() -> None:
    async with gate_of(2, 8) as gate:
        running, most, order = 0, 0, []
        lock, both = threading.Lock(), threading.Barrier(2)

        def work(number: int) -> int:
            nonlocal running, most
            with lock:
                running += 1
                most = max(most, running)
                order.append(number)
            both.wait(PATIENCE)
            with lock:
                running -= 1
            return number

        answers = await asyncio.gather(*(gate.ask(lambda n=n: work(n)) for n in range(10)))  # type: ignore[misc]
        assert answers == list(range(10))
        assert most == 2
        # The system decides which of two threads is the first to start.
        assert [sorted(order[i : i + 2]) for i in range(0, 10, 2)] == [[i, i + 1] for i in range(0, 10, 2)]
        assert (gate.running, gate.waiting) == (0, 0)


@in_loop
async def test_beyond_the_queue_it_is_full() -> None:
    async with gate_of(1, 2) as gate:
        assert not gate.full
        first = await gate.block()
        second = gate.ask(lambda: 2)
        await until(lambda: gate.waiting == 1)
        assert not gate.full
        gate.require_place()
        third = gate.ask(lambda: 3)
        await until(lambda: gate.waiting == 2)
        assert gate.full
        with pytest.raises(QueueFullError):
            gate.require_place()
        with pytest.raises(QueueFullError):
            await gate.ask(lambda: 4)
        assert gate.waiting == 2
        gate.release.set()
        assert [await first, await second, await third] == [True, 2, 3]
        assert not gate.full


@in_loop
async def test_a_further_turn_waits_however_long_the_queue_is() -> None:
    async with gate_of(1, 1) as gate:
        ticket = Ticket()
        assert not ticket.admitted
        assert await gate.ask_with(ticket, lambda: 1) == 1
        assert ticket.admitted
        await gate.block()
        gate.expect(None)
        assert gate.full, "one runs, and one is on the way"
        gate.expect_no_longer(None)
        gate.ask(lambda: 2)
        await until(lambda: gate.waiting == 1)
        further = gate.ask_with(ticket, lambda: 3)
        await until(lambda: gate.waiting == 2)
        assert gate.full, "by more than it has places"
        gate.release.set()
        assert await further == 3


@in_loop
async def test_a_deadline_passes_in_the_queue() -> None:
    async with gate_of(1, 1) as gate:
        first = await gate.block()
        with pytest.raises(DeadlinePassedError):
            await gate.ask(lambda: 2, deadline=Deadline(at=time.monotonic() + 0.05))
        assert gate.waiting == 0
        gate.release.set()
        await first
        assert gate.running == 0
        # One that has passed already is not even looked at, though there is room.
        with pytest.raises(DeadlinePassedError):
            await gate.ask(lambda: pytest.fail("searched"), deadline=Deadline(at=time.monotonic()))
        assert gate.running == 0


@in_loop
async def test_what_does_not_heed_the_deadline_is_waited_for_until_then() -> None:
    """It goes on and keeps its slot; what heeds the deadline has its answer waited for."""
    async with gate_of(2, 0) as gate:
        soon_over = Deadline(at=time.monotonic() + 0.1)
        deaf = gate.ask(gate.release.wait, deadline=soon_over, heeds=lambda: False)
        hearing = gate.ask(gate.release.wait, deadline=soon_over)
        with pytest.raises(DeadlinePassedError):
            await deaf
        assert soon_over.passed
        assert (gate.running, hearing.done()) == (2, False)
        gate.release.set()
        assert await hearing
        await until(lambda: gate.running == 0)


@in_loop
async def test_what_has_come_to_heed_the_deadline_by_then_is_waited_for() -> None:
    async with gate_of(1, 0) as gate:
        deadline, asked = Deadline(at=time.monotonic() + 0.1), threading.Event()

        def heeds() -> bool:
            asked.set()
            return True

        late = gate.ask(gate.release.wait, deadline=deadline, heeds=heeds)
        await until(asked.is_set)
        assert deadline.passed
        assert not late.done()
        gate.release.set()
        assert await late


@in_loop
async def test_without_a_deadline_a_turn_is_waited_for() -> None:
    async with gate_of(1, 1) as gate:
        await gate.block()
        waiting = gate.ask(lambda: 2, deadline=Deadline())
        await until(lambda: gate.waiting == 1)
        gate.release.set()
        assert await waiting == 2


@in_loop
async def test_who_leaves_the_queue_frees_the_place_and_who_runs_keeps_the_slot() -> None:
    async with gate_of(1, 1) as gate:
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
async def test_a_turn_that_comes_as_its_caller_leaves_is_handed_on_and_costs_nothing(used: float) -> None:
    """Its holder has used as much as the other one, whose turn it then is, or less."""
    async with gate_of(1, 8) as gate:
        order: list[str] = []
        for holder in (b"one", b"other"):
            gate.expect(holder)
        await gate.ask(lambda: time.sleep(used), b"other") if used else None
        first = await gate.block()
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
        assert order == (["one", "other"] if used else ["other", "one"])


@in_loop
async def test_a_failure_gives_the_slot_back() -> None:
    async with gate_of(1, 0) as gate:
        with pytest.raises(ZeroDivisionError):
            await gate.ask(lambda: 1 // 0)
        assert await gate.ask(lambda: 3) == 3


@in_loop
async def test_what_fails_after_its_caller_has_left_is_not_reported_as_a_defect() -> None:
    reported: list[dict[str, object]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: reported.append(context))
    async with gate_of(1, 0) as gate:

        def fail() -> None:
            gate.release.wait()
            raise ZeroDivisionError

        asked = gate.ask(fail)
        await until(lambda: gate.running == 1)
        asked.cancel()
        await asyncio.wait({asked})
        gate.release.set()
        await until(lambda: gate.running == 0)
        # asyncio reports an exception that was never retrieved.
        gate.asked.clear()
        del asked
        gc.collect()
    assert not reported


@in_loop
async def test_what_cannot_be_started_gives_the_slot_back() -> None:
    gate = Gate(1, 0)
    gate.close()
    for _ in range(2):
        with pytest.raises(RuntimeError, match="closed"):
            await gate.run(lambda: 1, soon(), Ticket(), lambda: True)
    assert gate.running == 0


@in_loop
async def test_everything_that_runs_is_told_to_give_up() -> None:
    async with gate_of(2, 0) as gate:
        deadlines = soon(), soon()
        works = [await gate.block(deadline=deadline) for deadline in deadlines]
        gate.cancel_all()
        assert [deadline.cancelled for deadline in deadlines] == [True, True]
        gate.release.set()
        assert await asyncio.gather(*works) == [True, True]


@in_loop
async def test_what_does_not_hear_is_not_waited_for() -> None:
    async with gate_of(1, 0) as gate:
        deaf = await gate.block()
        gate.cancel_all()
        with pytest.raises(CancelledError):
            await deaf
        assert gate.running == 1  # the thread is still at it


@in_loop
async def test_what_hears_soon_is_waited_for() -> None:
    async with gate_of(1, 0) as gate:
        deadline = soon()

        def search() -> str:
            while not deadline.cancelled:
                time.sleep(0.001)
            time.sleep(0.05)
            return "best so far"

        hearing = gate.ask(search, deadline=deadline)
        await until(lambda: gate.running == 1)
        gate.cancel_all()
        assert await hearing == "best so far"


@in_loop
async def test_to_close_waits_for_nothing() -> None:
    async with gate_of(1, 0) as gate:
        running = await gate.block()
        threading.Timer(1.0, gate.release.set).start()
        gate.close()
        assert not gate.release.is_set()
        gate.release.set()
        assert await running


@in_loop
async def test_told_to_give_up_twice_it_ends_once() -> None:
    failures: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: failures.append(context))
    async with gate_of(1, 0) as gate:
        gate.cancel_all()  # nothing has run yet
        deaf = await gate.block()
        gate.cancel_all()
        gate.cancel_all()
        both = asyncio.Event()
        asyncio.get_running_loop().call_later(HEARING_SECONDS, both.set)
        await both.wait()
        await until(deaf.done)
    assert failures == []


@pytest.mark.skipif(sys.platform != "linux", reason="threads have no priority of their own elsewhere")
@in_loop
async def test_threads_may_go_behind_others() -> None:
    def nice() -> int:
        return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())

    behind, usual = Gate(1, 1, nice=3), Gate(1, 1)
    before = nice()
    assert [await gate.run(nice, soon(), Ticket(), lambda: True) for gate in (behind, usual)] == [
        before + 3,
        before,
    ]
    assert nice() == before
    for gate in (behind, usual):
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
            await gate.run(fail, soon(), Ticket(None), lambda: True)

    async def scenario() -> None:
        async with gate_of(1, 1, long_per_slot) as gate:
            await refused(gate)
            await until(lambda: kept[0]() is None)

    gc.disable()
    try:
        in_loop(scenario)()
    finally:
        gc.enable()
