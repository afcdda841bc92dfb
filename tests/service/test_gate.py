"""Who may search: slots, queue, deadlines, and those who leave."""

from __future__ import annotations

import asyncio
import threading
import time
from pathlib import Path

import pytest
from service.runtime import HangUpError, Runtime

from association import Deadline
from service.admission.gate import SearchGate
from service.http.problems import ProblemError
from service.settings import Settings


def soon() -> Deadline:
    return Deadline(at=time.monotonic() + 30.0)


async def until(condition: object) -> None:
    assert callable(condition)
    for _ in range(1000):
        if condition():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("did not come about")


def test_never_more_at_once_than_slots_and_the_rest_in_order() -> None:
    async def scenario() -> None:
        gate = SearchGate(2, 10)
        running, most, order = 0, 0, []
        lock = threading.Lock()

        def work(number: int) -> int:
            nonlocal running, most
            with lock:
                running += 1
                most = max(most, running)
                order.append(number)
            time.sleep(0.01)
            with lock:
                running -= 1
            return number

        answers = await asyncio.gather(*(gate.run(lambda n=n: work(n), soon()) for n in range(10)))
        assert answers == list(range(10))
        assert most == 2
        assert order[2:] == sorted(order[2:])
        assert (gate.running, gate.waiting) == (0, 0)
        gate.close()

    asyncio.run(scenario())


def test_beyond_the_queue_is_overloaded() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 1)
        release = threading.Event()
        first = asyncio.ensure_future(gate.run(release.wait, soon()))
        second = asyncio.ensure_future(gate.run(lambda: 2, soon()))
        await until(lambda: gate.waiting == 1)
        refusal = gate.refusal()
        assert refusal is not None
        assert refusal.response("id").headers["retry-after"] == "1"
        with pytest.raises(ProblemError) as caught:
            await gate.run(lambda: 3, soon())
        assert caught.value.code == "overloaded"
        further = asyncio.ensure_future(gate.run(lambda: 4, soon(), admitted=True))
        await asyncio.sleep(0)
        release.set()
        assert (await first, await second, await further) == (True, 2, 4)
        gate.close()

    asyncio.run(scenario())


def test_a_deadline_passes_in_the_queue() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 1)
        release = threading.Event()
        first = asyncio.ensure_future(gate.run(release.wait, soon()))
        await until(lambda: gate.running == 1)
        with pytest.raises(ProblemError) as caught:
            await gate.run(lambda: 2, Deadline(at=time.monotonic() + 0.02))
        assert caught.value.code == "deadline_exceeded"
        assert gate.waiting == 0
        release.set()
        await first
        assert gate.running == 0
        gate.close()

    asyncio.run(scenario())


def test_who_leaves_the_queue_frees_the_place_and_who_runs_keeps_the_slot() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 1)
        release = threading.Event()
        first = asyncio.ensure_future(gate.run(release.wait, soon()))
        second = asyncio.ensure_future(gate.run(lambda: 2, soon()))
        await until(lambda: gate.waiting == 1)
        second.cancel()
        await until(lambda: gate.waiting == 0)
        first.cancel()
        await asyncio.sleep(0.02)
        assert gate.running == 1
        release.set()
        await until(lambda: gate.running == 0)
        assert await gate.run(lambda: 3, soon()) == 3
        gate.close()

    asyncio.run(scenario())


class GoneRequest:
    """A request whose client hangs up while the search runs."""

    def __init__(self) -> None:
        self.gone = asyncio.Event()
        self.scope = {"state": {"holder": None}}

    async def receive(self) -> dict[str, str]:
        await self.gone.wait()
        return {"type": "http.disconnect"}


def test_a_client_that_hangs_up_ends_its_search(tmp_path: Path) -> None:
    async def scenario() -> None:
        runtime = Runtime(Settings(data_dir=tmp_path, searches=1))
        deadline, request = soon(), GoneRequest()

        def search() -> None:
            while not deadline.cancelled:
                time.sleep(0.001)

        answer = asyncio.ensure_future(runtime.search(request, search, deadline))  # type: ignore[arg-type]
        await until(lambda: runtime.gate.running == 1)
        request.gone.set()
        with pytest.raises(HangUpError):
            await answer
        await until(lambda: runtime.gate.running == 0)
        runtime.close()

    asyncio.run(scenario())


def test_a_rest_lasts_until_a_slot_is_empty() -> None:
    async def scenario() -> None:
        gate = SearchGate(2, 10)
        release = [threading.Event(), threading.Event()]
        began = [threading.Event(), threading.Event()]

        def work(number: int) -> None:
            began[number].set()
            release[number].wait(10.0)

        def rest() -> float:
            start = time.monotonic()
            gate.rest(0.3)
            return time.monotonic() - start

        one = asyncio.ensure_future(gate.run(lambda: work(0), soon()))
        await until(began[0].is_set)
        assert rest() < 0.1  # a slot is empty
        other = asyncio.ensure_future(gate.run(lambda: work(1), soon()))
        await until(began[1].is_set)
        assert 0.29 < rest() < 3.0
        threading.Timer(0.05, release[0].set).start()
        assert 0.04 < rest() < 0.25
        assert rest() < 0.1  # nothing has come into the empty slot
        release[1].set()
        await asyncio.gather(one, other)
        gate.close()

    asyncio.run(scenario())


