"""The fitted model of the verdict: odds against an answer, on this map and elsewhere."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from .features import Features

FILE = "models.json"
WRONG, ELSEWHERE = "wrong", "elsewhere"  # the two ways in which an answer is not right


@dataclass(frozen=True, slots=True)
class Curve:
    """The contribution of one feature to a logarithm of odds: a line that bends at some values."""

    slope: float
    bends: tuple[tuple[float, float], ...] = ()

    def at(self, value: float) -> float:
        """Return the contribution at a value of the feature, nats."""
        return self.slope * value + sum(more * (value - start) for start, more in self.bends if value > start)


@dataclass(frozen=True, slots=True)
class Odds:
    """The logarithm of the odds for an answer against one way of being not right: a constant and a curve a feature."""

    constant: float
    curves: Mapping[str, Curve]

    def terms(self, features: Features) -> dict[str, float]:
        """Return the term of each feature, nats."""
        return {name: curve.at(getattr(features, name)) for name, curve in self.curves.items()}

    def at(self, features: Features) -> float:
        """Return the logarithm of the odds."""
        return self.constant + sum(curve.at(getattr(features, name)) for name, curve in self.curves.items())


@dataclass(frozen=True, slots=True)
class Model:
    """The probability of an answer by its features.

    Attributes
    ----------
    wrong, elsewhere : Odds
        Against another pose of this map, and against a scan that was taken elsewhere.
    on_map : float
        Fraction of the scans that the model was fitted to that were taken on their map.
    """

    wrong: Odds
    elsewhere: Odds
    on_map: float

    def log_odds(self, features: Features, on_map: float) -> float:
        """Return the logarithm of the odds that an answer is right.

        ``1 / odds = exp(-a) + exp(-b) k`` with the log odds a against another pose and b against another place; k is
        the ratio of the prior odds of another place to those in the data of the fit.
        """
        return -math.log(max(sum(self._against(features, on_map)), 1e-300))

    def _against(self, features: Features, on_map: float) -> tuple[float, float]:
        """Return the odds of another pose, and of another place, against an answer."""
        prior = (1.0 - on_map) / on_map * self.on_map / (1.0 - self.on_map)
        wrong, elsewhere = (
            math.exp(-min(500.0, max(-500.0, odds.at(features)))) for odds in (self.wrong, self.elsewhere)
        )
        return wrong, prior * elsewhere

    def probability(self, features: Features, on_map: float) -> float:
        """Return the probability that an answer is right, before its alternatives are counted."""
        return 1.0 / (1.0 + sum(self._against(features, on_map)))

    def elsewhere_probability(self, features: Features, on_map: float) -> float:
        """Return the probability that a scan was taken elsewhere."""
        wrong, elsewhere = self._against(features, on_map)
        return elsewhere / (1.0 + wrong + elsewhere)


def as_odds(document: Mapping[str, list[float]]) -> Odds:
    """Read odds: ``{"constant": [nats], feature: [slope, start of a bend, change of slope, ...]}``."""
    curves = {
        name: Curve(slope, tuple(zip(rest[::2], rest[1::2], strict=True)))
        for name, (slope, *rest) in document.items()
        if name != "constant"
    }
    return Odds(document["constant"][0], curves)


def as_model(document: Mapping[str, Any]) -> Model:
    """Read a model."""
    return Model(as_odds(document[WRONG]), as_odds(document[ELSEWHERE]), float(document["on_map"]))


def _read() -> tuple[dict[str, Model], dict[str, Any], Features]:
    document = json.loads(files(__package__).joinpath(FILE).read_bytes())
    models = {name: as_model(part) for name, part in document["models"].items()}
    usual = Features._make(document["usual"].get(name, 0.0) for name in Features._fields)
    return models, document["manifest"], usual


# By the form of the scan, "segments" or "ranges". Their manifest, see `benchmarks.manifest`, and the medians of the
# features of right answers.
MODELS, MANIFEST, USUAL = _read()
