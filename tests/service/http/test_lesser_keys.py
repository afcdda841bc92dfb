"""Attempts with keys of few rights on a running service, in addition to `test_roles`."""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator

import pytest

from linefix.documents import examples
from tests.running import RunningService, running
from tests.service.issuing import key_lines

ADMIN, READER, ASKER, WRITER = (f"the-key-of-the-{who}" for who in ("owner", "reader", "asker", "writer"))
SECRET = 77.123456
FOREIGN = {"segments": [[SECRET, 0, 81, 0], [81, 0, 81, 5], [81, 5, SECRET, 5]], "frame_id": "secret"}
SEEN = json.dumps({"segments": examples.SEEN})


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """One with a map that the lesser keys do not see, which has to be as it was at the end."""
    folder = tmp_path_factory.mktemp("lesser")
    roles = {READER: ["read"], ASKER: ["associate"], WRITER: ["write"]}
    (folder / "keys.toml").write_text("".join(key_lines(key, role, "hq-") for key, role in roles.items()))
    with running(folder, keys=ADMIN, keys_file=folder / "keys.toml") as service:
        client, owner = service.client, bearer(ADMIN)
        for map_id, document in (("hq-1", examples.MAP), ("lab-1", FOREIGN)):
            assert client.put(f"/v1/maps/{map_id}", json=document, headers=owner).status_code == 201
        asked = {"map": {"map_id": "lab-1"}, "scan": {"segments": examples.SEEN}}
        assert client.post("/v1/associate", json=asked, headers=owner).status_code == 200  # its index is there
        before = client.get("/v1/maps/lab-1", headers=owner)
        yield service
        after = client.get("/v1/maps/lab-1", headers=owner)
        assert (after.content, after.headers["etag"]) == (before.content, before.headers["etag"])
        listed = client.get("/v1/maps", headers=owner).json()["maps"]
        assert [item["map_id"] for item in listed] == ["hq-1", "lab-1"]
        assert not any(word in service.log() for word in (ADMIN, READER, ASKER, WRITER, "secret", "a defect"))
        assert not any(word in client.get("/metrics").text for word in (ADMIN, READER, "lab-1", "hq-"))


def bearer(key: str) -> dict[str, str]:
    return {"authorization": f"Bearer {key}"}


def told(service: RunningService, *lines: str | bytes) -> bytes:
    """Send lines of a head as they are; return all that comes back."""
    head = b"\r\n".join(line if isinstance(line, bytes) else line.encode() for line in lines)
    with service.connection() as connection:
        connection.sendall(head + b"\r\nHost: x\r\nConnection: close\r\n\r\n")
        return b"".join(iter(lambda: connection.recv(65_536), b""))


BODIES = [
    '{"map": {"map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "hq-1"}, "map": {"map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "hq-1", "map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "\\u006cab-1"}, "S": SEEN}',
    '{"m\\u0061p": {"map_id": "lab-1"}, "S": SEEN}',
    '{"map": {"map_id": "lab-1", "segments": [[0, 0, 1, 0]]}, "S": SEEN}',
    '{"map": {"map_id": "hq-1/../lab-1"}, "S": SEEN}',
    '{"map": {"map_id": ["lab-1"]}, "S": SEEN}',
]
"""Which of two names counts may depend on who reads: bodies of each size are read by another."""


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("packed", ["as-it-is", "gzip", "large"])
def test_a_body_that_names_a_foreign_map(kept: RunningService, body: str, packed: str) -> None:
    headers = bearer(ASKER) | ({"content-encoding": "gzip"} if packed == "gzip" else {})
    for path, scans, seen in (("/v1/associate", "scan", SEEN), ("/v1/associate:batch", "scans", f"[{SEEN}]")):
        content = body.replace('"S"', f'"{scans}"').replace("SEEN", seen).encode()
        content = content + b" " * 2_000_000 if packed == "large" else content
        content = gzip.compress(content) if packed == "gzip" else content
        answer = kept.client.post(path, content=content, headers=headers)
        assert answer.status_code in (404, 422), answer.text
        assert str(SECRET) not in answer.text


