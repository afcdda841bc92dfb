"""The fit of a verdict's model on drawn answers of known odds."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from association.verdict.models import MODELS, USUAL, Curve, Model
from association.verdict.roles import AGAINST, EITHER, FOR, ROLES
from benchmarks.curves import BENDS, Answers, Task, careful, fit, knots, likely, log_loss, logits, pieces
from benchmarks.examples import DRAWN_STRANGERS, SEGMENTS, Example


def answers(share: np.ndarray, deviation: np.ndarray, right: np.ndarray) -> list[Example]:
    return [
        Example(
            SEGMENTS, "drawn", "clean", "world",
            USUAL._replace(inlier_fraction=float(s), deviation=float(d)), bool(r), degenerate=False, told=not r,
        )
        for s, d, r in zip(share, deviation, right, strict=True)
    ]  # fmt: skip


def drawn(slope: float, count: int = 4000) -> list[Example]:
    """Answers whose log-odds rise by `slope` per unit of the share from -2 on, and do not depend on the deviation."""
    rng = np.random.default_rng(5)
    share, deviation = rng.uniform(0.0, 1.0, count), rng.uniform(0.0, 0.2, count)
    return answers(share, deviation, rng.uniform(size=count) < 1.0 / (1.0 + np.exp(2.0 - slope * share)))


def task(bends: tuple[float, ...]) -> Task:
    return Task(SEGMENTS, ("constant", "inlier_fraction", "deviation"), (), bends)


def fitted(examples: Sequence[Example], task: Task) -> Model:
    return fit(Answers.of(examples), task)


def slopes(curve: Curve) -> Sequence[float]:
    return [float(s) for s in np.cumsum([curve.slope, *(more for _, more in curve.bends)])]


def test_the_fit_finds_the_odds_that_answers_were_drawn_with() -> None:
    found = fitted(drawn(6.0), task(())).curves
    assert found["inlier_fraction"].slope == pytest.approx(6.0, rel=0.1)
    assert found["constant"].slope == pytest.approx(-2.0, abs=0.3)
    assert abs(found["deviation"].slope) < 1.5  # of 0.2 that it may be: less than 0.3 nats


def test_a_curve_never_falls_where_its_feature_speaks_for_an_answer() -> None:
    found = fitted(drawn(-6.0), task(BENDS)).curves
    assert len(found["inlier_fraction"].bends) == 3
    assert slopes(found["inlier_fraction"]) == pytest.approx([0.0] * 4, abs=1e-12)


def test_strangers_that_nobody_could_tell_teach_nothing() -> None:
    scans, ones = drawn(6.0), np.ones(2000)
    perfect = [
        replace(e, group=DRAWN_STRANGERS, right=False, told=False) for e in answers(ones, 0.0 * ones, 0.0 * ones)
    ]
    assert fitted([*scans, *perfect], task((0.5,))) == fitted(scans, task((0.5,)))
    told = [replace(e, told=True) for e in perfect]
    assert fitted([*scans, *told], task((0.5,))) != fitted(scans, task((0.5,)))


def test_a_curve_follows_odds_that_bend() -> None:
    rng = np.random.default_rng(6)
    share = rng.uniform(0.0, 1.0, 6000)
    logit = -1.0 + 8.0 * np.maximum(0.0, share - 0.5)
    found = fitted(answers(share, 0.0 * share, rng.uniform(size=6000) < 1.0 / (1.0 + np.exp(-logit))), task((0.5,)))
    below, above = slopes(found.curves["inlier_fraction"])
    assert below == pytest.approx(0.0, abs=0.8)
    assert above == pytest.approx(8.0, rel=0.1)


def test_a_pair_is_found_where_both_features_have_to_speak() -> None:
    rng = np.random.default_rng(7)
    share, deviation = rng.uniform(0.0, 1.0, 6000), rng.uniform(0.0, 0.2, 6000)
    logit = -2.0 + 5.0 * np.minimum(share, 1.0 - deviation / 0.2)
    scans = answers(share, deviation, rng.uniform(size=6000) < 1.0 / (1.0 + np.exp(-logit)))
    both = ("least", "+inlier_fraction", "-deviation"), ("most", "+inlier_fraction", "-deviation")
    least, most = fitted(scans, replace(task(()), pairs=both)).pairs
    assert (least.kind, least.first, least.second) == ("least", "inlier_fraction", "deviation")
    assert least.nats > 3.0 > 10.0 * most.nats >= 0.0
    assert least.from_to[0] == pytest.approx((0.05, 0.95), abs=0.02)
    assert least.from_to[1] == pytest.approx((0.19, 0.01), abs=0.01)


def test_a_pair_never_takes_from_what_speaks_for_an_answer() -> None:
    share, other = np.tile([0.0, 1.0], 500), np.repeat([0.0, 0.2], 500)
    scans = answers(share, other, (share < 0.5) | (other > 0.1))
    (pair,) = fitted(scans, replace(task(()), pairs=(("least", "+inlier_fraction", "-deviation"),))).pairs
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


@pytest.mark.parametrize("name", sorted(MODELS))
def test_the_models_in_use_never_go_the_wrong_way(name: str) -> None:
    for feature, curve in MODELS[name].curves.items():
        sign = EITHER if feature == "constant" else ROLES[feature].sign
        if sign != EITHER:
            assert min(sign * s for s in slopes(curve)) > -1e-3 * max(1.0, *map(abs, slopes(curve))), feature
    for pair in MODELS[name].pairs:
        assert pair.nats >= 0.0
        for feature, (start, end) in zip((pair.first, pair.second), pair.from_to, strict=True):
            assert ROLES[feature].sign in (EITHER, FOR if end > start else AGAINST)


def test_out_of_map_scans_that_could_be_told_count_in_the_log_loss() -> None:
    half, zero, right = np.array([0.5]), np.array([0.0]), np.array([True])
    here = answers(half, zero, right)
    assert log_loss(half, Answers.of(here)) == pytest.approx(np.log(2.0))
    away = [replace(one, group=DRAWN_STRANGERS, right=False, told=True) for one in here]
    both = Answers.of([*here, *away])
    assert log_loss(np.array([0.5, 0.9]), both) == pytest.approx(0.5 * (np.log(2.0) + np.log(10.0)))
    hidden = Answers.of([*here, *(replace(one, told=False) for one in away)])
    assert log_loss(np.array([0.5, 0.9]), hidden) == pytest.approx(np.log(2.0))


def test_a_map_that_is_known_adds_a_constant_to_the_log_odds() -> None:
    """As many out-of-map scans as others that look alike, where four of five in the map are right: ln 6 nats more.

    With all scans 4 of 10 are right, odds of 2 to 3; in the map 4 of 5, odds of 4.
    """
    same, right = np.full(5000, 0.5), np.arange(5000) % 5 > 0
    here = answers(same, 0.0 * same, right)
    away = [replace(one, group=DRAWN_STRANGERS, right=False, told=True) for one in here]
    every = Answers.of([*here, *away])
    model = fit(every, task(()))
    assert careful(model, every)[0] == pytest.approx(0.4, abs=1e-3)
    assert likely(model, every)[0] == pytest.approx(0.8, abs=1e-3)
    assert model.on_map == pytest.approx(np.log(6.0), abs=0.01)


def test_the_log_odds_of_many_answers_are_those_of_each() -> None:
    rng = np.random.default_rng(8)
    for model in MODELS.values():
        features = np.array(USUAL) * rng.uniform(0.5, 1.5, (20, len(USUAL)))
        np.testing.assert_allclose(logits(model, features), [model.logit(row) for row in features])
