"""Recordings of ROS 1 and 2: ``.bag``, ``.mcap`` and ``.db3`` files, and folders of them.

A bag brings its own definitions of messages, and rosbags would make code of them. They are not used: messages are read
by the definitions that ROS itself has, and only the few kinds that are wanted.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import apsw
import zstandard
from rosbags.rosbag1 import ReaderError as ReaderError1
from rosbags.rosbag2 import ReaderError as ReaderError2
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ..errors import FormatError, MalformedFileError, naming
from ..files import name_of
from ..limits import MAX_MESSAGE_BYTES
from ..report import Notes, shown
from .folders import recorded_files
from .mcap_files import McapFile
from .recording import CDR, ROS1, Connection, Received, RosbagFile

SCAN = "sensor_msgs/msg/LaserScan"
GRID = "nav_msgs/msg/OccupancyGrid"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
OLD_TRANSFORMS = "tf/msg/tfMessage"  # of ROS 1, laid out alike

FORMATS = {".bag": "rosbag1", ".mcap": "mcap"}  # of files alone
REPAIRS = {".bag": "rosbag reindex", ".mcap": "mcap recover"}  # of files that end early, as when the power went
NAMED = 20  # topics that an error lists at most
ZSTD = b"\x28\xb5\x2f\xfd"  # the beginning of a message that rosbag2 has compressed; no encoding begins so

# Exceptions of rosbags for files that are broken on purpose.
BROKEN = (
    ReaderError1, ReaderError2, SerdeError, apsw.Error, struct.error, zlib.error, OSError, EOFError, ValueError,
    TypeError, LookupError, AttributeError, ArithmeticError, AssertionError, RecursionError, RuntimeError, MemoryError,
    zstandard.ZstdError,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Bag:
    """An open recording.

    Attributes
    ----------
    name : str
        Of the file or folder, for errors and reports.
    format : str
        ``rosbag1``, ``rosbag2`` or ``mcap``.
    """

    name: str
    format: str
    _files: tuple[McapFile | RosbagFile, ...]
    _notes: Notes
    _folder: Path

    def connections(self, *kinds: str) -> list[Connection]:
        """Return the connections that carry messages of some kinds in an encoding that is read; all without kinds."""
        every = [one for file in self._files for one in file.connections]
        return [one for one in every if one.msgtype in kinds and one.encoding in (CDR, ROS1)] if kinds else every

    def received(self, connections: Collection[Connection]) -> Iterator[Received]:
        """Yield the messages of some connections with the time of their reception, in the order of the bag.

        Messages that are too long or cannot be decoded are left out, and counted in the notes.

        Raises
        ------
        MalformedFileError
            When the rest of the file cannot be read.
        """
        for file in self._files:
            wanted = [one for one in connections if any(one is held for held in file.connections)]
            if not wanted:
                continue
            with refusing(file.name, self._folder / file.name):
                for raw in file.messages(wanted):
                    message = self._decoded(raw)
                    if message is not None:
                        yield raw._replace(message=message)

    def _decoded(self, raw: Received) -> Any:
        """Return a message; None for one that is left out."""
        topic = shown(raw.connection.topic)
        kind = TRANSFORMS if raw.connection.msgtype == OLD_TRANSFORMS else raw.connection.msgtype
        short = kind.rpartition("/")[2].lower()
        if len(raw.message) > MAX_MESSAGE_BYTES:
            self._notes.add_dropped(f"long_{short}", f"messages of {topic} above {MAX_MESSAGE_BYTES} bytes", 1)
            return None
        try:
            data = _unpacked(raw.message)
            if raw.connection.encoding == ROS1:
                return _definitions(first=True).deserialize_ros1(data, kind)
            return _definitions(first=False).deserialize_cdr(data, kind)
        except BROKEN:
            self._notes.add_dropped(f"broken_{short}", f"broken messages of {topic}", 1)
            return None

    def topics(self) -> str:
        """Return the topics with their types and counts, for errors that name what there is."""
        counts: dict[tuple[str, str, str], int] = {}
        for one in self.connections():
            key = one.topic, one.msgtype, one.encoding
            counts[key] = counts.get(key, 0) + one.msgcount
        told = [
            f"{shown(topic)} ({shown(kind) or 'no type'}{'' if code in (CDR, ROS1) else f' as {shown(code)}'}, {count})"
            for (topic, kind, code), count in sorted(counts.items())
        ]
        more = f" and {len(told) - NAMED} more" if len(told) > NAMED else ""
        return f"its topics, with type and count: {', '.join(told[:NAMED])}{more}" if told else "it has no topics"


@contextmanager
def opened(path: Path, notes: Notes) -> Iterator[Bag]:
    """Open a recording.

    Parameters
    ----------
    path : Path
        A ``.bag``, ``.mcap`` or ``.db3``, or the folder of a bag of ROS 2.
    notes : Notes
        Takes what of it cannot be read.

    Raises
    ------
    FormatError
        When it cannot be read.
    """
    paths, name = recorded_files(path, notes), name_of(path)
    with ExitStack() as stack:
        files: list[McapFile | RosbagFile] = []
        for one in paths:
            try:
                with refusing(name if len(paths) == 1 else one.name, one):
                    files.append(McapFile(one) if one.suffix.lower() == ".mcap" else RosbagFile(one))
            except FormatError as error:
                if one is paths[-1] and not files:  # nothing else is left
                    raise
                notes.add_dropped("broken_files", f"files that cannot be read, such as {error}", 1)
                continue
            stack.callback(files[-1].close)
        ordered, form = sorted(files, key=lambda file: file.start), FORMATS.get(path.suffix.lower(), "rosbag2")
        bag = Bag(name, form, tuple(ordered), notes, paths[0].parent)
        yield bag
        for code, said, count in (remark for file in files for remark in file.remarks):
            notes.add_dropped(code, said, count)


def _unpacked(data: bytes) -> bytes:
    """Return a message that rosbag2 may have compressed."""
    if not data.startswith(ZSTD):
        return data
    if zstandard.frame_content_size(data) > MAX_MESSAGE_BYTES:
        raise ValueError("a message that is too long")
    return zstandard.ZstdDecompressor().decompress(data, max_output_size=MAX_MESSAGE_BYTES)


@cache
def _definitions(*, first: bool) -> Any:
    """Return ROS's own definitions of messages."""
    if not first:
        return get_typestore(Stores.ROS2_HUMBLE)
    types = get_typestore(Stores.ROS1_NOETIC)
    # Not among those that rosbags has of ROS 1.
    types.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
    return types


@contextmanager
def refusing(name: str, file: Path) -> Iterator[None]:
    """Turn what a broken bag brings about into an error of this package, without the folder of the file."""
    try:
        with naming(name):
            yield
    except FormatError:
        raise
    except BROKEN as error:
        text, repair = str(error), REPAIRS.get(file.suffix.lower())
        for place in (str(file.parent.resolve()), str(file.parent)):
            text = text.replace(place.rstrip(os.sep) + os.sep, "")
        lines = text.splitlines() or [type(error).__name__]
        mended_by = f"; if it was cut off, `{repair}` repairs it" if repair else ""
        if isinstance(error, ReaderError1) and "magic" in text:  # of ROS before Diamondback, or no bag
            lines, mended_by = ["it does not begin as a bag of version 2.0"], "; of V1.2, `rosbag fix` makes one"
        raise MalformedFileError(f"is a broken bag: {shown(lines[0])}{mended_by}", argument=name) from error
