"""The manifest of the verdict's models belongs to the code, and marks unknown entries."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from association.verdict.features import FEATURES, Features
from association.verdict.models import MANIFEST, MODELS, USUAL
from benchmarks import manifest
from benchmarks.calibration import RANGES, SEGMENTS, present_task, write
from benchmarks.examples import Example
from benchmarks.manifest import FORMAT, MODELS_FILE, UNKNOWN, accept, code_of, data_of, digest, manifest_of
from benchmarks.selection import Selected

from .answered import example


def test_the_features_are_those_of_the_code_in_order() -> None:
    assert MANIFEST["format"] == FORMAT
    assert tuple(MANIFEST["code"]["features"]) == Features._fields == FEATURES.names


def test_the_models_are_fitted_to_the_present_code() -> None:
    """Or a reason why they still hold is on record: python -m benchmarks.manifest --accept REASON."""
    assert MANIFEST["code"]["digest"] == digest(), "fit the models again, or accept them: see CONTRIBUTING"
    accepted = MANIFEST["code"]["accepted"]
    assert digest() in {MANIFEST["code"]["at_fit"], *(one["digest"] for one in accepted)}
    assert all(one["reason"] for one in accepted)


@pytest.mark.parametrize("name", sorted(MODELS))
def test_a_model_has_the_features_and_pairs_of_its_manifest_and_of_the_command(name: str) -> None:
    part, task, model = MANIFEST["models"][name], present_task(name), MODELS[name]
    assert set(MANIFEST["models"]) == set(MODELS) == {SEGMENTS, RANGES}
    assert tuple(part["features"]) == task.names == tuple(model.curves)
    assert [f"{kind} {one[1:]} {other[1:]}" for kind, one, other in task.pairs] == [p.key for p in model.pairs]


def test_nothing_is_left_out() -> None:
    assert set(MANIFEST["data"]) == {SEGMENTS, RANGES}
    for part in (MANIFEST, *MANIFEST["data"].values(), *MANIFEST["models"].values()):
        assert all(value not in (None, "", {}, []) or key in ("pairs", "bends") for key, value in part.items())


def test_comments_and_layout_are_no_code() -> None:
    one = code_of(
        '"""Module."""\nA = 1.0  # m, tables\n\n\ndef f(x):\n    """Double it."""\n    return [x,\n        x,\n    ]\n'
    )
    assert one == code_of("A = 1.0\ndef f(x):\n    return [x, x]\n")
    assert one != code_of("A = 1.1\ndef f(x):\n    return [x, x]\n")
    assert code_of('A = "m"') != code_of('A = "s"')


def test_the_digest_is_of_what_defines_the_features(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here, before = tmp_path / "association" / "verdict", digest()
    for pattern in manifest.DEFINITION:
        for path in manifest.ROOT.glob(pattern):
            copy = tmp_path / path.relative_to(manifest.ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_text(path.read_text())
    monkeypatch.setattr(manifest, "ROOT", tmp_path)
    assert digest() == before
    text = (here / "tuning.py").read_text()
    (here / "tuning.py").write_text("# A comment.\n" + text)
    assert digest() == before
    (here / "tuning.py").write_text(text.replace("MANY = 8", "MANY = 9"))
    assert digest() != before


def test_a_fit_writes_what_it_was_made_of(tmp_path: Path) -> None:
    examples: list[Example] = [example(right=True), example(right=False), example(stranger=True, told=True)]
    task, metrics = present_task(SEGMENTS), {"log_loss": 0.1}
    made = manifest_of("COMMAND", {SEGMENTS: data_of(examples)}, [(task, [Selected("lead", 0.25)], metrics)])
    write(tmp_path / "models.json", dict(MODELS), made, USUAL)
    document: Any = json.loads((tmp_path / "models.json").read_text())
    assert document["models"] == json.loads(MODELS_FILE.read_text())["models"]
    found = document["manifest"]
    assert set(found) == set(MANIFEST)
    assert (found["command"], found["code"]["digest"], found["code"]["accepted"]) == ("COMMAND", digest(), [])
    data = found["data"][SEGMENTS]
    assert (data["scans_in_map"], data["scans_out_of_map"], data["right"]) == (2, 1, 1)
    assert len(data["answers_sha256"]) == 64
    assert found["models"][SEGMENTS]["metrics"] == metrics
    assert found["models"][SEGMENTS]["selection"] == ["lead: 0.25000"]
    assert found["data"][RANGES] == MANIFEST["data"][RANGES], "what was not fitted again keeps its part"
    again = manifest_of("COMMAND", {}, [(task, [], metrics)])
    assert again["models"][SEGMENTS]["selection"] == MANIFEST["models"][SEGMENTS]["selection"]


def test_other_answers_have_another_digest() -> None:
    one = example(right=True)
    assert data_of([one])["answers_sha256"] == data_of([example(right=True)])["answers_sha256"]
    for other in (replace(one, right=False), replace(one, features=one.features._replace(lead=0.5))):
        assert data_of([other])["answers_sha256"] != data_of([one])["answers_sha256"]


def test_models_are_accepted_for_changed_code_with_a_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copy = tmp_path / "models.json"
    document = json.loads(MODELS_FILE.read_text())
    document["manifest"]["code"]["digest"] = UNKNOWN
    copy.write_text(json.dumps(document))
    monkeypatch.setattr(manifest, "MODELS_FILE", copy)
    accept("Nothing but names changed.")
    code = json.loads(copy.read_text())["manifest"]["code"]
    assert code["digest"] == digest()
    assert code["accepted"][-1] == {"digest": digest(), "reason": "Nothing but names changed."}