def test_a_failure_gives_the_slot_back() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 0)
        with pytest.raises(ZeroDivisionError):
            await gate.run(lambda: 1 // 0, soon())
        assert await gate.run(lambda: 3, soon()) == 3
        gate.close()

    asyncio.run(scenario())


def test_everything_that_runs_can_be_told_to_give_up() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 0)
        deadline = soon()
        release = threading.Event()
        work = asyncio.ensure_future(gate.run(release.wait, deadline))
        await until(lambda: gate.running == 1)
        gate.cancel_all()
        assert deadline.cancelled
        release.set()
        await work
        gate.close()

    asyncio.run(scenario())


def test_a_full_queue_is_shared_between_keys() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 3)
        release = threading.Event()
        greedy = [asyncio.ensure_future(gate.run(release.wait, soon(), b"greedy")) for _ in range(4)]
        await until(lambda: gate.waiting == 3)
        # Alone it may have everything, and beyond that the service is busy.
        refusal = gate.refusal(b"greedy")
        assert refusal is not None
        assert refusal.code == "overloaded"
        modest = [asyncio.ensure_future(gate.run(lambda: "modest", soon(), b"modest")) for _ in range(2)]
        await until(lambda: greedy[3].done() and greedy[2].done())
        for given_up in greedy[2:]:
            assert isinstance(given_up.exception(), ProblemError)
            assert given_up.exception().code == "rate_limited"  # type: ignore[union-attr]
        # Now each has its half: neither gets more, and both are told so.
        for holder in (b"greedy", b"modest"):
            with pytest.raises(ProblemError) as caught:
                await gate.run(lambda: None, soon(), holder)
            assert (caught.value.code, caught.value.response("id").headers["retry-after"]) == ("rate_limited", "1")
        release.set()
        assert await asyncio.gather(*greedy[:2], *modest) == [True, True, "modest", "modest"]
        assert (gate.running, gate.waiting) == (0, 0)
        gate.close()

    asyncio.run(scenario())


def test_turns_go_to_the_key_that_has_used_the_least_time() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 100)
        order: list[str] = []

        def work(name: str, seconds: float) -> None:
            order.append(name)
            time.sleep(seconds)

        release = threading.Event()
        first = asyncio.ensure_future(gate.run(release.wait, soon(), b"long"))
        calls = [gate.run(lambda: work("long", 0.03), soon(), b"long") for _ in range(4)]
        calls += [gate.run(lambda: work("short", 0.001), soon(), b"short") for _ in range(8)]
        waiting = [asyncio.ensure_future(call) for call in calls]
        await until(lambda: gate.waiting == 12)
        release.set()
        await asyncio.gather(first, *waiting)
        # Turn by turn the short ones would be done after 16; by time they are done before the second long one.
        assert order[:2].count("long") <= 1
        assert order.index("short") < 2
        assert [name for name in order[:10] if name == "short"] == ["short"] * 8
        gate.close()

    asyncio.run(scenario())


def test_parts_of_what_was_let_in_are_never_taken_away() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 2)
        release = threading.Event()
        first = asyncio.ensure_future(gate.run(release.wait, soon(), b"batch"))
        parts = [asyncio.ensure_future(gate.run(lambda: 1, soon(), b"batch", admitted=True)) for _ in range(4)]
        await until(lambda: gate.waiting == 4)
        with pytest.raises(ProblemError) as caught:
            await gate.run(lambda: 2, soon(), b"other")
        assert caught.value.code == "overloaded"
        release.set()
        assert await asyncio.gather(first, *parts) == [True, 1, 1, 1, 1]
        gate.close()

    asyncio.run(scenario())


def test_a_turn_that_comes_while_its_caller_leaves_goes_on_to_the_next() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 5)
        release = threading.Event()
        first = asyncio.ensure_future(gate.run(release.wait, soon()))
        second = asyncio.ensure_future(gate.run(lambda: 2, soon()))
        third = asyncio.ensure_future(gate.run(lambda: 3, soon()))
        await until(lambda: gate.waiting == 2)
        release.set()
        # As soon as the first has ended, and before the second can take its turn.
        await asyncio.wait({first})
        second.cancel()
        assert await third == 3
        assert (gate.running, gate.waiting) == (0, 0)
        gate.close()

    asyncio.run(scenario())


def test_no_more_are_let_in_than_find_room() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 1)
        coming = [gate.announce() for _ in range(2)]
        assert gate.full
        assert gate.refusal() is not None
        for announcement in coming:
            # Who was let in is not sent away at the gate, though another is still on the way.
            announcement.end()
            announcement.end()
            assert await gate.run(lambda: 1, soon()) == 1
        assert (gate.announced, gate.full) == (0, False)
        gate.close()

    asyncio.run(scenario())


def test_who_is_on_the_way_counts_for_the_key_it_comes_with() -> None:
    async def scenario() -> None:
        gate = SearchGate(1, 3)
        flood = [gate.announce(b"flood") for _ in range(4)]
        greedy = gate.refusal(b"flood")
        assert greedy is not None
        assert greedy.code == "overloaded"
        assert gate.refusal(b"robot") is None
        robot = gate.announce(b"robot")
        greedy = gate.refusal(b"flood")
        assert greedy is not None
        assert greedy.code == "rate_limited"
        for announcement in (*flood, robot):
            announcement.end()
        assert gate.refusal(b"flood") is None
        gate.close()

    asyncio.run(scenario())
