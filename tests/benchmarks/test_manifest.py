"""The manifest of the verdict's models belongs to the code, and marks unknown entries."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from association.verdict.features import Features
from association.verdict.model import MANIFEST, MODELS
from benchmarks import manifest
from benchmarks.examples import RANGES, SEGMENTS
from benchmarks.manifest import FORMAT, MODELS_FILE, UNKNOWN, accept, digest


def test_the_features_are_those_of_the_code_in_order() -> None:
    assert MANIFEST["format"] == FORMAT
    assert tuple(MANIFEST["code"]["features"]) == Features._fields


def test_the_models_are_fitted_to_the_present_code() -> None:
    """Or a reason why they still hold is on record: python -m benchmarks.manifest --accept REASON."""
    assert MANIFEST["code"]["digest"] == digest(), "fit the models again, or accept them: see CONTRIBUTING"
    accepted = MANIFEST["code"]["accepted"]
    assert digest() in {MANIFEST["code"]["at_fit"], *(one["digest"] for one in accepted)}
    assert all(one["reason"] for one in accepted)


@pytest.mark.parametrize("name", sorted(MODELS))
def test_a_model_has_features_of_the_code(name: str) -> None:
    assert set(MODELS) == {SEGMENTS, RANGES} == set(MANIFEST["data"]) == set(MANIFEST["metrics"])
    for odds in (MODELS[name].wrong, MODELS[name].elsewhere):
        assert set(odds.curves) <= set(Features._fields)


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
    (here / "tuning.py").write_text(text.replace("COMPARED = 12", "COMPARED = 13"))
    assert digest() != before


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
