"""Checking a map: without scans, and with sample scans."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

from association import CancelledError, Deadline, IndexingEndedError, MapIndex, Scan
from map_quality import Advice, MapCheck, Sample, SampleReport, check_map, conclude, finished, try_sample
from registration import RigidTransform


@dataclass(frozen=True, slots=True)
class CheckedMap:
    """The doubtful parts of a map, found without scans and with sample scans.

    Attributes
    ----------
    found : MapCheck
        Of the map without scans.
    samples : tuple of Sample or None
        Of each scan; None where there was no time for it.
    report : SampleReport or None
        The conclusion from all samples; None without samples.
    complete : bool
        False when the deadline ended a part of it.
    """

    found: MapCheck
    samples: tuple[Sample | None, ...] = ()
    report: SampleReport | None = None
    complete: bool = True

    @property
    def all(self) -> MapCheck:
        """Return one check with the findings of both; scans have precedence over the drawing."""
        if self.report is None:
            return replace(self.found, complete=self.complete)
        seen, drawn = self.report.advice, self.found.advice
        advice = Advice(
            drawn.sigma if seen.sigma is None else seen.sigma,
            drawn.oriented if seen.oriented is None else seen.oriented,
        )
        findings = (*self.report.findings, *self.found.findings)
        return replace(self.found, findings=findings, advice=advice, complete=self.complete)


def check(
    index: MapIndex,
    scans: Sequence[Scan] = (),
    poses: Sequence[RigidTransform | None] | None = None,
    deadline: Deadline | None = None,
    *,
    oriented: bool = True,
) -> CheckedMap:
    """Check a map, and, with sample scans, whether these fit better mirrored, scaled, moved or undirected.

    Parameters
    ----------
    index : MapIndex
        Built with its directions, whatever they mean.
    scans : sequence of Scan
        Taken in the map.
    poses : sequence of RigidTransform or None, optional
        Pose of each scan as the sender states it, map_from_scan.
    deadline : Deadline, optional
    oriented : bool
        True when the map states that directions mean something.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.

    Examples
    --------
    >>> import linefix
    >>> index = linefix.index_map([[0, 0, 6, 0], [6, 0, 6, 4], [6, 4, 0, 4], [0, 4, 0, 0]])
    >>> [finding.code for finding in linefix.check(index).all.findings]
    ['looks_alike']
    """
    return finished(checking(index, scans, poses, deadline or Deadline(), oriented=oriented))


def checking(
    index: MapIndex,
    scans: Sequence[Scan],
    poses: Sequence[RigidTransform | None] | None,
    deadline: Deadline,
    *,
    oriented: bool,
) -> Generator[None, None, CheckedMap]:
    """Do what `check` does, one part at a step, and return the same."""
    found, samples = check_map(index, deadline, oriented=oriented), list[Sample | None]()
    for scan, said in zip(scans, poses or [None] * len(scans), strict=True):
        yield
        samples.append(_try_in_time(index, scan, deadline, oriented=oriented, said=said))
    if not samples:
        return CheckedMap(found, complete=found.complete)
    yield
    report = conclude(index, scans, samples, deadline, oriented=oriented)
    complete = found.complete and None not in samples and not deadline.passed
    return CheckedMap(found, tuple(samples), report, complete)


def _try_in_time(
    index: MapIndex, scan: Scan, deadline: Deadline, *, oriented: bool, said: RigidTransform | None
) -> Sample | None:
    """Try a sample scan, see `map_quality.try_sample`; return None when no time is left for it.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if deadline.passed and not deadline.cancelled:
        return None
    try:
        return try_sample(index, scan, deadline, oriented=oriented, said=said)
    except IndexingEndedError:
        if deadline.cancelled:
            raise CancelledError from None
        return None
