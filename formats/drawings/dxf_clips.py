"""Block references of a DXF that are clipped (XCLIP): the parts of lines that are shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ezdxf.entities.insert import Insert
from ezdxf.math import BoundingBox2d, Vec2, Vec3
from ezdxf.math.clipping import ConcaveClippingPolygon2d, InvertedClippingPolygon2d
from ezdxf.xclip import XClip


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
