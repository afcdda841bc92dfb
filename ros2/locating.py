"""Scans to the pose of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import linefix
from formats.logs.tracks import Known
from registration import RigidTransform

from .agreement import Observation, Place
from .looking import Look
from .messages import Time
from .options import NodeOptions
from .transforms import NS, planar
from .tuning import INCONCLUSIVE_NATS

OPTIONS = linefix.AssociationOptions(max_alternatives=10)  # each of them may be where the robot is


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """The result of a scan.

    Attributes
    ----------
    stamp : Time
        Of the scan, of several the newest.
    answer : AssociationResult
        Its poses are map_from_base.
    """

    stamp: Time
    answer: linefix.AssociationResult

    @property
    def pose(self) -> RigidTransform | None:
        """map_from_base."""
        return self.answer.pose

    @property
    def covariance(self) -> NDArray[np.float64] | None:
        """Of the pose, (3, 3): additive (x, y, theta) in the map frame."""
        return self.answer.covariance

    def observation(self, known: Known | None, stamp: int) -> Observation:
        """Return the result for the agreement, with odom_from_base at its stamp (nanoseconds)."""
        odometry = () if known is None else (planar(known.matrix)[0], known.part, known.unknown_ns / NS)
        answer = self.answer
        others = tuple(Place(one.pose, one.map_id) for one in answer.alternatives)
        return replace(
            Observation(stamp, answer.pose, answer.covariance, answer.usable, *odometry),
            others=others,
            conclusive=self._conclusive,
            map_id=answer.map_id,
        )

    @property
    def _conclusive(self) -> bool:
        """Return whether each pose that explains the scan about as well is listed."""
        answer = self.answer
        if answer.status not in (linefix.Status.OK, linefix.Status.AMBIGUOUS) or answer.diagnostics is None:
            return False
        unlisted = (1.0 - answer.search.complete_above) * answer.diagnostics.score
        listed = len(answer.alternatives) < OPTIONS.max_alternatives
        return listed and answer.search.complete and unlisted >= INCONCLUSIVE_NATS


def search_options(options: NodeOptions) -> linefix.AssociationOptions:
    """Return how the node searches each scan."""
    return replace(OPTIONS, on_map=options.on_map, usable_from=options.usable_from)


def locate(
    index: linefix.MapIndex | linefix.MapSet,
    looks: Sequence[Look],
    options: linefix.AssociationOptions = OPTIONS,
    deadline: linefix.Deadline | None = None,
) -> Located:
    """Find where the robot is by one scan, or several together, at the time of the first beam of the first."""
    together = linefix.assemble([look.view for look in looks])
    return Located(looks[0].stamp, linefix.locate(index, together, options=options, deadline=deadline))
