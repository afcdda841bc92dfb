"""Several scans that agree through odometry: only their pose is published. No DDS in here.

The state is a list of hypotheses, each a pose of the robot in a map that odometry carries along:

1. A usable scan that agrees with the prediction of a hypothesis supports it; with none, it starts a new one.
2. A usable scan that disagrees counts against a hypothesis; so does one that is not usable, where the prediction is
   neither its pose nor one of its alternatives although all poses that explain it as well are listed.
3. A hypothesis is agreed when the scans that support it, less those against it, are as many as needed, and the robot
   has moved far enough between them, or has rested long enough while nothing spoke against it. If another pose was
   likely, twice as many scans over twice the way are needed, and rest is no evidence. If scans contradict odometry,
   only way is evidence: at rest and in a turn, a mount or a scale that is wrong is not seen.
4. The agreed hypothesis stays until another one is agreed; what speaks against it meanwhile is reported at once. It is
   also supported over a short time in which odometry is not known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from association import Alternative
from registration import IDENTITY, RigidTransform
from registration.layout import Floats

from . import tuning
from .clock import Confirmation


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """The result of one scan, and odometry at its time.

    Attributes
    ----------
    stamp : int
        Nanoseconds.
    pose : RigidTransform
        map_from_base; of a scan without one any, neither usable nor conclusive.
    covariance : (3, 3)
        Of `pose`, additive (x, y, theta) in the map frame; m^2, m rad, rad^2; 0 where it is not known.
    usable : bool
    odometry : RigidTransform or None
        odom_from_base at `stamp`; None: no odometry, the robot is taken to rest.
    part : tuple of int
        Of odometry; that of different parts is not comparable.
    unknown_s : float
        Seconds up to `stamp` in which odometry is not known; the uncertainty of a step grows with them.
    others : sequence of Alternative
        Other poses that explain the scan; of each, `pose` and `map_id` count.
    conclusive : bool
        True when every pose that explains the scan about as well is `pose` or one of `others`.
    rival : bool
        True when one of `others` is likely.
    map_id : str or None
        Of several maps the one that `pose` is on.
    """

    stamp: int
    pose: RigidTransform = IDENTITY
    covariance: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    usable: bool = False
    odometry: RigidTransform | None = None
    part: tuple[int, ...] = ()
    unknown_s: float = 0.0
    others: Sequence[Alternative | Observation] = ()
    conclusive: bool = False
    rival: bool = False
    map_id: str | None = None


class Event(StrEnum):
    """The change that an observation makes."""

    NOTHING = "nothing"
    AGREED = "agreed"  # another hypothesis is agreed now
    CONFIRMED = "confirmed"  # the agreed hypothesis is supported again
    CONTRADICTED = "contradicted"  # the observation speaks against the agreed hypothesis


@dataclass(slots=True, eq=False)
class _Hypothesis:
    """A pose that odometry carries along; `latest` is the last scan that supports it."""

    first: Observation
    latest: Observation
    counted: Observation
    supporting: int = 1
    against: int = 0
    moved: float = 0.0
    turned: float = 0.0
    rival: bool = False

    def support(self, scan: Observation) -> None:
        """Take a usable scan that agrees; scans of nearly the same place and time count once."""
        self.rival = self.rival or scan.rival
        whole = step_between(self.first, scan) or IDENTITY
        self.moved = max(self.moved, math.hypot(whole.x, whole.y))
        self.turned = max(self.turned, abs(whole.theta))
        since = step_between(self.counted, scan) or IDENTITY
        if (
            math.hypot(since.x, since.y) >= tuning.SEPARATE_DISTANCE
            or abs(since.theta) >= tuning.SEPARATE_ANGLE
            or scan.stamp - self.counted.stamp >= tuning.SEPARATE_NS
        ):
            self.supporting += 1
            self.counted = scan
        self.latest = scan

    def agreed(self, needed: int, *, contradicted: bool) -> bool:
        if needed == 1:
            return self.supporting > self.against
        times = 2 if self.rival else 1
        rested = times == 1 and self.against == 0 and self.latest.stamp - self.first.stamp >= tuning.RESTED_NS
        turned = self.turned >= times * tuning.TURNED
        enough = self.moved >= times * tuning.MOVED or ((turned or rested) and not contradicted)
        return self.supporting - self.against >= times * needed and enough

    def verdict(self, scan: Observation, *, agreed: bool) -> bool | None:
        """Return whether a scan agrees; None where that is undecided.

        Before the agreement all of the way since the first scan counts, so that a robot whose odometry is missing or
        frozen does not seem to rest. Afterwards it is the way since a scan that was taken elsewhere or a second ago.
        """
        begin = self.counted if agreed else self.first
        step = step_between(begin, scan)
        if step is not None and (scan.odometry is not None or not agreed):
            return _verdict(begin, scan, step, abs(scan.unknown_s - begin.unknown_s))
        seconds = (scan.stamp - self.latest.stamp) / 1e9
        if not agreed or seconds > tuning.UNKNOWN_SECONDS:
            return None
        return _verdict(self.latest, scan, IDENTITY, seconds)


@dataclass(slots=True)
class Agreement:
    """Follows the hypotheses from scan to scan.

    Attributes
    ----------
    needed : int
        Scans that have to agree; 1: each usable scan is agreed alone.
    """

    needed: int = 3
    _hypotheses: list[_Hypothesis] = field(default_factory=list)
    _agreed: _Hypothesis | None = None
    _newest: int | None = None
    _confirmation: Confirmation[Observation] = field(default_factory=Confirmation)
    _unexplained: int = 0  # scans since the last agreement that contradict odometry

    @property
    def latest(self) -> Observation | None:
        """The last scan that supports the agreed hypothesis; None where nothing is agreed."""
        return None if self._agreed is None else self._agreed.latest

    @property
    def contradicted(self) -> bool:
        """Return whether a scan contradicted the agreed hypothesis since it was last supported."""
        return self._agreed is not None and self._agreed.against > 0

    @property
    def refuted(self) -> bool:
        """Return whether so many scans contradict the agreed hypothesis that it is not to be used any more."""
        return self._agreed is not None and self._agreed.against >= tuning.LOST_SCANS

    @property
    def progress(self) -> tuple[int, float, float]:
        """Scans for the best hypothesis less those against it, metres and radians that the robot has moved."""
        best = max(self._hypotheses, key=lambda one: one.supporting - one.against, default=None)
        return (0, 0.0, 0.0) if best is None else (max(0, best.supporting - best.against), best.moved, best.turned)

    def reset(self) -> None:
        """Forget everything, as when the robot was carried, or the map changed."""
        self._hypotheses, self._agreed, self._newest = [], None, None
        self._confirmation, self._unexplained = Confirmation(), 0

    def take(self, scan: Observation) -> Event:
        """Take the next scan.

        Scans that are a little older than the last one are left out. One whose stamp is far from that of the last is
        taken when the next one confirms its clock; where that was set back, everything is forgotten.
        """
        ahead = 0 if self._newest is None else scan.stamp - self._newest
        fits = -tuning.CLOCK_BACK_NS <= ahead <= tuning.CLOCK_AHEAD_NS
        if fits and ahead < 0:
            return Event.NOTHING
        event = Event.NOTHING
        for one in self._confirmation.take(scan.stamp, scan, fits=fits):
            if self._newest is not None and one.stamp < self._newest:
                self.reset()
            event = self._take(one)
        return event

    def _take(self, scan: Observation) -> Event:
        self._newest = scan.stamp
        self._hypotheses = [
            one
            for one in self._hypotheses
            if one is self._agreed or scan.stamp - one.latest.stamp <= tuning.FORGOTTEN_NS
        ]
        verdicts = [(one, one.verdict(scan, agreed=one is self._agreed)) for one in self._hypotheses]
        against = [one for one, agrees in verdicts if agrees is False]
        for one in against:
            one.against += 1
        supported = [one for one, agrees in verdicts if agrees and scan.usable]
        for one in supported:
            one.support(scan)
        if scan.usable and not supported:
            supported = [self._begin(scan)]
            if scan.odometry is not None and against:
                self._unexplained += 1
        if self._agreed is not None and self._agreed in supported:
            self._agreed.against = 0
            return Event.CONFIRMED
        contradicted = self._unexplained >= tuning.UNEXPLAINED_SCANS
        for one in supported:
            if one.agreed(self.needed, contradicted=contradicted):
                self._agreed, self._hypotheses, self._unexplained, one.against = one, [one], 0, 0
                return Event.AGREED
        return Event.CONTRADICTED if self._agreed in against else Event.NOTHING

    def _begin(self, scan: Observation) -> _Hypothesis:
        if len(self._hypotheses) >= tuning.MAX_HYPOTHESES:
            others = (one for one in self._hypotheses if one is not self._agreed)
            self._hypotheses.remove(min(others, key=lambda one: one.latest.stamp))
        self._hypotheses.append(_Hypothesis(scan, scan, scan, rival=scan.rival))
        return self._hypotheses[-1]


def step_between(begin: Observation, end: Observation) -> RigidTransform | None:
    """Return where the robot is at `end`, relative to where it was at `begin`.

    Without odometry at both it is taken to rest. None where odometry is known at one of them only, or of two parts.
    """
    if begin.odometry is None and end.odometry is None:
        return IDENTITY
    if begin.odometry is None or end.odometry is None or begin.part != end.part:
        return None
    return begin.odometry.inverse().compose(end.odometry)


def predict(begin: Observation, step: RigidTransform, unknown_s: float = 0.0) -> tuple[RigidTransform, Floats]:
    """Return the pose that odometry predicts from a scan with a pose, and its covariance.

    Parameters
    ----------
    begin : Observation
    step : RigidTransform
        As by `step_between`.
    unknown_s : float
        Seconds of the step in which odometry is not known.

    Returns
    -------
    RigidTransform
        map_from_base.
    (3, 3)
        Additive (x, y, theta) in the map frame; with the error of odometry.
    """
    predicted = begin.pose.compose(step)
    known = begin.pose.carry(begin.covariance, step)
    distance, angle = math.hypot(step.x, step.y), abs(step.theta)
    place = tuning.ODOMETRY_DISTANCE + tuning.ODOMETRY_DISTANCE_PER_METRE * distance + tuning.UNKNOWN_SPEED * unknown_s
    turn = tuning.ODOMETRY_ANGLE + tuning.ODOMETRY_ANGLE_PER_ANGLE * angle + tuning.ODOMETRY_ANGLE_PER_METRE * distance
    turn += tuning.UNKNOWN_TURN_RATE * unknown_s
    return predicted, known + np.diag([place**2, place**2, turn**2])


def _verdict(begin: Observation, scan: Observation, step: RigidTransform, unknown_s: float) -> bool | None:
    """Return whether a scan agrees with what odometry predicts; None where that is undecided.

    Poses of different maps never agree.
    """
    predicted, covariance = predict(begin, step, unknown_s)
    if scan.usable and scan.map_id != begin.map_id:
        return False
    if scan.usable:
        return predicted.chi_square(scan.pose, covariance + scan.covariance) <= tuning.AGREEING_CHI_SQUARE
    if not scan.conclusive:
        return None
    places = [one.pose for one in (scan, *scan.others) if one.map_id == begin.map_id]
    near = any(predicted.chi_square(pose, covariance) <= tuning.AGREEING_CHI_SQUARE for pose in places)
    return None if near else False
