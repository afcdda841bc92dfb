"""The curves of a verdict's model: fitted by likelihood, each rising or falling throughout where its feature speaks so.

Beside them stand pairs of features of which the one counts as far as the other does too, or where the other does not;
these never go the wrong way either.

More of what speaks for an answer must not make the verdict less sure of it. Free curves do so where few examples hold
them, and what they win on the buildings that they were fitted on they lose on others.

Out-of-map scans that cannot be recognized are left out of a fit: the scan agrees with the map, although it was taken
elsewhere. All that these would teach is to mistrust a scan that fits without fault.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar

from association.verdict.features import Features
from association.verdict.models import LEAST, Curve, Model, Pair
from association.verdict.roles import AGAINST, FOR, ROLES
from association.verdict.tuning import NO_MATCH_PROBABILITY

from .examples import DRAWN, DRAWN_STRANGERS, Example

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
SignedPair = tuple[str, str, str]

BENDS = (0.2, 0.5, 0.8)  # quantiles of a feature at which its curve may bend
IN_FULL = (0.05, 0.95)  # quantiles of a feature between which it counts in a pair
RIDGE = 3.0  # on slopes of standardised features, in units of one answer; cross-validated
LEAST_BESIDE = 0.03  # share of the examples that lies on either side of a bend,
LEAST_PIECE = 0.02  # and of what the values come to in all that lies between two
# A scan of a real plan or log counts as that many of drawn buildings, of which there are as many as one cares to draw.
REAL = 3.0
MOST_ON_MAP = 20.0  # nats


@dataclass(frozen=True, slots=True)
class Task:
    """A model to be fitted.

    Attributes
    ----------
    form : str
        Of the scans.
    names : tuple of str
        The features, with the constant.
    pairs : tuple of (str, str, str)
        The kind and both names, each behind the sign by which it speaks for an answer: ("least", "+misfit", "-null").
    bends : tuple of float
        Quantiles of each feature at which its curve may bend.
    """

    form: str
    names: tuple[str, ...]
    pairs: tuple[SignedPair, ...] = ()
    bends: tuple[float, ...] = BENDS


@dataclass(frozen=True, slots=True)
class Answers:
    """Some examples as arrays, (n,) if not stated otherwise.

    Attributes
    ----------
    features, before_null : (n, d) float64
        In the order of `Features`, with the null score and with the least one.
    among, least : float64
        Probability of the answer among its alternatives: the mean, and the least of three comparisons.
    right, away, fixed : bool
        True if the answer is right; if the scan is of another building; if the walls fix the pose.
    told : bool
        True if the answer is right, or if the scan shows that it is wrong.
    weights : float64
    folds : str
    """

    features: Floats
    before_null: Floats
    among: Floats
    least: Floats
    right: Flags
    away: Flags
    fixed: Flags
    told: Flags
    weights: Floats
    folds: NDArray[np.str_]

    @classmethod
    def of(cls, examples: Sequence[Example]) -> Answers:
        """Return the arrays of some examples."""
        drawn = np.array([e.group in (DRAWN, DRAWN_STRANGERS) for e in examples])
        return cls(
            np.array([e.features for e in examples], np.float64).reshape(len(examples), -1),
            np.array([e.before_null for e in examples], np.float64).reshape(len(examples), -1),
            np.array([e.among.mean for e in examples]),
            np.array([e.among.least for e in examples]),
            np.array([e.right for e in examples], bool),
            np.array([e.stranger for e in examples], bool),
            np.array([not e.degenerate for e in examples], bool),
            np.array([e.told or not e.stranger for e in examples], bool),
            np.where(drawn, 1.0, REAL),
            np.array([e.fold for e in examples]),
        )

    def where(self, mask: Flags) -> Answers:
        """Return some of the answers."""
        return Answers(**{field.name: getattr(self, field.name)[mask] for field in fields(self)})

    def column(self, name: str) -> Floats:
        """Return the values of a feature."""
        return self.features[:, Features._fields.index(name)]


def logits(model: Model, features: Floats) -> Floats:
    """Return the logarithm of the odds for each row of features, (n,)."""
    total = np.zeros(len(features))
    place = Features._fields.index
    for name, curve in model.curves.items():
        values = features[:, place(name)]
        total += curve.slope * values
        for start, more in curve.bends:
            total += more * np.maximum(0.0, values - start)
    for pair in model.pairs:
        total += pair.nats * term_of_pair(pair, features)
    return total


def term_of_pair(pair: Pair, features: Floats) -> Floats:
    """Return how far a pair counts, (n,), 0 to 1."""
    one, other = (
        np.clip((features[:, Features._fields.index(name)] - start) / (full - start), 0.0, 1.0)
        for name, (start, full) in zip((pair.first, pair.second), pair.from_to, strict=True)
    )
    return np.asarray((np.minimum if pair.kind == LEAST else np.maximum)(one, other))


def fitted_to(model: Model, answers: Answers) -> Floats:
    """Return the probability that each answer is right, out-of-map scans included: that which is fitted."""
    return np.asarray(answers.among * logistic(logits(model, answers.features)))


def careful(model: Model, answers: Answers) -> Floats:
    """Return the same where the least comparison with the alternatives counts: that which decides."""
    return np.asarray(answers.least * logistic(logits(model, answers.features)))


def likely(model: Model, answers: Answers) -> Floats:
    """Return the probability that each answer is right where its scan is known to be of the map."""
    return np.asarray(answers.among * logistic(logits(model, answers.before_null) + model.on_map))


def logistic(values: Floats) -> Floats:
    """Return probabilities from the logarithms of their odds."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(values, -500.0, 500.0))))


