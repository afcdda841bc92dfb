"""The visible entities of a DXF's model space, blocks taken apart by the rules of AutoCAD.

An entity on layer 0 of a block is on the layer of the block's reference (INSERT). A frozen layer hides its entities
and references, with all that is in them. A layer that is off hides its entities alone. Of a reference on it these are
the entities on layer 0 of the block; those with a visible layer of their own remain. A clipped reference (XCLIP) shows
a part of its lines.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from ezdxf.entities.dxfentity import DXFEntity
from ezdxf.entities.insert import Insert
from ezdxf.entities.mline import MLine
from ezdxf.math import BoundingBox2d, Vec2, Vec3
from ezdxf.math.clipping import ConcaveClippingPolygon2d, InvertedClippingPolygon2d
from ezdxf.xclip import XClip

from ..errors import TooLargeError
from ..limits import MAX_BLOCK_DEPTH, MAX_ENTITIES
from ..report import Notes, listed, shown
from .drawing import Drawing

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

BYBLOCK = "0"  # the layer whose entities take that of their block's reference


@dataclass(frozen=True, slots=True)
class Clip:
    """A polygon of the model space; what is outside is hidden, or inside where `inverted`."""

    polygon: tuple[Vec2, ...]
    inverted: bool

    def shown(self, line: Sequence[Vec2]) -> list[Sequence[Vec2]]:
        """Return the parts of a polyline that are shown."""
        if not self.inverted:
            return list(ConcaveClippingPolygon2d(self.polygon).clip_polyline(line))
        bounds = BoundingBox2d([*self.polygon, *line])
        bounds.grow(0.1 * bounds.size.magnitude)
        return list(InvertedClippingPolygon2d(self.polygon, bounds).clip_polyline(line))


class Placed(NamedTuple):
    """An entity with its layers, those of the references that it is in first, what these clip, their blocks, its line.

    Without a reference, BYBLOCK is a continuous line.
    """

    entity: Any
    layers: tuple[str, ...]
    clips: tuple[Clip, ...] = ()
    blocks: tuple[str, ...] = ()
    linetype: str = "Continuous"


@dataclass(slots=True)
class Expansion:
    """Takes blocks apart and counts what is hidden or cannot be shown.

    Attributes
    ----------
    frozen, off : set of str
        Layers by name, casefolded.
    linetypes : mapping of str to str
        Of the layers.
    broken : set of str
        Linetypes with gaps and without symbols, casefolded.
    drawing : Drawing
        Whose notes take what was done.
    """

    frozen: set[str]
    off: set[str]
    linetypes: Mapping[str, str]
    broken: set[str]
    drawing: Drawing
    _hidden: Counter[str] = field(default_factory=Counter)
    _external: Counter[str] = field(default_factory=Counter)
    _missing: Counter[str] = field(default_factory=Counter)
    _count: int = 0

    @classmethod
    def of(cls, document: Document, drawing: Drawing) -> Expansion:
        """Take the states of a document's layers."""
        layers = list(document.layers)
        frozen = {layer.dxf.name.casefold() for layer in layers if layer.is_frozen()}
        off = {layer.dxf.name.casefold() for layer in layers if layer.is_off()}
        linetypes = {layer.dxf.name.casefold(): str(layer.dxf.get("linetype", "Continuous")) for layer in layers}
        broken = {one.dxf.name.casefold() for one in document.linetypes if len(one.simplified_line_pattern()) > 1}
        return cls(frozen, off, linetypes, broken, drawing)

    def visible(self, entities: Iterable[Any]) -> Iterator[Placed]:
        """Yield the visible entities with their layers; notes are complete when it ends.

        Raises
        ------
        TooLargeError
            When blocks lie too deep in one another, or expand to too much.
        """
        yield from self._visible(entities, Placed(None, ()), 0)
        self._note(self.drawing.notes)

    def layers(self, entities: Iterable[Any]) -> set[str]:
        """Return the layers of the visible entities; those of the references that they are in do not count."""
        found: set[str] = set()
        waiting: list[tuple[Iterable[Any], tuple[str, ...]]] = [(entities, ())]
        known: set[tuple[str, tuple[str, ...]]] = set()
        while waiting and len(known) < MAX_ENTITIES:
            some, outer = waiting.pop()
            for entity in some:
                layers = _layers_of(entity, outer)
                if self.hides(layers[-1], reference=isinstance(entity, Insert)):
                    continue
                if not isinstance(entity, Insert):
                    found.add(layers[-1])
                elif (block := entity.block()) is not None and (block.name, layers) not in known:
                    known.add((block.name, layers))
                    if len(layers) <= MAX_BLOCK_DEPTH:
                        waiting.append((block, layers))
        return found

    def hides(self, layer: str, *, reference: bool = False) -> bool:
        """Tell whether a layer hides its entities, or a reference on it with all that is in it."""
        name = layer.casefold()
        return name in self.frozen or (name in self.off and not reference)

    def _visible(self, entities: Iterable[Any], outer: Placed, depth: int) -> Iterator[Placed]:
        for entity in entities:
            self._count += 1
            if self._count > MAX_ENTITIES:
                raise TooLargeError(f"expected at most {MAX_ENTITIES} entities, blocks expanded")
            placed = self._placed(entity, _layers_of(entity, outer.layers), outer)
            if entity.dxf.get("invisible", 0):
                self.drawing.notes.add_dropped("invisible", "entities and blocks with the attribute invisible", 1)
            elif self.hides(placed.layers[-1], reference=isinstance(entity, Insert)):
                self._hidden[placed.layers[-1]] += 1
            elif isinstance(entity, Insert):
                yield from self._expanded(entity, placed, depth)
            elif isinstance(entity, MLine):
                self.drawing.notes.add_read("entity_mline", "MLINE entities", 1)
                lines = (part for part in entity.virtual_entities() if part.dxftype() != "HATCH")
                yield from (self._placed(part, placed.layers, outer) for part in lines)
            else:
                yield placed

    def _placed(self, entity: DXFEntity, layers: tuple[str, ...], outer: Placed) -> Placed:
        linetype = str(entity.dxf.get("linetype", "BYLAYER"))
        if linetype.upper() == "BYLAYER":
            linetype = self.linetypes.get(layers[-1].casefold(), linetype)
        elif linetype.upper() == "BYBLOCK":
            linetype = outer.linetype
        return outer._replace(entity=entity, layers=layers, linetype=linetype)

    def _expanded(self, reference: Insert, placed: Placed, depth: int) -> Iterator[Placed]:
        if depth >= MAX_BLOCK_DEPTH:
            raise TooLargeError(f"expected at most {MAX_BLOCK_DEPTH} blocks in one another")
        if reference.mcount > MAX_ENTITIES:
            raise TooLargeError(f"expected at most {MAX_ENTITIES} copies of a block")
        name, block = shown(str(reference.dxf.get("name", ""))), reference.block()
        if block is None:
            self._missing[name] += 1
            return
        if block.block is not None and (block.block.is_xref or block.block.is_xref_overlay):
            x, y, _ = reference.dxf.insert
            self._external[f"{name} ({shown(str(block.block.dxf.xref_path))}) at ({x:g}, {y:g})"] += 1
            return
        self.drawing.notes.add_merged("blocks", "blocks taken apart", reference.mcount)
        for one in reference.multi_insert() if reference.mcount > 1 else (reference,):
            self._count += 1  # so that empty blocks cannot be repeated without end
            inner = one.virtual_entities(skipped_entity_callback=lambda entity, _: self.drawing.drop(entity.dxftype()))
            clip = clip_of(reference, one)
            clips = placed.clips if clip is None else (*placed.clips, clip)
            yield from self._visible(inner, placed._replace(clips=clips, blocks=(*placed.blocks, name)), depth + 1)

    def _note(self, notes: Notes) -> None:
        if self._hidden:
            what = f"entities and blocks on layers that are off or frozen: {listed(self._hidden)}"
            notes.add_dropped("hidden_layer", what, self._hidden.total())
        if self._external:
            notes.add_dropped(
                "external_reference",
                f"external references to other drawings: {listed(self._external)}; bind them (XREF, "
                "Bind) and save the drawing again",
                self._external.total(),
            )
        if self._missing:
            what = f"references to blocks that the file does not define: {listed(self._missing)}"
            notes.add_dropped("missing_block", what, self._missing.total())


