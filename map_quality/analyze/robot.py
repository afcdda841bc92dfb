"""The robot that stands all over a map."""

from __future__ import annotations

import math
from dataclasses import dataclass

from registration import InputError
from simulation import Scanner

MOST_BEAMS = 20_000
LEAST_SIGMA, MOST_SIGMA = 1e-6, 10.0  # m; what a search takes for the sigma of ranges
ALL_ROUND = math.tau - 0.01  # rad; a full turn, and what people write for one
HEADINGS = 4  # that a scanner looks in which does not see all round


class AnalysisError(InputError):
    """A property of the robot or of its places is out of range."""


@dataclass(frozen=True, slots=True)
class Robot:
    """What a robot sees by. The default sees all round, 720 beams, 20 m far, with 2 cm noise.

    Attributes
    ----------
    fov : float
        Field of view about straight ahead, radians, above 0 and at most a full turn.
    beams : int
        Over the field of view, 8 to 20,000.
    range_max : float
        Metres, 0.5 to 1,000.
    sigma : float
        Standard deviation of the ranges, metres, 1e-6 to 10.

    Raises
    ------
    AnalysisError
        When a value is out of range.
    """

    fov: float = math.tau
    beams: int = 720
    range_max: float = 20.0
    sigma: float = 0.02

    def __post_init__(self) -> None:
        checks = [
            ("fov", 0.0 < self.fov <= math.tau + 1e-3, "radians above 0, at most a full turn"),
            ("beams", 8 <= self.beams <= MOST_BEAMS, f"a number from 8 to {MOST_BEAMS}"),
            ("range_max", 0.5 <= self.range_max <= 1000.0, "metres from 0.5 to 1000"),
            ("sigma", LEAST_SIGMA <= self.sigma <= MOST_SIGMA, f"metres from {LEAST_SIGMA:g} to {MOST_SIGMA:g}"),
        ]
        for argument, good, what in checks:
            if not good:
                raise AnalysisError(f"expected {what}, got {getattr(self, argument)!r}", argument=f"laser.{argument}")

    @property
    def scanner(self) -> Scanner:
        """The scanner that it carries."""
        return Scanner.over(
            math.tau if self.fov >= ALL_ROUND else self.fov, self.beams, range_max=self.range_max, sigma=self.sigma
        )

    @property
    def headings(self) -> tuple[float, ...]:
        """Where it looks from each place, radians: once is enough for one that sees all round."""
        count = 1 if self.fov >= ALL_ROUND else HEADINGS
        return tuple(math.remainder(k * math.tau / count, math.tau) for k in range(count))
