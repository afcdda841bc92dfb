"""Tables of wrong requests: the place that is named and what its message says, or the status and its code."""

from __future__ import annotations

import json
from typing import Any

from linefix.documents import examples

ROOM = [[-4.0, -3.0, 4.0, -3.0], [4.0, -3.0, 4.0, 3.0], [4.0, 3.0, -4.0, 3.0], [-4.0, 3.0, -4.0, -3.0]]
MISSING, UNKNOWN = "expected this field, found none", "unknown field; correct its name or remove it"
REGISTER, ASSOCIATE, BATCH, VECTORIZE, ANALYZE, UPDATE, APPLY, CHECK, PUT = (
    *("POST /v1/register", "POST /v1/associate", "POST /v1/associate:batch", "POST /v1/vectorize", "POST /v1/analyze"),
    *("POST /v1/maps/wrong:update", "POST /v1/maps:apply", "POST /v1/maps/wrong:check", "PUT /v1/maps/wrong"),
)
TWO_MAPS = [{"map_id": "hall", "segments": ROOM[:3]}, {"map_id": "room", "segments": ROOM}]
SEVERALLY = "POST /v1/associate "  # without the map
BODIES: dict[str, dict[str, Any]] = {
    REGISTER: {"map": {"segments": ROOM}, "scan": {"segments": ROOM}},
    ASSOCIATE: {"map": {"segments": ROOM}, "scan": {"segments": ROOM}},
    SEVERALLY: {"scan": {"segments": ROOM}},
    BATCH: examples.BATCH,
    VECTORIZE: {},
    ANALYZE: {"map": {"segments": ROOM}},
    UPDATE: examples.UPDATE,
    APPLY: {"map": {"segments": ROOM}, "changes": []},
    CHECK: {},
    PUT: {"segments": ROOM},
}


# Parts, the places that are named below the part, and what the first message says. ---------------------------------

