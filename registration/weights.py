"""Weights of the pairs, and their noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .correspondences import MIN_SIGMA, Correspondences
from .errors import InvalidArgumentError
from .layout import Floats
from .limits import MAX_SIGMA
from .options import RegistrationOptions

MIN_WEIGHT, MAX_WEIGHT = 1e-100, 1e100  # squares and products with 1e9 m squared stay finite


@dataclass(frozen=True, slots=True, eq=False)
class PairWeights:
    """Weights of n pairs; a pair that does not count has 0 in each.

    Attributes
    ----------
    used : (n,)
        The weights of the estimator and the ambiguities.
    information : (n,) 1/m^2
        1 / variance of chi2 and the covariance: the caller's own weights, or else the noise, or else `used`.
    noise : (n,) 1/m^2, or None
        1 / variance by the sigmas; None where a pair has none. True if a set is degenerate is a question of noise, and
        not of how a caller weighs.
    """

    used: Floats
    information: Floats
    noise: Floats | None

    def take(self, rows: NDArray[np.bool_]) -> PairWeights:
        """Return those of some of the pairs."""
        used = self.used[rows]
        information = used if self.information is self.used else self.information[rows]
        return PairWeights(used, information, None if self.noise is None else self.noise[rows])


def weigh(pairs: Correspondences, map_sigma: float, options: RegistrationOptions) -> PairWeights:
    """Weigh pairs as `options` say.

    Raises
    ------
    InvalidArgumentError
        ``map.sigma`` out of range; ``weights`` of a wrong length, negative, not finite, beyond 1e-100 to 1e100, or all
        zero; ``scan.sigma`` when information weighting meets a pair without any noise.
    """
    if not (math.isfinite(map_sigma) and 0.0 <= map_sigma <= MAX_SIGMA):
        raise InvalidArgumentError(
            f"expected a number from 0 to {MAX_SIGMA:g}, found {map_sigma:g}", argument="map.sigma"
        )
    floored = max(float(map_sigma), MIN_SIGMA) if map_sigma > 0.0 else 0.0
    variances = pairs.variances + floored**2
    noise = 1.0 / variances if (variances > 0.0).all() else None
    if options.weights is not None:
        given = _checked_weights(options.weights, len(pairs))
        return PairWeights(given, given, None if noise is None else np.where(given > 0.0, noise, 0.0))
    if options.weighting == "information":
        if noise is None:
            raise InvalidArgumentError(
                "sigma of scan and map are both 0, expected one above 0; set sigma, or other weights",
                argument="scan.sigma",
            )
        return PairWeights(noise, noise, noise)
    used = (
        np.minimum(pairs.lengths, pairs.map_lengths) if options.weighting == "shorter_length" else np.ones(len(pairs))
    )
    return PairWeights(used, used if noise is None else noise, noise)


def _checked_weights(weights: ArrayLike, count: int) -> Floats:
    try:
        array = np.asarray(weights)
    except (ValueError, OverflowError) as error:
        raise InvalidArgumentError("expected one number per correspondence", argument="weights") from error
    if array.shape != (count,):
        raise InvalidArgumentError(f"expected shape ({count},), found {array.shape}", argument="weights")
    if count and array.dtype.kind not in "fiu":
        raise InvalidArgumentError(f"expected numbers, found {array.dtype}", argument="weights")
    array = array.astype(np.float64)
    # Written so that NaN is bad.
    bad = ~((array == 0.0) | ((array >= MIN_WEIGHT) & (array <= MAX_WEIGHT)))
    if bad.any():
        index = int(np.argmax(bad))
        raise InvalidArgumentError(
            f"expected 0 or a number from {MIN_WEIGHT:g} to {MAX_WEIGHT:g}, found {array[index]:g}",
            argument="weights",
            index=index,
        )
    if count and not array.any():
        raise InvalidArgumentError("all weights are 0, expected at least one above 0", argument="weights")
    return array
