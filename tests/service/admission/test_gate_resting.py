"""Who rests: a turn that has gone on for long, while somebody waits who has used less."""

from __future__ import annotations

import asyncio
import threading
import time

import pytest

from service.admission import gate as gates
from service.admission.gate import HEARING_SECONDS, LONG_SECONDS, RESTING

from .gates import PATIENCE, BlockedGate, gate_of, in_loop, soon, until


class Long:
    """A function that looks at its deadline all the time, until it is told to end."""

    def __init__(self) -> None:
        self.deadline = soon()
        self.looks = 0
        self.ended = threading.Event()

    def __call__(self) -> str:
        while not self.ended.is_set() and not self.deadline.passed:
            self.looks += 1
            time.sleep(1e-4)
        return "long"

    def asked_of(self, gate: BlockedGate, holder: bytes) -> asyncio.Future[str]:
        return gate.ask(self, holder, self.deadline)


async def is_held_up(long: Long) -> bool:
    """Tell whether it has not looked for a while."""
    await asyncio.sleep(0.05)
    looks = long.looks
    await asyncio.sleep(0.1)
    return long.looks == looks


def test_a_long_turn_rests_while_somebody_else_has_a_short_one() -> None:
    async def scenario() -> None:
        async with gate_of(1, 4) as gate:
            long = Long()
            first = long.asked_of(gate, b"long")
            await until(lambda: long.looks > 0)
            begun = time.monotonic()
            for number in range(50):
                assert await gate.ask(lambda n=number: n, b"short") == number  # type: ignore[misc]
            # It has been long once and for all.
            assert time.monotonic() - begun < 50 * 0.8 * LONG_SECONDS
            assert not first.done()
            assert (gate.running, gate.waiting) == (1, 0)
            assert not await is_held_up(long)
            long.ended.set()
            assert await first == "long"
            assert (gate.running, gate.waiting) == (0, 0)

    in_loop(scenario)


def test_two_long_ones_share_a_slot_and_never_run_at_once() -> None:
    async def scenario() -> None:
        async with gate_of(1, 4) as gate:
            lock, running, most = threading.Lock(), 0, 0
            begun = time.monotonic()
            spent = {b"one": 0.0, b"other": 0.0}

            class Working(Long):
                def __init__(self, holder: bytes) -> None:
                    super().__init__()
                    self.holder = holder

                def __call__(self) -> str:
                    nonlocal running, most
                    while time.monotonic() < begun + 1.0:
                        with lock:
                            running += 1
                            most = max(most, running)
                        time.sleep(1e-3)
                        spent[self.holder] += 1e-3
                        with lock:
                            running -= 1
                        assert not self.deadline.passed
                    return "worked"

            both = [Working(holder).asked_of(gate, holder) for holder in spent]
            assert await asyncio.gather(*both) == ["worked", "worked"]
            assert most == 1
            assert min(spent.values()) > 0.35 * sum(spent.values()), spent

    in_loop(scenario)


def test_nobody_rests_for_others_of_the_same_holder_or_for_who_has_used_more() -> None:
    async def scenario() -> None:
        async with gate_of(1, 8) as gate:
            long = Long()
            gate.expect(b"used")
            await gate.ask(lambda: time.sleep(0.5), b"used")
            gate.expect(b"long")  # active from here on, with as much
            await gate.ask(lambda: time.sleep(0.5), b"used")
            first = long.asked_of(gate, b"long")
            await until(lambda: long.looks > 0)
            of_same, of_used = gate.ask(lambda: 1, b"long"), gate.ask(lambda: 2, b"used")
            await asyncio.sleep(5 * LONG_SECONDS)
            assert not of_same.done()
            assert not of_used.done()
            # Until it has used as much itself.
            assert await of_used == 2
            assert not of_same.done()
            long.ended.set()
            assert (await first, await of_same) == ("long", 1)

    in_loop(scenario)


