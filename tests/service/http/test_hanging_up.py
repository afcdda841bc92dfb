"""Giving up what is done for a client that is gone."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

import pytest

from association import Deadline
from service.http.hanging_up import FIRST_SECONDS, HangUpError, unless


async def after(seconds: float) -> None:
    await asyncio.sleep(seconds)


async def worked(seconds: float, ends: list[str]) -> str:
    try:
        await asyncio.sleep(seconds)
    finally:
        ends.append("ended")
    return "done"


def run(main: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(main, 10.0))


def test_who_stays_gets_what_came_of_it() -> None:
    async def main() -> None:
        deadline, ends, tasks = Deadline(), list[str](), asyncio.all_tasks()
        assert await unless(lambda: after(60.0), worked(2.0 * FIRST_SECONDS, ends), deadline) == "done"
        assert not deadline.cancelled
        await asyncio.sleep(0.01)
        assert asyncio.all_tasks() == tasks  # nobody watches any more

    run(main())


def test_a_short_answer_is_not_watched() -> None:
    async def main() -> None:
        asked: list[int] = []

        async def gone() -> None:
            asked.append(1)

        assert await unless(gone, worked(0.0, []), Deadline()) == "done"
        await asyncio.sleep(2.0 * FIRST_SECONDS)
        assert asked == []

    run(main())


def test_what_is_done_for_who_is_gone_ends() -> None:
    async def main() -> None:
        deadline, ends = Deadline(), list[str]()
        with pytest.raises(HangUpError):
            await unless(lambda: after(0.01), worked(60.0, ends), deadline)
        assert deadline.cancelled
        assert ends == ["ended"]
        await asyncio.sleep(0.01)  # and this task goes on

    run(main())


def test_who_leaves_at_the_moment_of_the_result_cancels_nothing_later() -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        for first in (0, 1):
            left, result = loop.create_future(), loop.create_future()

            async def gone(left: asyncio.Future[None] = left) -> None:
                await left

            async def work(result: asyncio.Future[None] = result) -> str:
                await result
                return "done"

            def both(pair: tuple[asyncio.Future[None], ...]) -> None:
                for future in pair:
                    future.set_result(None)

            loop.call_later(2.0 * FIRST_SECONDS, both, (left, result) if first else (result, left))
            assert await unless(gone, work(), Deadline()) == "done"
            await asyncio.sleep(0.01)

    run(main())


def test_a_server_that_ends_is_no_client_that_is_gone() -> None:
    async def main() -> None:
        deadline, ends = Deadline(), list[str]()
        task = asyncio.ensure_future(unless(lambda: after(60.0), worked(60.0, ends), deadline))
        await asyncio.sleep(2.0 * FIRST_SECONDS)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert deadline.cancelled
        assert ends == ["ended"]

    run(main())


def test_an_error_of_the_work_is_told() -> None:
    async def wrong() -> None:
        raise ZeroDivisionError

    async def main() -> None:
        with pytest.raises(ZeroDivisionError):
            await unless(lambda: after(60.0), wrong(), Deadline())

    run(main())
