"""Work for a client that hangs up ends."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from association import Deadline
from service.http.search_stage import WATCH_AFTER, HangUpError, unless_hung_up


@pytest.mark.parametrize("ends", [("gone",), ("gone", "result"), ("result", "gone")], ids=", ".join)
def test_the_work_for_a_client_that_hung_up_ends(ends: tuple[str, ...]) -> None:
    """A hang-up at the moment of the result cancels nothing later."""

    async def scenario() -> None:
        loop, deadline, ended = asyncio.get_running_loop(), Deadline(), list[str]()
        futures = {name: loop.create_future() for name in ("gone", "result")}

        async def receive() -> dict[str, Any]:
            await futures["gone"]
            return {"type": "http.disconnect"}

        async def work() -> str:
            try:
                return str(await futures["result"])
            finally:
                ended.append("ended")

        loop.call_later(2.0 * WATCH_AFTER, lambda: [futures[name].set_result("done") for name in ends])
        if "result" in ends:
            assert await unless_hung_up(receive, work(), deadline) == "done"
        else:
            with pytest.raises(HangUpError):
                await unless_hung_up(receive, work(), deadline)
            assert (deadline.cancelled, ended) == (True, ["ended"])
        await asyncio.sleep(0)  # and this task goes on

    asyncio.run(asyncio.wait_for(scenario(), 10.0))
