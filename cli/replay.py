"""``linefix replay``: the scans of a log, one after the other."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from itertools import islice
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated, TextIO

from .asking import answering, server_at
from .errors import CommandError, NoSuchMapError, RefusedError, refusing
from .inputs import documents_of, draw_picture, read_target
from .logs import opened, options_of, print_notes, scans_of
from .options import AsJson, File, LogTopic, Server, TfNamespace, UsableOptions, argument, grouped, option
from .printing import Json, plain, print_json, print_rows, print_table
from .progress import progress
from .tracking import Frames, Stays, Tracker, map_of, pose_of

if TYPE_CHECKING:
    from formats import Log, LoggedScan, StampedPose
    from registration import RigidTransform


HOPELESS = 20  # scans from the first on
FEW = 0.5  # of the scans; where fewer are usable the map may be to blame
HINT = "linefix map check MAP --log LOG tests the scale, the handedness and the directions of the map"


class Mode(StrEnum):
    """Where to look."""

    TRACK = "track"
    GLOBAL = "global"


TRACK = Mode.TRACK


@dataclass(slots=True)
class Tally:
    """Counts and poses of the scans so far."""

    verdicts: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    warnings: Counter[str] = field(default_factory=Counter)
    times: list[float] = field(default_factory=list)  # ms
    rounds: dict[int, list[StampedPose]] = field(default_factory=dict)  # usable poses, by the round of their clock
    on_map: dict[str, tuple[list[RigidTransform], list[RigidTransform]]] = field(default_factory=dict)  # usable, others
    refused: CommandError | None = None  # the last
    stays: Stays = field(default_factory=Stays)

    @property
    def count(self) -> int:
        """The number of scans so far."""
        return sum(self.verdicts.values())

    def take(self, one: LoggedScan, found: Json | CommandError) -> None:
        """Count an answer, and keep its pose."""
        from formats import StampedPose

        if isinstance(found, CommandError):
            self.verdicts["refused"] += 1
            self.refused = found
            return
        usable, pose = found["usable"], pose_of(found)
        self.verdicts[found["status"] + (", usable" if usable else ", not usable")] += 1
        self.reasons.update(reason["code"] for reason in found["reasons"][:1])
        self.warnings.update(warning["code"] for warning in found["warnings"])
        self.times.append(found["timing_ms"]["total"])
        self.stays.take(one.stamp_ns, found)
        if pose is not None:
            self.on_map.setdefault(map_of(found) or "", ([], []))[0 if usable else 1].append(pose)
            if usable:
                self.rounds.setdefault(one.round, []).append(StampedPose(one.stamp_ns, pose))


@dataclass(frozen=True, slots=True)
class ScanChoice:
    """Which scans of a log to localize, and how, as options."""

    topic: LogTopic = None
    tf_namespace: TfNamespace = None
    mount: Annotated[tuple[float, float, float] | None, option("Pose of the laser on the robot.", "X Y THETA")] = None
    mode: Annotated[Mode, option("track: the prior is by odometry from the last usable pose; global: no prior.")] = (
        TRACK
    )
    every: Annotated[int, option("Use each Nth scan.", "N", min=1)] = 1


@grouped
def replay(
    log: Annotated[Path, argument("A bag of ROS 1 or ROS 2, an MCAP file, or a CARMEN log.", "LOG")],
    on: Annotated[list[str], option("A map file, a folder, or the id of a stored map; repeatable.", "MAP", "--map")],
    scans: ScanChoice,
    usable: UsableOptions,
    out: Annotated[File, option("Write the usable poses to this file in the TUM format.", "FILE")] = None,
    picture: Annotated[File, option("Draw map and poses to this PNG file; usable poses are green.", "FILE")] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Localize the scans of a log one after the other. With --json, print one line per scan.

    Poses are those of the robot if --mount or the log has the mount of the laser. Otherwise they are those of the
    laser.
    """
    options = options_of(scans.topic, scans.tf_namespace, scans.mount)
    told, opened_log = read_target(on), opened(log, options)
    tally, frames = Tally(), Frames(options.mount)
    broken: RefusedError | None = None
    with locating(told, usable, server) as locate:
        taken = _shown(islice(scans_of(opened_log), 0, None, scans.every), opened_log, scans.every)
        try:
            for one, found in located(locate, taken, frames, scans.mode):
                tally.take(one, found)
                if as_json:
                    print_json(_line(one, found, frames, several="maps" in told))
        except RefusedError as error:  # the rest of the log cannot be read; what came before it counts
            if not tally.count:
                raise
            broken = error
    if out is not None:
        _write_poses(tally, out, sys.stderr if as_json else sys.stdout)
    if picture is not None:
        _draw(documents_of(told, server), tally, picture)
    _tell_log(opened_log, frames, sys.stderr if as_json else sys.stdout)
    if not as_json:
        _tell(tally)
    if broken is not None:
        raise broken
    if tally.refused is not None and tally.count == tally.verdicts["refused"]:
        raise tally.refused


@contextmanager
def locating(target: Json, usable: UsableOptions, server: str | None) -> Iterator[Callable[[Json], Json]]:
    """Give the function from scan and prior of a request to its answer: by this process, or by the server at a URL."""
    options = {"include": [], "max_alternatives": 0, **asdict(usable)}
    if server is not None:
        with server_at(server) as remote:
            yield lambda sought: remote.call("AssociateAnswer", "associate", {**target, **sought, "options": options})
        return
    with answering() as within:
        from linefix.answering import locating as locating_on

        answer = locating_on(target, options, within)

    def here(sought: Json) -> Json:
        with refusing():
            return answer(sought)

    yield here


