"""Maps by id: revisions, conditions, damage, and that an acknowledged one is kept."""

from __future__ import annotations

import httpx

from linefix.documents import examples
from tests.running import RunningService, until
from tests.service.asking import answered
from tests.service.maps.stores import alter


def test_a_map_comes_back_to_the_bit(client: httpx.Client) -> None:
    document = {
        "segments": [[0.1 + 0.2, 1e-7, 1e3 + 1 / 3, 2.0**-40], [-0.0, 1.0, 3.3, 4.4]],
        "sigma": 0.1,
        "frame_id": "Gebäude 7 \U0001f916",
        "meta": {"floor": [3, None, True, "x"]},
    }
    put = client.put("/v1/maps/bits", json=document)
    assert put.status_code == 201
    told = {"map_id": "bits", "revision": 1, "segment_count": 2, "bounds": [0.0, 2.0**-40, 1e3 + 1 / 3, 4.4]}
    assert put.json() == {**told, "sigma": 0.1, "oriented": None}
    got = client.get("/v1/maps/bits")
    assert got.json() == document
    assert str(got.json()["segments"][1][0]) == "-0.0"
    client.delete("/v1/maps/bits")


def test_revisions_and_conditions(client: httpx.Client) -> None:
    url = "/v1/maps/conditions"
    nothing = client.put(url, json=examples.MAP, headers={"if-match": '"1"'})
    assert (nothing.status_code, "etag" in nothing.headers) == (412, False)
    assert "no map" in nothing.json()["detail"]
    assert client.put(url, json=examples.MAP, headers={"if-match": "*"}).status_code == 412
    first = client.put(url, json=examples.MAP, headers={"if-none-match": "*"})
    assert (first.status_code, first.headers["etag"], first.json()["revision"]) == (201, '"1"', 1)
    assert first.json()["bounds"] == [-4.0, -3.0, 4.0, 3.0]
    demands = [("if-match", tags) for tags in ('"7", "8"', 'W/"1"', '"x", "01", "0"')]
    for name, value in [*demands, ("if-none-match", "*"), ("if-none-match", 'W/"1", "7"')]:
        conflict = client.put(url, json=examples.MAP, headers={name: value})
        assert (conflict.status_code, conflict.headers["etag"]) == (412, '"1"'), (name, value)
        assert "present revision is 1" in conflict.json()["detail"]
    # Taken for no demand it would write over a map that the caller wanted to keep.
    for name in ("if-match", "if-none-match"):
        for value in ("1", "", '"3', '"3" x', "**", "W/3", '"1", x'):
            wrong = client.put(url, json=examples.MAP, headers={name: value})
            assert (wrong.status_code, wrong.json()["errors"][0]["pointer"]) == (422, f"/header/{name}")
    second = client.put(url, json=examples.MAP, headers=[("if-match", '"7"'), ("if-match", '"1",')])
    assert (second.status_code, second.headers["etag"]) == (200, '"2"')

    unchanged = client.get(url, headers={"if-none-match": 'W/"2"'})
    assert (unchanged.status_code, unchanged.content, unchanged.headers["etag"]) == (304, b"", '"2"')
    for other in ('"1"', "2"):
        assert client.get(url, headers={"if-none-match": other}).json() == examples.MAP

    assert client.delete(url, headers={"if-match": '"1"'}).json()["code"] == "revision_conflict"
    gone = client.delete(url, headers={"if-match": '"2"'})
    assert (gone.status_code, gone.content) == (204, b"")
    assert client.delete(url).json()["code"] == "unknown_map"
    assert client.get(url).json()["code"] == "unknown_map"
    # A map that was deleted is none, whatever revision it had.
    assert client.put(url, json=examples.MAP, headers={"if-match": '"2"'}).status_code == 412
    assert client.delete(url, headers={"if-match": '"2"'}).status_code == 412
    # A number is never used twice, so that an old tag cannot match a new map.
    again = client.put(url, json=examples.MAP, headers={"if-none-match": '"1", "2"'})
    assert (again.status_code, again.headers["etag"]) == (201, '"3"')
    client.delete(url)


