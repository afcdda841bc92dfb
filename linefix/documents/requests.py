"""The bodies that the routes take."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, SkipValidation, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from .arrays import PairRows, PointRows, Weights
from .errors import Fault, InvalidRequestError
from .limits import require_within
from .parts import AnyMap, AnyPrior, InlineMap, MapWeights, SearchOptions, SeveralMaps
from .sensors import AnyScan, Laser, MeasuredFields, RaySigma, Twist, require_at_the_sensor, require_times
from .strict import DeadlineMs, Point, Pose, Referenced, Sigma, Strict


class KnownMap(InlineMap):
    """The map side of known correspondences.

    Attributes
    ----------
    sigma
        standard deviation of the map's lines, normal to the lines, metres; null: estimated
    """

    sigma: Sigma | None = 0.0


class EstimatorOptions(Strict):
    """How to register.

    Attributes
    ----------
    estimator
        `joint` minimizes over rotation and translation; `one_step` is the published closed form
    rotation
        estimate of the rotation for `one_step`
    k_translation
        coefficient of the translation in the ambiguity
    k_rotation
        coefficient of the rotation in the ambiguity
    evaluate_at
        also give the ambiguity at this pose
    oriented
        whether free space lies on the left of segments; null: as the map states, else true
    """

    estimator: Literal["joint", "one_step"] = "joint"
    rotation: Literal["wahba", "mitsuta"] = "wahba"
    k_translation: Annotated[float, Field(ge=0.0, le=1e9)] = 1.0
    k_rotation: Annotated[float, Field(ge=0.0, le=1e9)] = 1.0
    evaluate_at: Pose | None = None
    oriented: bool | None = None


class RegisterRequest(Strict):
    """Known correspondences.

    Attributes
    ----------
    correspondences
        `[scan, map]` indices; default i with i
    weights
        one per correspondence; replaces `weighting`
    weighting
        weights of the correspondences: all equal, the shorter length, or the information
    """

    map: KnownMap
    scan: MeasuredFields
    correspondences: PairRows | None = None
    weights: Weights | None = None
    weighting: Literal["uniform", "shorter_length", "information"] = "information"
    options: EstimatorOptions = EstimatorOptions()


class OnMaps(Strict):
    """A request that names the map to search, or several maps.

    Attributes
    ----------
    map
        the map to search, or the id of a stored one; or `maps`
    maps
        2 to 256 maps, or a prefix of the ids of stored ones, to search together
    map_weights
        probability of maps by id; the other maps share the rest equally. It is part of the score, and never fused
    """

    map: AnyMap | None = None
    maps: SeveralMaps | None = None
    map_weights: MapWeights | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.map is None) == (self.maps is None):
            found = "neither" if self.map is None else "both"
            raise InvalidRequestError([Fault("", f"expected exactly one of map and maps, found {found}")])
        ids = [one.map_id for one in self.maps] if isinstance(self.maps, list) else []
        for number, map_id in enumerate(ids):
            if map_id in ids[:number]:
                message = "found an id that another map has, expected a different one for each map"
                raise InvalidRequestError([Fault(f"/maps/{number}/map_id", message)])
        return self


class AssociateRequest(OnMaps, Referenced):
    """Unknown correspondences.

    Attributes
    ----------
    scan
        the scan: segments, ranges, points or views
    prior
        prior knowledge of the pose; null: none
    """

    scan: AnyScan
    prior: AnyPrior | None = None
    options: SearchOptions = SearchOptions()


class BatchRequest(OnMaps, Referenced):
    """Several scans, one map or several. Each scan and prior is checked alone, so that a bad one spoils no other.

    Attributes
    ----------
    scans
        scans, each as `scan` of /v1/associate
    priors
        one prior per scan, as `prior` of /v1/associate, or null
    """

    # Each is validated separately, as `BatchItem`.
    scans: list[Annotated[AnyScan, SkipValidation]] = Field(min_length=1)
    priors: list[Annotated[AnyPrior | None, SkipValidation]] | None = None
    options: SearchOptions = SearchOptions()

    @model_validator(mode="after")
    def _within_limits(self, info: ValidationInfo) -> BatchRequest:
        require_within(info, "batch", len(self.scans), "scans", "/scans")
        if self.priors is not None and len(self.priors) != len(self.scans):
            raise PydanticCustomError(
                "priors", f"expected one prior or null for each of {len(self.scans)} scans, found {len(self.priors)}"
            )
        return self


class BatchItem(Strict):
    """One scan of a batch and its prior."""

    scan: AnyScan
    prior: AnyPrior | None = None


MOST_SAMPLES = 64


class CheckRequest(Referenced):
    """Sample scans to check a map by, and where they were taken, as far as that is known.

    Attributes
    ----------
    scans
        each as `scan` of /v1/associate
    poses
        one per scan, or null: the known or assumed pose of the scan's frame in the map frame
    deadline_ms
        milliseconds; parts that it leaves no time for are omitted
    """

    scans: Annotated[list[AnyScan], Field(min_length=1, max_length=MOST_SAMPLES)]
    poses: Annotated[list[Pose | None], Field(max_length=MOST_SAMPLES)] | None = None
    deadline_ms: DeadlineMs | None = None

    @model_validator(mode="after")
    def _as_many(self) -> CheckRequest:
        if self.poses is not None and len(self.poses) != len(self.scans):
            raise PydanticCustomError(
                "poses", f"expected one pose or null for each of {len(self.scans)} scans, found {len(self.poses)}"
            )
        return self


NO_SAMPLES = CheckRequest.model_construct(scans=[])
"""A check of a map alone, which needs no body."""


class VectorizeOptions(Strict):
    """How to cut points into segments.

    Attributes
    ----------
    sigma
        standard deviation of single ranges, metres; null: estimated
    min_points
        least number of points on a segment
    min_length
        least length of a segment, metres
    max_gap
        metres between neighbours on one segment; null: by the angle between the beams
    """

    sigma: RaySigma | None = None
    min_points: Annotated[int, Field(ge=3, le=1000)] = 4
    min_length: Annotated[float, Field(ge=1e-3, le=1e3)] = 0.1
    max_gap: Annotated[float, Field(gt=0.0, le=1e4)] | None = None


class VectorizeRequest(Strict):
    """Ranges or points; exactly one of the two.

    Attributes
    ----------
    laser
        ranges, as in a LaserScan message
    points
        `[x, y]` each, metres, in scanning order
    twist
        velocity of the sensor during the scan, in its own frame; 0: at rest; segments are in the frame of the first
        beam
    viewpoint
        position of the sensor, metres, on the left of every segment; null: several positions, for example of a contour,
        and segments run in the order of their points
    """

    laser: Laser | None = None
    points: PointRows | None = None
    twist: Twist | None = None
    viewpoint: Point | None = Field(default_factory=lambda: [0.0, 0.0])
    options: VectorizeOptions = VectorizeOptions()

    @model_validator(mode="after")
    def _exactly_one(self) -> VectorizeRequest:
        if (self.laser is None) == (self.points is None):
            raise PydanticCustomError("one_of", "expected exactly one of laser and points, found both or neither")
        if self.laser is not None:
            require_times(self.laser, self.twist)
        elif self.twist is not None:
            raise PydanticCustomError(
                "twist", "a twist requires a laser, because points have no times; send a laser, or omit the twist"
            )
        return self

    @field_validator("viewpoint")
    @classmethod
    def _from_the_sensor(cls, value: list[float] | None, info: ValidationInfo) -> list[float] | None:
        if info.data.get("laser") is not None:
            require_at_the_sensor(value)
        return value
