"""``linefix batch``: where the scans of many logs were taken."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .errors import RefusedError, WrongUseError
from .options import AsJson, UsableOptions, grouped
from .printing import noted, print_json, print_rows

if TYPE_CHECKING:
    from batch import Engine, FleetOptions, LogNote, Summary
    from batch import Progress as Done


@dataclass(frozen=True, slots=True)
class WorkerOptions:
    """The workers of a run, as options."""

    workers: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Number of processes. Default: the number of cores.")
    ] = None
    ray: Annotated[bool, typer.Option("--ray", help="Run on a Ray cluster: that of RAY_ADDRESS, or a new one.")] = False
    block: Annotated[
        int, typer.Option(min=1, max=65_536, metavar="N", help="Number of scans in the block of a worker.")
    ] = 512


@dataclass(frozen=True, slots=True)
class SearchChoice:
    """How to search each scan, as options."""

    undirected: Annotated[bool, typer.Option("--undirected", help="The directions of segments have no meaning.")] = (
        False
    )
    deadline_ms: Annotated[float, typer.Option(min=1.0, metavar="MS", help="Time limit of each search.")] = 10_000.0


@grouped
def batch(
    logs: Annotated[list[str], typer.Argument(metavar="LOGS", help="Parquet files, bags, MCAP files or CARMEN logs.")],
    maps: Annotated[Path, typer.Option(metavar="MAPS", help="A map file, or a folder of map files.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The Parquet file to write, one row per scan.")],
    workers: WorkerOptions,
    search: SearchChoice,
    usable: UsableOptions,
    as_json: AsJson = False,
) -> None:
    """Localize the scans of many logs; the same command continues an interrupted run.

    A scan lies on the map that its column map_id names, else on that named as its log, else on the only one.
    """
    if out.is_dir():
        raise WrongUseError(f"--out: found the folder {out}, expected a file")
    from registration import InputError

    begun = time.monotonic()
    try:
        from batch import associate_many

        with shown_progress() as watch:
            options = _options(workers.block, search, usable)
            summary = associate_many(logs, maps, out, options, _engine(workers), watch)
    except ModuleNotFoundError as error:
        extra = "ray" if workers.ray else "batch"
        raise RefusedError(
            f'linefix batch needs the package {error.name}: in a checkout, pip install ".[{extra}]"'
        ) from None
    except InputError as error:
        raise RefusedError(str(error)) from None
    if as_json:
        print_json(asdict(summary))
    else:
        print_rows(_rows(summary, time.monotonic() - begun))
    if summary.scans and summary.errors == summary.scans:
        raise RefusedError(f"none of the {summary.scans:,} scans could be searched; the first: {_first_error(out)}")


def _first_error(out: Path) -> str:
    """Return what is wrong with the first scan of a file of poses."""
    import pyarrow.parquet as pq

    return next((str(told) for told in pq.read_table(out, columns=["error"])["error"].to_pylist() if told), "unknown")


def _options(block: int, chosen: SearchChoice, usable: UsableOptions) -> FleetOptions:
    from association import AssociationOptions
    from batch import FleetOptions
    from linefix.compiling import compile_kernels

    search = AssociationOptions(max_alternatives=0, include=(), oriented=not chosen.undirected, **asdict(usable))
    return FleetOptions(search, chosen.deadline_ms, block, compile_kernels)


def _engine(chosen: WorkerOptions) -> Engine | None:
    from batch import OnRay, Processes

    if chosen.ray:
        if chosen.workers is not None:
            raise WrongUseError(
                "--workers: not possible with --ray, which uses all cores of the cluster; omit --workers"
            )
        return OnRay()
    return None if chosen.workers is None else Processes(chosen.workers)


def _rows(summary: Summary, seconds: float) -> list[tuple[str, str]]:
    searched = summary.scans - summary.taken_over
    rows = [("scans", f"{summary.scans:,}, of which {summary.taken_over:,} were done before")]
    rows += [(status, f"{count:,}") for status, count in sorted(summary.statuses.items())]
    rows += [("usable", f"{summary.usable:,}"), ("errors", f"{summary.errors:,}")]
    rows += [(note.kind, _noted(note)) for note in summary.notes]
    return [*rows, ("speed", f"{searched / max(seconds, 1e-9):,.0f} scans/s")]


def _noted(note: LogNote) -> str:
    """Return a note, with the log that it is of."""
    more = f" and {note.logs - 1:,} more" if note.logs > 1 else ""
    return f"{noted({'message': note.message, 'count': note.count})}, {Path(note.log).name}{more}"


@contextmanager
def shown_progress() -> Iterator[Callable[[Done], None]]:
    """Show the progress of a run on a terminal; yield the function that takes its steps."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal) as bars:
        known = {}

        def watch(progress: Done) -> None:
            if progress.stage not in known:
                known[progress.stage] = bars.add_task(progress.stage, total=progress.total)
                bars.reset(known[progress.stage], total=progress.total, completed=progress.done)
            bars.update(known[progress.stage], completed=progress.done)

        yield watch
