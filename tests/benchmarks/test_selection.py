"""Features that tell right answers from wrong ones are selected, the most telling first, and others are not."""

from __future__ import annotations

import numpy as np

from association.verdict.models import USUAL
from association.verdict.roles import ROLES
from benchmarks.calibration import present_task
from benchmarks.curves import Answers
from benchmarks.examples import RANGES, SEGMENTS
from benchmarks.selection import candidates, pairs_of, select

from .answered import example


def test_what_tells_is_selected() -> None:
    """The lead tells most, the agreement less, and the blocked lines of sight nothing."""
    rng = np.random.default_rng(3)
    examples = []
    for k in range(600):
        lead, agreement, blocked = rng.uniform(0.0, 10.0), rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0)
        right = rng.uniform() < 1.0 / (1.0 + np.exp(6.5 - lead - 3.0 * agreement))
        features = USUAL._replace(lead=lead, agreement=agreement, blocked=blocked)
        examples.append(example(right=bool(right), told=not right, features=features, fold=f"world {k % 3}"))
    task, steps = select(Answers.of(examples), SEGMENTS, ("blocked", "agreement", "lead"), 0.001)
    assert task.names == ("constant", "lead", "agreement")
    assert [step.added for step in steps[:3]] == list(task.names)
    losses = [step.loss for step in steps]
    assert losses == sorted(losses, reverse=True)


def test_a_pair_is_selected_where_both_features_have_to_speak() -> None:
    rng = np.random.default_rng(4)
    examples = []
    for k in range(3000):
        lead, agreement = rng.uniform(0.0, 10.0), rng.uniform(0.0, 1.0)
        right = rng.uniform() < 1.0 / (1.0 + np.exp(3.0 - 6.0 * min(0.1 * lead, agreement)))
        features = USUAL._replace(lead=lead, agreement=agreement)
        examples.append(example(right=bool(right), told=not right, features=features, fold=f"world {k % 3}"))
    task, _ = select(Answers.of(examples), SEGMENTS, ("agreement", "lead"), 0.001)
    assert task.pairs[0][0] == "least"
    assert set(task.pairs[0][1:]) == {"+lead", "+agreement"}


def test_a_pair_has_the_signs_of_its_features() -> None:
    assert set(pairs_of(("lead", "blocked"))) == {("least", "+lead", "-blocked"), ("most", "+lead", "-blocked")}
    assert len(set(pairs_of(("lead", "misfit")))) == 4, "a misfit may speak for an answer or against it"
    assert list(pairs_of(("lead", "deviation"))) == []


def test_a_model_is_offered_what_it_can_know() -> None:
    beams = {name for name, role in ROLES.items() if role.needs_beams}
    assert not beams & set(candidates(SEGMENTS))
    assert beams <= set(candidates(RANGES))
    for form in (SEGMENTS, RANGES):
        assert set(present_task(form).names) <= {"constant", *candidates(form)}
