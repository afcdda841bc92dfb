"""Changes of buildings, maps and lasers between the drawing of a map and a search in it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from registration import Segments
from simulation import Scanner

from .buildings import Building
from .changes import rearranged, with_doors
from .map_errors import DrawnMap, exact, in_pieces, stretched, walls_off

BEAMS = 720
RANGE_MIN = 0.05  # m
RANGE_MAX = (20.0, 30.0)  # m
SIGMA = (0.01, 0.03)  # m
FIELDS_OF_VIEW = (1.5 * math.pi, math.tau)
# Of depth cameras, and of lasers whose view the robot's body limits:
FEW_BEAMS = 240
SHORT_RANGE_MAX = (4.0, 10.0)  # m
NARROW_FIELDS_OF_VIEW = (math.radians(60.0), math.radians(180.0))

SWEEP = 0.1  # s; of a full turn of the laser
TURNING = math.radians(90.0)  # rad/s
WRONG_STEP = 0.005  # share of the angle between two beams


class Stranger(StrEnum):
    """Why no pose in the map is right."""

    UNMAPPED = "the scan is from a part of the building that is not mapped"
    SISTER = "the map is of another building of the same owner"
    OTHER_TYPE = "the map is of another kind of building"
    MIRRORED = "the laser is mounted upside down, without notice"
    WINDOW = "the window that is searched does not hold the truth"


def any_laser(rng: np.random.Generator) -> Scanner:
    """Draw a laser of 270 or 360 degrees."""
    return _laser(float(rng.choice(FIELDS_OF_VIEW)), rng)


def laser_of_270_degrees(rng: np.random.Generator) -> Scanner:
    """Draw a laser of 270 degrees."""
    return _laser(FIELDS_OF_VIEW[0], rng)


def short_sighted(rng: np.random.Generator) -> Scanner:
    """Draw a laser that sees little: 60 to 180 degrees and 4 to 10 m."""
    view, reach, sigma = rng.uniform(*NARROW_FIELDS_OF_VIEW), rng.uniform(*SHORT_RANGE_MAX), rng.uniform(*SIGMA)
    return Scanner.over(view, FEW_BEAMS, range_min=RANGE_MIN, range_max=reach, sigma=sigma)


def _laser(view: float, rng: np.random.Generator) -> Scanner:
    reach, sigma = rng.uniform(*RANGE_MAX), rng.uniform(*SIGMA)
    return Scanner.over(view, BEAMS, range_min=RANGE_MIN, range_max=reach, sigma=sigma)


def as_mapped(building: Building, _rng: np.random.Generator) -> Building:
    """Return the building as it was when its map was made."""
    return building


def as_declared(scanner: Scanner, _rng: np.random.Generator) -> Scanner:
    """Return the laser as it is declared."""
    return scanner


@dataclass(frozen=True, slots=True)
class Condition:
    """One thing, or several, that happen to a building, its map and the laser.

    Attributes
    ----------
    what : str
        One line for a reader.
    today : callable
        From the building when it was mapped to the same building when it is scanned.
    clutter : float
        Share of the beams that end on people and pallets, 0 to 1.
    draw_map : callable
        From what the map should show to what it does.
    laser : callable
        From the laser as it is declared to what it really is.
    draw_laser : callable
        The laser as it is declared.
    corrected : bool
        True if the beams' angles are declared as they really are: the robot knows how fast it turned.
    stranger : Stranger or None
        Why no pose is right; None where the truth is in the map.
    """

    what: str
    today: Callable[[Building, np.random.Generator], Building] = as_mapped
    clutter: float = 0.0
    draw_map: Callable[[Segments, np.random.Generator], DrawnMap] = exact
    laser: Callable[[Scanner, np.random.Generator], Scanner] = as_declared
    draw_laser: Callable[[np.random.Generator], Scanner] = any_laser
    corrected: bool = False
    stranger: Stranger | None = None


def _to_scale(share: float) -> Callable[[Segments, np.random.Generator], DrawnMap]:
    """Return how a map is drawn too large or too small by a share."""
    return lambda segments, rng: stretched(segments, (1.0 + _sign(rng) * share) * np.eye(2))


def _sheared(segments: Segments, rng: np.random.Generator) -> DrawnMap:
    """Draw a map of which one axis leans by 1 % and the other is 1 % too long."""
    return stretched(segments, np.array([[1.0, _sign(rng) * 0.01], [0.0, 1.0 + _sign(rng) * 0.01]]))


def _off_by(sigma: float) -> Callable[[Segments, np.random.Generator], DrawnMap]:
    return lambda segments, rng: walls_off(segments, rng, sigma)


def _with_some_error(segments: Segments, rng: np.random.Generator) -> DrawnMap:
    """Draw a map that is wrong in one of the ways that maps are."""
    errors = (_to_scale(0.01), _sheared, _off_by(0.02), _off_by(0.05), lambda s, r: in_pieces(s, r, 0.02))
    return errors[rng.integers(len(errors))](segments, rng)


def _biased(scanner: Scanner, rng: np.random.Generator) -> Scanner:
    return replace(scanner, bias=_sign(rng) * 0.02)


def _noisier(scanner: Scanner, _rng: np.random.Generator) -> Scanner:
    return replace(scanner, sigma=2.0 * scanner.sigma)


def _wrong_step(scanner: Scanner, rng: np.random.Generator) -> Scanner:
    return replace(scanner, angle_increment=scanner.angle_increment * (1.0 + _sign(rng) * WRONG_STEP))


def _turning(scanner: Scanner, rng: np.random.Generator) -> Scanner:
    """Let the laser sweep more or less than declared, for it turns with its robot; the pose is that of mid-sweep."""
    share = 1.0 + _sign(rng) * TURNING * SWEEP / math.tau
    return replace(scanner, angle_min=scanner.angle_min * share, angle_increment=scanner.angle_increment * share)


def _saturated(scanner: Scanner, _rng: np.random.Generator) -> Scanner:
    return replace(scanner, saturated=True)


def _upside_down(scanner: Scanner, _rng: np.random.Generator) -> Scanner:
    return replace(scanner, angle_min=-scanner.angle_min, angle_increment=-scanner.angle_increment)


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


CONDITIONS: dict[str, Condition] = {
    "clean": Condition("nothing"),
    "changed": Condition("a fifth of what can move is moved or gone, a fifth of the doors shut", today=rearranged),
    "doors": Condition("every doorway has a leaf: half are shut, half stand open", today=with_doors),
    "clutter_33": Condition("a third of the beams end on people and pallets", clutter=0.33),
    "clutter_66": Condition("two thirds of the beams end on people and pallets", clutter=0.66),
    "scaled_1": Condition("the map is too large or too small by 1 %", draw_map=_to_scale(0.01)),
    "scaled_2": Condition("the map is too large or too small by 2 %", draw_map=_to_scale(0.02)),
    "sheared": Condition("the map leans by 1 %, and one of its axes is off by 1 %", draw_map=_sheared),
    "walls_5mm": Condition("each wall of the map is off by 5 mm", draw_map=_off_by(0.005)),
    "walls_2cm": Condition("each wall of the map is off by 2 cm", draw_map=_off_by(0.02)),
    "walls_5cm": Condition("each wall of the map is off by 5 cm", draw_map=_off_by(0.05)),
    "cut": Condition("each wall is off by 2 cm and cut into pieces",
                     draw_map=lambda segments, rng: in_pieces(segments, rng, 0.02)),
    "bias": Condition("all ranges are too long or too short by 2 cm", laser=_biased),
    "noisier": Condition("the noise is declared two times too small", laser=_noisier),
    "wrong_step": Condition("the angle between two beams is declared wrong by half a percent",
                            laser=_wrong_step, draw_laser=laser_of_270_degrees),
    "turning": Condition("the robot turns at 90 degrees/s, ten scans a second", laser=_turning,
                         draw_laser=laser_of_270_degrees),
    "turning_corrected": Condition("the robot turns at 90 degrees/s and corrects its scan for it",
                                   laser=_turning, draw_laser=laser_of_270_degrees, corrected=True),
    "saturated": Condition("a beam without return reads range_max", laser=_saturated),
    "unmapped": Condition("from a part of the building that is not mapped", stranger=Stranger.UNMAPPED),
    "sister": Condition("in another building of the same style", stranger=Stranger.SISTER),
    "other_type": Condition("in another kind of building", stranger=Stranger.OTHER_TYPE),
    "mirrored": Condition("from a laser mounted upside down", laser=_upside_down, stranger=Stranger.MIRRORED),
    # If only out-of-map scans had exact maps, an error of the map would seem to prove that the robot is in it.
    "rough": Condition("the map has one of the errors above, and the building has changed", today=rearranged,
                       draw_map=_with_some_error),
    "rough_unmapped": Condition("unmapped, and rough", today=rearranged, draw_map=_with_some_error,
                                stranger=Stranger.UNMAPPED),
    "rough_sister": Condition("sister, and rough", today=rearranged, draw_map=_with_some_error,
                              stranger=Stranger.SISTER),
    "rough_other_type": Condition("other_type, and rough", today=rearranged, draw_map=_with_some_error,
                                  stranger=Stranger.OTHER_TYPE),
    "rough_mirrored": Condition("mirrored, and rough", today=rearranged, draw_map=_with_some_error,
                                laser=_upside_down, stranger=Stranger.MIRRORED),
    "narrow": Condition("from a laser that sees little, in a building that has changed", today=rearranged,
                        draw_laser=short_sighted),
    "narrow_unmapped": Condition("unmapped, and narrow", today=rearranged, draw_laser=short_sighted,
                                 stranger=Stranger.UNMAPPED),
    "narrow_sister": Condition("sister, and narrow", today=rearranged, draw_laser=short_sighted,
                               stranger=Stranger.SISTER),
    "window": Condition("in a window that does not hold the truth", stranger=Stranger.WINDOW),
}  # fmt: skip
