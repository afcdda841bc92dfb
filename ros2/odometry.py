"""The motion of the robot between two times, and its speed at one, from odometry."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from formats.logs.tracks import Known, Track
from formats.logs.tuning import JITTER, STALE_NS
from registration import IDENTITY, RigidTransform
from registration.layout import Floats

from .clock import Clock, Confirmation
from .frames import matrix_in_space, matrix_of, planar
from .messages import NS, Odometry, nanoseconds
from .tuning import CLOCK_BACK_NS, CLOCKS_AGREE_NS, ENDED_SECONDS, MAX_SPEED, MAX_TURN_RATE

KEPT = 2000  # messages; 20 s at 100 Hz
FRESH_NS = NS // 5  # a speed does not hold for longer
SWITCHES = 4  # of the frame, within some seconds: two publishers, not one that began again
TRANSFORMS = "tf"  # as a source


@dataclass(frozen=True, slots=True)
class Speed:
    """The speed of the robot: m/s and rad/s, in its base frame."""

    vx: float
    vy: float
    omega: float

    def carried(self, by: RigidTransform) -> Speed:
        """Return the speed of a frame that is fixed to this one, by its pose in this one."""
        vx, vy = self.vx - self.omega * by.y, self.vy + self.omega * by.x
        c, s = math.cos(by.theta), math.sin(by.theta)
        return Speed(c * vx + s * vy, c * vy - s * vx, self.omega)


class OdometryHistory:
    """The newest poses and speeds of the robot in its odometry frame, by messages or else by transforms.

    Parameters
    ----------
    clock : Clock, optional

    Attributes
    ----------
    frame : str
        The odometry frame; empty before the first value.
    source : str
        The topic; empty before the first value.
    """

    def __init__(self, clock: Clock | None = None) -> None:
        self._clock = clock or Clock()
        self.frame = self.source = ""
        self._track = Track(static=False, most=KEPT)
        self._tracks = 0  # that came before, of other sources
        self._speeds: deque[tuple[int, Speed]] = deque(maxlen=KEPT)
        self._received = 0  # the newest value, by the clock
        self._confirmation = Confirmation[tuple[int, Floats, int]](CLOCK_BACK_NS)
        self._switched: deque[tuple[float, str]] = deque(maxlen=SWITCHES)  # times of messages in another frame
        self._transform: tuple[int, Floats] | None = None  # that messages have to reach before it is compared
        self._apart: tuple[float, str] = -math.inf, ""  # when it differed from messages, and by how much

    def take(self, message: Odometry, child_from_base: RigidTransform = IDENTITY, topic: str = "odometry") -> None:
        """Take a message; messages go before transforms.

        Parameters
        ----------
        message : Odometry
            Of its child frame, twist as well.
        child_from_base : RigidTransform
            Pose of the base frame in the child frame.
        topic : str

        Raises
        ------
        ValueError
            When it is no pose, or no speed.
        """
        matrix, twist = matrix_of(message.pose.pose.position, message.pose.pose.orientation), message.twist.twist
        speed = Speed(twist.linear.x, twist.linear.y, twist.angular.z)
        if not (math.hypot(speed.vx, speed.vy) <= MAX_SPEED and abs(speed.omega) <= MAX_TURN_RATE):
            raise ValueError(
                f"found a twist of {speed.vx:.4g} m/s, {speed.vy:.4g} m/s and {speed.omega:.4g} rad/s, "
                f"expected at most {MAX_SPEED:g} m/s and {MAX_TURN_RATE:g} rad/s"
            )
        stamp = nanoseconds(message.header.stamp)
        self._add(stamp, matrix @ matrix_in_space(child_from_base), message.header.frame_id.strip("/"), topic)
        if self._speeds and stamp < self._speeds[-1][0]:
            self._speeds.clear()
        self._speeds.append((stamp, speed.carried(child_from_base)))

    def take_transform(self, stamp: int, odom_from_base: Floats, frame: str) -> None:
        """Take a pose of the tree of frames, where no message has come for some time."""
        if self.source == TRANSFORMS and self._track.newest[0] == stamp:
            return
        if self.source in ("", TRANSFORMS) or self.silent_s > ENDED_SECONDS:
            self._add(stamp, odom_from_base, frame, TRANSFORMS)
        elif frame == self.frame:
            self._compare(stamp, odom_from_base)

    def _compare(self, stamp: int, odom_from_base: Floats) -> None:
        """Compare messages with a transform between the same frames."""
        then, matrix = self._transform = self._transform or (stamp, odom_from_base)
        if self._track.newest[0] < then:
            return
        self._transform, known = None, self._track.known(then)
        if known is None:
            return
        step = planar(np.linalg.inv(known.matrix) @ matrix)
        distance, angle = math.hypot(step.x, step.y), abs(step.theta)
        self._apart = -math.inf, ""
        if max(distance, angle) > JITTER:
            self._apart = self._clock.steady() / NS, f"{distance:.2f} m and {math.degrees(angle):.0f} degrees"

    def _add(self, stamp: int, odom_from_base: Floats, frame: str, source: str) -> None:
        """Add a value; a stamp far from the time by odometry counts when the next one confirms its clock."""
        now = self._clock.steady()
        if (frame, source) != (self.frame, self.source):
            if source == self.source:
                self._switched.append((now / NS, self.frame))
            self.frame, self.source, self._track = frame, source, Track(static=False, most=KEPT)
            self._tracks += 1
        expected = self._track.newest[0] + now - self._received if len(self._track) else stamp
        fits = abs(expected - stamp) <= CLOCK_BACK_NS
        for then, matrix, received in self._confirmation.take(stamp, (stamp, odom_from_base, now), fits=fits):
            self._track.add(then, matrix, received=received)
            self._received = now

    @property
    def newest(self) -> tuple[int, RigidTransform, Known] | None:
        """The time now by the clock of odometry, nanoseconds, and the newest value; None where it ended or jumped."""
        known = self.known(self._track.newest[0]) if len(self._track) else None
        if known is None or self.silent_s > ENDED_SECONDS:
            return None
        return self._track.newest[0] + self._clock.steady() - self._received, planar(known.matrix), known

    @property
    def silent_s(self) -> float:
        """Seconds since the newest value was received; infinite where none was."""
        return (self._clock.steady() - self._received) / NS if len(self._track) else math.inf

    @property
    def jump(self) -> str:
        """The last step that is not possible, as a text, until a while after; empty where there is none."""
        jumps = self._track.jumps if len(self._track) else []
        return str(jumps[-1]) if jumps and self._track.newest[0] - jumps[-1].end < ENDED_SECONDS * NS else ""

    @property
    def frames(self) -> tuple[str, ...]:
        """The frames that messages of the topic come in, if these alternate; else none."""
        lately = [frame for when, frame in self._switched if self._clock.steady() / NS - when < ENDED_SECONDS]
        return tuple(sorted({self.frame, *lately})) if len(lately) == SWITCHES else ()

    @property
    def apart(self) -> str:
        """By how much messages and the transform between the same frames differ; empty where they do not."""
        when, told = self._apart
        return told if self._clock.steady() / NS - when < ENDED_SECONDS else ""

    def clock_offset(self, stamp: int, received: int) -> int:
        """Return how many nanoseconds longer after its stamp a scan was received than odometry was; 0 without it."""
        return received - stamp - self._track.latency(stamp, received) if len(self._track) else 0

    def clocks(self, offset: int) -> str:
        """Return that the clock of scans differs from that of odometry by so many nanoseconds, and the remedy."""
        side = "behind" if offset > 0 else "ahead of"
        found = f"the stamps of scans are {abs(offset) / NS:.1f} s {side} those of odometry on {self.source}"
        return f"{found}; expected at most {CLOCKS_AGREE_NS / NS:g} s. Synchronize the clocks; until then, odometry is"

    def awaited(self, stamp: int) -> bool:
        """Return whether odometry arrives, but has not reached a stamp."""
        return bool(len(self._track)) and 0 < stamp - self._track.newest[0] <= STALE_NS

    def speed(self, at: int) -> Speed | None:
        """Return the speed of the robot at a time, nanoseconds; None where it is not known."""
        stamp, speed = min(self._speeds, key=lambda one: abs(one[0] - at), default=(0, None))
        return speed if abs(stamp - at) <= FRESH_NS else None

    def between(self, begin: int, end: int) -> RigidTransform | None:
        """Return where the robot was at `end`, relative to where it was at `begin`; None where that is not known.

        Times are in nanoseconds. At the ends of odometry it is taken to rest for a while.
        """
        if begin == end:
            return IDENTITY
        a, b = (self._track.at(one) if len(self._track) else None for one in (begin, end))
        return None if a is None or b is None else planar(a).inverse().compose(planar(b))

    def begin_part(self) -> None:
        """Begin a new part: poses before and after it are not comparable, because they are looked up at other times."""
        self._tracks += 1

    def known(self, stamp: int, received: int | None = None) -> Known | None:
        """Return odom_from_base of something with a stamp and a time of reception; None where it is not known."""
        known = self._track.known(stamp, received) if len(self._track) else None
        return None if known is None else replace(known, part=(self._tracks, *known.part))
