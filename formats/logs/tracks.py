"""Values of one transform over time, and when odometry is known: one rule for logs and for robots.

Odometry is known at a time if the values on both sides of it are near in time and the motion between them, and between
the values around them, is possible. A stamp that goes back begins a new part: no value before it is used after it.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from . import tuning

Floats = NDArray[np.float64]

NS = 1_000_000_000
ROUNDING = 1e-6  # m and rad; by which values differ that are equal
PERIODS = 9  # before a value, of which the median is the period


@dataclass(frozen=True, slots=True)
class Known:
    """A transform at a time.

    Attributes
    ----------
    matrix : (4, 4)
    part : tuple of int
        Transforms of different parts are not comparable: the clock was set back, or odometry jumped in between.
    unknown_ns : int
        Time within the part, up to this one, in which odometry is not known.
    """

    matrix: Floats
    part: tuple[int, ...] = ()
    unknown_ns: int = 0

    def after(self, inner: Known) -> Known:
        """Return this transform after another one at the same time."""
        return Known(self.matrix @ inner.matrix, inner.part + self.part, inner.unknown_ns + self.unknown_ns)


@dataclass(frozen=True, slots=True)
class Jump:
    """Two values with a motion between them that is not possible."""

    begin: int  # nanoseconds
    end: int
    distance: float  # m
    angle: float  # rad

    def __str__(self) -> str:
        seconds = (self.end - self.begin) / NS
        turned = f" and {math.degrees(self.angle):.0f} degrees" if self.angle > tuning.JITTER else ""
        return f"{self.distance:.2f} m{turned} within {seconds:.3f} s at stamp {self.begin / NS:.3f}"


@dataclass(slots=True)
class _Part:
    """Values whose stamps are of one clock."""

    stamps: list[int] = field(default_factory=list)
    matrices: list[Floats] = field(default_factory=list)
    received: list[int] = field(default_factory=list)
    jumps: list[Jump] = field(default_factory=list)
    longest: int = 0  # of the gaps, nanoseconds
    _stretches: list[int] = field(default_factory=list)  # the number of jumps up to a value
    _unknown: list[int] = field(default_factory=list)  # nanoseconds of gaps up to a value

    def add(self, stamp: int, matrix: Floats, received: int) -> None:
        at = bisect.bisect_right(self.stamps, stamp)
        if at and self.stamps[at - 1] == stamp and not _jump(self.stamps, self.matrices, at - 1, (stamp, matrix)):
            at -= 1  # the same value again
            del self.stamps[at], self.matrices[at], self.received[at]
        self.stamps.insert(at, stamp)
        self.matrices.insert(at, matrix)
        self.received.insert(at, received)
        del self._stretches[at:], self._unknown[at:]

    def trim(self, most: int) -> None:
        """Forget the oldest values where there are more than twice as many."""
        if len(self.stamps) > 2 * most:
            self.settle()
            for values in (self.stamps, self.matrices, self.received, self._stretches, self._unknown):
                del values[:-most]
            self.jumps = [one for one in self.jumps if one.end >= self.stamps[0]]

    def settle(self) -> None:
        """Find the gaps and the jumps among the values that were added."""
        stamps, begin = self.stamps, len(self._unknown)
        if begin < len(stamps):
            self.jumps = [one for one in self.jumps if begin and one.end <= stamps[begin - 1]]
        for k in range(begin, len(stamps)):
            if k == 0:
                self._stretches.append(0)
                self._unknown.append(0)
                continue
            jump = _jump(stamps, self.matrices, k - 1, (stamps[k], self.matrices[k]))
            if jump is not None:
                self.jumps.append(jump)
            step = stamps[k] - stamps[k - 1]
            gap = step if step > _most_gap(stamps, k) else 0
            self.longest = max(self.longest, gap)
            self._stretches.append(self._stretches[-1] + (jump is not None))
            self._unknown.append(self._unknown[-1] + gap)

    def near(self, stamp: int, hold: int) -> Floats | None:
        """Return the value at a time, at the ends for so long the last one; None where it is not known."""
        self.settle()
        after = bisect.bisect_left(self.stamps, stamp)
        if after < len(self.stamps) and self.stamps[after] == stamp:
            return self.matrices[after]
        if after in (0, len(self.stamps)):
            end = min(after, len(self.stamps) - 1)
            return self.matrices[end] if abs(self.stamps[end] - stamp) <= hold else None
        if self._unknown[after] != self._unknown[after - 1]:
            return None
        fraction = (stamp - self.stamps[after - 1]) / (self.stamps[after] - self.stamps[after - 1])
        return between(self.matrices[after - 1], self.matrices[after], fraction)

    def known(self, stamp: int, number: int) -> Known | None:
        """Return the value at a time as odometry."""
        matrix = self.near(stamp, 0)
        near = bisect.bisect_left(self.jumps, stamp - tuning.MOST_GAP_NS, key=lambda one: one.end)
        if matrix is None or (near < len(self.jumps) and self.jumps[near].begin <= stamp + tuning.MOST_GAP_NS):
            return None
        at = min(bisect.bisect_left(self.stamps, stamp), len(self.stamps) - 1)
        return Known(matrix, (number, self._stretches[at]), self._unknown[at])

    def latency(self, stamp: int) -> int:
        """Return how long after its stamp the value nearest to a time was received."""
        after = bisect.bisect_left(self.stamps, stamp)
        near = range(max(0, after - 1), min(after + 1, len(self.stamps)))
        nearest = min(near, key=lambda k: abs(self.stamps[k] - stamp))
        return self.received[nearest] - self.stamps[nearest]


@dataclass(slots=True)
class Track:
    """Values of one transform over time.

    Attributes
    ----------
    static : bool
        True: a value holds until another one is received, and the first one before, too.
    refixed : bool
        True: static values differ.
    moves : bool
        True: values that are not static differ by more than rounding.
    most : int or None
        Values to keep, of the newest part only, for a robot that runs for weeks; None: all.
    topics : set of str
        Sources of the values.
    """

    static: bool
    refixed: bool = False
    moves: bool = False
    most: int | None = None
    topics: set[str] = field(default_factory=set)
    _parts: list[_Part] = field(default_factory=list)
    _dropped: int = 0  # parts

    def __len__(self) -> int:
        return sum(len(part.stamps) for part in self._parts)

    def add(
        self, stamp: int, matrix: Floats, *, static: bool = False, received: int | None = None, topic: str = ""
    ) -> None:
        """Add a value; a static one holds from when it was received, and is left out where there are others."""
        if static and not self.static:
            return
        if static and self._parts:
            same = np.allclose(self._parts[-1].matrices[-1], matrix, rtol=0.0, atol=tuning.REFIXED)
            if same and not self.most:
                return
            self.refixed |= not same
        elif self.static:
            self._parts.clear()
        self.static = static
        if static or not self._parts or stamp < self._parts[-1].stamps[-1] - tuning.PART_NS:
            self._dropped += len(self._parts) if self.most else 0
            self._parts[:] = [_Part()] if self.most else [*self._parts, _Part()]
        first = self._parts[0].matrices
        self.moves = self.moves or (not static and bool(first) and bool(abs(matrix - first[0]).max() > ROUNDING))
        self._parts[-1].add(stamp, matrix, stamp if received is None else received)
        self.topics.add(topic)
        if self.most:
            self._parts[-1].trim(self.most)

    def at(self, stamp: int, received: int | None = None, hold: int = tuning.STALE_NS) -> Floats | None:
        """Return the value at a time, nanoseconds; None where it is not known.

        Parameters
        ----------
        stamp : int
        received : int, optional
            When what has this stamp was received; it chooses the part. None: the last part.
        hold : int
            Nanoseconds that the first and the last value hold.
        """
        if self.static:
            return self._fixed(received)
        part = self._parts[self._number(stamp, received)]
        if not self.moves:
            return part.matrices[-1] if part.stamps[0] - hold <= stamp <= part.stamps[-1] + hold else None
        return part.near(stamp, hold)

    def known(self, stamp: int, received: int | None = None) -> Known | None:
        """Return the value at a time as odometry; None where that is not known."""
        if self.static:
            return Known(self._fixed(received))
        number = self._number(stamp, received)
        if not self.moves:
            matrix = self.at(stamp, received)
            return None if matrix is None else Known(matrix, (self._dropped + number, 0))
        part = self._parts[number]
        if received is not None and abs(received - stamp - part.latency(stamp)) > tuning.CLOCKS_APART_NS:
            return None
        return part.known(stamp, self._dropped + number)

    def latency(self, stamp: int, received: int) -> int:
        """Return how long after its stamp the value nearest to a time was received, nanoseconds."""
        return self._parts[self._number(stamp, received)].latency(stamp)

    @property
    def newest(self) -> tuple[int, Floats]:
        """The newest stamp, and its value."""
        return self._parts[-1].stamps[-1], self._parts[-1].matrices[-1]

    @property
    def stamps(self) -> Sequence[int]:
        """Times of the values, nanoseconds, part by part."""
        return [stamp for part in self._parts for stamp in part.stamps]

    def times(self, step: int) -> Iterator[tuple[int, int]]:
        """Yield stamps that are at least a step apart, with their times of reception."""
        for part in self._parts:
            last = part.stamps[0] - step
            for stamp, received in zip(part.stamps, part.received, strict=True):
                if stamp >= last + step:
                    last = stamp
                    yield stamp, received

    @property
    def part_count(self) -> int:
        """The number of parts."""
        return len(self._parts)

    @property
    def jumps(self) -> list[Jump]:
        """The steps that are not possible."""
        return [jump for part in self._settled() for jump in part.jumps]

    @property
    def longest_gap(self) -> int:
        """The longest time within a part in which odometry is not known, nanoseconds."""
        return max(part.longest for part in self._settled())

    def _settled(self) -> list[_Part]:
        for part in self._parts:
            part.settle()
        return self._parts

    def _fixed(self, received: int | None) -> Floats:
        """Return the static value that held when something was received; None: the last one."""
        before = bisect.bisect_right(self._parts, received or math.inf, key=lambda part: part.received[0])
        return self._parts[max(0, before - 1)].matrices[-1]

    def _number(self, stamp: int, received: int | None) -> int:
        """Return the part whose values were received as long after their stamps as what has this stamp."""
        if received is None or len(self._parts) == 1:
            return len(self._parts) - 1
        latency = received - stamp
        return min(range(len(self._parts)), key=lambda k: abs(self._parts[k].latency(stamp) - latency))


def between(a: Floats, b: Floats, fraction: float) -> Floats:
    """Interpolate two transforms that are near each other, (4, 4) each; the axes are made orthonormal again."""
    mixed = (1.0 - fraction) * a + fraction * b
    u, _, vt = np.linalg.svd(mixed[:3, :3])
    mixed[:3, :3] = u @ vt
    return mixed


def jump_between(begin: int, end: int, distance: float, angle: float) -> Jump | None:
    """Return a motion (m, rad) between two times, nanoseconds, if no robot moves so fast."""
    possible = tuning.JITTER + tuning.FASTEST * max(0, end - begin) / NS
    return None if distance <= possible and abs(angle) <= possible else Jump(begin, end, distance, abs(angle))


def _jump(stamps: Sequence[int], matrices: Sequence[Floats], before: int, after: tuple[int, Floats]) -> Jump | None:
    (end, b), a = after, matrices[before]
    distance = math.hypot(b[0, 3] - a[0, 3], b[1, 3] - a[1, 3])
    sine, cosine = a[0, 0] * b[1, 0] - a[1, 0] * b[0, 0], a[0, 0] * b[0, 0] + a[1, 0] * b[1, 0]
    return jump_between(stamps[before], end, distance, math.atan2(sine, cosine))


def _most_gap(stamps: Sequence[int], k: int) -> float:
    """Return how far a value may be from the one before, nanoseconds: some periods, within limits."""
    periods = sorted(stamps[j] - stamps[j - 1] for j in range(max(1, k - PERIODS), k))
    usual = tuning.MOST_PERIODS * periods[len(periods) // 2] if periods else tuning.MOST_GAP_NS
    return min(tuning.MOST_GAP_NS, max(tuning.USUAL_GAP_NS, usual))
