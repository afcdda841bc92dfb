"""``linefix batch``: where the scans of many logs were taken."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from .errors import RefusedError, WrongUseError, needing
from .options import ORIENTED, UsableOptions, argument, flag, grouped, option, required
from .printing import Output, noted, progress, rows

if TYPE_CHECKING:
    from batch import LogNote, Summary


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How to search the scans, as options."""

    workers: int | None = option(None, "Number of processes. Default: the number of cores.", "N", min=1)
    ray: bool = flag("Run on a Ray cluster: that of RAY_ADDRESS, or a new one.", "--ray")
    block: int = option(512, "Number of scans in the block of a worker.", "N", min=1, max=65_536)
    oriented: bool = flag(*ORIENTED, default=True)
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
        from association import AssociationOptions
        from batch import FleetOptions, OnRay, Processes, associate_many
        from linefix.compiling import compile_kernels

        search = AssociationOptions(max_alternatives=0, include=(), oriented=run.oriented, **asdict(usable))
        options = FleetOptions(search, run.deadline_ms, run.block, compile_kernels)
        engine = OnRay() if run.ray else None if run.workers is None else Processes(run.workers)
        summary = associate_many(logs, maps, out, options, engine, show)
    output.print(asdict(summary), rows(_rows(summary, time.monotonic() - begun)))
    if summary.scans and summary.errors == summary.scans:
        raise RefusedError(f"none of the {summary.scans:,} scans could be searched; the first: {_first_error(out)}")


def _first_error(out: Path) -> str:
    """Return what is wrong with the first scan of a file of poses."""
    import pyarrow.parquet as pq

    return next((str(told) for told in pq.read_table(out, columns=["error"])["error"].to_pylist() if told), "unknown")


def _rows(summary: Summary, seconds: float) -> list[tuple[str, str]]:
    searched = summary.scans - summary.taken_over
    found = [("scans", f"{summary.scans:,}, of which {summary.taken_over:,} were done before")]
    found += [(status, f"{count:,}") for status, count in sorted(summary.statuses.items())]
    found += [("usable", f"{summary.usable:,}"), ("errors", f"{summary.errors:,}")]
    found += [(note.kind, _noted(note)) for note in summary.notes]
    return [*found, ("speed", f"{searched / max(seconds, 1e-9):,.0f} scans/s")]


def _noted(note: LogNote) -> str:
    """Return a note, with the log that it is of."""
    more = f" and {note.logs - 1:,} more" if note.logs > 1 else ""
    return f"{noted({'message': note.message, 'count': note.count})}, {Path(note.log).name}{more}"
