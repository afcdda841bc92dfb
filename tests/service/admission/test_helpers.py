"""Who may take part in a long search: threads of slots that nobody uses, as long as nobody does."""

from __future__ import annotations

import asyncio
import threading

from association import Deadline
from association.options import Helpers

from .gates import PATIENCE, gate_of, in_loop, soon, until


class Searching:
    """Something that runs until it is told to end."""

    def __init__(self) -> None:
        self.deadline, self.ended = soon(), threading.Event()

    def __call__(self) -> None:
        self.ended.wait(PATIENCE)

    @property
    def helpers(self) -> Helpers:
        assert self.deadline.helpers is not None
        return self.deadline.helpers


def test_as_many_help_as_slots_are_free() -> None:
    async def scenario() -> None:
        async with gate_of(3, 4) as gate:
            one, other, more = Searching(), Searching(), [threading.Event(), threading.Event()]
            asked = [gate.ask(one, b"one", one.deadline)]
            await until(lambda: gate.running == 1)
            assert one.deadline.helped
            helping = []
            for begun, free in ((more[0], True), (more[1], False)):
                helping.append(one.helpers.run(lambda begun=begun: begun.wait(PATIENCE) and None))  # type: ignore[misc]
                assert one.helpers.free is free
            assert one.helpers.welcome
            asked.append(gate.ask(other, b"other", other.deadline))
            await until(lambda: gate.running == 2)
            assert not one.helpers.welcome
            assert not one.helpers.free
            more[1].set()
            await until(helping[1].done)
            assert one.helpers.welcome
            assert not other.deadline.helped
            more[0].set()
            await until(helping[0].done)
            assert other.deadline.helped
            for searching in (one, other):
                searching.ended.set()
            await asyncio.gather(*asked)

    in_loop(scenario)


def test_who_is_taken_back_before_he_begins_does_not_count() -> None:
    async def scenario() -> None:
        async with gate_of(2, 4) as gate:
            one, begun = Searching(), threading.Event()
            asked = gate.ask(one, b"one", one.deadline)
            await until(lambda: gate.running == 1)
            first, second = (one.helpers.run(lambda: begun.wait(PATIENCE) and None) for _ in range(2))
            assert second.cancel()
            assert not one.helpers.free
            begun.set()
            await until(first.done)
            assert one.helpers.free
            one.ended.set()
            await asked

    in_loop(scenario)


def test_nobody_helps_when_the_gate_has_closed() -> None:
    async def scenario() -> None:
        async with gate_of(2, 4) as gate:
            one, begun = Searching(), threading.Event()
            asked = gate.ask(one, b"one", one.deadline)
            await until(lambda: gate.running == 1)
            helping = one.helpers.run(lambda: begun.wait(PATIENCE) and None)
            assert one.helpers.welcome
            gate.close()
            assert not one.helpers.welcome
            for event in (begun, one.ended):
                event.set()
            await until(helping.done)
            await asked

    in_loop(scenario)


def test_with_one_slot_there_are_none() -> None:
    async def scenario() -> None:
        async with gate_of(1, 4) as gate:
            deadline = soon()
            assert await gate.ask(lambda: deadline.helpers, None, deadline) is None
            assert not deadline.helped
            assert not Deadline().helped

    in_loop(scenario)
