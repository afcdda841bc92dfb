"""The fitted models of the verdict, read from the file that ``python -m benchmarks.calibration --write`` makes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from .features import Features

FILE = "models.json"

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Curve:
    """What one feature adds to the logarithm of the odds: a line that bends at some values.

    Attributes
    ----------
    slope : float
        Nats per unit of the feature, below the first bend.
    bends : tuple of (float, float)
        From which value on the slope is more, and by how much.
    """

    slope: float
    bends: tuple[tuple[float, float], ...] = ()

    def __call__(self, value: float) -> float:
        """Return what a value adds, nats."""
        return self.slope * value + sum(more * (value - start) for start, more in self.bends if value > start)


@dataclass(frozen=True, slots=True)
class Model:
    """A generalised additive model: the logarithm of the odds is a sum of curves, one for each feature.

    Attributes
    ----------
    curves : mapping
        By the name of the feature, of `Features`.
    """

    curves: Mapping[str, Curve]

    def logit(self, features: Features) -> float:
        """Return the logarithm of the odds."""
        return sum(curve(getattr(features, name)) for name, curve in self.curves.items())

    def part(self, features: Features, names: Sequence[str]) -> float:
        """Return what some features add to it; those that do not count add nothing."""
        return sum(self.curves[name](getattr(features, name)) for name in names if name in self.curves)


def as_model(document: Mapping[str, Sequence[float]]) -> Model:
    """Read a model: for each feature its slope, then the value and the change of slope of each bend in turn."""
    curves = {}
    for name, (slope, *rest) in document.items():
        curves[name] = Curve(slope, tuple(zip(rest[::2], rest[1::2], strict=True)))
    return Model(curves)


def as_document(model: Model) -> dict[str, list[float]]:
    """Do the opposite of `as_model`."""
    return {
        name: [float(f"{value:.4g}") for value in (curve.slope, *(v for bend in curve.bends for v in bend))]
        for name, curve in model.curves.items()
    }


def _read() -> tuple[dict[str, Model], dict[str, str], Features]:
    document = json.loads(files(__package__).joinpath(FILE).read_bytes())
    models = {name: as_model(curves) for name, curves in document["models"].items()}
    return models, document["fitted_on"], Features(**document["usual"])


# "probability", for scans that are known to be of this map, and "cautious", where scans of other buildings are reckoned
# with; each also "_with_beams". What each was fitted on, and the medians of the features of right answers.
MODELS, FITTED_ON, USUAL = _read()
