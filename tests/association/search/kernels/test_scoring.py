"""Hypotheses are scored as by the reference."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association import HardPrior
from association.consensus.tuning import ROUNDS
from association.layout import RULES, record
from association.search.kernels import scoring
from registration import RigidTransform

from ...kernels.drawn import GATES, INDEX, MODEL, PLACE, SEEDS, SMALL, TABLES, drawn, workspace_of
from ...kernels.plans import state_of
from ...reference import proposing as twin
from ...reference.consensus import refine
from ...reference.geometry import moved
from ...reference.matching import gates_about, match_scan, reachable
from ...scenes import context_of, scan_of

RULE = record(RULES, kept_share=0.65, rival_share=0.95)  # distinct at no distance


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_score_hypotheses(seed: int) -> None:
    """Each is matched only as far as it may still be stored next to those before it, and each step is counted."""
    d = drawn(seed, radius=7.0)
    variance, pin = SMALL[2, 2] * 10.0 ** d.rng.uniform(-1.0, 1.0), d.rng.uniform(-2.0, 2.0, 2)
    window = HardPrior(d.near(), 0.5, 0.2) if seed % 2 else None
    there = window and HardPrior(moved(window.pose, [0.0, *INDEX.origin]), window.radius, window.angle)
    question, work = context_of(INDEX, scan_of(d.endpoints), there).question(RULE), workspace_of(d.scan)
    if whole := d.rng.random() < 0.7:
        work.spreads[:], _ = gates_about(d.scan, variance, np.zeros(2), 0.0, GATES)
        work.later[:] = d.scan["later_gain"]
    else:
        question.terms["gates"]["least_overlap"] = 0.4  # a midpoint may then be off the map: the raster has no entry
    gates = question.terms["gates"]
    places = [d.near(0.3, 3.0, 3.0), d.near(0.1, 0.5, 0.5), d.near(), d.at, d.near(0.1, 0.5, 0.5)]
    best_value = d.rng.uniform(0.0, 1.0) * d.scan["gain"].sum()
    state = state_of(9, best_value)
    state.best["least_freedom"] = d.rng.choice([0.0, 10.0])
    for one, at in zip(work.hypotheses, places, strict=False):
        one["x"], one["y"], one["theta"] = at.x, at.y, at.theta
        one["cosine"], one["sine"] = math.cos(at.theta), math.sin(at.theta)
        one["lever_x"], one["lever_y"] = RigidTransform(0.0, 0.0, at.theta).apply(pin)
        one["angle_variance"] = variance
    verified, scores = 0, [0.0]
    for at in places:
        least = 0.65 * best_value
        floor = least + state.best["least_freedom"][0]
        x, y = RigidTransform(0.0, 0.0, at.theta).apply(pin)
        turning = np.array([y, -x, 1.0])
        covariance = variance * np.outer(turning, turning)
        outside = window is not None and not twin.may_be_refined_into(window, at)
        if outside or (whole and reachable(d.scan, at, work.spreads, work.shifts, TABLES.raster) < floor):
            continue
        if match_scan(d.scan, at, covariance, PLACE, gates)[1] >= floor:
            verified += 1
            refined = refine(d.scan, at, covariance, PLACE, gates, MODEL, ROUNDS)
            inside = window is None or window.contains(refined.pose)
            scores += [refined.score] if refined.score > 0.0 and refined.score >= least and inside else []
            best_value = max(best_value, *scores)
    assert scoring.score_hypotheses(question, TABLES, len(places), state, work)
    assert state.statistics[0][["hypotheses", "verified"]].item() == (len(places), verified)
    assert state.poses["value"].max() == pytest.approx(max(scores))
    state.stop[0] = 1
    assert not scoring.score_hypotheses(question, TABLES, len(places), state, work)
    assert state.statistics["hypotheses"][0] == len(places)
