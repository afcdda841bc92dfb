"""Options of a registration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from numpy.typing import ArrayLike

from .errors import InvalidArgumentError
from .transform import RigidTransform

Estimator = Literal["joint", "one_step"]
Rotation = Literal["wahba", "mitsuta"]
Weighting = Literal["uniform", "shorter_length", "information"]

MAX_COEFFICIENT = 1e30
MAX_TRANSLATION = 1e10  # m; no pose between two sets within 1e9 m of their origins lies farther out


@dataclass(frozen=True, slots=True)
class RegistrationOptions:
    """How to register.

    Attributes
    ----------
    estimator : "joint" or "one_step"
        Weighted least squares over rotation and translation together, or the paper's closed form (Eqs. 5 to 15), which
        takes the rotation first and depends on where the origin is.
    rotation : "wahba" or "mitsuta"
        The paper's average of angles: Eqs. (10) to (15) or Alg. 1. The joint estimator takes its starting angle from
        it and nothing else.
    k_translation, k_rotation : float
        The paper's coefficients of the two parts of the ambiguity, 0 to 1e30.
    evaluate_at : RigidTransform or None
        A further pose at which to evaluate the ambiguity.
    oriented : bool
        True if the directions of segments mean anything. If not, scan segments are turned round as one rotation wants.
    weighting : "uniform", "shorter_length" or "information"
        1; the length of the shorter segment of a pair in metres (Sec. 4.2); or
        ``1 / (sigma_scan^2 / points + sigma_map^2)``.
    weights : (n,) or None
        The information of each pair in 1/m^2, 0 or from 1e-100 to 1e100. Replaces `weighting`.

    Raises
    ------
    InvalidArgumentError
        When a value is not one of those above.
    """

    estimator: Estimator = "joint"
    rotation: Rotation = "wahba"
    k_translation: float = 1.0
    k_rotation: float = 1.0
    evaluate_at: RigidTransform | None = None
    oriented: bool = True
    weighting: Weighting = "information"
    weights: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name, choices in (("estimator", Estimator), ("rotation", Rotation), ("weighting", Weighting)):
            _require_choice(name, getattr(self, name), get_args(choices))
        for name in ("k_translation", "k_rotation"):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0.0 <= value <= MAX_COEFFICIENT):
                raise InvalidArgumentError(
                    f"expected a number from 0 to {MAX_COEFFICIENT:g}, found {value!r}", argument=f"options.{name}"
                )
        at = self.evaluate_at
        if at is not None and max(abs(at.x), abs(at.y)) > MAX_TRANSLATION:
            raise InvalidArgumentError(
                f"expected x and y within {MAX_TRANSLATION:g} m of 0, found ({at.x:g}, {at.y:g})",
                argument="options.evaluate_at",
            )


def _require_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise InvalidArgumentError(
            f"expected one of {', '.join(choices)}, found {str(value)[:40]!r}",
            argument=name if name == "weighting" else f"options.{name}",
        )
