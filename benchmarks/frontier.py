"""Accepted right answers over accepted out-of-map scans, for thresholds of the cautious probability: a picture.

Scans of the drawn worlds that nothing was fitted on, as ranges and as segments, with the models as they are. Of an
answer goes in what the models weigh; the second look at its alternatives and a search that was cut short are left out.

``python -m benchmarks.frontier [--stride 1] [--keep FOLDER]``
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from association.verdict.models import MODELS
from association.verdict.tuning import USABLE_CAUTIOUS

from .curves import Answers
from .examples import RANGES, SEGMENTS, Example, collected
from .full_path import by_model
from .pictures import COLOURS, panels, save
from .table import print_table
from .worlds.goals import KEPT

BARS = (0.0, 0.3, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.88, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99, 0.995)
STRANGE = ("unmapped", "sister")  # the conditions whose scans are hardest to tell


@dataclass(frozen=True, slots=True)
class Point:
    """The result of a threshold, percent of the scans.

    Attributes
    ----------
    bar : float
        The threshold of the cautious probability.
    kept : dict
        Usable and right, by group of conditions.
    let_in : float
        Usable of the out-of-map scans, where the scan shows that they are.
    wrong : float
        Usable but wrong of the usable, of scans in their map.
    """

    bar: float
    kept: dict[str, float]
    let_in: float
    wrong: float


def frontier(form: str, examples: Sequence[Example], bars: Sequence[float] = BARS) -> list[Point]:
    """Return a point for each bar, of examples of one form."""
    p = by_model(MODELS[form], Answers.of(examples))
    open_to = ~np.array([e.degenerate for e in examples])
    right, told = np.array([e.right for e in examples]), np.array([e.told for e in examples])
    here = ~np.array([e.stranger for e in examples])
    conditions = np.array([e.condition for e in examples])
    found = []
    for bar in bars:
        usable = open_to & (p.careful >= bar)
        kept = {
            name: 100.0 * float(np.mean((usable & right)[here & np.isin(conditions, group)]))
            for name, (group, _, _) in KEPT.items()
        }
        let_in = 100.0 * float(np.mean((usable & told)[np.isin(conditions, STRANGE)]))
        wrong = 100.0 * float(np.sum(usable & here & ~right) / max(1, np.sum(usable & here)))
        found.append(Point(bar, kept, let_in, wrong))
    return found


def draw(found: dict[str, list[Point]], chosen: dict[str, Point]) -> None:
    """Draw what is kept over what is let in, a plot for each form, with the point that was chosen."""
    title = "Accepted right answers over accepted out-of-map scans, by threshold"
    figure, [axes] = panels(1, len(found), (5.2, 4.0), title)
    for ax, (form, points) in zip(axes, found.items(), strict=True):
        for colour, name in zip(COLOURS, KEPT, strict=False):
            ax.plot([p.let_in for p in points], [p.kept[name] for p in points], ".-", color=colour, label=name)
            ax.plot(chosen[form].let_in, chosen[form].kept[name], "o", color=colour, markersize=9)
        ax.set(title=f"as {form}", xlabel=f"usable out-of-map scans ({' and '.join(STRANGE)}), %",
               ylabel="usable and right, % of the scans", ylim=(0, 100))  # fmt: skip
        ax.set_xlim(left=0)
        ax.legend(loc="lower right", title=f"circle: the bar of {chosen[form].bar:g}")
    save(figure, "verdict-frontier")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.frontier", description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many cases")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep answers there, and read those that are")
    args = parser.parse_args()
    found, chosen = {}, {}
    for form in (RANGES, SEGMENTS):
        examples = collected(args.keep, form, args.stride, kept_for_report=True)
        found[form] = frontier(form, examples)
        [chosen[form]] = frontier(form, examples, [USABLE_CAUTIOUS])
        cells = [
            (f"{p.bar:g}", *(f"{share:.1f}" for share in p.kept.values()), f"{p.let_in:.2f}", f"{p.wrong:.2f}")
            for p in found[form]
        ]
        print_table(f"Scans as {form}, {len(examples)} answers, %", ("bar", *KEPT, "let in", "wrong of usable"), cells)
    draw(found, chosen)


if __name__ == "__main__":
    main()
