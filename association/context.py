"""The inputs of one search, derived once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from registration import RigidTransform
from registration.layout import POSE, Floats, Records
from registration.observability import most_parallel_up_to

from .deadline import Deadline
from .index.joint import JointIndex
from .index.map_index import MapIndex
from .layout import HARD_PRIOR, NO_PRIOR, PRIOR, SOFT_PRIOR, TERMS, Integers, record
from .options import AssociationOptions, HardPrior, MapsPrior, Prior, SoftPrior
from .scan.alignment import aligned
from .scan.beams import BeamSet, beams_of_ranges, rays_to_lines
from .scan.scan import Scan
from .scan.scan_lines import ScanLines, gates
from .tables import Question, ScoreWork
from .tuning import EMPTY_CELL, LATE_CROWD, MOST_LOOKED_AT, MOST_RAYS

NOTHING_KNOWN = record(PRIOR, kind=NO_PRIOR)


@dataclass(frozen=True)
class SearchContext:
    """A search's map, scan, prior and options, and the arrays of them that the kernels take.

    Attributes
    ----------
    index : MapIndex
        Of the directed or of the undirected map, as the options want it.
    scan : Scan
    prior : Prior, MapsPrior or None
        In the map frame.
    options : AssociationOptions
    deadline : Deadline
    lines : ScanLines
    gates : (1,) of `GATES`
    """

    index: MapIndex
    scan: Scan
    prior: Prior | MapsPrior | None
    options: AssociationOptions
    deadline: Deadline
    lines: ScanLines
    gates: Records

    @classmethod
    def of(
        cls,
        index: MapIndex,
        scan: Scan,
        prior: Prior | MapsPrior | None,
        options: AssociationOptions,
        deadline: Deadline,
    ) -> SearchContext:
        """Prepare a search; views that are not exact are laid on one another, as far as the deadline lets it.

        On a map whose directions mean nothing those of the scan mean nothing either, whatever the options are.
        """
        place = index if options.oriented else index.undirected
        if options.oriented and len(place.segments) > place.directed:
            options = replace(options, oriented=False)
        scan = aligned(scan, deadline, directed=options.oriented)
        lines = ScanLines.of(scan, place.sigma, options)
        return cls(place, scan, prior, options, deadline, lines, gates(options))

    def with_scan(self, scan: Scan, lines: ScanLines | None = None) -> SearchContext:
        """Return the same search for another scan."""
        lines = lines or ScanLines.of(scan, self.index.sigma, self.options)
        return SearchContext(self.index, scan, self.prior, self.options, self.deadline, lines, self.gates)

    def anywhere(self) -> SearchContext:
        """Return the same search without its prior."""
        return SearchContext(self.index, self.scan, None, self.options, self.deadline, self.lines, self.gates)

    @property
    def with_beams(self) -> bool:
        """Return whether single beams are evidence."""
        return self.scan.beams is not None

    @property
    def pose_prior(self) -> Prior | None:
        """The prior of the pose, if there is one."""
        return self.prior.of_pose if isinstance(self.prior, MapsPrior) else self.prior

    @property
    def window(self) -> HardPrior | None:
        """The hard prior, if there is one."""
        prior = self.pose_prior
        return prior if isinstance(prior, HardPrior) else None

    @cached_property
    def viewpoints(self) -> Floats:
        """The places of the sensors, (v, 2) metres in the scan frame; nan where a view is not from one place."""
        if self.scan.views is not None:
            return self.scan.views.viewpoints
        return np.array([self.scan.viewpoint or (np.nan, np.nan)])

    @cached_property
    def _view_weights(self) -> Floats:
        return np.ones(1) if self.scan.views is None else self.scan.views.weights

    @cached_property
    def rays_to_lines(self) -> BeamSet:
        """The rays to points of the scan's lines."""
        return rays_to_lines(self.lines.sightings, self.viewpoints, self._view_weights)

    @cached_property
    def beams(self) -> BeamSet:
        """The beams that are evidence: those of the ranges, or the rays to lines."""
        ranges, views = self.scan.beams, self.scan.views
        if ranges is not None:
            place = self.scan.viewpoint or (0.0, 0.0)
            return beams_of_ranges(ranges, place, None if views is None else views.of_beam, self._view_weights)
        return self.rays_to_lines

    @property
    def sensor(self) -> tuple[float, float]:
        """The sensor's place, else the middle of the lines, metres in the scan frame: the centre of all that is judged.

        Not the origin of the scan frame, which may lie anywhere.
        """
        return float(self.lines.model["sensor_x"][0]), float(self.lines.model["sensor_y"][0])

    def at_sensor(self, poses: Records) -> Records:
        """Return poses, (k,) of `ESTIMATE`, as those of the sensor in place of the scan's origin."""
        (x, y), c, s = self.sensor, np.cos(poses["theta"]), np.sin(poses["theta"])
        x, y = c * x - s * y, s * x + c * y
        out, xt, yt, tt = poses.copy(), poses["xt"], poses["yt"], poses["tt"]
        out["x"], out["y"] = poses["x"] + x, poses["y"] + y
        out["xx"] += y * (y * tt - 2.0 * xt)
        out["yy"] += x * (x * tt + 2.0 * yt)
        out["xy"] += x * xt - y * yt - x * y * tt
        out["xt"], out["yt"] = xt - y * tt, yt + x * tt
        return out

    @property
    def can_look(self) -> bool:
        """Return whether rays can be followed: the map has few enough walls along them."""
        return MOST_RAYS * self.index.across * (self.index.most_near + EMPTY_CELL) <= MOST_LOOKED_AT

    @property
    def too_late_to_look(self) -> bool:
        """Return whether rays cannot be followed, or take long after the deadline: many walls lie in one place."""
        return not self.can_look or (self.index.crowd > LATE_CROWD and self.deadline.passed)

    @cached_property
    def work(self) -> ScoreWork:
        """The arrays that kernels write to while they score poses."""
        lines, walls = len(self.lines.rows), len(self.index.walls.rows)
        return ScoreWork.of(lines, walls, most_parallel_up_to(lines))

    @cached_property
    def question(self) -> Question:
        """The input of the kernels."""
        terms = record(TERMS)
        terms["gates"], terms["prior"], terms["model"] = self.gates, self.prior_record, self.lines.model
        return Question(self.lines.rows, terms)

    def maps_at(self, poses: Records) -> Integers:
        """Return the map of each pose (k,), (k,): that nearest to the sensor; 0 where there is one."""
        if not isinstance(self.index, JointIndex) or not len(poses):
            return np.zeros(len(poses), np.intp)
        x, y = self.sensor
        c, s = np.cos(poses["theta"]), np.sin(poses["theta"])
        return self.index.map_at(np.stack([c * x - s * y + poses["x"], s * x + c * y + poses["y"]], axis=1))

    def on_map_of(self, pose: RigidTransform, other: RigidTransform) -> bool:
        """Return whether a pose of the map frame is on the map of one of the index frame, where there are several."""
        here = self.in_index(pose)
        at = np.array([(here.theta, here.x, here.y), (other.theta, other.x, other.y)], POSE)
        of_here, of_other = self.maps_at(at)
        return bool(of_here == of_other)

    def in_map(self, pose: RigidTransform) -> RigidTransform:
        """Return a pose of the index frame in the map frame."""
        x, y = self.index.origin
        return RigidTransform(pose.x + float(x), pose.y + float(y), pose.theta)

    def in_index(self, pose: RigidTransform) -> RigidTransform:
        """Return a pose of the map frame in the index frame."""
        x, y = self.index.origin
        return RigidTransform(pose.x - float(x), pose.y - float(y), pose.theta)

    @cached_property
    def prior_record(self) -> Records:
        """The prior in the index frame, (1,) of `PRIOR`."""
        prior = self.pose_prior
        if prior is None:
            return NOTHING_KNOWN
        x, y = self.index.origin
        at = {"x": prior.pose.x - x, "y": prior.pose.y - y, "theta": prior.pose.theta}
        if isinstance(prior, HardPrior):
            return record(PRIOR, kind=HARD_PRIOR, **at, radius=prior.radius, angle=prior.angle)
        assert isinstance(prior, SoftPrior)
        information = np.linalg.inv(prior.covariance)[np.triu_indices(3)]
        named = dict(zip(("xx", "xy", "xt", "yy", "yt", "tt"), information, strict=True))
        return record(PRIOR, kind=SOFT_PRIOR, **at, **named)
