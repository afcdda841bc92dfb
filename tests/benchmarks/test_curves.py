"""The fit of a verdict's model on drawn answers of known odds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from association.verdict.models import MODELS, USUAL, Curve
from association.verdict.roles import AGAINST, EITHER, FOR, ROLES
from benchmarks.curves import Task, fit, knots, log_loss, pieces
from benchmarks.examples import DRAWN_STRANGERS, SEGMENTS, Example

NONE = np.zeros(0)


def answers(share: np.ndarray, deviation: np.ndarray, right: np.ndarray) -> list[Example]:
    return [
        Example(
            SEGMENTS, "drawn", "clean", "world",
            USUAL._replace(inlier_fraction=float(s), deviation=float(d)), NONE, NONE,
            bool(r), degenerate=False, told=not r,
        )
        for s, d, r in zip(share, deviation, right, strict=True)
    ]  # fmt: skip


def drawn(slope: float, count: int = 4000) -> list[Example]:
    """Answers whose log-odds rise by `slope` per unit of the share from -2 on, and do not depend on the deviation."""
    rng = np.random.default_rng(5)
    share, deviation = rng.uniform(0.0, 1.0, count), rng.uniform(0.0, 0.2, count)
    return answers(share, deviation, rng.uniform(size=count) < 1.0 / (1.0 + np.exp(2.0 - slope * share)))


def task(bends: tuple[float, ...]) -> Task:
    return Task("cautious", 1.0, MODELS["cautious"], ("constant", "inlier_fraction", "deviation"), bends)


def slopes(curve: Curve) -> Sequence[float]:
    return [float(s) for s in np.cumsum([curve.slope, *(more for _, more in curve.bends)])]


def test_the_fit_finds_the_odds_that_answers_were_drawn_with() -> None:
    found = fit(drawn(6.0), task(()), 1.0).model.curves
    assert found["inlier_fraction"].slope == pytest.approx(6.0, rel=0.1)
    assert found["constant"].slope == pytest.approx(-2.0, abs=0.3)
    assert abs(found["deviation"].slope) < 1.5  # of 0.2 that it may be: less than 0.3 nats


def test_a_curve_never_falls_where_its_feature_speaks_for_an_answer() -> None:
    found = fit(drawn(-6.0), task((0.2, 0.5, 0.8)), 1.0).model.curves
    assert len(found["inlier_fraction"].bends) == 3
    assert slopes(found["inlier_fraction"]) == pytest.approx([0.0] * 4, abs=1e-12)


def test_strangers_that_nobody_could_tell_teach_nothing() -> None:
    scans, ones = drawn(6.0), np.ones(2000)
    perfect = [
        replace(e, group=DRAWN_STRANGERS, right=False, told=False) for e in answers(ones, 0.0 * ones, 0.0 * ones)
    ]
    assert fit([*scans, *perfect], task((0.5,)), 1.0) == fit(scans, task((0.5,)), 1.0)
    told = [replace(e, told=True) for e in perfect]
    assert fit([*scans, *told], task((0.5,)), 1.0) != fit(scans, task((0.5,)), 1.0)


def test_a_curve_follows_odds_that_bend() -> None:
    rng = np.random.default_rng(6)
    share = rng.uniform(0.0, 1.0, 6000)
    logit = -1.0 + 8.0 * np.maximum(0.0, share - 0.5)
    found = fit(answers(share, 0.0 * share, rng.uniform(size=6000) < 1.0 / (1.0 + np.exp(-logit))), task((0.5,)), 1.0)
    below, above = slopes(found.model.curves["inlier_fraction"])
    assert below == pytest.approx(0.0, abs=0.8)
    assert above == pytest.approx(8.0, rel=0.1)


def test_a_pair_is_found_where_both_features_have_to_speak() -> None:
    rng = np.random.default_rng(7)
    share, deviation = rng.uniform(0.0, 1.0, 6000), rng.uniform(0.0, 0.2, 6000)
    logit = -2.0 + 5.0 * np.minimum(share, 1.0 - deviation / 0.2)
    scans = answers(share, deviation, rng.uniform(size=6000) < 1.0 / (1.0 + np.exp(-logit)))
    both = ("least", "+inlier_fraction", "-deviation"), ("most", "+inlier_fraction", "-deviation")
    least, most = fit(scans, replace(task(()), pairs=both), 1.0).model.pairs
    assert (least.kind, least.first, least.second) == ("least", "inlier_fraction", "deviation")
    assert least.nats > 3.0 > 10.0 * most.nats >= 0.0
    assert least.from_to[0] == pytest.approx((0.05, 0.95), abs=0.02)
    assert least.from_to[1] == pytest.approx((0.19, 0.01), abs=0.01)


def test_a_pair_never_takes_from_what_speaks_for_an_answer() -> None:
    share, other = np.tile([0.0, 1.0], 500), np.repeat([0.0, 0.2], 500)
    scans = answers(share, other, (share < 0.5) | (other > 0.1))
    (pair,) = fit(scans, replace(task(()), pairs=(("least", "+inlier_fraction", "-deviation"),)), 1.0).model.pairs
    assert pair.nats == pytest.approx(0.0, abs=1e-9)


def test_pieces_between_bends_add_up_to_the_value() -> None:
    values = np.array([-1.0, 0.3, 0.7, 2.0])
    found = pieces(values, (0.0, 0.5, 1.0))
    np.testing.assert_allclose(found.sum(axis=1), values)
    np.testing.assert_allclose(found[2], [0.0, 0.5, 0.2, 0.0])


def test_no_bend_has_next_to_nothing_beside_it() -> None:
    capped = np.array([12.0] * 40 + list(range(60)))  # four in ten at a value that is none of a few quantiles
    assert 12.0 in knots(capped, (0.4,))
    assert knots(np.array([0.0] * 99 + [1.0]), (0.2, 0.5, 0.8, 0.99)) == ()


@pytest.mark.parametrize("name", ["cautious", "cautious_with_beams"])
def test_the_models_in_use_never_go_the_wrong_way(name: str) -> None:
    for feature, curve in MODELS[name].curves.items():
        sign = EITHER if feature == "constant" else ROLES[feature].sign
        if sign != EITHER:
            assert min(sign * s for s in slopes(curve)) > -1e-3 * max(1.0, *map(abs, slopes(curve))), feature
    for pair in MODELS[name].pairs:
        assert pair.nats >= 0.0
        for feature, (start, end) in zip((pair.first, pair.second), pair.from_to, strict=True):
            assert ROLES[feature].sign in (EITHER, FOR if end > start else AGAINST)


def test_log_loss_counts_strangers_by_their_weight() -> None:
    here = answers(np.array([0.5]), np.array([0.0]), np.array([True]))
    assert log_loss(np.array([0.5]), here, 1.0) == pytest.approx(np.log(2.0))