def located(
    locate: Callable[[Json], Json], scans: Iterator[LoggedScan], frames: Frames, mode: Mode
) -> Iterator[tuple[LoggedScan, Json | RefusedError]]:
    """Yield each scan with its pose, or the reason why it is refused.

    In mode track the prior comes from the answers before and odometry.
    """
    from formats import scan_json

    tracker = Tracker() if mode is Mode.TRACK else None
    refusals: list[str] | None = []  # None: one was taken
    for logged in scans:
        try:
            one = frames.taken(logged)
        except RefusedError as error:
            yield logged, error
            continue
        prior = None if tracker is None else tracker.prior(one)
        try:
            found = locate({"scan": scan_json(one)} | ({} if prior is None else {"prior": prior}))
        except RefusedError as error:
            refusals = None if refusals is None else [*refusals, str(error)]
            if isinstance(error, NoSuchMapError) or error.pointer.startswith("/map") or _hopeless(refusals):
                raise
            yield one, error
            continue
        refusals = None
        if tracker is not None:
            tracker.learn(found, one)
        yield one, found


def _hopeless(refusals: list[str] | None) -> bool:
    """Return whether many scans, and all so far, were refused with the same message: the map may be the reason."""
    return refusals is not None and len(refusals) == HOPELESS and len(set(refusals)) == 1


def _shown(scans: Iterator[LoggedScan], log: Log, every: int) -> Iterator[LoggedScan]:
    """Yield the scans; show the progress on a terminal."""
    total = None if log.count is None else -(-log.count // every)
    with progress() as show:
        for number, one in enumerate(scans, 1):
            yield one
            show("scans", number, total)


def _line(one: LoggedScan, found: Json | CommandError, frames: Frames, *, several: bool) -> Json:
    refused = isinstance(found, CommandError)
    answer: Json = {"usable": False, "reasons": []} if isinstance(found, CommandError) else found
    fields = ("status", "usable", "probability", "pose", "covariance", "reasons", "timing_ms")
    return {
        "stamp": one.stamp,
        **{name: answer.get(name) for name in fields},
        "child_frame_id": frames.name,
        "error": str(found) if refused else None,
        **({"map_id": None if refused else map_of(answer)} if several else {}),
    }


def _write_poses(tally: Tally, out: Path, where: TextIO) -> None:
    """Write the usable poses in the order of their stamps; those after a clock was set back to a file of their own."""
    from formats import write_tum

    first, *others = sorted(tally.rounds.items()) or [(0, [])]
    for number, (_, poses) in enumerate([first, *others], 1):
        file = out if number == 1 else out.with_stem(f"{out.stem}-{number}")
        in_order = {one.stamp_ns: one for one in sorted(poses, key=lambda one: one.stamp_ns)}
        write_tum(in_order.values(), file)
        if others:
            seconds = f"{min(in_order) / 1e9:.3f} to {max(in_order) / 1e9:.3f}"
            print(f"{'poses':10}part {number} of the log, stamps {seconds}, in {file}", file=where)


def _draw(documents: dict[str, Json], tally: Tally, picture: Path) -> None:
    """Draw the map and the poses on it; of several maps those with a usable pose, each to a file with its name."""
    several = len(documents) > 1
    visited = {stay.map_id for stay in tally.stays.found}
    for name, document in documents.items():
        if not several or name in visited:
            usable, others = tally.on_map.get(name if several else "", ([], []))
            draw_picture(document, picture.with_stem(f"{picture.stem}-{name}") if several else picture, usable, others)


def _tell_log(log: Log, frames: Frames, where: TextIO) -> None:
    """Print what was read of the log, and whose poses are printed."""
    from linefix.ranges import SPEED, TURN

    print_notes(log, where)
    codes = {note.code for note in log.report.assumed}
    if "no_odometry" in codes:
        print(f"{'prior':10}none without odometry: each scan is searched on the whole map", file=where)
    if "motion" in codes:
        wider = f"{SPEED:.1f} m/s and {TURN:.1f} rad/s"
        print(f"{'poses':10}covariances include an unknown motion of {wider} for scans without odometry", file=where)
    print(f"{'poses':10}{plain(frames.told)}", file=where)


def _tell(tally: Tally) -> None:
    count = max(1, tally.count)
    table = [(verdict, number, f"{100.0 * number / count:.1f} %") for verdict, number in tally.verdicts.most_common()]
    print_table(("verdict", "scans", "fraction"), table)
    if tally.stays.found:
        columns = ("map", "from", "to", "usable scans")
        print_table(columns, [(one.map_id, one.first, one.last, one.scans) for one in tally.stays.found])
    if tally.reasons:
        print_table(("why not usable", "scans"), tally.reasons.most_common())
    if tally.warnings:
        print_table(("warning", "scans"), tally.warnings.most_common())
    if sum(map(len, tally.rounds.values())) < FEW * tally.count or "map_scale" in tally.warnings:
        print_rows([("hint", HINT)])
    if tally.refused is not None:
        print_rows([("refused", str(tally.refused))])
    if tally.times:
        print_rows([("time", f"{median(tally.times):.1f} ms a scan in the median, {max(tally.times):.1f} ms at most")])
