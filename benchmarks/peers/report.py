"""Linefix next to its peers: the same queries for all, success and processor time, and what Linefix says of itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version

from matplotlib.axes import Axes

from ..outcomes import progress
from ..pictures import COLOURS, panels, save
from ..table import Row, at_least, at_most, mean, print_rows, print_table, quantile
from .adapters import PEERS
from .race import GIVE_UP, LIMIT, Attempt, Racer, attempts
from .scenes import Cell, all_cells
from .settings import settings

SEED = 20190901
QUERIES = 40  # a cell
NEAR = 0.02  # of success, within which a peer must be slower
PACKAGES = {"kiss": "kiss-matcher", "opencv": "opencv-python-headless", "open3d": "open3d", "skimage": "scikit-image",
            "gicp": "small-gicp", "clipper": "clipperpy"}  # fmt: skip

Found = dict[str, list[list[Attempt]]]  # by peer and cell


def peers(quick: int) -> list[Row]:
    """Run all that are installed, print the tables, draw the picture, return the rows that were judged."""
    cells = all_cells(max(4, QUERIES // quick), SEED)
    found: Found = {}
    for key in PEERS:
        asked = run(key, cells)
        if asked is not None:
            found[key] = asked
    everywhere = [key for key in found if not PEERS[key].local]
    guessing = [key for key in found if PEERS[key].local]
    _print(f"Beside the peers, {len(cells[0].queries)} scans a cell: right, median / p95 ms", cells, found, everywhere)
    _print("From a guess 0.5 m and 10 degrees off: right, median / p95 ms", cells, found, guessing)
    _print_honesty(cells, found["linefix"])
    draw(cells, found)
    rows = [row for own, others in (("linefix", everywhere), ("guided", guessing))
            for row in judged(cells, found, own, others)]  # fmt: skip
    print_rows("Linefix against the best peer, and the fastest of those within two points", rows)
    return rows


def run(key: str, cells: list[Cell]) -> list[list[Attempt]] | None:
    """Ask a peer everything; None, and a line that says why, where it is missing."""
    found: list[list[Attempt]] = []
    racer, made = None, None
    for k, cell in enumerate(cells):
        wanted = settings(key, cell.level)
        if racer is None or wanted != made:
            if racer is not None:
                racer.close()
            racer, made = Racer(key, options=wanted), wanted
            reason = racer.missing()
            if reason is not None:
                print(f"{PEERS[key].name} is left out: {reason}")
                return None
        found.append(list(attempts(racer, cell)))
        progress(f"{PEERS[key].name}, cells", k + 1, len(cells))
    if racer is not None:
        racer.close()
    return found


def judged(cells: list[Cell], found: Found, own: str, others: list[str]) -> list[Row]:
    """Compare one with the others, cell by cell."""
    rows = []
    rivals = [key for key in others if key != own]
    if not rivals:
        return []
    for k, cell in enumerate(cells):
        name = f"{cell.name}{', guess' if PEERS[own].local else ''}"
        share = {key: mean(a.right for a in found[key][k]) for key in [own, *rivals]}
        time = {key: quantile((a.ms for a in found[key][k]), 0.5) for key in [own, *rivals]}
        rows.append(at_least(f"{name}: right", round(share[own], 3), round(max(share[key] for key in rivals), 3)))
        near = [time[key] for key in rivals if share[key] >= share[own] - NEAR]
        rows.append(at_most(f"{name}: median ms", time[own], round(min(near), 3) if near else None, form=".3f"))
    return rows


def _print(title: str, cells: list[Cell], found: Found, keys: list[str]) -> None:
    head = ("scenes", *(PEERS[key].name for key in keys))
    print_table(title, head, [(c.name, *(_told(found[key][k]) for key in keys)) for k, c in enumerate(cells)])
    lost = {PEERS[key].name: sum(a.out_of_time for cell in found[key] for a in cell) for key in keys}
    told = ", ".join(f"{name} {count}" for name, count in lost.items() if count)
    if told:
        print(f"\nOut of time at {1e3 * LIMIT:.0f} ms: {told}. After {GIVE_UP} in a cell the rest of it is not asked.")


def _told(asked: list[Attempt]) -> str:
    ms = [a.ms for a in asked]
    return f"{100.0 * mean(a.right for a in asked):.0f} % {quantile(ms, 0.5):.2f} / {quantile(ms, 0.95):.2f}"


def _print_honesty(cells: list[Cell], asked: list[list[Attempt]]) -> None:
    lines = [(cell.name, list(found)) for cell, found in zip(cells, asked, strict=True)]
    lines.append(("all", [a for found in asked for a in found]))
    body = [
        (name, f"{mean(a.right for a in found):.3f}", f"{mean(bool(a.usable) for a in found):.3f}",
         str(sum(not a.right for a in found)), str(sum(bool(a.usable) and not a.right for a in found)))
        for name, found in lines
    ]  # fmt: skip
    print_table("What Linefix says of itself", ("scenes", "right", "usable", "wrong", "wrong called usable"), body)


def versions() -> str:
    """Tell which peers are installed, in which versions."""
    told = []
    for name in PACKAGES.values():
        try:
            told.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(told) or "none"


def draw(cells: Sequence[Cell], found: Mapping[str, list[list[Attempt]]]) -> None:
    """Draw for each peer a line through its map sizes, the greater the dot the greater the map."""
    groups: dict[str, dict[str, list[int]]] = {}
    for k, cell in enumerate(cells):
        groups.setdefault(cell.kind, {}).setdefault(cell.level, []).append(k)
    figure, axes = panels(len(groups), 3, (4.2, 3.2), "Success over processor time: up and to the left is better")
    for row, (kind, levels) in zip(axes, groups.items(), strict=True):
        for ax, (level, chosen) in zip(row, levels.items(), strict=False):
            for colour, key in zip(COLOURS, found, strict=False):
                _line(ax, colour, key, [(cells[k], found[key][k]) for k in chosen])
            ax.set(xscale="log", ylim=(-4, 104), title=f"{kind}, {level}", xlabel="median ms", ylabel="right, %")
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    save(figure, "peers")


def _line(ax: Axes, colour: str, key: str, found: list[tuple[Cell, list[Attempt]]]) -> None:
    x = [quantile((a.ms for a in asked), 0.5) for _, asked in found]
    y = [100.0 * mean(a.right for a in asked) for _, asked in found]
    sizes = [12.0 + 12.0 * k for k in range(len(found))] if len(found) > 1 else [30.0]
    ours = PEERS[key].module == "association"
    style = "--" if PEERS[key].local else "-"
    ax.plot(x, y, style, color=colour, linewidth=2.2 if ours else 1.0, label=PEERS[key].name, zorder=3 if ours else 2)
    ax.scatter(x, y, sizes, color=colour, zorder=3 if ours else 2)
