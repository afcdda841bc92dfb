"""kill -9 while maps are written: what was acknowledged is there afterwards, whole and under its revision."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import pytest

from linefix.documents import examples
from tests.running import client_of

WRITERS = 3
MAPS_EACH = 3
State = tuple[int, int] | None  # revision and number of the content, None for no map


@dataclass
class Writer:
    """Puts and deletes maps of its own, and stores the answers."""

    name: str
    draw: random.Random
    acknowledged: int = 0
    interrupted: int = 0
    written: int = 0
    known: dict[str, State] = field(default_factory=dict)
    last: dict[str, int] = field(default_factory=dict)
    open: tuple[str, State] | None = None

    def work(self, url: str) -> None:
        """Write until the service is gone."""
        try:
            with client_of(url) as client:
                while True:
                    self.write(client)
        except httpx.TransportError:
            self.interrupted += self.open is not None

    def write(self, client: httpx.Client) -> None:
        name = f"{self.name}-{self.draw.randrange(MAPS_EACH)}"
        if self.known.get(name) is not None and self.draw.random() < 0.3:
            self.open = (name, None)
            answer = client.delete(f"/v1/maps/{name}")
            assert answer.status_code == 204, answer.text
            self.known[name] = None
        else:
            self.written += 1
            expected = (self.last.get(name, 0) + 1, self.written)
            self.open = (name, expected)
            answer = client.put(f"/v1/maps/{name}", json=content(self.written))
            assert answer.status_code == (201 if self.known.get(name) is None else 200), answer.text
            assert answer.json()["revision"] == expected[0]
            self.known[name] = expected
            self.last[name] = expected[0]
        self.open = None
        self.acknowledged += 1

    def check(self, client: httpx.Client) -> int:
        """Compare the stored maps with the answers; return the number of acknowledged writes that are lost."""
        lost = 0
        for number in range(MAPS_EACH):
            name = f"{self.name}-{number}"
            found = stored(client, name)
            allowed = [self.known.get(name)]
            if self.open is not None and self.open[0] == name:
                allowed.append(self.open[1])
            lost += found not in allowed
            self.known[name] = found
            if found is not None:
                self.last[name] = found[0]
        self.open = None
        return lost


def content(number: int) -> dict[str, Any]:
    """A map of up to 200 kB, so that kills come in the middle of it, too."""
    return {"segments": examples.WALLS * (1 + number % 7 * 200), "meta": number}


def stored(client: httpx.Client, name: str) -> State:
    answer = client.get(f"/v1/maps/{name}")
    if answer.status_code == 404:
        return None
    assert answer.status_code == 200, answer.text
    document = answer.json()
    assert document == content(document["meta"])
    return int(answer.headers["etag"].strip('"')), document["meta"]


# Each kill interrupts three writes.
@pytest.mark.parametrize("kills", [2, pytest.param(334, marks=pytest.mark.long)])
def test_nothing_acknowledged_is_lost(start_service: Callable[..., Any], tmp_path: Path, kills: int) -> None:
    draw = random.Random(kills)
    writers = [Writer(f"w{i}", random.Random(i)) for i in range(WRITERS)]
    lost = 0
    for _ in range(kills):
        # Not until the kernels are warm: maps are served before.
        running = start_service(tmp_path, probe="/livez")
        lost += sum(writer.check(running.client) for writer in writers)
        threads = [threading.Thread(target=writer.work, args=(running.url,)) for writer in writers]
        for thread in threads:
            thread.start()
        enough = sum(writer.acknowledged for writer in writers) + draw.randrange(1, 12)
        while sum(writer.acknowledged for writer in writers) < enough and all(thread.is_alive() for thread in threads):
            time.sleep(0.001)
        time.sleep(draw.uniform(0.0, 0.05))
        running.kill()
        running.client.close()
        for thread in threads:
            thread.join(30)
            assert not thread.is_alive()
    running = start_service(tmp_path)
    lost += sum(writer.check(running.client) for writer in writers)
    acknowledged = sum(writer.acknowledged for writer in writers)
    interrupted = sum(writer.interrupted for writer in writers)
    print(f"\n{kills} kills, {interrupted} writes interrupted, {acknowledged} acknowledged, {lost} of them lost")
    assert lost == 0
    # The kills came while something was being written.
    assert interrupted >= 0.8 * WRITERS * kills
    assert acknowledged >= kills
