"""Drawings in DXF, text or binary, read by ezdxf."""

from __future__ import annotations

import io
import logging
import re
import struct
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from ezdxf import path as ezpath
from ezdxf import recover
from ezdxf.audit import AuditError
from ezdxf.entities.dxfentity import DXFEntity
from ezdxf.entities.lwpolyline import LWPolyline
from ezdxf.entities.polyline import Polyline
from ezdxf.filemanagement import readfile
from ezdxf.lldxf.const import DXFError

from ..errors import FormatError, MalformedFileError, TooLargeError
from ..files import read_bounded
from ..limits import MAX_COORDINATE, MAX_CURVE_POINTS, MAX_DXF_OBJECTS, MAX_MAP_BYTES, MAX_TEXT
from ..options import US_FT
from ..report import Notes, first_of, shown
from .drawing import Drawing
from .dxf_blocks import Expansion, Placed, shown_parts
from .selection import walls_among

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

# It would print every repair of a broken file; they are counted in the report.
logging.getLogger("ezdxf").addHandler(logging.NullHandler())

# Metres per unit, by the number in $INSUNITS: inch, foot, mile, mm, cm, m, km, microinch, mil, yard, angstrom, nm, um,
# dm, dam, hm, and those of the US survey: foot, inch, yard, mile.
METRES_OF = {
    1: 0.0254, 2: 0.3048, 3: 1609.344, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 8: 2.54e-8, 9: 2.54e-5, 10: 0.9144, 11: 1e-10,
    12: 1e-9, 13: 1e-6, 14: 0.1, 15: 10.0, 16: 100.0, 21: US_FT, 22: US_FT / 12, 23: 3 * US_FT,
    24: 5280 * US_FT,
}  # fmt: skip

LINES = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
SAGITTA = 0.01  # m; how far a chord may lie from its arc

CURVE, FRAME = 8, 16  # flags of a vertex of a POLYLINE that was smoothed: of the curve, or a control point

BINARY = b"AutoCAD Binary DXF\r\n\x1a\x00"
_END = re.compile(rb"\n[ \t]*0\r?\n[ \t]*EOF\s*$")
_OBJECT = re.compile(rb"\n[ \t]*0\r?\n")  # group code 0 begins an entity, an object or a section
BROKEN = (DXFError, ArithmeticError, ValueError, TypeError, AttributeError, LookupError, RecursionError, struct.error)
PROXIES = ("ACAD_PROXY", "AEC_", "ACDBZOMBIE")  # beginnings of the kinds of entities of other programs


def read_dxf(path: Path, drawing: Drawing) -> None:
    """Read the lines of a DXF's model space, blocks taken apart.

    Raises
    ------
    FormatError
        When it is no DXF, or expands to too much.
    """
    document, options = _document(path, drawing.notes), drawing.options
    drawing.metres = _metres(document, drawing.notes)
    expansion = Expansion.of(document, drawing)
    metres = options.metres or drawing.metres or 1.0
    try:
        if not options.layers and not options.where:
            drawing.walls = walls_among(expansion.layers(document.modelspace()), drawing.notes)
        for placed in expansion.visible(document.modelspace()):
            if drawing.takes(placed.layers, _properties(placed, expansion.broken)):
                _add(placed, drawing, SAGITTA / metres)
    except FormatError:
        raise
    except BROKEN as error:
        raise MalformedFileError(
            "has a block that cannot be read; expected valid entities. Repair the drawing (AUDIT)"
        ) from error
    _note_paper_space(document, drawing)


def _document(path: Path, notes: Notes) -> Document:
    content = read_bounded(path, MAX_MAP_BYTES)
    if not content.strip():
        raise MalformedFileError("is empty, expected a DXF")
    if sum(1 for _ in islice(_OBJECT.finditer(content), MAX_DXF_OBJECTS + 1)) > MAX_DXF_OBJECTS:
        raise TooLargeError(
            f"expected at most {MAX_DXF_OBJECTS} entities and objects, found more; delete those that are no walls"
        )
    try:
        if content.startswith(BINARY):
            document = readfile(path)  # the recovering reader knows text alone
            auditor = document.audit()
        else:
            document, auditor = recover.read(io.BytesIO(content))
    except (OSError, *BROKEN) as error:
        raise MalformedFileError("is not a DXF; check whether it is cut off") from error
    entries = [*auditor.fixes, *auditor.errors]
    if wrong := [one.message for one in entries if one.code == AuditError.INVALID_FLOATING_POINT_VALUE]:
        raise MalformedFileError(f"has numbers that cannot be read, expected decimal points: {first_of(wrong)}")
    if entries:
        told = first_of([one.message for one in entries])
        notes.add_assumed("repairs", f"errors of the file that were repaired: {told}", len(entries))
    if not content.startswith(BINARY) and not _END.search(content[-MAX_TEXT:]):
        notes.add_dropped("cut_off", "the file is cut off: it does not end in EOF, and what follows is missing", 0)
    return document


