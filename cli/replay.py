"""``linefix replay``: the scans of a log, one after the other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby, islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TextIO

from .asking import Locate, Where
from .errors import NoSuchMapError, RefusedError
from .inputs import NamedMap, draw_picture, places_of, read_maps, target_of
from .logs import Frames, Tracker, map_of, mount_of, opened, pose_of, print_notes, scans_of
from .options import TopicOptions, UsableOptions, argument, grouped, option, required
from .printing import HINT, Json, Output, print_json, print_lines, progress, rows, table

if TYPE_CHECKING:
    from formats import LoggedScan
    from registration import RigidTransform


REFUSED = "refused"
FEW = 0.5  # of the scans; where fewer are usable the map may be to blame
MODE = "track: the prior is by odometry from the last usable pose; global: no prior."
NOTHING: Json = {"status": None, "usable": False, "pose": None, "reasons": [], "warnings": []}  # of a refused scan
FIELDS = ("status", "usable", "probability", "pose", "covariance", "reasons", "timing_ms")  # of a line of --json


@dataclass(frozen=True, slots=True)
class Located:
    """A scan and its verdict; `round` is that of the clock of the log, `map_id` empty without several maps."""

    stamp_ns: int
    round: int
    verdict: str
    usable: bool
    reasons: list[str]  # codes, as of `warnings`
    warnings: list[str]
    map_id: str
    pose: RigidTransform | None

    @classmethod
    def of(cls, one: LoggedScan, found: Json) -> Located:
        """Return the scan with its answer, or with the error why it is refused."""
        usable = "usable" if found["usable"] else "not usable"
        verdict = REFUSED if "error" in found else f"{found['status']}, {usable}"
        reasons, warnings = ([each["code"] for each in found[name]] for name in ("reasons", "warnings"))
        on = map_of(found) or ""
        return cls(one.stamp_ns, one.round, verdict, found["usable"], reasons, warnings, on, pose_of(found))


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
    opened_log, frames, found, refused = opened(log, source, mount), Frames(mount), list[Located](), ""
    options = {"include": [], "max_alternatives": 0, **asdict(usable)}
    broken: RefusedError | None = None
    tracker = Tracker() if scans.mode == "track" else None
    taken = islice(scans_of(opened_log), 0, None, scans.every)
    total = None if opened_log.count is None else -(-opened_log.count // scans.every)
    with where.opened() as service, progress() as show:
        locate = service.locating(target_of(maps), options, {**places_of(maps), "/scan": log.name})
        try:
            for one, answer in located(locate, taken, frames, tracker):
                found.append(Located.of(one, answer))
                show("scans", len(found), total)
                refused = answer.get("error", refused)
                if output.as_json:
                    print_json(_line(one, answer, several=len(maps) > 1))
        except RefusedError as error:  # the rest of the log cannot be read; what came before it counts
            if not found:
                raise
            broken = error
    if files.out is not None:
        _write_poses(found, files.out, output.notes)
    if files.picture is not None:
        _draw(maps, where, found, files.picture, output.notes)
    print_notes(opened_log, output.notes)
    print_lines(rows([("poses", frames.told)], 10), output.notes)
    if not output.as_json:
        print_lines(_lines(found, refused, where.server))
    if broken is None and refused and all(one.verdict == REFUSED for one in found):
        broken = RefusedError(refused)
    if broken is not None:
        raise broken


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
            yield one, {**NOTHING, "error": str(error)}
            continue
        if tracker is not None:
            tracker.learn(found, one)
        yield one, found


def _line(one: LoggedScan, found: Json, *, several: bool) -> Json:
    line = {"stamp": one.stamp, **{name: found.get(name) for name in FIELDS}, "child_frame_id": one.located_frame}
    line["error"] = found.get("error")
    return {**line, "map_id": map_of(found)} if several else line


def _write_poses(found: Sequence[Located], out: Path, where: TextIO) -> None:
    """Write the usable poses in the order of their stamps; those after a clock was set back to a file of their own."""
    from formats import StampedPose, write_tum

    usable = sorted((one for one in found if one.usable), key=lambda one: (one.round, one.stamp_ns))
    rounds = [list(poses) for _, poses in groupby(usable, key=lambda one: one.round)] or [[]]
    for number, poses in enumerate(rounds, 1):
        file = out if number == 1 else out.with_stem(f"{out.stem}-{number}")
        stamped = {one.stamp_ns: StampedPose(one.stamp_ns, one.pose) for one in poses if one.pose is not None}
        write_tum(stamped.values(), file)
        if len(rounds) > 1:
            seconds = f"{poses[0].stamp_ns / 1e9:.3f} to {poses[-1].stamp_ns / 1e9:.3f}"
            print_lines(rows([("poses", f"part {number} of the log, stamps {seconds}, in {file}")], 10), where)


def _draw(maps: Sequence[NamedMap], where: Where, found: Sequence[Located], picture: Path, notes: TextIO) -> None:
    """Draw the map and the poses on it; of several maps those with a usable pose, each to a file with its name."""
    several, drawn = len(maps) > 1, list[str]()
    for one in maps:
        mine = [each for each in found if each.pose is not None and each.map_id == (one.name if several else "")]
        usable, others = ([each.pose for each in mine if each.usable is kind] for kind in (True, False))
        if usable or not several:
            out = picture.with_stem(f"{picture.stem}-{one.name}") if several else picture
            draw_picture(where.whole_map(one.document), out, usable, others)
            drawn.append(str(out))
    if several:
        print_lines(rows([("picture", ", ".join(drawn) or "none: no map has a usable pose")], 10), notes)


def _lines(found: Sequence[Located], refused: str, server: str | None) -> Iterator[str]:
    count, usable = max(1, len(found)), [one for one in found if one.usable]
    verdicts = Counter(one.verdict for one in found).most_common()
    yield from table(("verdict", "scans", "fraction"), [(*one, f"{100.0 * one[1] / count:.1f} %") for one in verdicts])
    stays = [(name, list(poses)) for name, poses in groupby(usable, key=lambda one: one.map_id) if name]
    if stays:
        parts = [(name, 1e-9 * poses[0].stamp_ns, 1e-9 * poses[-1].stamp_ns, len(poses)) for name, poses in stays]
        yield from table(("map", "from", "to", "usable scans"), parts)
    reasons = Counter(code for one in found for code in one.reasons[:1])
    warnings = Counter(code for one in found for code in one.warnings)
    for name, counts in (("why not usable", reasons), ("warning", warnings)):
        if counts:
            yield from table((name, "scans"), counts.most_common())
    if len(usable) < FEW * len(found) or "map_scale" in warnings:
        yield from rows([("hint", HINT.format("" if server is None else f" --server {server}"))])
    if refused:
        yield from rows([("refused", refused)])
