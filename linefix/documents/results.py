"""Results of the library to answers: the fields are those of their models, each declared there alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticUndefined

from association import NOT_IN_ORDER, AssociationDiagnostics, AssociationResult, AssociationWarning, Status
from map_quality import Analysis, MapCheck, MapUpdate, PlaceVerdict
from registration import RegistrationResult
from vectorization import Vectorization

from ..checking import CheckedMap
from . import analysis, checks, found, replies, updates
from .parts import MapDocument
from .replies import WarningAnswer
from .strict import SEAL, Answer

if TYPE_CHECKING:
    from formats import ImportedMap, LineMap

    from ..driving import Explanation

Json = dict[str, Any]
Indices = NDArray[np.intp]
Listed = Callable[[Iterable[Json]], Any]
MOST_INDICES = 1000  # of one finding


def _model_in(annotation: Any) -> type[Answer] | None:
    if isinstance(annotation, type) and issubclass(annotation, Answer):
        return annotation
    return next((model for model in map(_model_in, get_args(annotation)) if model is not None), None)


@cache
def _plan(model: type[Answer]) -> tuple[tuple[str, str, type[Answer] | None, Any], ...]:
    """Return of each field its name in the answer, its attribute in a result, its model, and its default."""
    plan = (
        (one.alias or name, name, _model_in(one.annotation), one.get_default(call_default_factory=True))
        for name, one in model.model_fields.items()
    )
    return tuple(one for one in plan if one[0] not in SEAL)


def answer_of(model: type[Answer], result: object, /, **given: Any) -> Json:
    """Return a result as an answer.

    Each field of the model is the attribute of its name, unless it is given. One with a default may be missing.
    """
    answer: Json = {}
    for name, attribute, inner, default in _plan(model):
        if name in given:
            answer[name] = given[name]
        elif default is PydanticUndefined:
            answer[name] = _json(getattr(result, attribute), inner)
        elif (value := getattr(result, attribute, default)) not in (default, ()):
            answer[name] = _json(value, inner)
    return answer


def answers_of(model: type[Answer], results: Iterable[object]) -> list[Json]:
    """Return results as answers of one model."""
    return [answer_of(model, one) for one in results]


def _json(value: Any, model: type[Answer] | None = None) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if model is None or value is None:
        return value
    return answers_of(model, value) if isinstance(value, tuple | list) else answer_of(model, value)


def registration_json(result: RegistrationResult, pairs: Indices, listed: Listed = list) -> Json:
    """Return the answer of a registration.

    `pairs` are the indices of scan and map segment of each correspondence, (k, 2). `listed` makes a list of the
    residuals, which are many; or what is written as a list.
    """
    columns = (result.offsets.tolist(), result.angles.tolist(), result.weights.tolist())
    residuals = listed(
        {"scan": scan, "map": on, "offset": offset, "angle": angle, "weight": weight}
        for (scan, on), offset, angle, weight in zip(pairs.tolist(), *columns, strict=True)
    )
    status = "degenerate" if result.degenerate else "ok"
    return answer_of(replies.RegisterAnswer, result, status=status, residuals=residuals)


@dataclass(frozen=True, slots=True)
class Included:
    """Parts of an answer that are requested, and the segments that were found in the scan.

    Attributes
    ----------
    include : frozenset of str
        Names of the requested parts.
    segments : list or None
        Of the scan, where the caller sent ranges or points: rows of four numbers, metres; of several views one list or
        None each.
    starts : (v,) or None
        Index of the first segment of each view; segments are then named by view and index. None: a single view.
    """

    include: frozenset[str]
    segments: list[Any] | None = None
    starts: Indices | None = None

    def named(self, scan: int) -> Json:
        """Return the fields that name a segment of the scan."""
        if self.starts is None:
            return {"scan": scan}
        view = int(np.searchsorted(self.starts, scan, side="right")) - 1
        return {"view": view, "scan": scan - int(self.starts[view])}

    def listed(self, scans: Sequence[int]) -> list[Any]:
        """Return the names of segments of the scan, by index alone where it is of a single view."""
        return list(scans) if self.starts is None else [self.named(scan) for scan in scans]


def association_json(
    result: AssociationResult, included: Included, references: Mapping[str, Json] = MappingProxyType({})
) -> Json:
    """Return the answer of a search with the parts that are included.

    `references` are id and revision of each of several maps, by name.
    """
    given: Json = {"unmatched_scan": included.listed(result.unmatched_scan)}
    given["diagnostics"] = _diagnostics_json(result.diagnostics, included)
    given["correspondences"] = [
        answer_of(found.CorrespondenceAnswer, pair, **included.named(pair.scan)) for pair in result.correspondences
    ]
    given["segments"] = included.segments
    given["alternatives"] = answers_of(found.AlternativeAnswer, result.alternatives)
    given["missing_map"] = result.missing_map
    if result.maps:
        given["maps"] = [
            answer_of(found.MapVerdictAnswer, one, revision=references[one.map_id]["revision"]) for one in result.maps
        ]
        given["map"] = None if result.map_id is None else references[result.map_id]
    answer = answer_of(found.FoundAnswer, result, **given)
    for name in {"correspondences", "alternatives", "missing_map", "segments"} - included.include:
        del answer[name]
    return answer


def _diagnostics_json(diagnostics: AssociationDiagnostics | None, included: Included) -> Json | None:
    if diagnostics is None:
        return None
    wall = diagnostics.critical_wall
    critical = None if wall is None else answer_of(found.CriticalWallAnswer, wall, scan=included.listed(wall.scan))
    return answer_of(found.AssociationDiagnosticsAnswer, diagnostics, critical_wall=critical)


def explanation_json(found: Explanation) -> Json:
    """Return how a verdict came about, without the answer itself: the JSON of ``linefix explain``."""
    parts = {"verdict": found.verdict, "last_view": found.last_view}
    return {name: None if one is None else {**asdict(one), "status": str(one.status)} for name, one in parts.items()}


def vectorization_json(found: Vectorization, moving: AssociationWarning | None = None) -> Json:
    """Return the answer of a vectorization; `moving` is the warning about a sensor whose motion is not known."""
    measured = found.measured
    unordered = None if found.ordered else AssociationWarning("points_not_in_order", NOT_IN_ORDER)
    return answer_of(
        replies.VectorizeAnswer,
        measured,
        segments=measured.segments.endpoints.tolist(),
        point_counts=measured.point_counts.astype(int).tolist(),
        sigma=found.sigma,
        sigmas=measured.sigma.tolist(),
        rms=found.rms.tolist(),
        warnings=answers_of(WarningAnswer, [one for one in (unordered, moving) if one is not None]),
    )


def map_json(line_map: LineMap) -> Json:
    """Return a map as a map document; one without points does not mention them."""
    return {name: _json(value) for name, value in line_map.document.items()}


def import_json(imported: ImportedMap, found: MapCheck) -> Json:
    """Return the answer of an import: the map, the report of its files, and its doubtful parts."""
    return {"map": map_json(imported.map), "report": asdict(imported.report), "check": check_json(found)}


def check_json(found: MapCheck) -> Json:
    """Return the check of a map without scans."""
    findings = [
        answer_of(checks.FindingAnswer, one, segments=one.segments[:MOST_INDICES], count=len(one.segments))
        for one in found.findings
    ]
    return answer_of(checks.MapCheckAnswer, found, findings=findings)


def checked_json(checked: CheckedMap) -> Json:
    """Return the answer of a check; its ``samples`` are null without sample scans."""
    samples, report = None, checked.report
    if report is not None:
        nothing: Json = {"status": None, "usable": False, "pose": None}
        scans = [
            {"index": number, **nothing} if one is None else answer_of(checks.SampleAnswer, one.result, index=number)
            for number, one in enumerate(checked.samples)
        ]
        samples = answer_of(checks.SamplesAnswer, report, scans=scans)
    return {**check_json(checked.all), "samples": samples}


def analysis_json(found: Analysis, looks: Mapping[int, PlaceVerdict | None]) -> Json:
    """Return the answer of an analysis; `looks` by the poses' numbers, None where no robot can stand."""
    verdicts = [one for _, one in sorted(looks.items()) if one is not None]
    by_status, tried = Counter(one.status for one in verdicts), len(found.standing.order)
    return {
        "places": answers_of(analysis.AnalyzedPlaceAnswer, verdicts),
        "summary": {
            "places": len(verdicts),
            "usable": sum(one.usable for one in verdicts),
            **{str(one): by_status[one] for one in (Status.OK, Status.AMBIGUOUS, Status.DEGENERATE, Status.NO_MATCH)},
            "similar_pose": sum(one.similar_pose is not None for one in verdicts),
            "resolved_within": sum(one.resolved_after is not None for one in verdicts) if found.drive else None,
            "usable_with_landmark": None
            if found.landmark is None
            else sum(one.with_landmark is not None and one.with_landmark.usable for one in verdicts),
            "not_free": len(looks) - len(verdicts),
            "left_out": tried - len(looks),
        },
        "spacing": found.standing.spacing,
        "complete": len(looks) == tried,
    }