def _metres(document: Document, notes: Notes) -> float | None:
    """Return metres per unit; None where the file has no unit, or one that is none of a building."""
    unit = document.header.get("$INSUNITS", 0)
    metres = METRES_OF.get(unit)
    if metres is None and unit != 0:
        notes.add_assumed("unknown_unit", f"$INSUNITS is {shown(str(unit))}, which is no unit of a building")
    return metres


def _width(entity: DXFEntity) -> float:
    """Return how wide a polyline is drawn, where it begins; units of the drawing."""
    if isinstance(entity, LWPolyline):
        told = entity.dxf.get("const_width", 0.0) or next((start for _, _, start, _, _ in entity.get_points()), 0.0)
        return float(told)
    return float(entity.dxf.default_start_width) if isinstance(entity, Polyline) else 0.0


def _properties(placed: Placed, broken: set[str]) -> dict[str, str]:
    """Return what the option where may name."""
    gaps = {"linetype with gaps": placed.linetype} if placed.linetype.casefold() in broken else {}
    return gaps | {
        "layer": placed.layers[-1],
        "block": "/".join(placed.blocks),
        "entity": placed.entity.dxftype(),
        "color": str(placed.entity.dxf.get("color", 256)),
        "linetype": placed.linetype,
    }


def _add(placed: Placed, drawing: Drawing, sagitta: float) -> None:
    entity, kind = placed.entity, placed.entity.dxftype()
    mesh = isinstance(entity, Polyline) and not (entity.is_2d_polyline or entity.is_3d_polyline)
    if kind not in LINES or mesh:
        proxy = "is an object of another program; export the drawing with standard objects (EXPORTTOAUTOCAD)"
        drawing.drop("POLYLINE of a mesh" if mesh else kind, hint=proxy if kind.startswith(PROXIES) else "")
        return
    try:
        curve = ezpath.make_path(_without_frame(entity))
        reach = max((abs(value) for point in curve.control_vertices() for value in point.xyz), default=0.0)
        near = reach <= MAX_COORDINATE / SAGITTA * sagitta
        points = list(islice(curve.flattening(sagitta, segments=2), MAX_CURVE_POINTS + 1)) if near else []
        width = max(0.0, _width(entity))
        parts = shown_parts(points, placed.clips) if len(points) <= MAX_CURVE_POINTS else []
    except BROKEN as error:
        raise MalformedFileError(f"has a broken {_named(placed)}; delete it, or repair the drawing (AUDIT)") from error
    if not near:
        raise TooLargeError(
            f"has coordinates beyond {MAX_COORDINATE:g} m: {_named(placed)}; delete it, or set the option units"
        )
    if len(points) > MAX_CURVE_POINTS:
        raise TooLargeError(
            f"expected at most {MAX_CURVE_POINTS} points of a curve, found more; simplify the {_named(placed)}"
        )
    if placed.clips and (len(parts) != 1 or len(parts[0]) < len(points)):
        drawing.notes.add_dropped("clipped", "lines that the clipping of a block (XCLIP) hides, or divides", 1)
    for part in parts:
        drawing.add(part, width=width, layers=placed.layers, properties={"block": "/".join(placed.blocks)})
    if parts:
        drawing.notes.add_read(f"entity_{kind.lower()}", f"{kind} entities", 1)


def _named(placed: Placed) -> str:
    """Return the kind, the layer and the handle of an entity."""
    handle = shown(str(placed.entity.dxf.get("handle", None) or "of a block"))
    return f"{placed.entity.dxftype()} on layer {shown(placed.layers[-1])}, handle {handle}"


def _without_frame(entity: DXFEntity) -> DXFEntity:
    """Leave out the control points of a polyline that was smoothed, where it has the vertices of the curve too."""
    if isinstance(entity, Polyline) and any(vertex.dxf.flags & CURVE for vertex in entity.vertices):
        entity.vertices[:] = [vertex for vertex in entity.vertices if not vertex.dxf.flags & FRAME]
    return entity


def _note_paper_space(document: Document, drawing: Drawing) -> None:
    """Note the number of entities in paper space, by its layouts."""
    for layout in document.layouts:
        count = 0 if layout.is_modelspace else sum(entity.dxftype() != "VIEWPORT" for entity in layout)
        if count:
            name = shown(layout.name)
            told = f"entities in paper space, layout {name}; move walls to the model space (CHSPACE)"
            drawing.notes.add_dropped(f"paper_space_{name}", told, count)