def log_loss(probabilities: Floats, answers: Answers) -> float:
    """Return the mean of minus the log of the probability of what happened, nats; of those that could be told."""
    p = np.clip(probabilities, 1e-12, 1.0 - 1e-12)
    weights = answers.weights * answers.told
    return float(-(weights * np.where(answers.right, np.log(p), np.log1p(-p))).sum() / weights.sum())


def knots(values: Floats, quantiles: Sequence[float]) -> tuple[float, ...]:
    """Return where the curve of a feature may bend: at quantiles of its values that have enough on either side."""
    least, greatest = float(values.min()), float(values.max())
    apart, found = LEAST_PIECE * (greatest - least), [least]
    for k in np.unique(np.quantile(values, quantiles)).tolist():
        enough = min(np.mean(values < k), np.mean(values > k)) >= LEAST_BESIDE
        if enough and k - found[-1] >= apart and greatest - k >= apart:
            found.append(k)
    return tuple(found[1:])


def pieces(values: Floats, bends: Sequence[float]) -> Floats:
    """Return how far values go into each piece of the axis between bends: (n, bends + 1), their sum the value."""
    edges = np.array([-np.inf, *bends, np.inf])
    starts = np.where(np.isfinite(edges[:-1]), edges[:-1], 0.0)
    return np.asarray(np.clip(values[:, None], edges[:-1], edges[1:]) - starts)


def pair_between(answers: Answers, kind: str, *signed: str) -> Pair:
    """Return a pair of features that adds up to one nat."""
    from_to = []
    for name in signed:
        low, high = np.quantile(answers.column(name[1:]), IN_FULL).tolist()
        high = max(high, low + 1e-9)
        from_to.append((low, high) if name[0] == "+" else (high, low))
    one, other = signed
    return Pair(kind, one[1:], other[1:], 1.0, (from_to[0], from_to[1]))


def fit(answers: Answers, task: Task) -> Model:
    """Find the curves of greatest likelihood, with a pull towards 0 on the slopes of standardised pieces.

    Then the term of a map that is known, by the answers that state a probability to scans of their map.
    """
    answers = answers.where(answers.told)
    bends: dict[str, tuple[float, ...]] = {}
    columns, bounds = [np.ones((len(answers.right), 1))], [(-np.inf, np.inf)]
    for name in task.names:
        if name == "constant":
            continue
        values = answers.column(name)
        bends[name] = knots(values, task.bends)
        columns.append(pieces(values, bends[name]))
        sign = ROLES[name].sign
        bounds += [(0.0 if sign == FOR else -np.inf, 0.0 if sign == AGAINST else np.inf)] * (len(bends[name]) + 1)
    pairs = [pair_between(answers, *pair) for pair in task.pairs]
    for pair in pairs:
        columns.append(term_of_pair(pair, answers.features)[:, None])
        bounds.append((0.0, np.inf))
    w = _most_likely(answers, np.hstack(columns), bounds)
    curves, at = {"constant": Curve(float(w[0]))}, 1
    for name, places in bends.items():
        slopes = w[at : at + len(places) + 1]
        changes = np.diff(slopes).tolist()
        curves[name] = Curve(float(slopes[0]), tuple(zip(places, changes, strict=True)))
        at += len(slopes)
    fitted = tuple(replace(pair, nats=float(nats)) for pair, nats in zip(pairs, w[at:], strict=True))
    model = Model(curves, fitted)
    stated = logits(model, answers.before_null) >= math.log(NO_MATCH_PROBABILITY / (1.0 - NO_MATCH_PROBABILITY))
    return replace(model, on_map=_on_map(model, answers.where(~answers.away & answers.fixed & stated)))


def _most_likely(answers: Answers, raw: Floats, bounds: list[tuple[float, float]]) -> Floats:
    """Return the coefficients of some columns, (n, k); the first is constant."""
    middle, scale = raw.mean(axis=0), raw.std(axis=0)
    middle[0], scale[0] = 0.0, 1.0
    scale[scale < 1e-9] = np.inf  # what never changes says nothing
    z = (raw - middle) / scale
    pulled = np.arange(z.shape[1]) > 0

    def loss(w: Floats) -> tuple[float, Floats]:
        s = logistic(z @ w)
        p = np.clip(s * answers.among, 1e-12, 1.0 - 1e-12)
        nats = np.where(answers.right, np.log(p), np.log1p(-p))
        # With p = s among: d log(p) = 1 - s, d log(1 - p) = -p (1 - s) / (1 - p), by the logit.
        slope = -answers.weights * np.where(answers.right, 1.0 - s, -p * (1.0 - s) / (1.0 - p))
        total = -(answers.weights * nats).sum() + RIDGE * (w[pulled] ** 2).sum()
        return float(total), z.T @ slope + 2.0 * RIDGE * np.where(pulled, w, 0.0)

    start = np.zeros(z.shape[1])
    w = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 1000}).x / scale
    w[0] -= w[1:] @ middle[1:]
    return np.asarray(w)


def _on_map(model: Model, here: Answers) -> float:
    """Return what a scan has more that is known to be of the map, nats, by answers to scans of their map."""

    def loss(more: float) -> float:
        return log_loss(likely(replace(model, on_map=more), here), here)

    return float(minimize_scalar(loss, bounds=(0.0, MOST_ON_MAP), method="bounded").x) if len(here.right) else 0.0
