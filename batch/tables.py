"""The columns of input and output tables."""

from __future__ import annotations

from collections.abc import Callable

import pyarrow as pa

LASER = ("angle_min", "angle_increment", "ranges")
BOUNDS = ("range_min", "range_max")
MOTION = ("time_increment", "vx", "vy", "omega")
FORMS = ("ranges", "segments")


def _any_of(*tests: Callable[[pa.DataType], bool]) -> Callable[[pa.DataType], bool]:
    return lambda kind: any(test(kind) for test in tests)


types = pa.types
_is_number, _is_text = _any_of(types.is_floating, types.is_integer), _any_of(types.is_string, types.is_large_string)
_is_list = _any_of(types.is_list, types.is_large_list, types.is_fixed_size_list)
NUMBER, TEXT = (_is_number, "numbers"), (_is_text, "text")

# The columns of input that are read: the test of their type, and what is expected.
COLUMNS: dict[str, tuple[Callable[[pa.DataType], bool], str]] = {
    "stamp": (_any_of(types.is_integer, types.is_timestamp), "nanoseconds or points in time"),
    "ranges": (lambda kind: _is_list(kind) and _is_number(kind.value_type), "a list of numbers"),
    "segments": (_is_list, "lists of four numbers"),
    "flipped": (types.is_boolean, "true or false"),
    **dict.fromkeys(("map_id", "error"), TEXT),
    **dict.fromkeys((*LASER[:2], *BOUNDS, *MOTION, "sigma"), NUMBER),
}

# A log of another tool, laid out as Parquet.
SCANS = pa.schema(
    [
        ("stamp", pa.int64()),
        ("angle_min", pa.float64()),
        ("angle_increment", pa.float64()),
        ("ranges", pa.list_(pa.float64())),
        ("range_min", pa.float64()),
        ("range_max", pa.float64()),
        ("flipped", pa.bool_()),  # y becomes -y in the sensor's data: it is mounted upside down
        ("time_increment", pa.float64()),  # s, from beam to beam; null or 0: not known
        ("vx", pa.float64()),  # m/s and rad/s, of the sensor in its own frame; null: not known
        ("vy", pa.float64()),
        ("omega", pa.float64()),
        ("error", pa.string()),  # instead of a scan
    ]
)

# One row a scan. Metres, radians; poses are map_from_scan, of the sensor also where a log has its mount.
POSES = pa.schema(
    [
        ("log", pa.string()),  # as the caller named it
        ("index", pa.int64()),  # of the scan in its log, from 0
        ("stamp", pa.int64()),  # nanoseconds; null: not known
        ("map_id", pa.string()),
        ("status", pa.string()),  # ok, ambiguous, degenerate, no_match; null: there is an error
        ("usable", pa.bool_()),
        ("probability", pa.float64()),
        ("x", pa.float64()),
        ("y", pa.float64()),
        ("theta", pa.float64()),
        ("covariance", pa.list_(pa.float64(), 9)),  # by rows
        ("unobservable", pa.list_(pa.float64(), 2)),
        ("reasons", pa.list_(pa.string())),  # codes, the weightiest first
        ("warnings", pa.list_(pa.string())),
        ("inlier_fraction", pa.float64()),
        ("margin", pa.float64()),  # nats
        ("complete", pa.bool_()),
        ("search_ms", pa.float64()),
        ("error", pa.string()),  # "code: message" where the scan could not be searched
    ]
)
