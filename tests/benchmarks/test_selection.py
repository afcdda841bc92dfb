"""Features that tell right answers from wrong ones are selected, the most telling first, and others are not."""

from __future__ import annotations

import numpy as np

from association.verdict.models import USUAL
from benchmarks.calibration import BEAMS, TASKS
from benchmarks.examples import RANGES, SEGMENTS
from benchmarks.selection import candidates, select

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
    found = select(examples, TASKS[SEGMENTS][0], ("blocked", "agreement", "lead"), 0.001)
    assert [name for name, _ in found] == ["constant", "lead", "agreement"]
    losses = [loss for _, loss in found]
    assert losses == sorted(losses, reverse=True)


def test_a_model_is_offered_what_it_can_know() -> None:
    likely, cautious = TASKS[SEGMENTS]
    assert not set(BEAMS) & set(candidates(SEGMENTS, cautious))
    assert set(BEAMS) <= set(candidates(RANGES, TASKS[RANGES][1]))
    assert "null" in candidates(SEGMENTS, cautious)
    assert not {"null", "null_gap", "null_better"} & set(candidates(SEGMENTS, likely))
    for form, tasks in TASKS.items():
        for task in tasks:
            assert set(task.names) <= {"constant", *candidates(form, task)}
