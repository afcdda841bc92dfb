"""Waiting: for an index, for a database that says nothing, for work whose client hangs up."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import pytest

from linefix.documents import examples
from service.http.exchange import WATCH_AFTER, Exchange, HangUpError
from service.services import Services
from service.settings import Settings
from tests.running import RunningService, asked_again, client_of, until
from tests.service.conftest import empty_database
from tests.service.lines import Line
from tests.service.searches import slow_to_index

RUNNING, BEGUN = "linefix_indexing_running", "linefix_map_cache_misses_total"
SEEN = {"segments": [[0.0, 1.0, 2.0, 1.0]]}


@pytest.mark.long
def test_an_index_that_is_not_done_in_time_is_504_and_goes_on(start_service: Callable[..., RunningService]) -> None:
    """The answer came when the map was indexed, seconds after the deadline; who asked for the same map waited, too."""
    running = start_service(searches=2)
    slow = slow_to_index(100_000)
    tries = count(1)

    def ask(map_id: str, deadline_ms: float) -> int:
        body = {"map": {"map_id": map_id}, "scan": SEEN, "options": {"oriented": False, "deadline_ms": deadline_ms}}
        return running.client.post("/v1/associate", json=body).status_code

    def both_are_told_while_it_is_indexed() -> bool:
        """If the map is not yet read by then, or is indexed already, try again with another map, and more time."""
        number = next(tries)
        brief = 300.0 * 2.0 ** (number % 5 - 1)
        map_id = f"slow-{number}"
        running.client.put(f"/v1/maps/{map_id}", content=slow).raise_for_status()
        told = [(ask(map_id, deadline_ms), running.count(RUNNING) >= 1.0) for deadline_ms in (brief, 200.0)]
        assert {status for status, _ in told} <= {200, 504}
        until(lambda: ask(map_id, 30_000.0) == 200, patience=240.0)
        assert running.count(BEGUN) == number  # once, for all of them
        until(lambda: running.count(RUNNING) == 0.0)
        return told == [(504, True), (504, True)]

    until(both_are_told_while_it_is_indexed)
    assert "a defect" not in running.log()


STORED = {"map": {"map_id": "m"}, "scan": {"segments": examples.SEEN}}
INLINE = {"map": {"segments": examples.WALLS}, "scan": {"segments": examples.SEEN}}


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Line]:
    with empty_database("postgresql", tmp_path) as url, Line.to(url) as made:
        yield made


def test_inline_maps_do_not_wait_for_it(line: Line, start_service: Callable[..., RunningService]) -> None:
    """It held every search slot."""
    running = start_service(database_url=line.url, searches=1, queue=8)
    running.client.put("/v1/maps/m", json=examples.MAP).raise_for_status()
    assert running.client.post("/v1/associate", json=STORED).status_code == 200
    line.hold_up()
    statuses: list[int] = []

    def ask() -> None:
        body = {**STORED, "options": {"deadline_ms": 1500}}
        with client_of(running.url) as client:
            statuses.append(client.post("/v1/associate", json=body).status_code)

    with asked_again(6, ask):
        until(lambda: len(statuses) > 0)  # so all of them have come, and wait again
        batch = {"map": INLINE["map"], "scans": [INLINE["scan"]]}
        for path, body in (("/v1/associate", INLINE), ("/v1/associate:batch", batch)):
            assert running.client.post(path, json=body).status_code == 200
            assert running.count("linefix_searches_running") == 0.0
    assert set(statuses) == {504}
    assert running.client.get("/v1/maps/m").json()["code"] == "not_ready"
    line.mend()
    until(lambda: running.client.post("/v1/associate", json=STORED).status_code == 200)
    assert "a defect" not in running.log()


@pytest.mark.parametrize("ends", [("gone",), ("gone", "result"), ("result", "gone")], ids=", ".join)
def test_the_work_for_a_client_that_hung_up_ends(ends: tuple[str, ...]) -> None:
    """A hang-up at the moment of the result cancels nothing later."""

    async def scenario() -> None:
        loop, ended = asyncio.get_running_loop(), list[str]()
        futures = {name: loop.create_future() for name in ("gone", "result")}

        async def receive() -> dict[str, Any]:
            await futures["gone"]
            return {"type": "http.disconnect"}

        async def work() -> str:
            try:
                return str(await futures["result"])
            finally:
                ended.append("ended")

        head: dict[str, Any] = {"scope": {"headers": []}, "source": receive, "sink": receive, "services": None}
        exchange = Exchange(request_id="x", arrived=0.0, **head)
        loop.call_later(2.0 * WATCH_AFTER, lambda: [futures[name].set_result("done") for name in ends])
        if "result" in ends:
            assert await exchange.unless_hung_up(work()) == "done"
        else:
            with pytest.raises(HangUpError):
                await exchange.unless_hung_up(work())
            assert (exchange.deadline.cancelled, ended) == (True, ["ended"])
        await asyncio.sleep(0)  # and this task goes on

    asyncio.run(asyncio.wait_for(scenario(), 10.0))


def test_others_run_between_the_pieces_of_a_large_answer(tmp_path: Path) -> None:
    """A server waits for slow readers only: for a fast one, ten megabytes went in one turn of the event loop."""
    turns = list[str]()

    async def sink(message: Any = None) -> Any:
        turns.append("a piece")

    async def scenario() -> None:
        head: dict[str, Any] = {"scope": {"headers": []}, "source": sink, "sink": sink}
        exchange = Exchange(request_id="x", services=Services(Settings(data_dir=tmp_path)), **head)
        sent = asyncio.create_task(exchange.send({"type": "http.response.body", "body": bytes(1_000_000)}))
        while not sent.done():
            turns.append("others")
            await asyncio.sleep(0)
        exchange.services.close()

    asyncio.run(scenario())
    assert (turns.count("a piece") > 20, ("a piece", "a piece") in pairwise(turns)) == (True, False)
