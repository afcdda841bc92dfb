"""Searches that take long: they go on behind short ones, and give their slots back."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable

import pytest

from service.admission.gate import LONG_NICE
from tests.service.admission.gates import gate_of, in_loop, until

A, B = b"a", b"b"
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="threads have no priority of their own elsewhere")


def nice() -> int:
    return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())


def lasting(release: threading.Event, found: list[int]) -> Callable[[], None]:
    """Return a search that runs until it is released, and then notes its priority."""

    def search() -> None:
        release.wait()
        found.append(nice())

    return search


@in_loop
async def test_a_long_search_gives_its_slot_to_a_short_one_and_goes_on_with_a_lower_priority() -> None:
    async with gate_of(1, 4, 4) as gate:
        found: list[int] = []
        long = gate.ask(lasting(gate.release, found), A)
        assert await gate.ask(nice, B) == nice()
        assert not long.done()
        assert gate.running == 1
        gate.release.set()
        await long
        assert found == [min(nice() + LONG_NICE, 19)]
        assert gate.running == 0


@in_loop
async def test_a_thread_whose_priority_was_lowered_runs_nothing_else() -> None:
    async with gate_of(1, 8, 4) as gate:
        for _ in range(3):
            release = threading.Event()
            long = gate.ask(lasting(release, []), A)
            assert await gate.ask(nice, B) == nice()
            release.set()
            await long
            assert [await gate.ask(nice, A) for _ in range(3)] == [nice()] * 3


@in_loop
async def test_one_holder_has_half_of_the_long_ones_and_others_go_on() -> None:
    async with gate_of(1, 8, 4) as gate:
        long = [gate.ask(lasting(gate.release, []), A) for _ in range(4)]
        await until(lambda: gate.running == 2)
        assert await gate.ask(lambda: "short", B) == "short"
        # Further searches of A wait until one of its own ends.
        assert (gate.running, gate.waiting) == (2, 2)
        gate.release.set()
        for one in long:
            await one


@in_loop
async def test_beyond_all_that_may_be_long_a_search_keeps_its_slot_until_one_ends() -> None:
    async with gate_of(1, 8, 2) as gate:
        first = threading.Event()
        long = [gate.ask(lasting(first, []), A), gate.ask(lasting(gate.release, []), B)]
        await until(lambda: gate.running == 2)
        third = gate.ask(lasting(gate.release, []), b"c")
        waiting = gate.ask(lambda: "short", b"d")
        await until(lambda: gate.running == 3)
        assert gate.waiting == 1
        first.set()
        assert await waiting == "short"
        gate.release.set()
        for one in (*long, third):
            await one


@in_loop
async def test_long_ones_have_places_like_all_others() -> None:
    async with gate_of(1, 1, 4) as gate:
        long = [gate.ask(lasting(gate.release, []), A) for _ in range(2)]
        await until(lambda: gate.running == 2)
        assert gate.full
        gate.release.set()
        for one in long:
            await one
        assert not gate.full


@in_loop
async def test_who_leaves_a_long_search_gives_its_place_back_when_it_ends() -> None:
    async with gate_of(1, 4, 4) as gate:
        long = gate.ask(lasting(gate.release, []), A)
        assert await gate.ask(lambda: "short", B) == "short"
        long.cancel()
        await until(long.done)
        assert gate.running == 1
        gate.release.set()
        await until(lambda: gate.running == 0)


@in_loop
async def test_a_short_search_keeps_its_priority_and_its_slot() -> None:
    async with gate_of(1, 4, 4) as gate:
        order: list[str] = []

        def short(name: str) -> int:
            order.append(name)
            time.sleep(0.001)
            return nice()

        asked = [gate.ask(lambda name=name: short(name), A) for name in "abcd"]  # type: ignore[misc]
        assert [await one for one in asked] == [nice()] * 4
        assert order == list("abcd")
