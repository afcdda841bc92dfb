"""The columns of input and output tables."""

from __future__ import annotations

import pyarrow as pa

LASER = ("angle_min", "angle_increment", "ranges")
MOTION = ("time_increment", "vx", "vy", "omega")
FORMS = ("ranges", "segments")

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
