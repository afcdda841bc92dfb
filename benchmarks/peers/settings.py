"""The peers' settings for each level, as `tuning` found them on queries of their own."""

from __future__ import annotations

from typing import Any

from .corners import CornerOptions

PLANS = "plans"  # stands for every level of the floor plans

SETTINGS: dict[tuple[str, str], dict[str, Any]] = {
    ("kiss", "standard"): {
        "bound": 0.15,
        "gain": 0.5,
        "tips": False,
        "options": CornerOptions(seen_reach=0.7, known_reach=0.5, turn=5.0, slack=0.15, most=1000, headings=4),
    },
    ("kiss", "hard"): {
        "bound": 0.08,
        "gain": 1.0,
        "tips": False,
        "options": CornerOptions(seen_reach=1.5, known_reach=2.0, turn=12.0, slack=0.15, most=3000, headings=8),
    },
    ("kiss", "extreme"): {
        "bound": 0.15,
        "gain": 1.0,
        "tips": False,
        "options": CornerOptions(seen_reach=3.0, known_reach=2.0, turn=8.0, slack=0.1, most=3000, headings=8),
    },
    ("kiss", "plans"): {
        "bound": 0.15,
        "gain": 1.0,
        "tips": False,
        "options": CornerOptions(seen_reach=0.3, known_reach=0.05, turn=4.0, slack=0.1, most=10000, headings=4),
    },
    ("opencv", "standard"): {
        "threshold": 0.15,
        "trials": 10000,
        "options": CornerOptions(seen_reach=0.7, known_reach=0.05, turn=4.0, slack=0.1, most=1000, headings=4),
    },
    ("opencv", "hard"): {
        "threshold": 0.15,
        "trials": 10000,
        "options": CornerOptions(seen_reach=1.5, known_reach=2.0, turn=3.0, slack=0.15, most=1000, headings=8),
    },
    ("opencv", "extreme"): {
        "threshold": 0.15,
        "trials": 10000,
        "options": CornerOptions(seen_reach=3.0, known_reach=2.0, turn=4.0, slack=0.1, most=3000, headings=4),
    },
    ("opencv", "plans"): {
        "threshold": 0.08,
        "trials": 2000,
        "options": CornerOptions(seen_reach=3.0, known_reach=1.0, turn=4.0, slack=0.15, most=1000, headings=8),
    },
    ("gicp", "standard"): {"spacing": 0.2, "rounds": (1.0, 0.5, 0.2), "kind": "PLANE_ICP"},
    ("gicp", "hard"): {"spacing": 0.2, "rounds": (1.0, 0.3), "kind": "PLANE_ICP"},
    ("gicp", "extreme"): {"spacing": 0.1, "rounds": (1.0, 0.3), "kind": "GICP"},
    ("gicp", "plans"): {"spacing": 0.2, "rounds": (1.0, 0.5, 0.2), "kind": "GICP"},
    ("clipper", "standard"): {
        "reach": 0.04,
        "twist": 3.0,
        "options": CornerOptions(seen_reach=0.7, known_reach=0.05, turn=3.0, slack=0.1, most=1000, headings=4),
    },
    ("skimage", "standard"): {
        "threshold": 0.2,
        "trials": 1000,
        "options": CornerOptions(seen_reach=0.3, known_reach=0.5, turn=3.0, slack=0.15, most=1000, headings=0),
    },
    ("skimage", "hard"): {
        "threshold": 0.5,
        "trials": 1000,
        "options": CornerOptions(seen_reach=1.5, known_reach=2.0, turn=5.0, slack=0.1, most=10000, headings=0),
    },
    ("skimage", "extreme"): {
        "threshold": 0.2,
        "trials": 3000,
        "options": CornerOptions(seen_reach=1.5, known_reach=0.5, turn=8.0, slack=0.1, most=3000, headings=0),
    },
    ("skimage", "plans"): {
        "threshold": 0.5,
        "trials": 300,
        "options": CornerOptions(seen_reach=1.5, known_reach=0.05, turn=3.0, slack=0.15, most=3000, headings=0),
    },
    ("clipper", "hard"): {
        "reach": 0.08,
        "twist": 3.0,
        "options": CornerOptions(seen_reach=1.5, known_reach=0.5, turn=4.0, slack=0.1, most=1000, headings=4),
    },
    ("open3d", "standard"): {
        "threshold": 0.2,
        "trials": 20000,
        "options": CornerOptions(seen_reach=0.3, known_reach=1.0, turn=3.0, slack=0.15, most=1000, headings=4),
    },
    ("open3d", "hard"): {
        "threshold": 0.3,
        "trials": 20000,
        "options": CornerOptions(seen_reach=1.5, known_reach=2.0, turn=5.0, slack=0.25, most=1000, headings=8),
    },
    ("open3d", "extreme"): {
        "threshold": 0.3,
        "trials": 5000,
        "options": CornerOptions(seen_reach=3.0, known_reach=2.0, turn=4.0, slack=0.1, most=1000, headings=4),
    },
    ("open3d", "plans"): {
        "threshold": 0.2,
        "trials": 5000,
        "options": CornerOptions(seen_reach=1.5, known_reach=1.0, turn=3.0, slack=0.1, most=3000, headings=4),
    },
    ("clipper", "extreme"): {
        "reach": 0.08,
        "twist": 3.0,
        "options": CornerOptions(seen_reach=3.0, known_reach=2.0, turn=5.0, slack=0.1, most=1000, headings=0),
    },
}


def settings(key: str, level: str) -> dict[str, Any]:
    """Return how a peer is made for a level; nothing where its defaults stand."""
    return SETTINGS.get((key, PLANS if level.startswith("scan") else level), {})
