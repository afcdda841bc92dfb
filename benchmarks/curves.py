"""The curves of a verdict's model: fitted by likelihood, each rising or falling throughout where its feature speaks so.

Beside them stand pairs of features of which the one counts as far as the other does too, or where the other does not;
these never go the wrong way either.

More of what speaks for an answer must not make the verdict less sure of it. Free curves do so where few examples hold
them, and what they win on the buildings that they were fitted on they lose on others.

Out-of-map scans that cannot be recognized are left out of a fit: the scan agrees with the map, although it was taken
elsewhere. All that these would teach is to mistrust a scan that fits without fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from association.verdict.models import Curve, Model, Pair
from association.verdict.roles import AGAINST, FOR, ROLES

from .examples import DRAWN, DRAWN_STRANGERS, Example

IN_FULL = (0.05, 0.95)  # quantiles of a feature between which it counts in a pair
RIDGE = 3.0  # on slopes of standardised features, in units of one answer; cross-validated
LEAST_BESIDE = 0.03  # share of the examples that lies on either side of a bend,
LEAST_PIECE = 0.02  # and of what the values come to in all that lies between two
# A scan of a real plan or log counts as that many of drawn buildings, of which there are as many as one cares to draw.
REAL = 3.0


@dataclass(frozen=True, slots=True)
class Task:
    """A model to be fitted.

    Attributes
    ----------
    name : str
        As in the file.
    strangers : float
        Weight of a scan of another building.
    current : Model
        The one in the file.
    names : tuple of str
        The features of the new one.
    bends : tuple of float
        Quantiles of each at which its curve may bend.
    pairs : tuple of (str, str, str)
        The kind and both names, each behind the sign by which it speaks for an answer: ("least", "+misfit", "-null").
    """

    name: str
    strangers: float
    current: Model
    names: tuple[str, ...]
    bends: tuple[float, ...]
    pairs: tuple[tuple[str, str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model with the temperature of similar places, nats."""

    model: Model
    temperature: float

    def probabilities(self, examples: Sequence[Example]) -> np.ndarray:
        """Return the chance that each answer is right."""
        logits = np.array([self.model.logit(e.features) for e in examples])
        return np.asarray(_shares(examples, self.temperature) / (1.0 + np.exp(-logits)))


def _shares(examples: Sequence[Example], temperature: float) -> np.ndarray:
    return np.array([1.0 / (1.0 + (e.counted * np.exp(e.gaps / temperature)).sum()) for e in examples])


def _weights(examples: Sequence[Example], strangers: float) -> np.ndarray:
    drawn = np.array([e.group in (DRAWN, DRAWN_STRANGERS) for e in examples])
    away = np.array([e.stranger for e in examples])
    return np.where(drawn, 1.0, REAL) * np.where(away, strangers, 1.0)


def tellable(examples: Sequence[Example]) -> list[Example]:
    """Return the answers without those of out-of-map scans that cannot be recognized."""
    return [e for e in examples if e.told or not e.stranger]


def log_loss(probabilities: np.ndarray, examples: Sequence[Example], strangers: float) -> float:
    """Return the mean of minus the log of the chance given to what happened, nats."""
    p = np.clip(probabilities, 1e-12, 1.0 - 1e-12)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, strangers)
    return float(-(weights * np.where(right, np.log(p), np.log1p(-p))).sum() / weights.sum())


def knots(values: np.ndarray, quantiles: Sequence[float]) -> tuple[float, ...]:
    """Return where the curve of a feature may bend: at quantiles of its values that have enough on either side."""
    least, greatest = float(values.min()), float(values.max())
    apart, found = LEAST_PIECE * (greatest - least), [least]
    for k in np.unique(np.quantile(values, quantiles)).tolist():
        enough = min(np.mean(values < k), np.mean(values > k)) >= LEAST_BESIDE
        if enough and k - found[-1] >= apart and greatest - k >= apart:
            found.append(k)
    return tuple(found[1:])


def pieces(values: np.ndarray, bends: Sequence[float]) -> np.ndarray:
    """Return how far values go into each piece of the axis between bends: (n, bends + 1), their sum the value."""
    edges = np.array([-np.inf, *bends, np.inf])
    starts = np.where(np.isfinite(edges[:-1]), edges[:-1], 0.0)
    return np.asarray(np.clip(values[:, None], edges[:-1], edges[1:]) - starts)


def fit(examples: Sequence[Example], task: Task, temperature: float) -> Fitted:
    """Find the curves of greatest likelihood, with a pull towards 0 on the slopes of standardised pieces."""
    examples = tellable(examples)
    bends: dict[str, tuple[float, ...]] = {}
    columns, bounds = [np.ones((len(examples), 1))], [(-np.inf, np.inf)]
    for name in task.names:
        if name == "constant":
            continue
        values = np.array([getattr(e.features, name) for e in examples])
        bends[name] = knots(values, task.bends)
        columns.append(pieces(values, bends[name]))
        sign = ROLES[name].sign
        bounds += [(0.0 if sign == FOR else -np.inf, 0.0 if sign == AGAINST else np.inf)] * (len(bends[name]) + 1)
    pairs = [_pair(examples, kind, one, other) for kind, one, other in task.pairs]
    for pair in pairs:
        alone = Model({}, (pair,))
        columns.append(np.array([[alone.logit(e.features)] for e in examples]))
        bounds.append((0.0, np.inf))
    raw = np.hstack(columns)
    middle, scale = raw.mean(axis=0), raw.std(axis=0)
    middle[0], scale[0] = 0.0, 1.0
    scale[scale < 1e-9] = np.inf  # what never changes says nothing
    z, shares = (raw - middle) / scale, _shares(examples, temperature)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, task.strangers)
    pulled = np.arange(z.shape[1]) > 0

    def loss(w: np.ndarray) -> tuple[float, np.ndarray]:
        s = 1.0 / (1.0 + np.exp(-np.clip(z @ w, -500.0, 500.0)))
        p = np.clip(s * shares, 1e-12, 1.0 - 1e-12)
        total = -(weights * np.where(right, np.log(p), np.log1p(-p))).sum() + RIDGE * (w[pulled] ** 2).sum()
        # With p = s share: d log(p) = 1 - s, d log(1 - p) = -p (1 - s) / (1 - p), by the logit.
        slope = -weights * np.where(right, 1.0 - s, -p * (1.0 - s) / (1.0 - p))
        return float(total), z.T @ slope + 2.0 * RIDGE * np.where(pulled, w, 0.0)

    start = np.zeros(z.shape[1])
    w = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 1000}).x / scale
    curves, at = {"constant": Curve(float(w[0] - w[1:] @ middle[1:]))}, 1
    for name, places in bends.items():
        slopes = w[at : at + len(places) + 1]
        changes = np.diff(slopes).tolist()
        curves[name] = Curve(float(slopes[0]), tuple(zip(places, changes, strict=True)))
        at += len(slopes)
    fitted = (replace(pair, nats=float(nats)) for pair, nats in zip(pairs, w[at:], strict=True))
    return Fitted(Model(curves, tuple(fitted)), temperature)


def _pair(examples: Sequence[Example], kind: str, *signed: str) -> Pair:
    """Return a pair that adds up to one nat."""
    from_to = []
    for name in signed:
        low, high = np.quantile([getattr(e.features, name[1:]) for e in examples], IN_FULL).tolist()
        from_to.append((low, high) if name[0] == "+" else (high, low))
    one, other = signed
    return Pair(kind, one[1:], other[1:], 1.0, (from_to[0], from_to[1]))
