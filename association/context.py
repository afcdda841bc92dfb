"""The inputs of one search, derived once."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from registration import RigidTransform
from registration.layout import POSE, Records
from registration.observability import most_parallel_up_to
from registration.values import value

from .deadline import Deadline
from .index.joint import JointIndex
from .index.map_index import MapIndex
from .layout import (
    ENDS,
    GATES,
    HARD_PRIOR,
    MODEL,
    NO_PRIOR,
    POINT,
    PRIOR,
    RULES,
    SIGHTING,
    SOFT_PRIOR,
    TERMS,
    Integers,
    as_records,
    record,
)
from .options import AssociationOptions, HardPrior, MapsPrior, Prior, SoftPrior
from .scan.alignment import aligned
from .scan.scan import Scan
from .scan.scan_lines import ScanLines, gates
from .tables import KnownWalls, Question, Sights, Workspace
from .tuning import COMPARED_BEAMS, EMPTY_CELL, FAR, FARTHER, LATE_CROWD, MAX_RAYS, MOST_LOOKED_AT, RAY_SPACING, RAYS

NOTHING_KNOWN = record(PRIOR, kind=NO_PRIOR)
NOTHING_KEPT = record(RULES)
ONE_VIEW = np.ones(1)


@lru_cache
def _place(x: float, y: float) -> Records:
    return record(POINT, x=x, y=y)


@lru_cache
def _terms(gates: bytes, prior: bytes, model: bytes) -> bytes:
    """Put records together, which numpy does field by field: those of most searches on a map are the same."""
    terms = record(TERMS)
    terms["gates"], terms["prior"] = np.frombuffer(gates, GATES), np.frombuffer(prior, PRIOR)
    terms["model"] = np.frombuffer(model, MODEL)
    return terms.tobytes()


@value(frozen=True)
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
    def ends(self) -> Records:
        """The ends of the scan's segments, (n,) of `ENDS`.

        Read-only, as those that were sent are: a kernel is not compiled again for those of views that were moved.
        """
        ends = as_records(ENDS, self.scan.measured.segments.endpoints).view()
        ends.flags.writeable = False
        return ends

    @cached_property
    def sights(self) -> Sights:
        """The lines seen from each place, as far as lines of sight are evidence."""
        seen, views = self.lines.sightings, self.scan.views
        if views is None:
            seen = seen if self.scan.viewpoint is not None else seen[:0]
            place = _place(*(self.scan.viewpoint or (0.0, 0.0)))
            return Sights(place, np.array([0, len(seen)]), seen, np.arange(len(seen)), ONE_VIEW)
        sighted = ~np.isnan(views.viewpoints[:, 0])
        seen = seen[sighted[seen["sensor"]]]
        places = as_records(POINT, np.where(sighted[:, None], views.viewpoints, 0.0))
        starts = np.searchsorted(seen["sensor"], np.arange(len(views) + 1))
        return Sights(places, starts, seen, np.lexsort((seen["sensor"], seen["row"])), views.weights)

    @property
    def lines_of_sight(self) -> Sights:
        """The same where it scores poses: segments have no lines of sight where single beams are better evidence."""
        return self.nothing_seen if self.with_beams else self.sights

    @cached_property
    def nothing_seen(self) -> Sights:
        """The same, without lines of sight."""
        nothing = np.zeros(len(self.sights.starts), np.int64), np.zeros(0, SIGHTING), np.zeros(0, np.intp)
        return Sights(self.sights.places, *nothing, self.sights.weights)

    @cached_property
    def looks(self) -> float:
        """Bound the number of walls, in cells that they pass, that are looked at for the rays from one pose.

        Of the lines of sight of the scan, of those in all directions, and of the beams that are compared.
        """
        grid, views, scan = self.index.grid.shape[0], self.sights.places, self.scan
        across = self.index.across
        rays = RAYS * len(views) + MAX_RAYS * len(self.sights.seen) + (COMPARED_BEAMS if self.with_beams else 0)
        in_a_cell = self.index.most_near + EMPTY_CELL
        if rays * across * in_a_cell <= MOST_LOOKED_AT:
            return rays * across * in_a_cell
        seen, per_cell = self.sights.seen, 2.0 / float(grid["cell"])
        from_view = views[seen["sensor"]]
        away = np.hypot(seen["x"] - from_view["x"], seen["y"] - from_view["y"]) + 0.5 * seen["length"]
        reach = max(FAR, FARTHER * float(away.max(initial=0.0)))
        to_each = np.minimum(MAX_RAYS, np.ceil(seen["length"] / RAY_SPACING))
        cells = float(to_each @ np.minimum(across, 1.0 + per_cell * away))
        cells += RAYS * len(views) * min(across, 1.0 + per_cell * reach)
        if scan.beams is not None:
            cells += COMPARED_BEAMS * min(across, 1.0 + per_cell * scan.beams.range_max)
        return cells * in_a_cell

    @property
    def can_look(self) -> bool:
        """Return whether rays can be followed: the map has few enough walls along them."""
        return self.looks <= MOST_LOOKED_AT

    @property
    def too_late_to_look(self) -> bool:
        """Return whether rays cannot be followed, or take long after the deadline: many walls lie in one place."""
        return not self.can_look or (self.index.crowd > LATE_CROWD and self.deadline.passed)

    @cached_property
    def workspace(self) -> Workspace:
        """The arrays that the kernels write to while they look at poses."""
        count = len(self.lines.rows)
        return Workspace.of(count, len(self.index.walls.rows), most_parallel_up_to(count))

    @cached_property
    def known_walls(self) -> KnownWalls:
        """The walls, and the uncertainty of their positions."""
        known = self.index.sigma
        return KnownWalls(self.index.walls.rows, self.index.ties, -1.0 if known is None else known**2)

    def question(self, rules: Records) -> Question:
        """Return the input of the kernels' search; `rules` (1,) define which poses are stored."""
        return Question(self.lines.rows, self._terms, rules)

    @cached_property
    def question_of_a_pose(self) -> Question:
        """The same for kernels that store no poses."""
        return Question(self.lines.rows, self._terms, NOTHING_KEPT)

    @cached_property
    def _terms(self) -> Records:
        terms = _terms(self.gates.tobytes(), self.prior_record.tobytes(), self.lines.model.tobytes())
        return np.frombuffer(bytearray(terms), TERMS)

    def anywhere(self) -> SearchContext:
        """Return the same search without its prior."""
        return self._searching(self.scan, self.lines)

    def instead(self, scan: Scan, lines: ScanLines) -> SearchContext:
        """Return the search, without a prior, for a scan that differs from this one, on the same map.

        If it has as many lines, both write to the same workspace: only one of them may search at a time.
        """
        other = self._searching(scan, lines)
        if lines.model is self.lines.model and self.prior is None:
            other.__dict__["_terms"] = self._terms
        if len(lines.rows) == len(self.lines.rows):
            other.__dict__["workspace"] = self.workspace
        return other

    def _searching(self, scan: Scan, lines: ScanLines) -> SearchContext:
        return SearchContext(self.index, scan, None, self.options, self.deadline, lines, self.gates)

    @property
    def middle(self) -> tuple[float, float]:
        """Mean of the midpoints of the scan's lines, metres in the scan frame."""
        rows = self.lines.rows
        return (float(rows["x"].mean()), float(rows["y"].mean())) if len(rows) else (0.0, 0.0)

    def maps_at(self, poses: Records) -> Integers:
        """Return the map of each pose (k,), (k,): that nearest to the middle of the scan; 0 where there is one."""
        if not isinstance(self.index, JointIndex) or not len(poses):
            return np.zeros(len(poses), np.intp)
        x, y = self.middle
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