def test_properties_go_with_the_map(client: httpx.Client) -> None:
    """Put, got, listed; a change of one is a new revision with another tag."""
    url = "/v1/maps/properties"
    plain = {"segments": examples.WALLS}
    tags = []
    for more in ({}, {"oriented": False}, {"oriented": None, "sigma": None}, {"oriented": True, "sigma": 0.03}):
        put = client.put(url, json=plain | more)
        tags.append(put.headers["etag"])
        told = {"sigma": more.get("sigma"), "oriented": more.get("oriented")}
        assert {name: put.json()[name] for name in told} == told
        assert client.get(url).json() == plain | more
        page = client.get("/v1/maps", params={"limit": 1, "cursor": "propertier"}).json()
        assert page["maps"] == [put.json()]
    assert len(set(tags)) == len(tags)
    assert client.get(url, headers={"if-none-match": tags[-2]}).status_code == 200
    assert client.get(url, headers={"if-none-match": tags[-1]}).status_code == 304
    client.delete(url)


def test_a_listing_has_pages(client: httpx.Client) -> None:
    names = [f"pages-{name}" for name in ("b", "a", "B", "a.1", "a-1")]
    for name in names:
        client.put(f"/v1/maps/{name}", json=examples.MAP)
    seen: list[str] = []
    cursor: str | None = "pages-"
    while cursor is not None and len(seen) < len(names):
        page = client.get("/v1/maps", params={"limit": 2, "cursor": cursor}).json()
        assert len(page["maps"]) <= 2
        seen += [item["map_id"] for item in page["maps"]]
        cursor = page["next"]
    assert [name for name in seen if name.startswith("pages-")] == sorted(names)
    for name in names:
        assert client.delete(f"/v1/maps/{name}").status_code == 204
    rest = client.get("/v1/maps", params={"cursor": "pages-"}).json()
    assert not any(one["map_id"].startswith("pages-") for one in rest["maps"])
    assert (rest["corrupt"], client.get("/v1/maps", params={"cursor": "zzz"}).json()["next"]) == ([], None)


def test_a_damaged_map_is_named_and_not_served(service: RunningService) -> None:
    client = service.client
    for name in ("damaged", "whole"):
        client.put(f"/v1/maps/{name}", json=examples.MAP).raise_for_status()
    alter(
        f"sqlite:///{service.data_dir / 'maps.sqlite3'}",
        "UPDATE map_documents SET document = CAST(replace(document, '4', '5') AS BLOB) WHERE map_id = 'damaged'",
    )
    body = {"map": {"map_id": "damaged"}, "scan": {"segments": examples.SEEN}}
    for answer in (client.get("/v1/maps/damaged"), client.post("/v1/associate", json=body)):
        assert (answer.status_code, answer.json()["code"]) == (409, "map_corrupt")
    listed = client.get("/v1/maps").json()
    assert ("whole" in {item["map_id"] for item in listed["maps"]}, listed["corrupt"]) == (True, ["damaged"])
    until(lambda: "map quarantined" in service.log())  # lines are written by a thread of their own
    (quarantined,) = [line for line in service.log().splitlines() if "map quarantined" in line]
    assert '"damaged"' in quarantined
    assert client.put("/v1/maps/damaged", json=examples.MAP).status_code == 200
    assert client.get("/v1/maps/damaged").json() == examples.MAP
    for name in ("damaged", "whole"):
        client.delete(f"/v1/maps/{name}")


def test_what_is_stored_can_be_searched(client: httpx.Client) -> None:
    """Two pieces of one wall are longer together than a segment may be."""
    segments = [[0.0, 0.0, 6e3, 0.0], [6e3, 0.0, 1.2e4, 0.0], [1.2e4, 0.0, 1.2e4, 50.0], [0.0, 50.0, 0.0, 0.0]]
    assert client.put("/v1/maps/long", json={"segments": segments}).status_code == 201
    asked = {"map": {"map_id": "long"}, "scan": {"segments": [[1.0, -1.0, 5.0, -1.0]]}}
    for oriented in (True, False):
        answered(client, "/v1/associate", asked, options={"oriented": oriented})
    client.delete("/v1/maps/long")
