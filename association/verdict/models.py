"""The fitted models of the verdict, read from the file that ``python -m benchmarks.calibration --write`` makes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..layout import BEND, CURVE, TWO_FEATURES
from ..tables import Odds
from .features import Features
from .kernels.odds import log_odds

FILE = "models.json"
LEAST, MOST = "least", "most"  # kinds of pairs
ON_MAP = "on_map"

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Curve:
    """The contribution of one feature to the logarithm of the odds: a line that bends at some values.

    Attributes
    ----------
    slope : float
        Nats per unit of the feature, below the first bend.
    bends : tuple of (float, float)
        From which value on the slope is more, and by how much.
    """

    slope: float
    bends: tuple[tuple[float, float], ...] = ()

    def at(self, value: float) -> float:
        """Return the contribution at a value of the feature, nats."""
        return self.slope * value + sum(more * (value - start) for start, more in self.bends if value > start)


@dataclass(frozen=True, slots=True)
class Pair:
    """The joint contribution of two features: the one counts as far as the other lets it.

    Attributes
    ----------
    kind : str
        `LEAST`: both have to speak for the answer. `MOST`: one of them is enough.
    first, second : str
        Names, of `Features`.
    nats : float
        The term that it adds where both are evidence for the answer.
    from_to : ((float, float), (float, float))
        For each the value that does not speak for the answer at all and the one that does in full. In between it is
        linear.
    """

    kind: str
    first: str
    second: str
    nats: float
    from_to: tuple[tuple[float, float], tuple[float, float]]

    @property
    def key(self) -> str:
        """Return the name of the pair in the file."""
        return f"{self.kind} {self.first} {self.second}"

    def at(self, first: float, second: float) -> float:
        """Return the contribution at values of both features, nats."""
        fractions = [
            min(1.0, max(0.0, (value - start) / (full - start)))
            for value, (start, full) in zip((first, second), self.from_to, strict=True)
        ]
        return self.nats * (min(fractions) if self.kind == LEAST else max(fractions))


@dataclass(frozen=True)
class Model:
    """An additive model: the logarithm of the odds is a sum of curves, one for each feature, and of some pairs of them.

    Attributes
    ----------
    curves : mapping
        By the name of the feature, of `Features`.
    pairs : tuple of Pair
    on_map : float
        Added to the logarithm of the odds where the robot is known to be on the map, nats. The rest of the model
        includes out-of-map scans.
    """

    curves: Mapping[str, Curve]
    pairs: tuple[Pair, ...] = ()
    on_map: float = 0.0

    def logit(self, features: Features | Floats) -> float:
        """Return the logarithm of the odds; for several models an array (n,) of the features is faster."""
        return float(log_odds(self.odds, np.asarray(features)))

    def terms(self, features: Features) -> dict[str, float]:
        """Return the terms of the logarithm of the odds, nats, by the names of features and the keys of pairs."""
        found = {name: curve.at(getattr(features, name)) for name, curve in self.curves.items()}
        for pair in self.pairs:
            found[pair.key] = pair.at(getattr(features, pair.first), getattr(features, pair.second))
        return found

    @cached_property
    def odds(self) -> Odds:
        """The same for the kernels."""
        place = Features._fields.index
        curves, bends = np.zeros(len(self.curves), CURVE), [bend for c in self.curves.values() for bend in c.bends]
        end = 0
        for row, (name, curve) in zip(curves, self.curves.items(), strict=True):
            end += len(curve.bends)
            row["feature"], row["begin"], row["end"], row["slope"] = (
                place(name),
                end - len(curve.bends),
                end,
                curve.slope,
            )
        pairs = [
            (place(pair.first), place(pair.second), pair.kind == LEAST, pair.nats, *pair.from_to[0], *pair.from_to[1])
            for pair in self.pairs
        ]
        return Odds(np.array(curves, CURVE), np.array(bends, BEND), np.array(pairs, TWO_FEATURES))


def as_model(document: Mapping[str, Sequence[float]]) -> Model:
    """Read a model.

    An entry of a feature has its slope, then the value and the change of slope of each bend in turn. The key of a pair
    is its kind and the names of both. Its entry has its term, then for each feature the values at which it begins to
    count and at which it counts in full. The entry `ON_MAP` has what is added on a map that is known.
    """
    curves, pairs, on_map = {}, [], 0.0
    for key, (first, *rest) in document.items():
        if key == ON_MAP:
            on_map = first
        elif " " in key:
            kind, one, other = key.split(" ")
            start, end, begin, finish = rest
            pairs.append(Pair(kind, one, other, first, ((start, end), (begin, finish))))
        else:
            curves[key] = Curve(first, tuple(zip(rest[::2], rest[1::2], strict=True)))
    return Model(curves, tuple(pairs), on_map)


def _read() -> tuple[dict[str, Model], dict[str, Any], Features]:
    document = json.loads(files(__package__).joinpath(FILE).read_bytes())
    models = {name: as_model(curves) for name, curves in document["models"].items()}
    return models, document["manifest"], Features(**document["usual"])


# By the form of the scan, "segments" or "ranges". Their manifest, see `benchmarks.manifest`, and the medians of the
# features of right answers.
MODELS, MANIFEST, USUAL = _read()
