"""Drawings in GeoJSON with coordinates in metres or another unit of length; degrees are refused."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import MalformedFileError, TooLargeError
from ..files import kind_of, load_json, read_bounded
from ..limits import MAX_ENTITIES, MAX_MAP_BYTES, MAX_UNITS
from .coordinate_systems import require_lengths
from .drawing import Drawing
from .selection import lower_keys

MAX_COLLECTIONS = 4
HEIGHTS = ("z", "elevation", "elev")  # properties of a feature whose positions have no z
PACKED = re.compile(r'"([^"]+)"=>"([^"]*)"')  # tags as ogr2ogr writes them into one property
HIDDEN = ("feature_type", "id")  # members of an IMDF feature outside its properties

Lines = Iterator[tuple[Any, bool]]


def read_geojson(path: Path, drawing: Drawing) -> None:
    """Read the lines and the outlines of areas.

    Parameters
    ----------
    path : Path
    drawing : Drawing
        Takes them. Layers are the properties ``layer`` and ``name``, and ``thickness`` or ``width`` are those of a wall
        drawn by its centre line.

    Raises
    ------
    FormatError
        When it is no GeoJSON, or its coordinates are degrees or of an unknown unit.
    """
    root = load_json(read_bounded(path, MAX_MAP_BYTES))
    if not isinstance(root, dict) or not isinstance(root.get("type"), str):
        found = "an object without it" if isinstance(root, dict) else kind_of(root)
        raise MalformedFileError(f"is not GeoJSON: expected an object with a type, found {found}")
    drawing.metres = 1.0
    features = root.get("features", []) if root["type"] == "FeatureCollection" else [root]
    if not isinstance(features, list):
        raise MalformedFileError(f"expected features to be a list, found {kind_of(features)}")
    if len(features) > MAX_ENTITIES:
        raise TooLargeError(f"expected at most {MAX_ENTITIES} features, found {len(features)}")
    for k, feature in enumerate(features):
        if not isinstance(feature, dict):
            raise MalformedFileError(f"expected every feature to be an object, found {kind_of(feature)} as feature {k}")
        _read_feature(feature, drawing, k)
    members = [one[key] for one in (root, *features) for key in ("crs", "coordRefSys") if key in one]
    require_lengths(members[0] if members else None, drawing)


def _read_feature(feature: dict[str, Any], drawing: Drawing, number: int) -> None:
    geometry = feature.get("geometry") if feature.get("type") == "Feature" else feature
    named = _properties(feature)
    layers = tuple(value for key in ("layer", "name") if isinstance(value := named.get(key), str))
    if not drawing.takes(layers, named):
        return
    if geometry is None:
        drawing.drop("feature without geometry")
        return
    widths = (named.get(key) for key in ("thickness", "width"))
    width = next((told for told in map(_width, widths) if told is not None), 0.0)
    height = next((float(named[key]) for key in HEIGHTS if type(named.get(key)) in (int, float)), 0.0)
    for points, closed in _lines(geometry, drawing):
        try:
            places = [(p[0], p[1], p[2] if len(p) > 2 else height) for p in points]
        except (TypeError, LookupError) as error:
            raise MalformedFileError(
                f"has a position that is not [x, y] in feature {number}: check the nesting of lists"
            ) from error
        wrong = next((c for place in places for c in place if type(c) not in (int, float)), 0)
        if wrong != 0:
            raise MalformedFileError(
                f"has a coordinate that is not a number: expected metres, found {kind_of(wrong)} in feature {number}"
            )
        drawing.add(
            places, closed=closed, width=width, layers=layers[:1], properties=named, groups=layers[: "layer" in named]
        )


def _properties(feature: dict[str, Any]) -> dict[str, Any]:
    """Return the properties of a feature, names in lower case, with the tags of OpenStreetMap that tools pack."""
    properties = feature.get("properties")
    told = {key: feature[key] for key in HIDDEN if key in feature} | (
        properties if isinstance(properties, dict) else {}
    )
    named = lower_keys(told)
    if named.get("feature_type") == "level":  # its outline is on itself
        named["level_id"] = named.get("id")
    tags, packed = named.pop("tags", None), named.pop("other_tags", None)
    if isinstance(tags, dict):
        named = lower_keys(tags) | named
    return dict(PACKED.findall(packed)) | named if isinstance(packed, str) else named


def _width(value: Any) -> float | None:
    return float(value) if type(value) in (int, float) and 0.0 <= value <= MAX_UNITS else None


def _lines(geometry: Any, drawing: Drawing, depth: int = 0) -> Lines:
    """Yield the polylines of a geometry, and whether each is closed."""
    if not isinstance(geometry, dict):
        raise MalformedFileError(f"expected a geometry to be an object, found {kind_of(geometry)}")
    if depth > MAX_COLLECTIONS:
        raise MalformedFileError(f"expected at most {MAX_COLLECTIONS} nested collections, found more; flatten them")
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    if kind == "GeometryCollection":
        for inner in _listed(geometry.get("geometries")):
            yield from _lines(inner, drawing, depth + 1)
    elif kind == "LineString":
        yield _listed(coordinates), False
    elif kind in ("MultiLineString", "Polygon"):
        yield from ((_listed(line), kind == "Polygon") for line in _listed(coordinates))
    elif kind == "MultiPolygon":
        for polygon in _listed(coordinates):
            yield from ((_listed(ring), True) for ring in _listed(polygon))
    else:
        drawing.drop(str(kind))
        return
    drawing.notes.add_read(f"geometry_{str(kind).lower()}", f"{kind} geometries", 1)


def _listed(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise MalformedFileError(f"expected coordinates in lists, found {kind_of(value)}")
    return value
