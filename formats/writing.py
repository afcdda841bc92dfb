"""Files out: maps as JSON, GeoJSON, SVG, CSV and DXF, each so that reading it gives the same map; poses as TUM."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import orjson

from registration import RigidTransform

from .drawings.csv_table import COLUMNS
from .drawings.geojson import OWN
from .drawings.svg.reading import METRES, ORIENTED
from .drawings.svg.xml import NAMESPACE
from .errors import UnsupportedFormatError
from .files import ending_of, name_of
from .line_map import LineMap

NS = 1_000_000_000
UNDIRECTED = "WALLS"  # the layer of lines in a DXF whose directions mean nothing
LINE_WIDTH = 0.03  # m, in an SVG
MARGIN = 0.5  # m, around an SVG


def write_map(map: LineMap, path: str | os.PathLike[str]) -> None:
    """Write a map in the format of the file's name.

    Parameters
    ----------
    map : LineMap
    path : str or path
        Ends in ``.json``, ``.geojson``, ``.svg``, ``.csv`` or ``.dxf``. Only JSON keeps the points and sigma.

    Raises
    ------
    UnsupportedFormatError
        When it ends in anything else.
    """
    file = Path(path)
    writer = WRITERS.get(file.suffix.lower())
    if writer is None:
        raise UnsupportedFormatError(
            f"expected a name that ends in one of {', '.join(WRITERS)}, found {ending_of(file)}", argument=name_of(file)
        )
    file.write_bytes(writer(map))


def _json(map: LineMap) -> bytes:
    return orjson.dumps(map.document, option=orjson.OPT_SERIALIZE_NUMPY)


def _geojson(map: LineMap) -> bytes:
    lines = [
        {"type": "Feature", "properties": {"segment": k},
         "geometry": {"type": "LineString", "coordinates": [row[:2], row[2:]]}}
        for k, row in enumerate(map.segments.endpoints.tolist())
    ]  # fmt: skip
    own = {"metres": True, "oriented": map.oriented, "frame_id": map.frame_id}
    return orjson.dumps({"type": "FeatureCollection", OWN: own, "features": lines})


def _svg(map: LineMap) -> bytes:
    e = map.segments.endpoints
    corners = e.reshape(-1, 2) if len(e) else np.zeros((1, 2))
    low, high = corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN
    box = " ".join(repr(float(v)) for v in (low[0], -high[1], *(high - low)))
    told = f'{METRES}="1" {ORIENTED}="{str(map.oriented).lower()}"'
    lines = "\n".join(f'<line x1="{x1!r}" y1="{-y1!r}" x2="{x2!r}" y2="{-y2!r}"/>' for x1, y1, x2, y2 in e.tolist())
    return (
        f'<svg xmlns="{NAMESPACE}" viewBox="{box}" {told}>\n'
        f'<g id={quoteattr(map.frame_id)} stroke="black" stroke-width="{LINE_WIDTH}">\n{lines}\n</g>\n</svg>\n'
    ).encode()


def _csv(map: LineMap) -> bytes:
    lines = [f"# oriented={str(map.oriented).lower()}", ",".join(COLUMNS)]
    lines += [",".join(repr(c) for c in row) for row in map.segments.endpoints.tolist()]
    return "\n".join([*lines, ""]).encode()


def _dxf(map: LineMap) -> bytes:
    from ezdxf import units
    from ezdxf.filemanagement import new

    from .drawings.dxf import FREE_LEFT

    document = new("R2010", units=units.M)
    layer = FREE_LEFT if map.oriented else UNDIRECTED
    document.layers.add(layer)
    space = document.modelspace()
    for x1, y1, x2, y2 in map.segments.endpoints.tolist():
        space.add_line((x1, y1), (x2, y2), dxfattribs={"layer": layer})
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode("utf-8")


WRITERS: dict[str, Callable[[LineMap], bytes]] = {
    ".json": _json,
    ".geojson": _geojson,
    ".svg": _svg,
    ".csv": _csv,
    ".dxf": _dxf,
}


@dataclass(frozen=True, slots=True)
class StampedPose:
    """A pose of the robot with its time.

    Attributes
    ----------
    stamp_ns : int
        Nanoseconds.
    pose : RigidTransform
        map_from_scan.
    """

    stamp_ns: int
    pose: RigidTransform


def write_tum(poses: Iterable[StampedPose], path: str | os.PathLike[str]) -> int:
    """Write poses as TUM has them: ``seconds x y z qx qy qz qw`` a line; return how many."""
    count = 0
    with Path(path).open("w", encoding="ascii", newline="\n") as file:
        for one in poses:
            seconds, rest = divmod(one.stamp_ns, NS)
            z, w = math.sin(0.5 * one.pose.theta), math.cos(0.5 * one.pose.theta)
            file.write(f"{seconds}.{rest:09d} {one.pose.x:.9f} {one.pose.y:.9f} 0 0 0 {z:.12f} {w:.12f}\n")
            count += 1
    return count
