"""Candidates are ranked as their references rank them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels import ranking
from association.consensus.tuning import SAME_FAMILY
from association.layout import MATCH, SET_SCORE
from association.tables import Place, Sights
from association.tuning import DISTINCT_ANGLE, DISTINCT_DISTANCE
from registration import RigidTransform
from registration.layout import Floats, Records

from ...kernels.drawn import ASKED, GATES, MODEL, PLACE, SEEDS, drawn
from ...records import assert_records, covariance_of, estimate_of, pose_of, sights_of, work_of
from ...reference import ranking as twin
from ...reference.geometry import moved
from ...scenes import INSIDE, ROOM, context_of, index_of, local, pose, same_pose, scan_of, seen


def ranked(
    scan: Records, poses: list[RigidTransform], sights: Sights, place: Place
) -> tuple[Records, Records, Records]:
    """Return estimates, scores and matches."""
    estimates = np.concatenate([estimate_of(at, np.full((3, 3), 9.0)) for at in poses])
    scores, matches = np.zeros(len(poses), SET_SCORE), np.zeros((len(poses), len(scan)), MATCH)
    work = work_of(len(scan), len(place.walls))
    ranking.score_candidates(ASKED._replace(scan=scan), place, sights, estimates, scores, matches, work)
    return estimates, scores, matches


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_score_candidates(seed: int) -> None:
    """Good poses, bad ones and some at which nothing fits; with lines of sight and without."""
    d = drawn(seed, radius=8.0)
    poses = [
        d.at,
        d.near(0.02, 0.1, 0.1),
        d.near(1.5, 4.0, 4.0),
        moved(d.at, [0.0, 300.0, 0.0]),
        d.near(0.01, 0.5, 0.5),
    ]
    viewpoint = d.rng.normal(size=2) * 0.2
    for sighted in (False, True):
        sights = sights_of(d.scan, viewpoint, sighted=sighted)
        estimates, scores, matches = ranked(d.scan, poses, sights, PLACE)
        expected = twin.rank(d.scan, poses, viewpoint if sighted else None, PLACE, GATES, MODEL)
        for k, (at, covariance, score, match) in enumerate(expected):
            assert same_pose(pose_of(estimates[k]), at, 1e-5, 1e-6)
            np.testing.assert_allclose(covariance_of(estimates[k]), covariance, rtol=1e-4, atol=1e-8)
            assert_records(scores[k : k + 1], score, rtol=1e-5, atol=1e-4)
            np.testing.assert_array_equal(matches[k]["wall"], match["wall"])


@pytest.mark.parametrize(("lacking", "charged"), [(0, True), (3, False)])
def test_lines_of_sight_are_spared_where_a_pose_is_far_behind(lacking: int, charged: bool) -> None:
    """Of two equal rooms the second has a screen that the scan sees through, and may lack some of the walls."""
    second = ROOM[: len(ROOM) - lacking] + np.tile([20.0, 0.0], 2)
    index = index_of(np.vstack([ROOM, second, [[24.0, 0.5, 24.0, 3.5]]]))
    scan = context_of(index, scan_of(seen(ROOM, INSIDE)[0])).lines.rows
    poses = [local(index, INSIDE), local(index, pose(INSIDE.x + 20.0, INSIDE.y, INSIDE.theta))]
    place, sights = index.tables.place, sights_of(scan)
    blind, both, alone = (
        ranked(scan, some, one, place)[1]["score"][-1]
        for some, one in ((poses, sights_of(scan, sighted=False)), (poses, sights), (poses[1:], sights))
    )
    assert blind - alone > 3.0
    assert both == (alone if charged else blind)


def scores_of(scores: Floats) -> Records:
    found = np.zeros(len(scores), SET_SCORE)
    found["score"] = scores
    return found


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_distinct_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn_poses = rng.choice(rng.uniform(-4.0, 4.0, (12, 3)), 40) + rng.normal(size=(40, 3)) * 0.2
    poses = [pose(*row) for row in drawn_poses.tolist()]
    roots = rng.normal(size=(40, 3, 3)) * rng.choice([0.02, 0.3], (40, 1, 1))
    covariances, order = roots @ roots.transpose(0, 2, 1) + 1e-4 * np.eye(3), rng.permutation(40)
    estimates = np.concatenate([estimate_of(at, c) for at, c in zip(poses, covariances, strict=True)])
    scores, values = rng.uniform(0.0, 10.0, 40), np.zeros(40)
    values[order[:36]] = -np.arange(36.0)
    scores[order[36:]] = [0.0, -1.0, 0.0, -2.0]  # no explanations
    rules = DISTINCT_DISTANCE, DISTINCT_ANGLE, SAME_FAMILY, 6.0
    for most in (5, 40):
        got = ranking.distinct_poses(estimates, scores_of(scores), values - scores, most, *rules)
        assert got.tolist() == twin.distinct(poses, covariances, scores, order[:36], most, rules)


def test_a_pose_of_a_family_does_not_stand_for_a_much_better_one() -> None:
    """A window put the worse one first: along a corridor, 2 m of it uncertain."""
    poses = np.concatenate([estimate_of(pose(x), np.diag([4.0, 1e-4, 1e-4])) for x in (0.0, 1.0, 3.0)])
    for better, places in ((5.9, [0]), (6.1, [0, 2])):
        scores = np.array([10.0, 10.0, 10.0 + better])
        assert ranking.distinct_poses(poses, scores_of(scores), -scores, 3, 0.3, 0.1, 12.8, 6.0).tolist() == places


def test_a_pose_without_a_covariance_stands_for_those_near_it_alone() -> None:
    poses = np.concatenate([estimate_of(pose(x)) for x in (0.0, 0.2, 0.5)])
    assert ranking.distinct_poses(poses, scores_of(np.ones(3)), np.zeros(0), 3, 0.3, 0.1, 12.8, 6.0).tolist() == [0, 2]
