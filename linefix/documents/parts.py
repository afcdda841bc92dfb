"""The parts that requests are put together from: maps, one or several, priors, options."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from .arrays import Covariance, MapPointRows, MapSegmentRows
from .strict import DeadlineMs, FrameId, FreeJson, MapId, OneOf, Pose, Strict, in_radians

MapSigma = Annotated[float, Field(ge=0.0, le=10.0)]
PointSigma = Annotated[float, Field(gt=0.0, le=10.0)]
IncludeName = Literal["correspondences", "alternatives", "segments", "missing_map"]
EVERYTHING: tuple[IncludeName, ...] = ("correspondences", "alternatives", "segments", "missing_map")


class MapDocument(Strict):
    """A map, as a file of its own or to be stored.

    Attributes
    ----------
    segments
        `[x1, y1, x2, y2]` each, metres, free space on the left
    sigma
        standard deviation of the map's lines, normal to the lines, metres; null: estimated
    oriented
        whether free space lies on the left of its segments; null: true; a request's option has precedence
    frame_id
        frame of the map, as `frame_id` of the answer
    points
        `[x, y]` each, metres: objects too small for a wall, such as legs and posts; evidence for the beams of a scan
        only; at most as many as `max_map_segments` of /v1/limits
    points_sigma
        standard deviation of the points' positions, and half their width, metres; null: 0.05
    meta
        returned as it was sent
    """

    segments: MapSegmentRows
    sigma: MapSigma | None = None
    oriented: bool | None = None
    frame_id: FrameId = "map"
    points: MapPointRows = Field(default_factory=lambda: np.zeros((0, 2)), json_schema_extra={"default": []})
    points_sigma: PointSigma | None = None
    meta: FreeJson = None


class InlineMap(MapDocument):
    """A map in the request itself.

    Attributes
    ----------
    meta
        not used; allowed, so that a map file may be sent unchanged
    """

    meta: FreeJson = None


class StoredMap(Strict):
    """A map that was stored with PUT before.

    Attributes
    ----------
    map_id
        id under which the map was stored
    """

    map_id: MapId


def is_oriented(asked: bool | None, own: bool | None) -> bool:
    """Tell whether directions mean anything: as the request says, else as the map does, else yes."""
    return next((said for said in (asked, own) if said is not None), True)


AnyMap = Annotated[InlineMap | StoredMap, OneOf("segments and map_id, found both or neither", ("segments", "map_id"))]


FEWEST_MAPS, MOST_MAPS = 2, 256


class NamedMap(InlineMap):
    """A map in the request itself, with a name for the answer.

    Attributes
    ----------
    map_id
        name of the map in the answer
    """

    map_id: MapId


def _named_kind(value: Any) -> str:
    return "<named>" if isinstance(value, dict) and "segments" in value else "<stored>"


NamedOrStored = Annotated[
    Annotated[NamedMap, Tag("<named>")] | Annotated[StoredMap, Tag("<stored>")], Discriminator(_named_kind)
]


class MapPrefix(Strict):
    """All stored maps whose ids begin alike.

    Attributes
    ----------
    prefix
        beginning of the ids of the maps
    """

    prefix: Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,128}$", min_length=1, max_length=128)]


def _several_kind(value: Any) -> str:
    return "<prefix>" if isinstance(value, dict | MapPrefix) else "<list>"


SeveralMaps = Annotated[
    Annotated[Annotated[list[NamedOrStored], Field(min_length=FEWEST_MAPS, max_length=MOST_MAPS)], Tag("<list>")]
    | Annotated[MapPrefix, Tag("<prefix>")],
    Discriminator(_several_kind),
]


def _few_weights(value: Any) -> Any:
    """Refuse more weights than maps before any of them is looked at: each wrong one would become an error."""
    if isinstance(value, dict) and len(value) > MOST_MAPS:
        raise PydanticCustomError("weights", f"expected at most {MOST_MAPS} items, found {len(value)}")
    return value


MapWeights = Annotated[
    dict[MapId, Annotated[float, Field(ge=0.0, le=1.0)]],
    Field(min_length=1, max_length=MOST_MAPS),
    BeforeValidator(_few_weights),
]


class SoftPriorFields(Pose):
    """A Gaussian over the pose. It is part of the score, and never fused into pose or covariance.

    Attributes
    ----------
    covariance
        covariance of additive (x, y, theta); m^2, m rad, rad^2; positive definite
    map_id
        of several maps the one whose frame the pose is in
    """

    covariance: Covariance
    map_id: MapId | None = None


class HardPriorFields(Pose):
    """A window that must contain the answer.

    Attributes
    ----------
    radius
        metres around (x, y)
    angle
        radians around theta
    map_id
        of several maps the one whose frame the pose is in
    """

    radius: Annotated[float, Field(gt=0.0, le=1e6)]
    angle: Annotated[
        float,
        AfterValidator(in_radians(5e-324, 4.0, "above 0 and up to 4")),
        Field(json_schema_extra={"exclusiveMinimum": 0.0, "maximum": 4.0}),
    ]
    map_id: MapId | None = None


AnyPrior = Annotated[
    SoftPriorFields | HardPriorFields,
    OneOf("covariance, or radius with angle", ("covariance", "radius angle")),
]


class SearchOptions(Strict):
    """How to search, and what to put into the answer.

    Attributes
    ----------
    max_alternatives
        largest number of other poses to return
    confidence
        probability of not missing a better pose at which the search ends
    exhaustive
        try every base, independent of `confidence`
    seed
        seed of random sampling
    sampling
        order of the bases: informative and cheap ones first, or random by `seed`
    deadline_ms
        milliseconds; a longer one than `max_deadline_ms` of /v1/limits is shortened to it
    oriented
        whether free space lies on the left of segments; null: as the map states, else true
    offset_tolerance
        gate for offsets between scan lines and walls, metres; null: from the sigmas
    angle_tolerance
        gate for angles between scan lines and walls, radians; null: from the sigmas
    min_overlap
        fraction of a scan segment's length that must lie on the map
    on_map
        prior probability that the scan was taken on this map, or on one of these
    usable_from
        least `probability` of a usable answer
    estimator
        estimator of the final pose; `one_step` is the published closed form
    rotation
        estimate of the rotation for `one_step`
    include
        parts of the answer
    """

    max_alternatives: Annotated[int, Field(ge=0, le=50)] = 5
    confidence: Annotated[float, Field(ge=0.5, le=1.0)] = 0.9999
    exhaustive: bool = False
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    sampling: Literal["ordered", "random"] = "ordered"
    deadline_ms: DeadlineMs | None = None
    oriented: bool | None = None
    offset_tolerance: Annotated[float, Field(ge=1e-3, le=0.4)] | None = None
    angle_tolerance: Annotated[float, Field(ge=1e-3, le=0.35)] | None = None
    min_overlap: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    on_map: Annotated[float, Field(ge=0.5, le=1.0)] = 0.9
    usable_from: Annotated[float, Field(ge=0.5, le=0.9999)] = 0.95
    estimator: Literal["joint", "one_step"] = "joint"
    rotation: Literal["wahba", "mitsuta"] = "wahba"
    include: list[IncludeName] = Field(default_factory=lambda: list(EVERYTHING), max_length=16)