OPTIONS = [
    ({"confidence": "0.9"}, "/confidence", ""),
    ({"confidence": 0.2}, "/confidence", "expected at least 0.5"),
    ({"confidence": 1.1}, "/confidence", "expected at most 1"),
    ({"exhaustive": 1}, "/exhaustive", ""),
    ({"seed": 1.5}, "/seed", ""),
    ({"include": ["everything"]}, "/include/0", ""),
    ({"include": ["segments"] * 20}, "/include", "expected at most 16 items, found 20"),
    ({"estimator": "paper"}, "/estimator", ""),
    ({"sampling": "x"}, "/sampling", "expected 'ordered' or 'random'"),
    ({"confidnce": 0.9}, "/confidnce", UNKNOWN),
    ({"<script>" * 3000: 1}, "", UNKNOWN),  # a strange name is not repeated
    ({"on_map": None}, "/on_map", ""),
    ({"causes": True}, "/causes", UNKNOWN),
    ([], "", ""),
]
AT = {"x": 0.0, "y": 0.0, "theta": 0.0}
PRIORS = [
    (AT, "", "expected exactly one of covariance, or radius with angle"),
    ({**AT, "radius": 1, "covariance": []}, "", "expected exactly one of covariance, or radius with angle"),
    ({**AT, "angle": 1}, "/radius", MISSING),
    ({**AT, "radius": 1}, "/angle", MISSING),
    ({**AT, "radius": 0.0, "angle": 1.0}, "/radius", "expected more than 0"),
    ({**AT, "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "/covariance", ""),
    ({**AT, "covariance": [[1, 1, 0], [0, 1, 0], [0, 0, 1]]}, "/covariance", ""),
    ({**AT, "covariance": [[1, 0], [0, 1], [0, 0]]}, "/covariance/0 /covariance/1 /covariance/2", ""),
    # ROS gives 36 numbers in a row, of which (x, y, yaw) are those of rows and columns 0, 1 and 5.
    ({**AT, "covariance": [0.1] * 36}, "/covariance", "yaw"),
    ({**AT, "covariance": [[0.1] * 6] * 6}, "/covariance", "yaw"),
    ({**AT, "covariance": [0.1] * 9}, "/covariance", "3 rows"),
    ({**AT, "covariance": []}, "/covariance", "3 rows"),
    ({**AT, "theta": 80.0, "radius": 1.0, "angle": 1.0}, "/theta", "degrees"),
    ({**AT, "theta": 80.0, "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}, "/theta", "degrees"),
    ({**AT, "radius": 1, "angle": 1, "map_id": "room"}, "/map_id", ""),  # of one map
    (3, "", ""),
]
MAPS = [
    ({"segments": []}, "/segments", ""),
    ({"segments": [[0, 0, 0, 0]]}, "/segments/0", "shorter"),
    ({"segments": [[0, 0, 1, 0], [0, 0, 1e-7, 0]]}, "/segments/1", "shorter"),
    ({"segments": [[0, 0, 1, 0], [0, 0, 10_001, 0]]}, "/segments/1", ""),
    ({"segments": [[0, 0, 1, 0], [100_001, 0, 100_002, 0]]}, "/segments", "extent"),
    ({"segments": [[0, 0, 1]]}, "/segments/0", "expected 4 numbers, found 3"),
    ({"segments": [5]}, "/segments/0", ""),
    ({"segments": {}}, "/segments", ""),
    ({"segments": ROOM, "points": [[0.0, 0.0], [1.0]]}, "/points/1", ""),
    ({"segments": ROOM, "points": [[0.0, None]]}, "/points/0", ""),
    ({"segments": ROOM, "points": None}, "/points", ""),
    ({"segments": ROOM, "points": [[0.0, 0.0]], "points_sigma": 0.0}, "/points_sigma", ""),
    ({"segments": ROOM, "points": [[0.0, 0.0]], "points_sigma": 11.0}, "/points_sigma", ""),
    ({"segments": ROOM, "point": [[0.0, 0.0]]}, "/point", UNKNOWN),
    *(({"segments": ROOM, "oriented": wrong}, "/oriented", "") for wrong in ("no", 0, 1, [])),
]
NAMED_MAPS = [
    ({}, "", "expected exactly one of segments and map_id"),
    ({"segments": ROOM, "map_id": "m"}, "", "expected exactly one of segments and map_id"),
    ({"id": "hq"}, "/segments /id", MISSING),
    ({"map_id": ""}, "/map_id", "expected at least 1 characters"),
    ({"map_id": "a" * 200}, "/map_id", "expected at most 128 characters"),
    ({"map_id": "a b"}, "/map_id", "expected only letters (A to Z, a to z), digits and the"),
]
LASER = {"angle_min": -0.4, "angle_increment": 0.1, "ranges": [2.0] * 9, "range_max": 30.0}
ANGLES = "angle_min"
LASERS = [
    ({"angle_increment": 0.0}, "/angle_increment", ""),
    ({"angle_increment": 1e-200}, "/angle_increment", ""),
    ({"angle_min": -180.0}, "/angle_min", "degrees"),
    ({"range_min": 5.0, "range_max": 4.0}, "/range_max", ""),
    ({"ranges": [1.0, "2"]}, "/ranges/1", ""),
    ({"header": {"stmp": 1}}, "/header/stmp", UNKNOWN),
    # A driver that sets one of the angles wrong turns, mirrors or stretches its scans.
    ({"angle_max": -0.4}, "/angle_max", ANGLES),
    ({"angle_max": 0.4, "ranges": [2.0] * 18}, "/angle_max", ANGLES),
]
ONE_OF_SCANS = "expected exactly one of segments, laser, points and views"
SCANS = [
    ({}, "", ONE_OF_SCANS),
    ({"sigma": 0.1}, "", ONE_OF_SCANS),
    ({"segments": ROOM, "laser": {}}, "", ONE_OF_SCANS),
    ({"points": [], "laser": {}}, "", ONE_OF_SCANS),
    ({"segement": ROOM}, "/segments /segement", MISSING),
    ({"ranges": [1.0]}, "/laser /ranges", MISSING),
    ({"views": []}, "/views", "expected at least 1 items, found 0"),
]
VIEW = {"segments": examples.SEEN, "pose": AT}
VIEWS = [
    ({"segments": examples.SEEN}, "/pose", MISSING),
    ({**VIEW, "segments": [[0.0, 0.0, 0.0]]}, "/segments/0", "expected 4 numbers, found 3"),
    ({**VIEW, "point_counts": [3.0], "sigma": -1.0}, "/sigma", ""),
    ({**VIEW, "covariance": [[1.0, 0, 0], [0, 1.0, 0], [0, 0, -1.0]]}, "/covariance", ""),
    ({**VIEW, "covariance": [[200.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]}, "/covariance", ""),
    ({**VIEW, "relative_to": 2}, "/relative_to", ""),
    ({**VIEW, "relative_to": 1}, "/relative_to", ""),
    ({"laser": {**LASER, "angle_increment": 2.0}, "pose": AT}, "/laser/angle_increment", ""),
    ({"laser": {**LASER, "angle_max": 0.6}, "pose": AT}, "/laser/angle_max", ANGLES),
    ({"laser": LASER, "pose": AT, "twist": {"vx": 1.0, "omega": 0.0}}, "", ""),
    ({"laser": LASER, "segments": [], "pose": AT}, "", ""),
    ({**VIEW, "pose": {**AT, "theta": 90.0}}, "/pose/theta", "degrees"),
]
TWIST = {"vx": 0.5, "vy": -0.2, "omega": 1.5}
STILL = {"segments": examples.SEEN}
PAIRS = {"map": {"segments": ROOM, "sigma": 0.0}, "scan": {"segments": ROOM, "sigma": 0.0}}
FLAT = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
SEEN = examples.UPDATE["visits"][1]["scans"][0]
BOX = {"code": "removed", "segments": [], "new": []}
ONE, TWO = ({**BOX, "segments": [number]} for number in (1, 2))
SHARP = {"segments": [1], "ends": [[0.0, 0.0, 1.0, 0.0]], "sigma": [0.01]}
MANY = [{"segment": [1, 1, 2, 1], "sigma": 0.0}] * 5_001


def visited(**more: Any) -> dict[str, Any]:
    return {"visits": [{"visit": "a", "scans": [{**SEEN, **more}]}]}


# Whole requests.
OTHERS: list[tuple[str, dict[str, Any], str, str]] = [
    (REGISTER, {"correspondences": [[0, 0], [1, 4]]}, "/correspondences/1", ""),
    (REGISTER, {"scan": {"segments": ROOM[:3]}}, "/correspondences", ""),
    (REGISTER, {"map": {"segments": ROOM[:3]}}, "/correspondences", "4 scan and 3 map segments"),
    (REGISTER, PAIRS, "/scan/sigma", ""),
    (ASSOCIATE, {"client_ref": json.loads("[" * 200 + "]" * 200)}, "/client_ref", ""),
    (ASSOCIATE, {"client_ref": "x" * 20_000}, "/client_ref", "expected at most 16384 bytes of JSON, found 20002"),
    (ASSOCIATE, {"map_weights": {"room": 0.5}}, "/map_weights", ""),
    (VECTORIZE, {}, "", "expected exactly one of laser and points"),
    (VECTORIZE, {"laser": LASER, "points": [[0, 1]]}, "", "expected exactly one of laser and points"),
    (VECTORIZE, {"points": [[0.0, 0.0], [1e8, 0.0]]}, "/points/1", ""),
    (VECTORIZE, {"points": [], "options": {"min_points": 2}}, "/options/min_points", ""),
    (VECTORIZE, {"laser": LASER, "viewpoint": [1.0, 0.0]}, "/viewpoint", ""),
    (VECTORIZE, {"laser": LASER, "twist": TWIST}, "", "time_increment"),
    (VECTORIZE, {"points": ROOM[0], "twist": TWIST}, "/points/0 /points/1 /points/2 /points/3", ""),
    (VECTORIZE, {"points": [[0, 1]], "twist": TWIST}, "", ""),
    (VECTORIZE, {"laser": {**LASER, "time_increment": 1.0}, "twist": TWIST}, "/twist", ""),
    (ANALYZE, {"laser": {"fov": 360}}, "/laser/fov", ""),
    (ANALYZE, {"laser": {"fow": 1}}, "/laser/fow", UNKNOWN),
    (ANALYZE, {"spacing": 0}, "/spacing", ""),
    (ANALYZE, {"point": [100, 0]}, "/point", ""),
    (ANALYZE, {"places": 3}, "/places", UNKNOWN),
    (ANALYZE, {"drive": 31}, "/drive", ""),
    (ANALYZE, {"landmark": [[0, 0, 1]]}, "/landmark/0", ""),
    (ANALYZE, {"landmark": [[0, 0, 1, 0], [1, 1, 1, 1]]}, "/landmark/1", ""),
    (ANALYZE, {"landmark": [[0, 0, 1, 0]] * 101}, "/landmark", ""),
    (CHECK, {}, "/scans", MISSING),
    (CHECK, {"scans": [STILL, {"segments": [[0, 0, 1]]}]}, "/scans/1/segments/0", ""),
    (CHECK, {"scans": [{"segments": [[0, 0, 0, 0]]}]}, "/scans/0/segments/0", ""),
    (CHECK, {"scans": [{"laser": {**LASER, "angle_increment": 0}}]}, "/scans/0/laser/angle_increment", ""),
    (CHECK, {"scans": [STILL], "poses": []}, "", ""),
    (CHECK, {"scans": [STILL], "poses": [{**AT, "theta": 90}]}, "/poses/0/theta", "degrees"),
    (CHECK, {"scans": [STILL], "priors": []}, "/priors", UNKNOWN),
    (CHECK, {"scans": [{"segments": []}] * 65}, "/scans", ""),
    (UPDATE, {"visits": []}, "/visits", ""),
    (UPDATE, {"visits": [{"visit": "a", "scans": [STILL]}]}, "/visits/0/scans/0/laser /visits/0/scans/0/segments", ""),
    (UPDATE, visited(pose=AT), "/visits/0/scans/0", "both pose and"),
    (UPDATE, visited(pose=AT, covariance=FLAT), "/visits/0/scans/0/covariance", ""),
    (UPDATE, visited(odometry={**AT, "theta": 90.0}), "/visits/0/scans/0/odometry/theta", "degrees"),
    (UPDATE, {"accept": 2.0}, "/accept", ""),
    (UPDATE, {"refuse": [4]}, "/refuse", ""),
    (APPLY, {"changes": [{**BOX, "segments": [99]}]}, "/changes/0", "found segment 99"),
    (APPLY, {"changes": [{**ONE, "accepted": False}, TWO, TWO]}, "/changes/2", "named before"),
    (APPLY, {"changes": [{**BOX, "segments": [*range(4)]}]}, "/changes", "no segment that is left"),
    (APPLY, {"changes": [{**BOX, "new": [{"segment": [1, 1, 1, 1], "sigma": 0.0}]}]}, "/changes/0/new/0", "shorter"),
    (APPLY, {"changes": [{**BOX, "new": MANY}] * 2}, "/changes", "expected at most 10000 new segments of all changes"),
    (APPLY, {"sharpened": {**SHARP, "segments": [99]}}, "/sharpened/segments", ""),
    (APPLY, {"sharpened": {**SHARP, "sigma": []}}, "/sharpened", ""),
]
SEVERAL: list[tuple[str, dict[str, Any], str, str]] = [
    (SEVERALLY, {}, "", "map and maps"),
    (SEVERALLY, {"maps": TWO_MAPS, "map": {"segments": ROOM}}, "", "map and maps"),
    (SEVERALLY, {"maps": []}, "/maps", ""),
    (SEVERALLY, {"maps": TWO_MAPS[:1]}, "/maps", ""),
    (SEVERALLY, {"maps": TWO_MAPS * 129}, "/maps", ""),
    (SEVERALLY, {"maps": TWO_MAPS * 2}, "/maps/2/map_id", ""),
    (SEVERALLY, {"maps": [TWO_MAPS[0], {"segments": ROOM}]}, "/maps/1/map_id", ""),
    (SEVERALLY, {"maps": [TWO_MAPS[0], {"map_id": "room", "segments": []}]}, "/maps/1/segments", ""),
    (SEVERALLY, {"maps": [TWO_MAPS[0], {"map_id": "room", "segments": [[0, 0, 0, 0]]}]}, "/maps/1/segments/0", ""),
    (SEVERALLY, {"maps": {"prefix": ""}}, "/maps/prefix", ""),
    (SEVERALLY, {"maps": {"prefix": "a/b"}}, "/maps/prefix", ""),
    (SEVERALLY, {"maps": TWO_MAPS, "map_weights": {"cuckoo": 0.5}}, "/map_weights", ""),
    (SEVERALLY, {"maps": TWO_MAPS, "map_weights": {"room": 1.5}}, "/map_weights", ""),
    (SEVERALLY, {"maps": TWO_MAPS, "map_weights": {"room": 0.6, "hall": 0.6}}, "/map_weights", ""),
    (SEVERALLY, {"maps": TWO_MAPS, "prior": {**AT, "radius": 1, "angle": 1}}, "/prior/map_id", ""),
    (SEVERALLY, {"maps": TWO_MAPS, "prior": {**AT, "radius": 1, "angle": 1, "map_id": "cuckoo"}}, "/prior/map_id", ""),
]
NUMBERS = [
    ([*ROOM, [0.0, 0.0, 1.0, bad]], "/4", "expected a number")
    for bad in ("1.5", True, None, [1.0], {}, 1e10, -1e10, 10**30)
]


def below(call: str, place: str, rows: list[tuple[Any, str, str]]) -> list[tuple[str, dict[str, Any], str, str]]:
    """Return whole requests of which each has one part of a table at a place, such as ``/scan/laser``."""
    found = []
    for part, places, said in rows:
        body = part
        for name in reversed(place.split("/")[1:]):
            body = [VIEW, body] if name == "1" else {name: body}
        found.append((call, body, " ".join(place + one for one in places.split(" ")), said))
    return found


WRONG: list[tuple[str, dict[str, Any], str, str]] = [
    *below(ASSOCIATE, "/options", OPTIONS),
    *below(ASSOCIATE, "/prior", PRIORS),
    *below(ASSOCIATE, "/map", [*MAPS, *NAMED_MAPS]),
    *below(PUT, "", MAPS),
    *below(ASSOCIATE, "/scan", SCANS),
    *below(ASSOCIATE, "/scan/laser", [(LASER | part, *told) for part, *told in LASERS]),
    *below(VECTORIZE, "/laser", [(LASER | part, *told) for part, *told in LASERS]),
    *below(ASSOCIATE, "/scan/views/1", VIEWS),
    *below(ASSOCIATE, "/map/segments", NUMBERS),
    *below(ASSOCIATE, "/scan/segments", NUMBERS),
    *below(REGISTER, "/scan/segments", NUMBERS),
    *below(VECTORIZE, "/points", [([ROOM[0][:2]] * 4 + [[bad[-1][-1], 1.0]], *told) for bad, *told in NUMBERS]),
    *SEVERAL,
    *OTHERS,
]

NO_TIME: dict[str, Any] = {"options": {"deadline_ms": 0}}
NOWHERE = {"map_id": "nowhere"}
BEAMS = {"laser": {"angle_min": 0.0, "angle_increment": 1e-4, "ranges": [1.0] * 17_000}, "pose": AT}
# A request, what it has, its status and code, and headers of the answer or a word of the detail.
STATUSES: list[tuple[str, Any, int, str, dict[str, str] | str]] = [
    ("GET /nothing", b"", 404, "not_found", ""),
    ("GET /v1/maps/", b"", 404, "not_found", ""),
    ("GET /v1/associate", b"", 405, "method_not_allowed", {"allow": "POST"}),
    ("PATCH /livez", b"", 405, "method_not_allowed", {"allow": "GET, HEAD"}),
    ("POST /v1/maps/m", b"", 405, "method_not_allowed", {"allow": "DELETE, GET, HEAD, PUT"}),
    ("BREW /livez", b"", 405, "method_not_allowed", {"allow": "GET, HEAD"}),
    ("GET /v1/maps:import", b"", 405, "method_not_allowed", {"allow": "POST"}),
    ("GET /v1/maps/nowhere", b"", 404, "unknown_map", ""),
    ("DELETE /v1/maps/nowhere", b"", 404, "unknown_map", ""),
    ("GET /v1/maps/nowhere:check", b"", 404, "unknown_map", ""),
    ("POST /v1/maps/nowhere:check", {"scans": [STILL]}, 404, "unknown_map", ""),
    ("POST /v1/maps/nowhere:analyze", {}, 404, "unknown_map", ""),
    ("POST /v1/maps/nowhere:update", examples.UPDATE, 404, "unknown_map", ""),
    (ASSOCIATE, {"map": NOWHERE}, 404, "unknown_map", ""),
    (BATCH, {"map": NOWHERE}, 404, "unknown_map", ""),
    (SEVERALLY, {"maps": [NOWHERE, TWO_MAPS[0]]}, 404, "unknown_map", ""),
    (SEVERALLY, {"maps": {"prefix": "nowhere-"}}, 404, "unknown_map", ""),
    *((f"PUT /v1/maps/{name}", examples.MAP, 422, "invalid_request", "/path/map_id: ")
      for name in ("a b", "x" * 129, "\u00e4", "a:b", "m:check")),
    ("GET /v1/maps/a b:check", b"", 422, "invalid_request", "/path/map_id: "),
    ("GET /v1/maps/wrong:check?deadline_ms=soon", b"", 422, "invalid_request", "/query/deadline_ms: expected a number"),
    ("GET /v1/maps?limit=0", b"", 422, "invalid_request", "/query/limit: "),
    ("GET /v1/maps?limit=1e3", b"", 422, "invalid_request", "/query/limit: expected an integer"),
    ("GET /v1/maps/wrong:check?deadline_ms=0", b"", 504, "deadline_exceeded", ""),
    (CHECK, {"scans": [STILL], "deadline_ms": 0}, 504, "deadline_exceeded", ""),
    (ANALYZE, {"deadline_ms": 0}, 504, "deadline_exceeded", ""),
    (UPDATE, {"deadline_ms": 0}, 504, "deadline_exceeded", ""),
    (ASSOCIATE, NO_TIME, 504, "deadline_exceeded", ""),
    (BATCH, NO_TIME, 504, "deadline_exceeded", ""),
    (ASSOCIATE, b'{"a": [' + b"[]," * 1_000_001 + b"[]]}", 413, "too_large", "expected at most 2000000 values"),
    (PUT, {"points": [[0, 0]] * 200_001}, 413, "too_large", "expected at most 200000 map points"),
    (ASSOCIATE, {"scan": {"views": [VIEW] * 65}}, 413, "too_large", "expected at most 64 views"),
    (ASSOCIATE, {"scan": {"views": [BEAMS] * 6}}, 413, "too_large", "100000 ranges or points"),
]  # fmt: skip
# Parts of a laser that only look like mistakes.
TAKEN = [
    *({"ranges": [5e-324] * 9}, {"ranges": [2.0, 5e-324, 2.0] * 3, "range_min": 0.0}),  # numbers next to nothing
    {"angle_max": 0.4, "time_increment": 0.0, "scan_time": 0.1, "intensities": [1.0] * 9, "header": {"seq": 7}},
    *({"angle_max": last} for last in (None, 0.4, 0.5, 0.3)),  # off by a beam
    {"angle_min": -0.8, "angle_max": 0},
]
