"""Searches that take long give their slots to short ones and go on with a lower priority."""

from __future__ import annotations

import asyncio
import sys
import threading

import pytest

from service.admission.gate import LONG_NICE, LONG_SECONDS, Gate, Ticket

from .gates import A, B, gate_of, in_loop, nice, until, within

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="threads have no priority of their own elsewhere")


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
