"""Request models to the inputs of the libraries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from association import AssociationOptions, Deadline, HardPrior, MapIndex, MapPart, MapPoints, Prior, Scan, SoftPrior
from map_quality import NOT_SHARPENED, Analysis, Replacement, Robot, Sharpened, VisitScan
from registration import InputError, InvalidArgumentError, RegistrationOptions, Segments

from .analysis import AnalyzeRequest
from .errors import Fault, InvalidRequestError, RequestError, fault_of
from .parts import HardPriorFields, MapDocument, SearchOptions, SoftPriorFields, is_oriented
from .requests import CheckRequest, RegisterRequest
from .scans import scanned_of, transform_of
from .updates import ApplyRequest, SharpenedWalls, UpdateRequest

# Options of a search that have the same names and values in a request.
_AS_SENT = [one.name for one in fields(AssociationOptions) if one.name not in ("oriented", "include")]


def prior_of(prior: SoftPriorFields | HardPriorFields | None) -> Prior | None:
    """Return the prior of the pose; None without one."""
    if prior is None:
        return None
    if isinstance(prior, SoftPriorFields):
        return SoftPrior(transform_of(prior), prior.covariance)
    return HardPrior(transform_of(prior), prior.radius, prior.angle)


def association_options_of(options: SearchOptions, *, oriented: bool) -> AssociationOptions:
    """Return how to search a map whose directions count, or do not."""
    include = tuple(part for part in options.include if part != "segments")  # those of a scan are not searched for
    return AssociationOptions(oriented=oriented, include=include, **{name: getattr(options, name) for name in _AS_SENT})


def registration_options_of(asked: RegisterRequest) -> RegistrationOptions:
    """Return how to register."""
    options = asked.options
    return RegistrationOptions(
        evaluate_at=None if options.evaluate_at is None else transform_of(options.evaluate_at),
        oriented=is_oriented(options.oriented, asked.map.oriented),
        weighting=asked.weighting,
        weights=asked.weights,
        **{name: getattr(options, name) for name in ("estimator", "rotation", "k_translation", "k_rotation")},
    )


def pairs_of(asked: RegisterRequest, map_count: int, scan_count: int) -> NDArray[np.intp]:
    """Return the correspondences; i with i where none are given.

    Raises
    ------
    InvalidArgumentError
        When none are given and the sets differ in length.
    """
    if asked.correspondences is not None:
        return asked.correspondences.astype(np.intp)
    if map_count != scan_count:
        raise InvalidArgumentError(
            f"found none, with {scan_count} scan and {map_count} map segments; expected pairs, or equal counts",
            argument="correspondences",
        )
    return np.repeat(np.arange(map_count, dtype=np.intp)[:, None], 2, axis=1)


def scans_of(asked: CheckRequest) -> Iterator[Scan]:
    """Yield the sample scans of a request.

    Raises
    ------
    InvalidRequestError
        When the libraries reject one.
    """
    for number, one in enumerate(asked.scans):
        with naming_scan(f"/scans/{number}"):
            # A motion that is not known would only loosen the fit.
            yield scanned_of(one, timed=False).scan


def visit_scans(asked: UpdateRequest) -> Iterator[VisitScan]:
    """Yield the scans of all visits; an error names the place of a scan in the request."""
    for number, visit in enumerate(asked.visits):
        for place, one in enumerate(visit.scans):
            with naming_scan(f"/visits/{number}/scans/{place}"):
                pose = None if one.pose is None else transform_of(one.pose)
                odometry = None if one.odometry is None else transform_of(one.odometry)
                yield VisitScan(scanned_of(one).scan, visit.visit, pose, one.covariance, odometry)


def analysis_of(index: MapIndex, asked: AnalyzeRequest) -> Analysis:
    """Return the analysis of a map that a request is for.

    Raises
    ------
    AnalysisError
        When the requested places cannot be had.
    InputError
        When a segment of the landmark is too short or too long.
    """
    laser = asked.laser
    robot = Robot(laser.fov, laser.beams, laser.range_max, laser.sigma)
    landmark = Segments.from_array(asked.landmark, argument="landmark")
    return Analysis.over(
        index, robot, asked.spacing, asked.point, seed=asked.seed, drive=asked.drive, landmark=landmark
    )


def part_of(document: MapDocument, *, oriented: bool | None = None, path: str = "map.") -> MapPart:
    """Return a map as the search takes it; `path` goes before the fields that errors name.

    `oriented` None: as the map states.
    """
    segments = Segments.from_array(document.segments, argument=f"{path}segments")
    points = MapPoints.of(document.points, document.points_sigma, path=path)
    return MapPart(segments, document.sigma, is_oriented(oriented, document.oriented), points, document.frame_id)


def require_map(document: MapDocument, path: str = "") -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower left and the upper right corner of the walls of a map.

    Raises
    ------
    InvalidSegmentsError, InvalidMapError
        When it could not be searched.
    """
    part = part_of(document, path=path)
    return MapIndex.require(part.segments, part.sigma, path)


def parts_of(documents: Iterable[tuple[str | None, MapDocument]], oriented: bool | None) -> dict[str, MapPart]:
    """Return maps by name as the search takes them.

    A single map has the name None, for which that of its part is empty. `oriented` None: as each map states.
    """
    return {
        name or "": part_of(document, oriented=oriented, path="map." if name is None else f"maps.{number}.")
        for number, (name, document) in enumerate(documents)
    }


def reference_of(name: str | None, revision: int | None = None) -> dict[str, object] | None:
    """Return the id and the revision of a map as they are answered; None for a single map of the request."""
    return None if name is None else {"map_id": name, "revision": revision}


def index_of(document: MapDocument, *, oriented: bool | None = None, deadline: Deadline | None = None) -> MapIndex:
    """Return the index of a map, `oriented` as of `part_of`; raises `IndexingEndedError` when the deadline passes."""
    return part_of(document, oriented=oriented).indexed(deadline)


def replacements_of(asked: ApplyRequest) -> dict[int, Replacement]:
    """Return the accepted changes of a map, by their indices in the request."""
    found = {}
    for number, one in enumerate(asked.changes):
        if one.accepted:
            new = Segments.from_array([each.segment for each in one.new], argument=f"changes.{number}.new")
            sigma = np.array([each.sigma for each in one.new])
            found[number] = Replacement(one.code, tuple(one.segments), new.endpoints, sigma)
    return found


def sharpened_of(asked: SharpenedWalls | None) -> Sharpened:
    """Return the walls at better positions; none where there are none."""
    if asked is None:
        return NOT_SHARPENED
    ends = Segments.from_array(asked.ends, argument="sharpened.ends").endpoints
    return Sharpened(np.array(asked.segments, dtype=np.intp), ends, np.array(asked.sigma))


@contextmanager
def naming_scan(place: str) -> Iterator[None]:
    """Name the place of a scan in the request, where the libraries refuse the scan.

    Raises
    ------
    InvalidRequestError
        With pointers below `place`, in place of `/scan`.
    """
    try:
        yield
    except (InvalidRequestError, InputError) as error:
        moved = [Fault(place + one.pointer.removeprefix("/scan"), one.message) for one in faults_in(error)]
        raise InvalidRequestError(moved) from error


def faults_in(error: RequestError | InputError) -> tuple[Fault, ...]:
    """Return the wrong places of a request that an error names."""
    if isinstance(error, InvalidRequestError):
        return error.faults
    return (fault_of(error) if isinstance(error, InputError) else Fault(getattr(error, "pointer", ""), str(error)),)
