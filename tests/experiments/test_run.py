"""The quick mode writes every table and figure."""

import csv
from pathlib import Path

import pytest

from experiments.__main__ import EXPERIMENTS, run
from experiments.plan import QUICK

ROOT = Path(__file__).resolve().parents[2]
FILES = {
    "constant_time": ["constant_time.csv", "constant_time.png"],
    "precision": ["precision.csv", "precision.png"],
    "mean_angles": ["sec45_means.csv", "fig10_means.csv", "fig10_means.png"],
    "printed": ["printed.csv", "printed.png", "printed_exact.csv", "printed_ambiguity.csv"],
    "dispersion": ["fig5_environments.csv", "fig5_environments.png", "fig7_dispersion.csv", "fig7_dispersion.png",
                   "fig8_weighted.csv", "fig8_weighted.png"],
    "unreliable": ["fig9_reliability.csv", "fig9_reliability.png"],
    "sweep": ["fig6_errors.csv", "fig6_errors.png", "fig6_slopes.csv", "tab1_weighting.csv", "tab1_weighting.png",
              "tab2_correlation.csv", "tab2_correlation.png", "bound.csv", "bound_vectorized.png",
              "bound_cut_at_the_true_corners.png"],
    "hypotheses": ["hypotheses.csv", "hypotheses.png", "definitions_tab1.csv", "definitions_tab2.csv"],
    "crumbs": ["crumbs.csv", "crumbs.png"],
    "raw_beams": ["raw_beams.csv", "raw_beams.png"],
    "unknown": ["unknown.csv", "unknown.png"],
    "basin": ["basin.csv", "basin.png"],
}  # fmt: skip
SHORT = {"printed", "mean_angles", "unreliable"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in SHORT else [pytest.mark.long]) for name in EXPERIMENTS]
)
def test_the_quick_mode_writes_tables_without_gaps_and_figures(name, tmp_path):
    run([name], QUICK, tmp_path, 1)
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(FILES[name])
    for path in tmp_path.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")
        assert path.stat().st_size > 3_000
    for path in tmp_path.glob("*.csv"):
        head, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
        assert rows
        assert all(len(row) == len(head) for row in rows)


def test_every_published_figure_and_table_comes_from_an_experiment():
    published = {p.name for p in (ROOT / "docs" / "dev" / "experiments").iterdir()}
    assert published <= {name for names in FILES.values() for name in names}
    text = (ROOT / "docs" / "dev" / "experiments.md").read_text(encoding="utf-8")
    assert all(f"experiments/{name}" in text for name in published if name.endswith(".png"))
