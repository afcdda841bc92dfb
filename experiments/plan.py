"""Number of runs of each experiment."""

from __future__ import annotations

from dataclasses import dataclass

SEED = 20190901


@dataclass(frozen=True, slots=True)
class Plan:
    """Sizes of all experiments.

    Attributes
    ----------
    scans : int
        From each pose under each condition; the paper's 100.
    points : tuple of int
        Per scan.
    sigmas : tuple of float
        Noise of a range, units; the paper's 1, 3 and 10.
    test_points : tuple of int
        Per scan, where a hypothesis is tested.
    test_scans : int
        From each pose there.
    search_scans : int
        From each pose to be searched for without correspondences.
    basin_scans : int
        From each pose, for every pair of initial errors of the iterative closest point method.
    basin_steps : int
        Of the initial errors, each way.
    draws : int
        Of the averages of angles, for each noise.
    counts : tuple of int
        Of pairs, where time and rounding are measured.
    seed : int
    """

    scans: int = 100
    points: tuple[int, ...] = (100, 150, 200, 300, 500, 700, 1000, 1500)
    sigmas: tuple[float, ...] = (1.0, 3.0, 10.0)
    test_points: tuple[int, ...] = (300, 1000)
    test_scans: int = 20
    search_scans: int = 20
    basin_scans: int = 2
    basin_steps: int = 7
    draws: int = 20_000
    counts: tuple[int, ...] = (10, 100, 1_000, 10_000, 100_000, 1_000_000)
    seed: int = SEED


FULL = Plan()
QUICK = Plan(
    scans=3,
    points=(200, 800),
    sigmas=(1.0, 10.0),
    test_points=(300,),
    test_scans=3,
    search_scans=1,
    basin_scans=1,
    basin_steps=3,
    draws=500,
    counts=(10, 100, 1_000),
)
