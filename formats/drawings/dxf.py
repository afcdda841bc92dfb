"""Drawings in DXF, read and written by ezdxf."""

from __future__ import annotations

import fnmatch
import io
import logging
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ezdxf import path as ezpath
from ezdxf import recover
from ezdxf.entities.dxfentity import DXFEntity
from ezdxf.entities.insert import Insert
from ezdxf.entities.lwpolyline import LWPolyline
from ezdxf.entities.polyline import Polyline
from ezdxf.enums import InsertUnits
from ezdxf.lldxf.const import DXFError
from ezdxf.units import conversion_factor

from ..errors import FormatError, MalformedFileError, TooLargeError, UnsupportedFormatError
from ..files import name_of, read_bounded
from ..limits import MAX_BLOCK_DEPTH, MAX_CURVE_POINTS, MAX_ENTITIES, MAX_MAP_BYTES
from ..options import ImportOptions
from ..report import Notes, shown
from .drawing import Drawing

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

# It would print every repair of a broken file; they are counted in the report.
logging.getLogger("ezdxf").addHandler(logging.NullHandler())

# The layer of lines that have free space on their left; the one way in which a DXF says so.
FREE_LEFT = "FREE_LEFT"

# Of layers, in some languages of drawings.
NAMES_OF_WALLS = ("*wall*", "*wand*", "*mauer*", "*muro*", "*pared*", "*mur", "*murs*")
MOST_NAMED = 10  # layers

LINES = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
SAGITTA = 0.01  # m; how far a chord may lie from its arc


def read_dxf(path: Path, options: ImportOptions, notes: Notes) -> Drawing:
    """Read the lines of a DXF's model space, blocks taken apart.

    Parameters
    ----------
    path : Path
    options : ImportOptions
    notes : Notes

    Raises
    ------
    FormatError
        When it is no DXF, or expands to too much.
    """
    name = name_of(path)
    document = _document(read_bounded(path, MAX_MAP_BYTES), name, notes)
    hidden = {layer.dxf.name.casefold() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    layers = options.layers or _layers_of_walls(document, hidden, notes)
    drawing = Drawing(name, "dxf", layers, notes, _metres(document))
    metres = options.metres or drawing.metres or 1.0
    directed = 0
    try:
        for count, (entity, layers) in enumerate(_expanded(document.modelspace(), (), 0, drawing)):
            if count >= MAX_ENTITIES:
                raise TooLargeError(f"expected at most {MAX_ENTITIES} entities, blocks expanded", argument=name)
            if layers[-1].casefold() in hidden:
                notes.add_dropped("hidden_layer", "lines on layers that are off or frozen", 1)
            elif not drawing.wants(*layers):
                notes.add_dropped("other_layer", "entities on layers that were not asked for", 1)
            else:
                before = len(drawing.segments)
                _add(entity, drawing, SAGITTA / metres)
                directed += (len(drawing.segments) - before) * (layers[-1] == FREE_LEFT)
    except FormatError:
        raise
    except (DXFError, ArithmeticError, ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
        raise MalformedFileError("has a broken entity", argument=name) from error
    drawing.oriented = 0 < directed == len(drawing.segments)
    return drawing


def _document(content: bytes, name: str, notes: Notes) -> Document:
    if content[:4] == b"AC10":
        raise UnsupportedFormatError("is a DWG; save it as DXF", argument=name)
    if not content.strip():
        raise MalformedFileError("is empty", argument=name)
    try:
        document, auditor = recover.read(io.BytesIO(content))
    except (DXFError, OSError, ArithmeticError, ValueError, TypeError, AttributeError, LookupError) as error:
        raise MalformedFileError("is no DXF", argument=name) from error
    if auditor.fixes or auditor.errors:
        notes.add_assumed("repairs", "broken places that were repaired", len(auditor.fixes) + len(auditor.errors))
    return document


def _layers_of_walls(document: Document, hidden: set[str], notes: Notes) -> tuple[str, ...]:
    """Return patterns of the layers that hold walls by their names, where there are others; else none."""
    names = {str(entity.dxf.get("layer", "0")) for entity in document.modelspace()}
    shown_names = sorted(name for name in names if name.casefold() not in hidden)
    walls = [n for n in shown_names if any(fnmatch.fnmatchcase(n.casefold(), pattern) for pattern in NAMES_OF_WALLS)]
    others = [name for name in shown_names if name not in walls]
    if len(shown_names) < 2 or not others:
        return ()
    listed = ", ".join(shown(name) for name in others[:MOST_NAMED]) + (" ..." if len(others) > MOST_NAMED else "")
    if not walls:
        notes.add_assumed("layers", f"lines of all layers are walls: {listed}; say layers where some are not")
        return ()
    taken = ", ".join(shown(name) for name in walls[:MOST_NAMED])
    notes.add_assumed("layers", f"walls are on {taken}, by the name, and not on {listed}; say layers for others")
    return NAMES_OF_WALLS


def _metres(document: Document) -> float | None:
    units = document.header.get("$INSUNITS", 0)
    if not isinstance(units, int) or units == 0:
        return None
    try:
        return float(conversion_factor(InsertUnits(units), InsertUnits.Meters))
    except (DXFError, ValueError, LookupError):
        return None


def _expanded(
    entities: Iterable[Any], layers: tuple[str, ...], depth: int, drawing: Drawing
) -> Iterator[tuple[DXFEntity, tuple[str, ...]]]:
    """Yield entities with their layers, outermost first; blocks are taken apart."""
    for entity in entities:
        within = (*layers, str(entity.dxf.get("layer", "0")))
        if not isinstance(entity, Insert):
            yield entity, within
            continue
        if depth >= MAX_BLOCK_DEPTH:
            raise TooLargeError(f"expected at most {MAX_BLOCK_DEPTH} blocks in one another", argument=drawing.name)
        if entity.mcount > MAX_ENTITIES:
            raise TooLargeError(f"expected at most {MAX_ENTITIES} copies of a block", argument=drawing.name)
        drawing.notes.add_merged("blocks", "blocks taken apart", entity.mcount)
        yield entity, within  # counts, so that empty blocks cannot be repeated without end
        for one in entity.multi_insert() if entity.mcount > 1 else (entity,):
            yield from _expanded(one.virtual_entities(), within, depth + 1, drawing)


def _width(entity: DXFEntity) -> float:
    """Return how wide a polyline is drawn, where it begins; units of the drawing."""
    if isinstance(entity, LWPolyline):
        told = entity.dxf.get("const_width", 0.0) or next((start for _, _, start, _, _ in entity.get_points()), 0.0)
        return float(told)
    return float(entity.dxf.default_start_width) if isinstance(entity, Polyline) else 0.0


def _add(entity: DXFEntity, drawing: Drawing, sagitta: float) -> None:
    kind = entity.dxftype()
    if kind == "INSERT":
        return
    if kind not in LINES:
        drawing.drop(kind)
        return
    curve = ezpath.make_path(entity)
    points = [(p.x, p.y) for p in islice(curve.flattening(sagitta, segments=2), MAX_CURVE_POINTS + 1)]
    if len(points) > MAX_CURVE_POINTS:
        raise TooLargeError(f"expected at most {MAX_CURVE_POINTS} points of a curve", argument=drawing.name)
    drawing.add(points, width=max(0.0, _width(entity)))
    drawing.notes.add_read(f"entity_{kind.lower()}", f"{kind} entities", 1)