def kept_fields(old: MapDocument) -> Json:
    """Return the fields of a map that no update changes."""
    points: Json = {"points": old.points.tolist(), "points_sigma": old.points_sigma}
    kept = {"oriented": old.oriented, "frame_id": old.frame_id, "meta": old.meta}
    return {**kept, **(points if len(old.points) else {})}


def update_json(update: MapUpdate, old: MapDocument) -> Json:
    """Return the answer of an update of a map."""
    usable, held = update.usable, update.held_back
    changes = []
    for one, accepted in zip(update.changes, update.accepted, strict=True):
        new = zip(one.new.tolist(), one.sigma.tolist(), strict=True)
        evidence = {"from": one.evidence.first, "to": one.evidence.last}
        changes.append(
            answer_of(
                updates.ChangeAnswer,
                one,
                new=[{"segment": ends, "sigma": sigma} for ends, sigma in new],
                evidence=answer_of(updates.EvidenceAnswer, one.evidence, **evidence),
                accepted=accepted,
            )
        )
    return {
        "map": {"segments": update.segments.endpoints.tolist(), "sigma": update.sigma, **kept_fields(old)},
        "changes": changes,
        "scans": usable.scans + held.scans,
        "usable_before": usable.before + held.before,
        "usable_after": usable.after + held.after,
        "held_back": {"scans": held.scans, "usable_before": held.before, "usable_after": held.after},
        "sharpened": answer_of(updates.SharpenedAnswer, update.sharpened),
        "refused_visits": answers_of(updates.RefusedVisitAnswer, update.refused_visits),
        "kept": answers_of(updates.KeptWallsAnswer, update.kept),
        "complete": update.complete,
    }
