"""Bags of ROS 1 and 2, opened by rosbags.

A bag brings its own definitions of messages, and rosbags would make code of them. They are not used: messages are read
by the definitions that ROS itself has, and only the few kinds that are wanted.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import apsw
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag1 import ReaderError as ReaderError1
from rosbags.rosbag2 import Reader as Reader2
from rosbags.rosbag2 import ReaderError as ReaderError2
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from ..errors import FormatError, IncompleteFileError, MalformedFileError, TooLargeError, UnsupportedFormatError
from ..files import name_of, read_bounded, text_of
from ..limits import MAX_MESSAGE_BYTES, MAX_METADATA_BYTES
from ..report import shown

SCAN = "sensor_msgs/msg/LaserScan"
GRID = "nav_msgs/msg/OccupancyGrid"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
OLD_TRANSFORMS = "tf/msg/tfMessage"  # of ROS 1, laid out alike

SUFFIXES = (".bag", ".mcap", ".db3")
METADATA = "metadata.yaml"
SPECIAL = "%?#"  # in a URI

# What rosbags lets through of a file that is broken on purpose.
BROKEN = (
    ReaderError1, ReaderError2, SerdeError, apsw.Error, struct.error, zlib.error, OSError, EOFError, ValueError,
    TypeError, LookupError, AttributeError, ArithmeticError, AssertionError, RecursionError, RuntimeError, MemoryError,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Bag:
    """An open bag.

    Attributes
    ----------
    name : str
        Of the file, for errors and reports.
    format : str
        ``rosbag1``, ``rosbag2`` or ``mcap``.
    """

    name: str
    format: str
    _reader: Any
    _types: Any

    def connections(self, *kinds: str) -> list[Connection]:
        """Return the connections that carry messages of some kinds."""
        return [c for c in self._reader.connections if c.msgtype in kinds]

    def messages(self, connections: Collection[Connection]) -> Iterator[tuple[Connection, Any]]:
        """Yield the messages of some connections, in the order of the bag.

        Raises
        ------
        MalformedFileError
            When a message is broken.
        TooLargeError
            When one is too long.
        """
        if not connections:
            return
        read = self._types.deserialize_ros1 if self.format == "rosbag1" else self._types.deserialize_cdr
        with refusing(self.name):
            for connection, _time, raw in self._reader.messages(connections=connections):
                if len(raw) > MAX_MESSAGE_BYTES:
                    raise TooLargeError(f"expected messages of at most {MAX_MESSAGE_BYTES} bytes", argument=self.name)
                kind = TRANSFORMS if connection.msgtype == OLD_TRANSFORMS else connection.msgtype
                message = read(raw, kind)
                yield connection, message


def is_bag(path: Path) -> bool:
    """Tell whether a path is a bag: by its ending, or as the folder of one."""
    return path.suffix.lower() in SUFFIXES or (path / METADATA).is_file()


@contextmanager
def opened(path: Path) -> Iterator[Bag]:
    """Open a bag.

    Parameters
    ----------
    path : Path
        A ``.bag``, ``.mcap`` or ``.db3``, or the folder of a bag of ROS 2.

    Raises
    ------
    FormatError
        When it cannot be read.
    """
    name = name_of(path)
    if not path.exists():
        raise IncompleteFileError("there is no such file", argument=name)
    first = path.suffix.lower() == ".bag"
    storage = _storage_of(path / METADATA, name) if (path / METADATA).is_file() else path.suffix.lower()[1:]
    if storage not in ("bag", "mcap"):
        _refuse_special(path, name)
    with refusing(name, _mended_by(path), path.parent):
        reader: Any = Reader1(path) if first else Reader2(path)
        reader.open()
    try:
        form = "rosbag1" if first else "mcap" if path.suffix.lower() == ".mcap" else "rosbag2"
        yield Bag(name, form, reader, _definitions(first))
    finally:
        reader.close()


def _definitions(first: bool) -> Any:
    """Return ROS's own definitions of messages."""
    if not first:
        return get_typestore(Stores.ROS2_HUMBLE)
    types = get_typestore(Stores.ROS1_NOETIC)
    # Not among those that rosbags has of ROS 1.
    types.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
    return types


def _mended_by(path: Path) -> str:
    """Return how a bag is mended that ends early, as of a robot whose power went; empty where no tool is known."""
    if path.suffix.lower() == ".bag":
        return "; where it was cut off, `rosbag reindex` mends it"
    if path.suffix.lower() == ".mcap" or any(path.glob("*.mcap")):
        return "; where it was cut off, `mcap recover` mends it"
    return ""


@contextmanager
def refusing(name: str, mended_by: str = "", folder: Path | None = None) -> Iterator[None]:
    """Turn what a broken bag brings about into an error of this package; the `folder` that it is in is left out."""
    try:
        yield
    except FormatError:
        raise
    except BROKEN as error:
        text = str(error)
        for place in () if folder is None else (str(folder.resolve()), str(folder)):
            text = text.replace(place.rstrip(os.sep) + os.sep, "")
        lines = text.splitlines() or [type(error).__name__]
        raise MalformedFileError(f"is a broken bag: {shown(lines[0])}{mended_by}", argument=name) from error


def _refuse_special(path: Path, name: str) -> None:
    """Refuse paths that SQLite reads as other ones: rosbags opens them by a URI that it does not quote."""
    for file in path.iterdir() if path.is_dir() else [path]:
        found = [character for character in SPECIAL if character in str(file)]
        if found:
            raise UnsupportedFormatError(
                f"has {found[0]!r} in its path, which means something else where SQLite opens a bag: rename it",
                argument=name,
            )


def _storage_of(metadata: Path, name: str) -> str:
    """Return what the files of a bag are: ``sqlite3`` or ``mcap``.

    Files that are compressed whole are refused: they would be unpacked to disk without a bound.
    """
    text = text_of(read_bounded(metadata, MAX_METADATA_BYTES), name)
    try:
        told = YAML(typ="safe", pure=True).load(text)
        known = told["rosbag2_bagfile_information"]
        mode, storage = str(known.get("compression_mode", "")), str(known.get("storage_identifier", ""))
    except (YAMLError, RecursionError, TypeError, LookupError, AttributeError, ValueError) as error:
        raise MalformedFileError(f"has a broken {METADATA}", argument=name) from error
    if mode.lower() == "file":
        raise UnsupportedFormatError("is compressed file by file; unpack it first", argument=name)
    return storage
