"""Threads for what takes a while and is no search; searches have the gate's."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


class Threads(ThreadPoolExecutor):
    """Some threads under one name.

    Each kind of call has its own, so that none waits for the threads of another.
    """

    async def run(self, call: Callable[[], T]) -> T:
        """Return the result of a call in one of the threads."""
        return await asyncio.get_running_loop().run_in_executor(self, call)

    def close(self) -> None:
        """Give the threads back; does not wait for them."""
        self.shutdown(wait=False, cancel_futures=True)