@pytest.mark.parametrize("method", ["GET", "HEAD", "PUT", "DELETE"])
@pytest.mark.parametrize(
    "demand",
    [{}, {"if-none-match": '"1"'}, {"if-none-match": "*"}, {"if-match": '"1"'}, {"if-match": "*"}, {"if-match": "x"}],
    ids=str,
)
def test_demands_tell_nothing_of_a_foreign_map(kept: RunningService, method: str, demand: dict[str, str]) -> None:
    def answer(key: str, map_id: str) -> tuple[object, ...]:
        body = examples.MAP if method == "PUT" else None
        said = kept.client.request(method, f"/v1/maps/{map_id}", json=body, headers=bearer(key) | demand)
        fields = {name: value for name, value in said.headers.items() if name not in ("date", "x-request-id")}
        return said.status_code, fields, said.text.replace(said.headers["x-request-id"], "")

    for key in (READER, WRITER):
        assert answer(key, "lab-1") == answer(key, "lab-2")
        assert answer(key, "lab-1")[0] in (403, 404)


def test_each_request_of_a_connection_shows_its_own_key(kept: RunningService) -> None:
    one = f"GET /v1/maps/hq-1 HTTP/1.1\r\nAuthorization: Bearer {READER}\r\nHost: x\r\n\r\n"
    answer = told(kept, one + "GET /v1/maps/hq-1 HTTP/1.1")
    assert (answer.count(b"HTTP/1.1 200"), answer.count(b"HTTP/1.1 401")) == (1, 1)
    answer = told(kept, one + "GET /v1/maps/lab-1 HTTP/1.1", f"Authorization: Bearer {READER}")
    assert (answer.count(b"HTTP/1.1 200"), answer.count(b"HTTP/1.1 404")) == (1, 1)


@pytest.mark.parametrize(
    "lines",
    [
        [f"Authorization: Bearer {READER}", f"Authorization: Bearer {WRITER}"],
        [f"Authorization: Bearer {READER}, Bearer {WRITER}"],
        [f"Authorization: Basic {READER}"],
        [f"Authorization: {READER}"],
        [f"Authorization : Bearer {READER}"],
        [f"Proxy-Authorization: Bearer {READER}"],
        [f"Cookie: authorization=Bearer {READER}"],
        [f"Authorization: Bearer {READER[:-1]}"],
        [f"Authorization: Bearer {READER.upper()}"],
        [f"Authorization: Bearer {READER.replace('k', '%6b')}"],
        ["Authorization: Bearer " + "x" * 30_000],
        ["Authorization: Bearer Schlüssel-\u202e"],
    ],
    ids=ascii,
)
def test_a_key_is_shown_in_one_way(kept: RunningService, lines: list[str]) -> None:
    answer = told(kept, "GET /v1/maps HTTP/1.1", *lines)
    assert int(answer[9:12]) in (400, 401, 403)
    assert told(kept, "GET /v1/maps HTTP/1.1", f"authorization: bearer \t{READER} ")[9:12] == b"200"


@pytest.mark.parametrize("name", ["X-Original-URL", "X-Rewrite-URL", "X-Forwarded-Path", "X-HTTP-Method-Override"])
def test_no_header_leads_elsewhere(kept: RunningService, name: str) -> None:
    for value in ("/v1/maps/lab-1", "DELETE"):
        answer = told(kept, "GET /v1/maps/lab-1 HTTP/1.1", f"Authorization: Bearer {READER}", f"{name}: {value}")
        assert answer[9:12] == b"404"
        answer = told(kept, "GET /v1/maps/hq-1 HTTP/1.1", f"Authorization: Bearer {READER}", f"{name}: {value}")
        assert answer[9:12] == b"200"
        assert str(SECRET).encode() not in answer


@pytest.mark.parametrize(
    "query",
    ["cursor=lab-0", "cursor=hq-1", "limit=1000", "cursor=a&cursor=lab-0", "prefix=lab-", "cursor=%27%20OR%201=1"],
)
def test_no_query_lists_a_foreign_map(kept: RunningService, query: str) -> None:
    answer = kept.client.get(f"/v1/maps?{query}", headers=bearer(READER))
    assert answer.status_code in (200, 422)
    assert "lab-" not in answer.text
