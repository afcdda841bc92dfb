"""``linefix batch``: where the scans of many logs were taken."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from .errors import RefusedError, WrongUseError, needing
from .options import UsableOptions, argument, flag, grouped, option, required
from .printing import Output, compile_first, outline, progress


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to search the scans, as options."""

    workers: int | None = option(None, "Number of processes. Default: the number of cores.", "N", min=1)
    ray: bool = flag("Run on a Ray cluster: that of RAY_ADDRESS, or a new one.", "--ray")
    block: int = option(512, "Number of scans in the block of a worker.", "N", min=1, max=65_536)
    deadline_ms: float = option(10_000.0, "Time limit of each search.", "MS", min=1.0)


@grouped
def batch(
    logs: Annotated[list[str], argument("Parquet files, bags, MCAP files or CARMEN logs.", "LOGS")],
    maps: Annotated[Path, required("A map file, or a folder of map files.", "MAPS")],
    out: Annotated[Path, required("The Parquet file to write, one row per scan.", "FILE")],
    run: RunOptions,
    usable: UsableOptions,
    output: Output,
) -> None:
    """Localize the scans of many logs; the same command continues an interrupted run.

    A scan lies on the map that its column map_id names, else on that named as its log, else on the only one.
    """
    if out.is_dir():
        raise WrongUseError(f"--out: found the folder {out}, expected a file")
    if run.ray and run.workers is not None:
        raise WrongUseError("--workers: --ray uses all cores of the cluster; omit --workers")
    begun = time.monotonic()
    with needing("linefix batch", "ray" if run.ray else "batch"), progress() as show:
        from batch import FleetOptions, OnRay, Processes, associate_many

        compile_first()
        options = FleetOptions(**asdict(usable), deadline_ms=run.deadline_ms, block=run.block)
        engine = OnRay() if run.ray else None if run.workers is None else Processes(run.workers)
        summary = associate_many(logs, maps, out, options, engine, show)
    speed = (summary.scans - summary.taken_over) / max(time.monotonic() - begun, 1e-9)
    output.print(asdict(summary), outline({**asdict(summary), "scans_per_second": speed}))
    if summary.scans and summary.errors == summary.scans:
        raise RefusedError(f"none of the {summary.scans:,} scans could be searched; the first: {_first_error(out)}")


def _first_error(out: Path) -> str:
    """Return what is wrong with the first scan of a file of poses."""
    import pyarrow.parquet as pq

    return next((str(told) for told in pq.read_table(out, columns=["error"])["error"].to_pylist() if told), "unknown")
