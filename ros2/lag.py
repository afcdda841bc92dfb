"""The choice between stamps and times of reception for odometry, where these differ. No DDS in here."""

from __future__ import annotations

from formats.logs.tracks import Known

from .agreement import Observation, predict
from .frames import planar
from .messages import NS
from .odometry import OdometryHistory
from .tuning import AGREEING_CHI_SQUARE, CLOCKS_AGREE_NS, LAG_DECIDES, LAG_SECONDS


class Lag:
    """Compares the motion between usable scans with odometry at their stamps, and when they were received.

    The two differ where clocks are not synchronized, and where scans take longer to come than odometry. Which one is
    the cause shows where the robot changes its speed: at a constant one, its motion is the same at both times.

    Parameters
    ----------
    odometry : OdometryHistory
    """

    def __init__(self, odometry: OdometryHistory) -> None:
        self._odometry = odometry
        self._by_reception = False
        self._evidence = 0.0  # for the other way, as a sum of differences of chi-squares
        self._last: tuple[Observation, int] | None = None  # a usable scan, and its time of reception

    def shift(self, stamp: int, received: int) -> int:
        """Return how long after the stamp of a scan odometry of its time is stamped, nanoseconds."""
        return self._shift(stamp, received, by_reception=self._by_reception)

    def _shift(self, stamp: int, received: int, *, by_reception: bool) -> int:
        offset = self._odometry.clock_offset(stamp, received)
        return offset if by_reception and abs(offset) > CLOCKS_AGREE_NS else 0

    def take(self, scan: Observation, received: int) -> None:
        """Take a usable scan, and choose between the two ways."""
        begin, self._last = self._last, (scan, received)
        if begin is None or not 0 < scan.stamp - begin[0].stamp <= LAG_SECONDS * NS:
            return
        ours, other = (
            self._cost(begin, (scan, received), by_reception=by) for by in (self._by_reception, not self._by_reception)
        )
        if ours is None or other is None:
            return
        self._evidence = max(-LAG_DECIDES, self._evidence + ours - other)
        if self._evidence > LAG_DECIDES:
            self._by_reception, self._evidence = not self._by_reception, -LAG_DECIDES
            self._odometry.begin_part()

    def _cost(
        self, begin: tuple[Observation, int], end: tuple[Observation, int], *, by_reception: bool
    ) -> float | None:
        """Return by how much two scans contradict odometry, at most as one that disagrees; None if it is not known."""
        a, b = (self._known(*one, by_reception=by_reception) for one in (begin, end))
        if a is None or b is None or a.part != b.part:
            return None
        predicted, covariance = predict(begin[0], planar(a.matrix).inverse().compose(planar(b.matrix)))
        return min(AGREEING_CHI_SQUARE, predicted.chi_square(end[0].pose, covariance + end[0].covariance))

    def _known(self, scan: Observation, received: int, *, by_reception: bool) -> Known | None:
        shift = self._shift(scan.stamp, received, by_reception=by_reception)
        return self._odometry.known(scan.stamp + shift, received)
