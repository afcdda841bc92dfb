"""The picture of the comparison: success over time, a panel for each kind of scene and level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes

from ..pictures import COLOURS, panels, save
from ..table import mean, quantile
from .adapters import PEERS
from .race import Attempt
from .scenes import Cell


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
