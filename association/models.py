"""The fitted models of the verdict, read from the file that ``python -m benchmarks.calibration --write`` makes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from .features import Features

FILE = "models.json"


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """A logistic model: the logarithm of the odds is linear in some features.

    Attributes
    ----------
    names : tuple of str
        Of `Features`.
    coefficients : (k,) by name
    """

    names: tuple[str, ...]
    coefficients: NDArray[np.float64]

    def logit(self, features: Features) -> float:
        """Return the logarithm of the odds."""
        return float(np.array([getattr(features, name) for name in self.names]) @ self.coefficients)

    def coefficient(self, name: str) -> float:
        """Return what a feature is multiplied with, 0 for one that does not count."""
        return float(self.coefficients[self.names.index(name)]) if name in self.names else 0.0


def _read() -> dict[str, Model]:
    document = json.loads(files(__package__).joinpath(FILE).read_bytes())
    return {
        name: Model(tuple(terms), np.array(list(terms.values()), dtype=np.float64))
        for name, terms in document["models"].items()
    }


_MODELS = _read()
# For scans of segments that are known to be of this map, and where scans of other buildings are reckoned with.
PROBABILITY, CAUTIOUS = _MODELS["probability"], _MODELS["cautious"]
# With raw beams, which tell a wrong place by themselves, one model does for both.
WITH_BEAMS = _MODELS["with_beams"]