def test_what_rests_goes_on_before_its_holder_begins_anything_else() -> None:
    async def scenario() -> None:
        async with gate_of(1, 8) as gate:
            long, later = Long(), Long()
            first, second = (one.asked_of(gate, b"long") for one in (long, later))
            await until(lambda: long.looks > 0)
            for _ in range(3 * RESTING):
                await gate.ask(lambda: None, b"short")
            assert later.looks == 0
            for one in (long, later):
                one.ended.set()
            assert (await first, await second) == ("long", "long")

    in_loop(scenario)


def test_a_short_turn_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    # A busy machine holds up for tens of milliseconds what would be short.
    monkeypatch.setattr(gates, "LONG_SECONDS", 2.0)

    async def scenario() -> None:
        async with gate_of(1, 8) as gate:
            order = []
            deadline = soon()

            def short() -> None:
                ends = time.monotonic() + 0.1
                while time.monotonic() < ends:
                    assert not deadline.passed
                order.append("first")

            first = gate.ask(short, b"one", deadline)
            second = gate.ask(lambda: order.append("second"), b"other")
            await asyncio.gather(first, second)
            assert order == ["first", "second"]

    in_loop(scenario)


def test_no_more_rest_than_may() -> None:
    """Each has a holder of its own, and rests for the next; the last finds no place to rest."""

    async def scenario() -> None:
        async with gate_of(1, 20) as gate:
            longs = [Long() for _ in range(RESTING + 1)]
            asked = []
            for number, long in enumerate(longs):
                asked.append(long.asked_of(gate, b"%d" % number))
                await until(lambda long=long: long.looks > 0)  # type: ignore[misc]
            await until(lambda: gate.waiting == RESTING)
            short = gate.ask(lambda: "short", b"short")
            await asyncio.sleep(0.3)
            assert gate.waiting == RESTING + 1
            assert not short.done()
            longs[0].ended.set()
            for long in longs:
                long.ended.set()
            assert await asyncio.gather(*asked) == ["long"] * len(longs)
            assert await short == "short"

    in_loop(scenario)


def test_a_turn_rests_as_long_as_it_takes() -> None:
    """Longer than it takes to notice that the gate has closed."""

    async def scenario() -> None:
        async with gate_of(1, 8) as gate:
            long = Long()
            first = long.asked_of(gate, b"long")
            await until(lambda: long.looks > 0)
            other = gate.ask(gate.release.wait, b"other")
            await until(lambda: gate.waiting == 1 and gate.running == 1)
            await asyncio.sleep(1.5 * HEARING_SECONDS)
            assert await is_held_up(long)
            gate.release.set()
            assert await other
            long.ended.set()
            assert await first == "long"

    in_loop(scenario)


def test_nobody_rests_when_the_loop_has_ended() -> None:
    """A search that goes on beyond it, while others wait, is not ended by that."""
    gate, deadline, ended, looked = BlockedGate(1, 8), soon(), threading.Event(), threading.Event()
    found: list[bool] = []

    def late() -> None:
        ended.wait()
        time.sleep(1.5 * LONG_SECONDS)
        try:
            found.append(deadline.passed)
        finally:
            looked.set()

    async def scenario() -> None:
        gate.ask(late, b"long", deadline)
        await until(lambda: gate.running == 1)
        gate.ask(gate.release.wait, b"other")
        await until(lambda: gate.waiting == 1)

    loop = asyncio.new_event_loop()
    loop.set_exception_handler(lambda *_: None)  # tasks that it leaves behind are meant to be
    loop.run_until_complete(scenario())
    loop.close()  # as it is, with what runs and what waits
    ended.set()
    assert looked.wait(PATIENCE)
    assert found == [False]
    gate.close()


def test_what_rests_goes_on_when_the_gate_closes() -> None:
    """Else its thread would keep the process from ending."""

    async def scenario() -> None:
        async with gate_of(1, 8) as gate:
            long = Long()
            first = long.asked_of(gate, b"long")
            await until(lambda: long.looks > 0)
            gate.ask(gate.release.wait, b"other")
            await until(lambda: gate.waiting == 1)
            assert await is_held_up(long)
            gate.close()
            long.ended.set()
            assert await first == "long"

    in_loop(scenario)
