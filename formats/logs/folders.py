"""The files of a recording: one alone, or those in the folder of a bag of ROS 2, whose description may be missing."""

from __future__ import annotations

import re
from pathlib import Path, PureWindowsPath

from ..errors import FormatError, IncompleteFileError, MalformedFileError
from ..files import load_yaml, read_bounded, text_of
from ..limits import MAX_METADATA_BYTES, MAX_RECORDED_FILES
from ..report import Notes, first_of

FOLDER_SUFFIXES = (".mcap", ".db3")  # of files in the folder of a bag of ROS 2
SUFFIXES = (".bag", *FOLDER_SUFFIXES)
METADATA = "metadata.yaml"
PACKED = ".zstd"  # what rosbag2 appends where it compresses whole files
_NUMBER = re.compile(r"_\d+$")  # of a file among those that one recording was split into


def is_bag(path: Path) -> bool:
    """Tell whether a path is a recording: by its ending, or as a folder with such files."""
    if path.is_dir():
        return (path / METADATA).is_file() or bool(_ending(path, *FOLDER_SUFFIXES))
    return path.name.lower().endswith(SUFFIXES)


def recorded_files(path: Path, notes: Notes) -> list[Path]:
    """Return the files of a recording.

    Parameters
    ----------
    path : Path
        A ``.bag``, ``.mcap`` or ``.db3``, or the folder of a bag of ROS 2.
    notes : Notes
        Takes what is missing.

    Raises
    ------
    FormatError
        When there is none that can be read.
    """
    if not path.is_dir():
        return [path]
    listed = _listed(path, notes) if (path / METADATA).is_file() else None
    if listed is None:
        return _unlisted(path, notes)
    found = [file for file in map(_unpacked, listed) if file.is_file()]
    missing = [file.name for file in listed if _unpacked(file) not in found]
    if not found:
        hint = "; decompress them first with zstd -d" if missing[0].endswith(PACKED) else ""
        raise MalformedFileError(f"is missing the files that {METADATA} lists: {first_of(missing)}{hint}")
    if missing:
        notes.add_dropped(
            "missing_files", f"files that {METADATA} lists and that are missing: {first_of(missing)}", len(missing)
        )
    return found


def _listed(folder: Path, notes: Notes) -> list[Path] | None:
    """Return the files that the description of a bag lists; None where it cannot be used."""
    try:
        told = load_yaml(text_of(read_bounded(folder / METADATA, MAX_METADATA_BYTES)))
        listed = told["rosbag2_bagfile_information"]["relative_file_paths"]  # type: ignore[index]
        if not (isinstance(listed, list) and listed and all(isinstance(one, str) for one in listed)):
            raise TypeError
    except (FormatError, TypeError, LookupError):
        notes.add_assumed("broken_metadata", f"{METADATA} is broken: the files in the folder are read without it")
        return None
    # Names only: what lies elsewhere is not this bag's.
    return [folder / PureWindowsPath(one).name for one in listed[:MAX_RECORDED_FILES]]


def _unlisted(folder: Path, notes: Notes) -> list[Path]:
    """Return the files in a folder without a description, where they are of one recording."""
    found = _ending(folder, *FOLDER_SUFFIXES)
    if not found:
        raise IncompleteFileError(f"has a {METADATA}, but no files that end in {' or '.join(FOLDER_SUFFIXES)}")
    stems = sorted({_NUMBER.sub("", file.stem) for file in found})
    if len(stems) > 1 or len({file.suffix.lower() for file in found}) > 1:
        raise IncompleteFileError(
            f"has no {METADATA}, and files of several recordings: {first_of([f.name for f in found])}; choose one of "
            "them"
        )
    if not (folder / METADATA).is_file():
        notes.add_assumed(
            "no_metadata", f"{METADATA} is missing, as after a killed recorder; files are read without it", len(found)
        )
    return found[:MAX_RECORDED_FILES]


def _ending(folder: Path, *endings: str) -> list[Path]:
    """Return the files in a folder whose names end in one of some endings, sorted."""
    return sorted(file for file in folder.iterdir() if file.name.lower().endswith(endings) and file.is_file())


def _unpacked(file: Path) -> Path:
    """Return the file that a compressed one becomes when it is unpacked next to it."""
    return file.with_suffix("") if file.suffix.lower() == PACKED else file
