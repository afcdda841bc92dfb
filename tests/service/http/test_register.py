"""POST /v1/register against cases with known answers."""

from __future__ import annotations

import math
from typing import Any

import httpx
import pytest

from linefix.documents import examples


def registered(client: httpx.Client, **parts: Any) -> dict[str, Any]:
    response = client.post("/v1/register", json={**examples.REGISTER, **parts})
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


def test_the_example_has_the_pose_it_was_made_from(client: httpx.Client) -> None:
    answer = registered(client)
    assert (answer["status"], answer["usable"], answer["unobservable"]) == ("ok", True, None)
    assert answer["pose"]["x"] == pytest.approx(1.0, abs=1e-12)
    assert answer["pose"]["y"] == pytest.approx(0.5, abs=1e-12)
    assert answer["pose"]["theta"] == pytest.approx(math.pi / 2, abs=1e-12)
    assert [(row["scan"], row["map"]) for row in answer["residuals"]] == [(0, 0), (1, 1)]
    # 8 m and 4 m of wall at 5 cm a point, 2 cm of noise each.
    assert [row["weight"] for row in answer["residuals"]] == pytest.approx([160 / 4e-4, 80 / 4e-4])
    diagnostics = answer["diagnostics"]
    assert (diagnostics["pairs"], diagnostics["dof"]) == (2, 1)
    assert diagnostics["reliability"] == pytest.approx(2 * math.sqrt(160 * 80) / 240)
    assert diagnostics["ambiguity_at"] is None
    assert answer["timing_ms"].keys() == {"decode", "search", "total"}
    assert answer["request_id"]


def test_default_correspondences_are_i_with_i(client: httpx.Client) -> None:
    answer = registered(client, correspondences=None)
    given = registered(client)
    assert answer["pose"] == given["pose"]
    assert answer["residuals"] == given["residuals"]


def test_the_paper_s_estimator(client: httpx.Client) -> None:
    at = {"x": 1.0, "y": 0.5, "theta": math.pi / 2}
    options = {"estimator": "one_step", "rotation": "mitsuta", "evaluate_at": at, "k_rotation": 2.0}
    answer = registered(client, options=options, weighting="uniform")
    assert answer["covariance"] is None
    assert answer["pose"]["x"] == pytest.approx(1.0, abs=1e-9)
    assert [row["weight"] for row in answer["residuals"]] == [1.0, 1.0]
    assert answer["diagnostics"]["ambiguity_at"]["total"] == pytest.approx(0.0, abs=1e-9)
    assert answer["diagnostics"]["ambiguity_before"]["rotation"] == pytest.approx(2.0 * 2 * (math.pi / 2) ** 2)


def test_the_error_of_the_walls_is_estimated_where_it_is_null(client: httpx.Client) -> None:
    def variance(**sigma: float | None) -> float:
        answer = registered(client, map={"segments": examples.WALLS, **sigma}, scan={"segments": examples.SEEN})
        assert answer["usable"]
        return float(answer["covariance"][0][0])

    assert variance() == variance(sigma=0.0)
    assert 3.0 * variance() < variance(sigma=None) < variance(sigma=0.05)
    nothing = {"segments": examples.SEEN, "sigma": 0.0}
    assert registered(client, map={"segments": examples.WALLS, "sigma": None}, scan=nothing)["usable"]
    body = {**examples.REGISTER, "map": {"segments": examples.WALLS}, "scan": nothing, "correspondences": None}
    assert client.post("/v1/register", json=body).status_code == 422


def test_parallel_pairs_are_degenerate_and_say_along_what(client: httpx.Client) -> None:
    answer = registered(client, correspondences=[[0, 0]])
    assert (answer["status"], answer["usable"], answer["covariance"]) == ("degenerate", False, None)
    assert [abs(part) for part in answer["unobservable"]] == pytest.approx([1.0, 0.0], abs=1e-9)


def test_no_pairs_are_no_answer_and_no_error(client: httpx.Client) -> None:
    answer = registered(client, correspondences=[])
    assert (answer["status"], answer["pose"], answer["residuals"]) == ("degenerate", None, [])


def test_weights_replace_the_weighting(client: httpx.Client) -> None:
    assert [row["weight"] for row in registered(client, weights=[3.0, 5.0])["residuals"]] == [3.0, 5.0]
