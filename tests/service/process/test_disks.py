"""A disk that is full, and one that cannot be written."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from linefix.documents import examples

BODY = {"map": {"map_id": "room"}, "scan": {"segments": examples.SEEN}}


def mount(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["mount", *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 1 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    made = mount("-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)) if os.name == "posix" else None
    if made is None or made.returncode:
        pytest.skip("cannot mount a tmpfs here")
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True)


def large(number: int, times: int) -> dict[str, Any]:
    return {"segments": examples.WALLS * times, "meta": number}


def check(client: httpx.Client, kept: dict[str, tuple[dict[str, Any], str]]) -> None:
    """Everything that was acknowledged is there, and the room is searched."""
    for name, (document, tag) in kept.items():
        got = client.get(f"/v1/maps/{name}")
        assert (got.status_code, got.json(), got.headers["etag"]) == (200, document, tag)
    assert [item["map_id"] for item in client.get("/v1/maps").json()["maps"]] == sorted(kept)
    assert client.post("/v1/associate", json=BODY).json()["map"]["map_id"] == "room"


def test_a_full_disk_loses_nothing(start_service: Callable[..., Any], disk: Path) -> None:
    running = start_service(database_url=f"sqlite:///{disk / 'maps.sqlite3'}")
    client = running.client
    kept: dict[str, tuple[dict[str, Any], str]] = {}

    def put(name: str, document: dict[str, Any]) -> httpx.Response:
        answer = client.put(f"/v1/maps/{name}", json=document)
        if answer.is_success:
            kept[name] = (document, answer.headers["etag"])
        return answer

    (disk / "ballast").write_bytes(bytes(64_000))
    assert put("room", examples.MAP).status_code == 201
    assert put("m", large(0, 10)).status_code == 201
    answers = [put(f"m{i:02}", large(i, 200)) for i in range(60)]
    refused = [answer for answer in answers if not answer.is_success]
    assert len(refused) >= 10
    assert len(kept) >= 5
    for answer in refused:
        assert (answer.status_code, answer.json()["code"]) == (507, "storage_full")
    check(client, kept)
    # A failed write over a stored map does not change it, either.
    for _ in range(3):
        assert put("m", large(0, 2000)).status_code == 507
    check(client, kept)
    assert client.get("/readyz").status_code == 200

    with pytest.raises(OSError, match="No space"):
        (disk / "other").write_bytes(bytes(2_000_000))
    # Requests that make room need none.
    for name in ("m", "m03"):
        answer = client.delete(f"/v1/maps/{name}")
        assert answer.status_code == 204, answer.text
        del kept[name]
    check(client, kept)
    (disk / "ballast").unlink()  # a journal has to fit; the map takes the room of those that have gone
    assert put("m", large(0, 150)).status_code == 201
    check(client, kept)

    (disk / "other").unlink()
    assert mount("-o", "remount,size=8m", str(disk)).returncode == 0
    assert put("m", large(1, 2000)).status_code == 200
    assert put("late", examples.MAP).status_code == 201
    check(client, kept)
    assert client.delete("/v1/maps/late").status_code == 204
    assert "a defect" not in running.log()


@pytest.mark.long
def test_a_read_only_disk_is_read(start_service: Callable[..., Any], disk: Path) -> None:
    url = f"sqlite:///{disk / 'maps.sqlite3'}"
    first = start_service(database_url=url)
    put = first.client.put("/v1/maps/room", json=examples.MAP)
    kept = {"room": (examples.MAP, put.headers["etag"])}
    first.process.terminate()
    first.process.wait(15)
    assert mount("-o", "remount,ro", str(disk)).returncode == 0

    again = start_service(database_url=url)
    for write in (
        lambda: again.client.put("/v1/maps/m", json=large(1, 10)),
        lambda: again.client.delete("/v1/maps/room"),
    ):
        answer = write()
        assert (answer.status_code, answer.json()["code"]) == (503, "read_only")
        assert int(answer.headers["retry-after"]) >= 1
    check(again.client, kept)
    assert mount("-o", "remount,rw", str(disk)).returncode == 0
    # The connections that there were can only read.
    assert again.client.put("/v1/maps/room", json=large(1, 10)).status_code == 200
    assert "a defect" not in again.log()


@pytest.mark.long
def test_a_read_only_disk_without_a_database(start_service: Callable[..., Any], disk: Path) -> None:
    assert mount("-o", "remount,ro", str(disk)).returncode == 0
    running = start_service(probe="/livez", database_url=f"sqlite:///{disk / 'maps.sqlite3'}")
    for call in (
        lambda: running.client.put("/v1/maps/m", json=examples.MAP),
        lambda: running.client.get("/v1/maps/m"),
        lambda: running.client.get("/readyz"),
    ):
        answer = call()
        assert answer.status_code == 503
        assert answer.json()["code"] in ("read_only", "not_ready")
    assert running.client.post("/v1/associate", json=examples.ASSOCIATE).status_code in (200, 503)
    assert mount("-o", "remount,rw", str(disk)).returncode == 0
    assert running.client.put("/v1/maps/m", json=examples.MAP).status_code == 201
    assert "a defect" not in running.log()
