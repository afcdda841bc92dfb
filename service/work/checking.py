"""Checks of maps: what is doubtful in one by itself, and beside sample scans."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from association import CancelledError, IndexingEndedError, Scan
from map_quality.check import (
    Advice,
    Finding,
    MapCheck,
    Sample,
    SampleReport,
    check_map,
    find_thickness,
    fit_better_mirrored,
    judge_samples,
    thickness_finding,
    try_sample,
)
from registration import InputError

from ..admission.errors import DeadlinePassedError
from ..maps import CachedMap
from ..maps.lookup import FoundMap, MapLookup, is_oriented
from ..schemas.errors import Fault, InvalidRequestError
from ..schemas.parts import InlineMap
from ..schemas.requests import CheckRequest
from .answers import Json, pose_json
from .inputs import scanned_of, transform_of
from .job import Done, Job

MOST_INDICES = 1000  # of one finding
HIDES_THICKNESS = {"reversed", "scale"}  # what such a map's walls seem to be is no thickness


@dataclass(frozen=True, slots=True)
class Checked:
    """A map that was checked by itself, ready for samples.

    Attributes
    ----------
    cached : CachedMap
        With its directions, whatever they mean.
    oriented : bool
        Whether the map says that they mean something.
    scans : sequence of Scan
        The samples.
    found : MapCheck
    reference : dict or None
        Id and revision of the map, as they are answered; None where it is not stored.
    """

    cached: CachedMap
    oriented: bool
    scans: Sequence[Scan]
    found: MapCheck
    reference: Json | None


def check(lookup: MapLookup, on: InlineMap | FoundMap, asked: CheckRequest | None, job: Job) -> Checked:
    """Index a map and check it; with samples read these, too.

    Raises
    ------
    StoreError
        When the map cannot be had.
    ParserEndedError
        When it is large and could not be read.
    InvalidRequestError
        When one of the samples is not what the libraries take.
    DeadlinePassedError
        When the deadline has passed before.
    CancelledError
        When the client has gone.
    """
    cached = lookup.indexed(on, oriented=True, deadline=job.deadline)
    scans = [_scan_of(asked, number) for number in range(len(asked.scans))] if asked is not None else []
    job.watch.lap("decode")
    if job.deadline.passed and not job.deadline.cancelled:
        raise DeadlinePassedError
    job.searching.set()
    if isinstance(on, FoundMap):
        own, reference = on.record.oriented, {"map_id": on.record.map_id, "revision": on.record.revision}
    else:
        own, reference = on.oriented, None
    oriented = is_oriented(None, own)
    # Of its own: an index without directions, which a check may add to it, goes with the check, for the cache does not
    # count it.
    cached = replace(cached, index=replace(cached.index))
    found = check_map(cached.index, job.deadline, oriented=oriented)
    return Checked(cached, oriented, scans, found, reference)


def sample(checked: Checked, asked: CheckRequest, number: int, job: Job) -> Sample | None:
    """Try one of the samples in a map; None when there is no time left. Raises `CancelledError`."""
    if job.deadline.passed and not job.deadline.cancelled:
        return None
    pose = None if asked.poses is None else asked.poses[number]
    said, index = None if pose is None else transform_of(pose), checked.cached.index
    try:
        return try_sample(index, checked.scans[number], job.deadline, oriented=checked.oriented, said=said)
    except IndexingEndedError:
        if job.deadline.cancelled:
            raise CancelledError from None
        return None


@dataclass(frozen=True, slots=True)
class Judged:
    """What all samples say of a map.

    Attributes
    ----------
    samples : sequence of Sample or None
        None where no time was left for one.
    report : SampleReport
    wall_thickness : float or None
        By how much walls are thicker than drawn, metres; None where nothing speaks for it.
    """

    samples: Sequence[Sample | None]
    report: SampleReport
    wall_thickness: float | None

    @property
    def findings(self) -> list[Finding]:
        """The weightiest first."""
        thick = [] if self.wall_thickness is None else [thickness_finding(self.wall_thickness, oriented=self.directed)]
        return [*thick, *self.report.findings]

    @property
    def directed(self) -> bool:
        """Whether directions of the map mean something, as far as the samples say."""
        return self.report.advice.oriented is not False


def conclude(checked: Checked, samples: Sequence[Sample | None], job: Job) -> Judged:
    """Conclude from all samples together, and find how thick walls are; raises `CancelledError`."""
    tried = [one for one in samples if one is not None]
    index = checked.cached.index
    report = judge_samples(tried, sigma=index.sigma, oriented=checked.oriented)
    judged = Judged(samples, report, None)
    codes = {one.code for one in report.findings}
    if codes & HIDES_THICKNESS or job.deadline.passed:
        return judged
    scans = [scan for scan, one in zip(checked.scans, samples, strict=True) if one is not None]
    wall_thickness = find_thickness(index, scans, job.deadline, oriented=judged.directed)
    if wall_thickness is None or "mirrored" not in codes:
        return replace(judged, wall_thickness=wall_thickness)
    # What fits badly may fit a little better mirrored.
    if not judged.directed or fit_better_mirrored(index, scans, job.deadline):
        return judged
    others = tuple(one for one in report.findings if one.code != "mirrored")
    return Judged(samples, replace(report, findings=others), wall_thickness)


def check_done(checked: Checked, judged: Judged | None, asked: CheckRequest | None, job: Job) -> Done:
    """Return the answer of a check; `judged` None where there were no samples."""
    job.watch.lap("search")
    found, findings, advice = checked.found, list(checked.found.findings), checked.found.advice
    complete, told = found.complete, None
    if judged is not None:
        report = judged.report
        findings = [*judged.findings, *findings]
        advice = _first(report.advice, advice)
        complete = complete and None not in judged.samples and not job.deadline.passed
        scans = [_sample_json(number, one) for number, one in enumerate(judged.samples)]
        told = {
            "usable": report.usable,
            "usable_as_advised": report.usable_as_advised,
            "wall_thickness": judged.wall_thickness,
            "scans": scans,
        }
    answer = {
        **check_json(replace(found, findings=tuple(findings), advice=advice, complete=complete)),
        "samples": told,
        "map": checked.reference,
        "client_ref": None if asked is None else asked.client_ref,
    }
    return job.done(answer, map=checked.reference, findings=[one.code for one in findings])


def check_json(found: MapCheck) -> Json:
    """Return what was found of a map by itself."""
    return {
        "findings": [_finding_json(one) for one in found.findings],
        "size": {name: getattr(found.size, name) for name in ("segment_count", "walls", "length", "diagonal")},
        "advice": {"sigma": found.advice.sigma, "oriented": found.advice.oriented},
        "places": [{"pose": pose_json(one.pose), "similar_pose": pose_json(one.similar_pose)} for one in found.places],
        "viewpoints": found.viewpoints,
        "complete": found.complete,
    }


def _first(seen: Advice, drawn: Advice) -> Advice:
    """Return what scans say of a map, and where they say nothing, what its drawing says."""
    sigma = drawn.sigma if seen.sigma is None else seen.sigma
    return Advice(sigma, drawn.oriented if seen.oriented is None else seen.oriented)


def _finding_json(finding: Finding) -> Json:
    return {
        "code": finding.code,
        "message": finding.message,
        "segments": list(finding.segments[:MOST_INDICES]),
        "count": len(finding.segments),
    }


def _sample_json(number: int, one: Sample | None) -> Json:
    if one is None:
        return {"index": number, "status": None, "usable": False, "pose": None}
    result = one.result
    return {
        "index": number,
        "status": str(result.status),
        "usable": result.usable,
        "pose": pose_json(result.pose),
    }


def _scan_of(asked: CheckRequest, number: int) -> Scan:
    with _placed(number):
        # A motion that is not known would only loosen the fit.
        return scanned_of(asked.scans[number], timed=False).scan


@contextmanager
def _placed(number: int) -> Iterator[None]:
    """Say which of the samples it is in which the libraries refuse something."""
    try:
        yield
    except InvalidRequestError as error:
        faults = [Fault(_moved(fault.pointer, number), fault.message) for fault in error.faults]
        raise InvalidRequestError(faults) from error
    except InputError as error:
        place = "/" + error.argument.replace(".", "/") + ("" if error.index is None else f"/{error.index}")
        raise InvalidRequestError([Fault(_moved(place, number), error.message)]) from error


def _moved(pointer: str, number: int) -> str:
    return f"/scans/{number}" + pointer.removeprefix("/scan")
