"""Stores that version 0.1.0 wrote are opened, every map bit for bit; a newer one is refused.

`stores-0.1.0/` was written over HTTP by the service at three commits, on SQLite and on PostgreSQL, where `pg_dump` read
it out; what it then answered is next to it. `first` (f21fb3f) had no migrations, `sealed` (c81779d) has documents in a
table of their own, `properties` (bd9f405) has columns of sigma and oriented. A store of each release is added, and none
is made again.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psycopg
import pytest

from linefix.documents import examples
from service.database_location import database_url
from service.maps import MapStore
from service.maps.errors import UnknownMapError
from tests.running import RunningService

from .stores import ANY, BOX, alter, opened

STORES = Path(__file__).parent / "stores-0.1.0"
ERAS = ("first", "sealed", "properties")


def told(era: str) -> dict[str, Any]:
    """Return what the service answered that wrote the store: listing, and tag and text of each map."""
    found: dict[str, Any] = json.loads((STORES / f"{era}.json").read_text())
    return found


@pytest.fixture
def earlier(database: str, era: str) -> str:
    """A database of each kind with what was written then."""
    url = database_url(database)
    if url.get_backend_name() == "sqlite":
        shutil.copy(STORES / f"{era}.sqlite3", url.database or "")
    else:
        with psycopg.connect(database) as connection:
            connection.execute((STORES / f"{era}.sql").read_bytes())
    return database


def summaries(store: MapStore) -> list[dict[str, Any]]:
    return [
        {
            "map_id": item.map_id,
            "revision": item.revision,
            "segments": item.outline.segments,
            "bounds": list(item.outline.bounds),
            "sigma": item.outline.sigma,
            "oriented": item.outline.oriented,
        }
        for item in store.list(100, "").maps
    ]


@pytest.mark.parametrize("era", ERAS)
def test_every_map_is_there_to_the_bit(earlier: str, era: str) -> None:
    then = told(era)
    with opened(earlier) as store:
        for map_id, answer in then["maps"].items():
            found = store.load(map_id)
            assert found.document == answer["document"].encode()
            assert answer["etag"] == f'"{found.record.revision}"'
        properties = {name: json.loads(answer["document"]) for name, answer in then["maps"].items()}
        assert summaries(store) == [
            item | {key: properties[item["map_id"]].get(key) for key in ("sigma", "oriented")}
            for item in then["listing"]
        ]
        with pytest.raises(UnknownMapError):
            store.load("gone")
        assert store.put("gone", b"new", BOX, ANY) == (3, True)  # its revisions were 1 and 2


@pytest.mark.parametrize("era", ERAS)
def test_a_store_that_was_opened_is_opened_again(earlier: str, era: str) -> None:
    for _ in range(2):
        with opened(earlier) as store:
            assert {item.map_id for item in store.list(100, "").maps} == set(told(era)["maps"])


def test_a_service_goes_on_with_it(start_service: Callable[..., RunningService], tmp_path: Path) -> None:
    shutil.copy(STORES / "first.sqlite3", tmp_path / "maps.sqlite3")
    client = start_service().client
    for map_id, then in told("first")["maps"].items():
        answer = client.get(f"/v1/maps/{map_id}")
        assert (answer.text, answer.headers["etag"]) == (then["document"], then["etag"])
    asked = {"map": {"map_id": "many"}, "scan": {"segments": examples.SEEN}}
    assert client.post("/v1/associate", json=asked).json()["map"] == {"map_id": "many", "revision": 1}


def test_a_service_says_that_a_store_is_newer(start_service: Callable[..., RunningService], tmp_path: Path) -> None:
    """It does not end, and leaves the store unchanged for the newer version."""
    path = tmp_path / "maps.sqlite3"
    shutil.copy(STORES / "properties.sqlite3", path)
    alter(f"sqlite:///{path}", "UPDATE linefix_schema SET version_num = '9999'")
    before = path.read_bytes()
    running = start_service(probe="/livez")
    for method, url, body in (
        ("GET", "/v1/maps", None),
        ("GET", "/v1/maps/case", None),
        ("PUT", "/v1/maps/case", examples.MAP),
        ("POST", "/v1/associate", {"map": {"map_id": "case"}, "scan": {"segments": examples.SEEN}}),
    ):
        answer = running.client.request(method, url, json=body)
        assert (answer.status_code, answer.json()["code"]) == (503, "not_ready")
        assert "newer version" in answer.json()["detail"] or "kernels are being loaded" in answer.json()["detail"]
    assert running.client.get("/readyz").status_code == 503
    assert "the database was made by a newer version of the service" in running.log()
    assert path.read_bytes() == before
