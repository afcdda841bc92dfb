"""Work for a client that hangs up ends."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

import pytest

from association import Deadline
from service.http.search_stage import WATCH_AFTER, HangUpError, unless_hung_up

Receive = Callable[[], Awaitable[dict[str, Any]]]


def connected_until(future: asyncio.Future[None]) -> Receive:
    """Return what a server gives to an application whose client stays until a future is done."""

    async def receive() -> dict[str, Any]:
        await future
        return {"type": "http.disconnect"}

    return receive


def run(main: Callable[[Receive, asyncio.Future[None], asyncio.Future[str]], Coroutine[Any, Any, None]]) -> None:
    """Run a test with a client, the future that ends its connection, and the future that ends the work."""

    async def ran() -> None:
        loop = asyncio.get_running_loop()
        gone, result = loop.create_future(), loop.create_future()
        await asyncio.wait_for(main(connected_until(gone), gone, result), 10.0)

    asyncio.run(ran())


async def waited(result: asyncio.Future[str], ends: list[str]) -> str:
    try:
        return await result
    finally:
        ends.append("ended")


def test_the_work_for_a_client_that_hung_up_ends() -> None:
    async def main(receive: Receive, gone: asyncio.Future[None], result: asyncio.Future[str]) -> None:
        deadline, ends = Deadline(), list[str]()
        gone.set_result(None)
        with pytest.raises(HangUpError):
            await unless_hung_up(receive, waited(result, ends), deadline)
        assert deadline.cancelled
        assert ends == ["ended"]
        await asyncio.sleep(0)  # and this task goes on

    run(main)


@pytest.mark.parametrize("first", ["hang-up", "result"])
def test_a_hang_up_at_the_moment_of_the_result_cancels_nothing_later(first: str) -> None:
    async def main(receive: Receive, gone: asyncio.Future[None], result: asyncio.Future[str]) -> None:
        def both() -> None:
            ends = [lambda: gone.set_result(None), lambda: result.set_result("done")]
            for end in ends if first == "hang-up" else reversed(ends):
                end()

        asyncio.get_running_loop().call_later(2.0 * WATCH_AFTER, both)
        assert await unless_hung_up(receive, waited(result, []), Deadline()) == "done"
        await asyncio.sleep(0)

    run(main)
