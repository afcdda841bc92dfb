"""Slots for several clients: places and order by key, and requests that are being read."""

from __future__ import annotations

import asyncio

import pytest

from service.admission.errors import QueueFullError, ShareUsedError
from service.admission.ticket import Ticket

from .gates import gate_of, in_loop, until


@in_loop
async def test_a_full_queue_is_shared_between_keys() -> None:
    async with gate_of(1, 3) as gate:
        greedy = [await gate.block(b"greedy")]
        greedy += [gate.ask(lambda: True, b"greedy") for _ in range(3)]
        await until(lambda: gate.waiting == 3)
        # Alone it may have everything, and beyond that the service is busy.
        with pytest.raises(QueueFullError):
            gate.require_place(b"greedy")
        gate.require_place(b"modest")
        modest = [gate.ask(lambda: "modest", b"modest") for _ in range(2)]
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
        # A third has a share of one and a third, so one place is its own.
        third = gate.ask(lambda: "third", b"third")
        await until(lambda: sum(asked.done() for asked in gate.asked) == 5)
        gate.release.set()
        assert await third == "third"
        await asyncio.gather(*gate.asked, return_exceptions=True)
        assert [asked.exception() is None for asked in (*greedy[:2], *modest)].count(True) == 3
        assert (gate.running, gate.waiting) == (0, 0)


@in_loop
async def test_more_keys_than_places_are_told_that_it_is_full() -> None:
    async with gate_of(1, 1) as gate:
        await gate.block(b"a")
        gate.ask(lambda: 1, b"b")
        await until(lambda: gate.waiting == 1)
        with pytest.raises(QueueFullError):
            gate.require_place(b"c")
        with pytest.raises(QueueFullError):
            await gate.ask(lambda: 1, b"c")


@in_loop
async def test_turns_go_to_the_key_that_has_used_the_least_time() -> None:
    async with gate_of(1, 100) as gate:
        order: list[str] = []
        await gate.block(b"long")
        calls = [gate.ask(lambda: order.append("long"), b"long") for _ in range(4)]
        calls += [gate.ask(lambda: order.append("short"), b"short") for _ in range(8)]
        await until(lambda: gate.waiting == 12)
        await asyncio.sleep(1.0)
        gate.release.set()
        await asyncio.gather(*calls)
        # Turn by turn the short ones would be done after 12; together they take no second, as the first did.
        assert order == ["short"] * 8 + ["long"] * 4


@in_loop
async def test_parts_of_what_was_let_in_are_never_taken_away() -> None:
    async with gate_of(1, 2) as gate:
        batch = Ticket(b"batch")
        await gate.ask_with(batch, lambda: 0)
        first = await gate.block(b"batch")
        parts = [gate.ask_with(batch, lambda: 1) for _ in range(4)]
        await until(lambda: gate.waiting == 4)
        with pytest.raises(QueueFullError):
            await gate.ask(lambda: 2, b"other")
        gate.release.set()
        assert await asyncio.gather(first, *parts) == [True, 1, 1, 1, 1]


@in_loop
async def test_the_only_place_of_another_is_not_taken() -> None:
    """Searches that no holder may start fill the gate. A holder of one place does not lose it to one that has none."""
    async with gate_of(1, 5) as gate:
        batch = Ticket(b"batch")
        await gate.ask_with(batch, lambda: 0)
        await gate.block(b"batch")
        for _ in range(4):
            gate.ask_with(batch, lambda: 1)
        single = gate.ask(lambda: "single", b"single")
        await until(lambda: gate.waiting == 5)
        with pytest.raises(QueueFullError):
            await gate.ask(lambda: 2, b"third")
        gate.release.set()
        assert await single == "single"


@in_loop
async def test_who_is_expected_has_a_place_until_it_comes() -> None:
    async with gate_of(1, 1) as gate:
        coming = [Ticket(gate=gate) for _ in range(2)]
        for ticket in coming:
            gate.require_place()
            ticket.announce()
            ticket.announce()
        assert gate.full
        with pytest.raises(QueueFullError):
            gate.require_place()
        for ticket in coming:
            # An admitted request is not refused at the gate, although another one is still on the way.
            assert await gate.ask_with(ticket, lambda: 1) == 1
        assert not gate.full


@in_loop
async def test_who_never_comes_gives_the_place_back() -> None:
    async with gate_of(1, 0) as gate:
        ticket = Ticket(gate=gate)
        ticket.arrive()
        ticket.announce()  # too late: it has gone
        assert not gate.full
        other = Ticket(gate=gate)
        other.announce()
        assert gate.full
        other.arrive()
        other.arrive()
        assert not gate.full


@in_loop
async def test_who_is_on_the_way_counts_for_the_key_it_comes_with() -> None:
    async with gate_of(1, 3) as gate:
        tickets = [Ticket(b"flood", gate) for _ in range(4)]
        for ticket in tickets:
            ticket.announce()
        with pytest.raises(QueueFullError):
            gate.require_place(b"flood")
        gate.require_place(b"robot")
        robot = Ticket(b"robot", gate)
        robot.announce()
        with pytest.raises(ShareUsedError):
            gate.require_place(b"flood")
        for ticket in (*tickets, robot):
            ticket.arrive()
        gate.require_place(b"flood")