def _layers_of(entity: DXFEntity, outer: tuple[str, ...]) -> tuple[str, ...]:
    layer = str(entity.dxf.get("layer", BYBLOCK))
    return (*outer, outer[-1] if outer and layer == BYBLOCK else layer)


def clip_of(reference: Insert, placed: Insert) -> Clip | None:
    """Return how a reference clips its block, at the place of one of its copies; None where it does not."""
    source = reference.origin_of_copy or reference
    clip = XClip(source) if isinstance(source, Insert) else None
    if clip is None or not (clip.has_clipping_path and clip.is_clipping_enabled):
        return None
    path = clip.get_block_clipping_path()
    inner = list(path.inner_polygon())
    corners = BoundingBox2d(inner).rect_vertices() if len(inner) == 2 else inner
    polygon = Vec2.tuple(placed.matrix44().transform_vertices(Vec3.generate(corners)))
    return Clip(polygon, path.is_inverted_clip) if len(polygon) > 2 else None


def shown_parts(points: list[Vec3], clips: Sequence[Clip]) -> list[list[tuple[float, float, float]]]:
    """Return the parts of a polyline that no reference hides."""
    if not clips:
        return [[(p.x, p.y, p.z) for p in points]]
    parts: list[Sequence[Vec2]] = [Vec2.list(points)]
    for clip in clips:
        parts = [part for line in parts for part in clip.shown(line)]
    return [[(p.x, p.y, points[0].z) for p in part] for part in parts]
