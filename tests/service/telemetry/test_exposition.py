"""The text for Prometheus: as things stand, and no more often made than need be."""

from __future__ import annotations

import asyncio
import time

import pytest

from service.telemetry import metrics as module
from service.telemetry.metrics import Metrics


class Counted(Metrics):
    """Counts how often its text is made."""

    def __init__(self) -> None:
        super().__init__()
        self.made = 0

    def rendered(self) -> bytes:
        self.made += 1
        return super().rendered()


def test_however_many_ask_it_is_made_a_few_times_a_second() -> None:
    """Each who asked had one made, 10 ms of the event loop each."""
    counted = Counted()

    async def ask_until(made: int) -> int:
        answers = 0
        while counted.made < made:
            answers += len(await asyncio.gather(*(counted.exposition() for _ in range(50))))
        return answers

    begun = time.monotonic()
    assert asyncio.run(ask_until(5)) >= 150
    assert counted.made <= 1 + (time.monotonic() - begun) / module.EXPOSITION_SECONDS + 1


def test_it_holds_what_was_counted_before_it_was_asked_for() -> None:
    metrics = Metrics()

    async def ask() -> list[bytes]:
        texts = []
        for _ in range(3):
            metrics.cache_hits.inc()
            texts.append(await metrics.exposition())
        return texts

    for number, text in enumerate(asyncio.run(ask()), 1):
        assert b"linefix_map_cache_hits_total %d.0\n" % number in text


def test_one_that_fails_is_not_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    metrics = Metrics()

    async def ask() -> bytes:
        with monkeypatch.context() as broken:
            broken.setattr(metrics, "refresh", lambda: 1 // 0)
            for _ in range(2):
                with pytest.raises(ZeroDivisionError):
                    await metrics.exposition()
        return await metrics.exposition()

    assert b"linefix_build_info" in asyncio.run(ask())
