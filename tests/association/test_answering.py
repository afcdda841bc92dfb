"""An answer that is worked out in one call is the one that its steps come to, to the bit."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import cycle, product
from typing import Any

import numpy as np
import pytest

from association import AssociationOptions, Deadline, HardPrior, MapIndex, Scan, associate, candidates, explain, layout
from association.answering import answer_at_once, given_of, is_plain
from association.candidates import Begun, Effort
from association.context import SearchContext
from association.features import twin_share, weigh
from association.tuning import NULL_SHARE
from association.verdict import _Chances as Chances
from registration import Segments
from registration.layout import Floats

from .scenes import (
    CORRIDOR,
    INSIDE,
    ROOM,
    SQUARE,
    beams_of,
    context_of,
    equal_rooms,
    index_of,
    maze,
    pose,
    scan_of,
    seen,
)

OPTIONS = (
    AssociationOptions(),
    AssociationOptions(max_alternatives=40, offset_tolerance=0.2),
    AssociationOptions(sampling="random", seed=5, min_overlap=0.7),
    AssociationOptions(oriented=False, estimator="one_step"),
)
STEPS, EXPLAINED, JUDGED = "left to the steps", "explained", "judged"
FAR = {layout.EXPLAINED: EXPLAINED, layout.JUDGED: JUDGED}


def how_far(context: SearchContext) -> str:
    """Tell up to where one call answers."""
    if not is_plain(context):
        return STEPS
    told = answer_at_once(context)[1]
    if told is None:
        return STEPS
    return EXPLAINED if told.weighing is None else JUDGED


def both(index: MapIndex, scan: Scan, options: AssociationOptions) -> tuple[str, str]:
    """Return the answer as it is, and by its steps."""
    with pytest.MonkeyPatch.context() as patch:
        answer = repr(associate(index, scan, None, options))
        patch.setattr(explain, "is_plain", lambda _: False)
        return answer, repr(associate(index, scan, None, options))


def scans(seed: int, walls: Floats, clutter: float) -> Scan:
    """Return what is seen from somewhere on a map with so much beside it, from one place or from nowhere."""
    rng = np.random.default_rng(seed)
    x, y, turn = rng.uniform((8.0, 8.0, -3.0), (22.0, 22.0, 3.0)).tolist()
    at, strange = pose(x, y, turn), round(10 * clutter)
    ends = seen(walls, at, noise=0.01, clutter=strange, seed=seed, radius=9.0)[0]
    return scan_of(ends, viewpoint=(0.0, 0.0) if seed % 2 else None)


def mirrored_walls(walls: Floats) -> Floats:
    """Return walls with left and right exchanged, 60 m away, and some of them 0.3 m off."""
    turned = (walls * [1.0, -1.0, 1.0, -1.0])[:, [2, 3, 0, 1]] + [60.0, 0.0, 60.0, 0.0]
    turned[::8, [1, 3]] += 0.3
    return turned


MIRRORED = [(seed, maze(seed)) for seed in range(16)]


@pytest.mark.parametrize("options", OPTIONS, ids=range(len(OPTIONS)))
def test_one_call_answers_as_the_steps_do(options: AssociationOptions) -> None:
    """Usable or not, on maps of which the error is known and not, to scale and not, with rivals, and of strangers."""
    reached: Counter[str] = Counter()
    status: Counter[str] = Counter()
    sigmas = cycle((None, 0.02, None, 0.0))
    for seed, clutter in product(range(6), (0.0, 0.5, 1.5)):
        walls, sigma = maze(seed), next(sigmas)
        stretched, strange = seed == 2, seed == 3
        index = index_of(walls * (1.03 if stretched else 1.0), sigma)
        scan = scans(seed, maze(99) if strange else walls, clutter)
        answer, expected = both(index, scan, options)
        assert answer == expected
        found = associate(index, scan, None, options)
        reached[how_far(SearchContext.of(index, scan, None, options, Deadline()))] += 1
        status[f"{found.status} {found.usable}"] += 1
    assert reached[JUDGED] > 10
    assert status["ok True"] > 2
    assert len(status) > 1


def off_by_centimetres(seed: int) -> MapIndex:
    """Return two equal rooms of which each wall is drawn some 5 cm off by itself."""
    rooms = Segments.from_array(equal_rooms(2))
    errors = np.random.default_rng(seed).normal(0.0, 0.05, len(rooms))
    return index_of(rooms.endpoints + np.tile(errors[:, None] * rooms.normals, 2))


def test_its_chances_are_those_of_the_steps() -> None:
    """Before they come to a verdict, which shows little of them: the second look at rivals, and the null."""
    in_rooms = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))
    asked = [(index_of(maze(seed)), scans(seed, maze(seed), clutter)) for seed in range(8) for clutter in (0.0, 1.0)]
    asked += [(off_by_centimetres(seed), in_rooms) for seed in range(24)]
    asked += [(index_of(np.vstack([walls, mirrored_walls(walls)])), scans(s, walls, 0.0)) for s, walls in MIRRORED]
    seconds = nulls = 0
    for index, scan in asked:
        context = context_of(index, scan)
        explanations = explain.explain(context)
        if explanations.weighing is None:
            continue
        at_once, steps = (
            Chances.of(context, one, capped=False, certain=True)
            for one in (explanations, replace(explanations, weighing=None))
        )
        assert at_once.features.tobytes() == steps.features.tobytes()
        assert replace(at_once, features=steps.features) == steps
        assert explanations.answer is not None
        weighed = weigh(explanations.answer.best, tuple(explanations.rivals))
        seconds += at_once.share < twin_share(weighed)
        nulls += at_once.features["null"][0] > NULL_SHARE
    assert seconds > 2
    assert nulls > 2


@pytest.mark.parametrize(
    ("walls", "scanned"),
    [
        (ROOM, ROOM),
        (SQUARE, SQUARE),
        (equal_rooms(2), ROOM),
        (equal_rooms(12), ROOM),
        (CORRIDOR, CORRIDOR),
        (ROOM, ROOM[:1]),
        (ROOM, ROOM[:3]),
        (ROOM, 0.1 * ROOM),
    ],
)
def test_it_does_so_of_twins_and_of_what_is_free(walls: Floats, scanned: Floats) -> None:
    for noise, sigma in ((0.0, None), (0.02, None), (0.02, 0.01)):
        scan = scan_of(seen(scanned, INSIDE, noise=noise)[0], viewpoint=(0.0, 0.0))
        answer, expected = both(index_of(walls, sigma), scan, AssociationOptions())
        assert answer == expected


def test_a_map_that_is_not_to_scale_is_left_to_the_steps() -> None:
    walls = maze(2)
    context = context_of(index_of(1.03 * walls), scans(2, walls, 0.0))
    assert how_far(context) == EXPLAINED
    assert how_far(context_of(index_of(1.03 * walls, 0.02), scans(2, walls, 0.0))) == JUDGED, "nobody asks for a factor"


def test_what_its_budget_ends_is_left_to_the_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    walls = maze(1)
    index, scan = index_of(walls), scans(1, walls, 0.5)
    usual = repr(associate(index, scan))
    far = {}
    for chunk in (1, *range(200, 4_000, 50), 10_000_000):
        monkeypatch.setattr(candidates, "CHUNK", chunk)
        assert repr(associate(index, scan)) == usual
        far[chunk] = how_far(context_of(index, scan))
    assert list(dict.fromkeys(far.values())) == [STEPS, JUDGED]


def test_so_is_a_verdict_whose_null_takes_longer() -> None:
    """The search ends at the first pose here that explains anything; that of the mirrored scan finds none."""
    context, reached = context_of(index_of(maze(0)), scans(0, maze(0), 1.0)), []
    for budget in (1, *range(50, 2_000, 50)):
        begun, given = Begun.of(context, Effort(64, 0.65, 0.75, 1e-4, enough=20.0), budget), given_of(context)
        _, plan = begun.search(context, given)
        reached.append(STEPS if plan is not None else FAR[given.told.reached["stage"][0]])
    assert list(dict.fromkeys(reached)) == [STEPS, EXPLAINED, JUDGED]


@pytest.mark.parametrize(
    ("prior", "beams", "deadline"), [(HardPrior(INSIDE, 1.0, 1.0), False, None), (None, True, None), (None, False, 0.0)]
)
def test_what_is_not_plain_is_left_to_the_steps(prior: Any, beams: bool, deadline: float | None) -> None:
    index = index_of(ROOM)
    scan = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0), beams=beams_of(index, INSIDE) if beams else None)
    assert how_far(context_of(index, scan)) == (STEPS if beams else JUDGED)
    assert how_far(context_of(index, scan, prior, Deadline(deadline))) == STEPS


def test_explanations_are_made_when_they_are_asked_for() -> None:
    told = answer_at_once(context_of(index_of(equal_rooms(3)), scan_of(seen(ROOM, INSIDE)[0])))[1]
    assert told is not None
    ranked = told.ranked
    assert len(ranked) == len(list(ranked)) > 2
    assert ranked[0] is ranked[0] is ranked[-len(ranked)]
    assert ranked[1:3] == [ranked[1], ranked[2]]
    assert [one.value for one in ranked] == sorted((one.value for one in ranked), reverse=True)
    with pytest.raises(IndexError):
        ranked[len(ranked)]
