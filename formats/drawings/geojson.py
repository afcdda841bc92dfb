"""Drawings in GeoJSON with coordinates in metres, which the standard has no place for: by an explicit flag."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import IncompleteFileError, MalformedFileError, TooLargeError
from ..files import kind_of, load_json, name_of, read_bounded
from ..limits import MAX_ENTITIES, MAX_MAP_BYTES, MAX_UNITS
from ..options import ImportOptions
from ..report import Notes
from .drawing import Drawing

MAX_COLLECTIONS = 4
OWN = "linefix"  # the member that identifies our own files

Lines = Iterator[tuple[Any, bool]]


def read_geojson(path: Path, options: ImportOptions, notes: Notes) -> Drawing:
    """Read the lines and the outlines of areas.

    Parameters
    ----------
    path : Path
    options : ImportOptions
        `local_metres` has to be set for any file but our own; layers are the properties ``layer`` and ``name``, and
        ``thickness`` or ``width`` are those of a wall drawn by its centre line.
    notes : Notes

    Raises
    ------
    FormatError
        When it is no GeoJSON, or its coordinates are degrees.
    """
    name = name_of(path)
    root = load_json(read_bounded(path, MAX_MAP_BYTES), name)
    if not isinstance(root, dict) or not isinstance(root.get("type"), str):
        found = "an object without it" if isinstance(root, dict) else kind_of(root)
        raise MalformedFileError(f"is not GeoJSON: expected an object with a type, found {found}", argument=name)
    own = root.get(OWN)
    told = own if isinstance(own, dict) else {}
    if not options.local_metres and told.get("metres") is not True:
        raise IncompleteFileError(
            "has degrees, as its standard requires; expected metres. If it has metres, set the option local_metres",
            argument=name,
        )
    drawing = Drawing(name, "geojson", options.layers, notes, 1.0, told.get("oriented") is True)
    features = root.get("features", []) if root["type"] == "FeatureCollection" else [root]
    if not isinstance(features, list):
        raise MalformedFileError(f"expected features to be a list, found {kind_of(features)}", argument=name)
    if len(features) > MAX_ENTITIES:
        raise TooLargeError(f"expected at most {MAX_ENTITIES} features, found {len(features)}", argument=name)
    for k, feature in enumerate(features):
        if not isinstance(feature, dict):
            raise MalformedFileError(
                f"expected every feature to be an object, found {kind_of(feature)} as feature {k}", argument=name
            )
        _read_feature(feature, drawing)
    return drawing


def _read_feature(feature: dict[str, Any], drawing: Drawing) -> None:
    geometry = feature.get("geometry") if feature.get("type") == "Feature" else feature
    properties = feature.get("properties")
    named = properties if isinstance(properties, dict) else {}
    layers = [value for key in ("layer", "name") if isinstance(value := named.get(key), str)]
    if not drawing.wants(*layers):
        drawing.notes.add_dropped("other_layer", "features on layers that the option layers excludes", 1)
        return
    if geometry is None:
        drawing.drop("feature without geometry")
        return
    widths = (named.get(key) for key in ("thickness", "width"))
    width = next((told for told in map(_width, widths) if told is not None), 0.0)
    for points, closed in _lines(geometry, drawing):
        try:
            pairs = [(p[0], p[1]) for p in points]
        except (TypeError, LookupError) as error:
            raise MalformedFileError(
                "has a position that is not [x, y]: check the nesting of lists", argument=drawing.name
            ) from error
        wrong = next((c for pair in pairs for c in pair if type(c) not in (int, float)), 0)
        if wrong != 0:
            raise MalformedFileError(
                f"has a coordinate that is not a number: expected metres, found {kind_of(wrong)}", argument=drawing.name
            )
        drawing.add(pairs, closed=closed, width=width, layer=layers[0] if layers else "")


def _width(value: Any) -> float | None:
    return float(value) if type(value) in (int, float) and 0.0 <= value <= MAX_UNITS else None


def _lines(geometry: Any, drawing: Drawing, depth: int = 0) -> Lines:
    """Yield the polylines of a geometry, and whether each is closed."""
    if not isinstance(geometry, dict):
        raise MalformedFileError(
            f"expected a geometry to be an object, found {kind_of(geometry)}", argument=drawing.name
        )
    if depth > MAX_COLLECTIONS:
        raise MalformedFileError(
            f"expected at most {MAX_COLLECTIONS} nested collections, found more; flatten them",
            argument=drawing.name,
        )
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    if kind == "GeometryCollection":
        for inner in _listed(geometry.get("geometries"), drawing):
            yield from _lines(inner, drawing, depth + 1)
    elif kind == "LineString":
        yield _listed(coordinates, drawing), False
    elif kind in ("MultiLineString", "Polygon"):
        yield from ((_listed(line, drawing), kind == "Polygon") for line in _listed(coordinates, drawing))
    elif kind == "MultiPolygon":
        for polygon in _listed(coordinates, drawing):
            yield from ((_listed(ring, drawing), True) for ring in _listed(polygon, drawing))
    else:
        drawing.drop(str(kind))
        return
    drawing.notes.add_read(f"geometry_{str(kind).lower()}", f"{kind} geometries", 1)


def _listed(value: Any, drawing: Drawing) -> list[Any]:
    if not isinstance(value, list):
        raise MalformedFileError(f"expected coordinates in lists, found {kind_of(value)}", argument=drawing.name)
    return value
