"""``linefix replay``: the scans of a log, one after the other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from itertools import groupby, islice
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated, Literal, TextIO

from .asking import Locate, Where
from .errors import NoSuchMapError, RefusedError
from .inputs import NamedMap, draw_picture, places_of, read_maps, target_of
from .logs import Frames, Tracker, map_of, mount_of, opened, pose_of, print_notes, scans_of
from .options import TopicOptions, UsableOptions, argument, grouped, option, required
from .printing import Json, Lines, Output, print_json, print_lines, progress, rows, table

if TYPE_CHECKING:
    from formats import Log, LoggedScan
    from registration import RigidTransform


FEW = 0.5  # of the scans; where fewer are usable the map may be to blame
HINT = "linefix map check MAP --log LOG{} tests the scale, the handedness and the directions of the map"
MODE = "track: the prior is by odometry from the last usable pose; global: no prior."
FIELDS = ("status", "usable", "probability", "pose", "covariance", "reasons", "timing_ms")  # of a line of --json


@dataclass(frozen=True, slots=True)
class Located:
    """A pose that was found; `round` is that of the clock of the log, `map_id` empty without several maps."""

    stamp_ns: int
    round: int
    map_id: str
    usable: bool
    pose: RigidTransform


@dataclass(slots=True)
class Tally:
    """Counts and poses of the scans so far."""

    verdicts: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    warnings: Counter[str] = field(default_factory=Counter)
    times: list[float] = field(default_factory=list)  # ms
    poses: list[Located] = field(default_factory=list)
    refused: str | None = None  # the last message

    @property
    def count(self) -> int:
        """The number of scans so far."""
        return sum(self.verdicts.values())

    @property
    def usable(self) -> list[Located]:
        """The usable poses so far."""
        return [one for one in self.poses if one.usable]

    def take(self, one: LoggedScan, found: Json) -> None:
        """Count an answer, and keep its pose."""
        if "error" in found:
            self.verdicts["refused"] += 1
            self.refused = found["error"]
            return
        usable, pose = found["usable"], pose_of(found)
        self.verdicts[found["status"] + (", usable" if usable else ", not usable")] += 1
        self.reasons.update(reason["code"] for reason in found["reasons"][:1])
        self.warnings.update(warning["code"] for warning in found["warnings"])
        self.times.append(found["timing_ms"]["total"])
        if pose is not None:
            self.poses.append(Located(one.stamp_ns, one.round, map_of(found) or "", usable, pose))


@dataclass(frozen=True, slots=True)
class ScanOptions:
    """Which scans of a log to localize, and how, as options."""

    mount: tuple[float, float, float] | None = option(None, "Pose of the laser on the robot.", "X Y THETA")
    mode: Literal["track", "global"] = option("track", MODE)
    every: int = option(1, "Use each Nth scan.", "N", min=1)


@dataclass(frozen=True, slots=True)
class ResultFiles:
    """The files to write, as options."""

    out: Path | None = option(None, "Write the usable poses to this file in the TUM format.", "FILE")
    picture: Path | None = option(None, "Draw map and poses to this PNG file; usable poses are green.", "FILE")


@grouped
def replay(
    log: Annotated[Path, argument("A bag of ROS 1 or ROS 2, an MCAP file, or a CARMEN log.", "LOG")],
    on: Annotated[list[str], required("A map file, a folder, or the id of a stored map; repeatable.", "MAP", "--map")],
    source: TopicOptions,
    scans: ScanOptions,
    usable: UsableOptions,
    where: Where,
    output: Output,
    files: ResultFiles,
) -> None:
    """Localize the scans of a log one after the other. With --json, print one line per scan.

    Poses are those of the robot if --mount or the log has the mount of the laser. Otherwise they are those of the
    laser.
    """
    mount, maps = mount_of(scans.mount), read_maps(on)
    opened_log, tally, frames = opened(log, source, mount), Tally(), Frames(mount)
    broken: RefusedError | None = None
    options = {"include": [], "max_alternatives": 0, **asdict(usable)}
    with where.opened() as service:
        locate = service.locating(target_of(maps), options, {**places_of(maps), "/scan": log.name})
        taken = _shown(islice(scans_of(opened_log), 0, None, scans.every), opened_log, scans.every)
        try:
            for one, found in located(locate, taken, frames, Tracker() if scans.mode == "track" else None):
                tally.take(one, found)
                if output.as_json:
                    print_json(_line(one, found, frames, several=len(maps) > 1))
        except RefusedError as error:  # the rest of the log cannot be read; what came before it counts
            if not tally.count:
                raise
            broken = error
    if files.out is not None:
        _write_poses(tally, files.out, output.notes)
    if files.picture is not None:
        _draw(maps, where, tally, files.picture, output.notes)
    print_notes(opened_log, output.notes)
    print_lines(_log_lines(opened_log, frames), output.notes)
    if not output.as_json:
        print_lines(_lines(tally, where.server))
    if broken is not None:
        raise broken
    if tally.refused is not None and tally.count == tally.verdicts["refused"]:
        raise RefusedError(tally.refused)


def located(
    locate: Locate, scans: Iterator[LoggedScan], frames: Frames, tracker: Tracker | None
) -> Iterator[tuple[LoggedScan, Json]]:
    """Yield each scan with its answer; that of a scan that is refused has the reason as its ``error``.

    With a tracker the prior comes from the answers before and odometry.
    """
    from formats import scan_json

    for one in scans:
        try:
            one = frames.taken(one)
            prior = None if tracker is None else tracker.prior(one)
            found = locate({"scan": scan_json(one)} | ({} if prior is None else {"prior": prior}))
        except RefusedError as error:
            if isinstance(error, NoSuchMapError) or error.pointer.startswith("/map"):
                raise
            yield one, {"usable": False, "reasons": [], "error": str(error)}
            continue
        if tracker is not None:
            tracker.learn(found, one)
        yield one, found


def _shown(scans: Iterator[LoggedScan], log: Log, every: int) -> Iterator[LoggedScan]:
    """Yield the scans; show the progress on a terminal."""
    total = None if log.count is None else -(-log.count // every)
    with progress() as show:
        for number, one in enumerate(scans, 1):
            yield one
            show("scans", number, total)


def _line(one: LoggedScan, found: Json, frames: Frames, *, several: bool) -> Json:
    line = {"stamp": one.stamp, **{name: found.get(name) for name in FIELDS}, "child_frame_id": frames.name}
    line["error"] = found.get("error")
    return {**line, "map_id": map_of(found)} if several else line


def _write_poses(tally: Tally, out: Path, where: TextIO) -> None:
    """Write the usable poses in the order of their stamps; those after a clock was set back to a file of their own."""
    from formats import StampedPose, write_tum

    usable = sorted(tally.usable, key=lambda one: (one.round, one.stamp_ns))
    rounds = [list(poses) for _, poses in groupby(usable, key=lambda one: one.round)] or [[]]
    for number, poses in enumerate(rounds, 1):
        file = out if number == 1 else out.with_stem(f"{out.stem}-{number}")
        stamped = {one.stamp_ns: StampedPose(one.stamp_ns, one.pose) for one in poses}
        write_tum(stamped.values(), file)
        if len(rounds) > 1:
            seconds = f"{poses[0].stamp_ns / 1e9:.3f} to {poses[-1].stamp_ns / 1e9:.3f}"
            print_lines(rows([("poses", f"part {number} of the log, stamps {seconds}, in {file}")], 10), where)


def _draw(maps: Sequence[NamedMap], where: Where, tally: Tally, picture: Path, notes: TextIO) -> None:
    """Draw the map and the poses on it; of several maps those with a usable pose, each to a file with its name."""
    several, drawn = len(maps) > 1, []
    for one in maps:
        mine = [pose for pose in tally.poses if pose.map_id == (one.name if several else "")]
        usable, others = ([pose.pose for pose in mine if pose.usable is kind] for kind in (True, False))
        if usable or not several:
            out = picture.with_stem(f"{picture.stem}-{one.name}") if several else picture
            draw_picture(where.whole_map(one.document), out, usable, others)
            drawn.append(out)
    if several:
        written = ", ".join(str(out) for out in drawn) or "none: no map has a usable pose"
        print_lines(rows([("picture", written)], 10), notes)


def _log_lines(log: Log, frames: Frames) -> Lines:
    """Return what was read of the log, and whose poses are printed."""
    from linefix.ranges import SPEED, TURN

    codes, found = {note.code for note in log.report.assumed}, []
    if "no_odometry" in codes:
        found.append(("prior", "none without odometry: each scan is searched on the whole map"))
    if "motion" in codes:
        wider = f"{SPEED:.1f} m/s and {TURN:.1f} rad/s"
        found.append(("poses", f"covariances include an unknown motion of {wider} for scans without odometry"))
    return rows([*found, ("poses", frames.told)], 10)


def _lines(tally: Tally, server: str | None) -> Iterator[str]:
    count, usable = max(1, tally.count), tally.usable
    verdicts = [(name, number, f"{100.0 * number / count:.1f} %") for name, number in tally.verdicts.most_common()]
    yield from table(("verdict", "scans", "fraction"), verdicts)
    stays = [(name, list(poses)) for name, poses in groupby(usable, key=lambda one: one.map_id) if name]
    if stays:
        parts = [(name, 1e-9 * poses[0].stamp_ns, 1e-9 * poses[-1].stamp_ns, len(poses)) for name, poses in stays]
        yield from table(("map", "from", "to", "usable scans"), parts)
    for name, counts in (("why not usable", tally.reasons), ("warning", tally.warnings)):
        if counts:
            yield from table((name, "scans"), counts.most_common())
    if len(usable) < FEW * tally.count or "map_scale" in tally.warnings:
        yield from rows([("hint", HINT.format("" if server is None else f" --server {server}"))])
    if tally.refused is not None:
        yield from rows([("refused", tally.refused)])
    if tally.times:
        told = f"{median(tally.times):.1f} ms a scan in the median, {max(tally.times):.1f} ms at most"
        yield from rows([("time", told)])
