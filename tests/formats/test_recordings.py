"""Recordings that are whole but unusual, and those that are not whole."""

from __future__ import annotations

import gzip
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zstandard
from mcap.writer import CompressionType
from rosbags.rosbag2 import StoragePlugin, Writer

from formats import (
    FormatError,
    IncompleteFileError,
    Log,
    LogOptions,
    MalformedFileError,
    UnsupportedFormatError,
    read_log,
)

from .bags import BEGUN, SCAN, SECOND, TYPES, Messages, Recording, scan_bytes
from .reading import counts, notes


def read(path: Path, topic: str | None = None) -> tuple[list[int], Log]:
    """Return seconds since the beginning of each scan, and the log."""
    log = read_log(path, LogOptions(topic=topic))
    return [(scan.stamp_ns - BEGUN) // SECOND for scan in log], log


def dropped(log: Log) -> dict[str, int]:
    return counts(log, "dropped")


@pytest.mark.parametrize("profile", ["ros2", "", "ros1", "own"])
@pytest.mark.parametrize("chunk", [0, 1000])
def test_the_profile_of_an_mcap_does_not_matter(tmp_path: Path, profile: str, chunk: int) -> None:
    recording = Recording(tmp_path / "a.mcap", profile, chunk)
    recording.scans(5)
    found, log = read(recording.done())
    assert (found, log.report.format) == ([0, 1, 2, 3, 4], "mcap")


@pytest.mark.parametrize("kind", [SCAN, "sensor_msgs/LaserScan"])
def test_an_mcap_of_ros_1(tmp_path: Path, kind: str) -> None:
    recording = Recording(tmp_path / "a.mcap", "ros1")
    for k in range(3):
        recording.put("/scan", k + 1, Messages("ros1").scan(BEGUN + k * SECOND), kind, "ros1", "ros1msg")
    found, report = read(recording.done())
    assert (found, dropped(report)) == ([0, 1, 2], {})


@pytest.mark.parametrize(
    ("kind", "encoding", "schema"),
    [
        ("State", "json", "jsonschema"),
        ("foxglove.Log", "protobuf", "protobuf"),
        ("", "", ""),
        ("odd", "cbor", "odd"),
        ("", "cdr", ""),
    ],
)
def test_channels_that_are_not_of_ros_are_left_out(recording: Recording, kind: str, encoding: str, schema: str) -> None:
    recording.put("/state", BEGUN, b"{}", kind, encoding, schema)
    recording.put("/other", BEGUN, b"{}", "Other", "json", "jsonschema")
    recording.scans(3)
    found, report = read(recording.done())
    assert (found, dropped(report)) == ([0, 1, 2], {})


def test_a_scan_in_another_encoding_is_named(recording: Recording) -> None:
    recording.put("/laser", BEGUN, b"", "foxglove.LaserScan", "protobuf", "protobuf")
    path = recording.done()
    with pytest.raises(
        IncompleteFileError, match=r"no messages of LaserScan; .*/laser \(foxglove.LaserScan as protobuf, 1\)"
    ):
        read(path)
    with pytest.raises(IncompleteFileError, match=r"on laser, which is foxglove.LaserScan as protobuf"):
        read(path, "laser")


@pytest.mark.parametrize(
    "options",
    [{"use_statistics": False}, {"use_summary_offsets": False}, {"repeat_channels": False}, {"repeat_schemas": False}],
)
@pytest.mark.parametrize("compression", list(CompressionType))
def test_an_mcap_with_a_partial_summary(tmp_path: Path, options: dict[str, Any], compression: CompressionType) -> None:
    recording = Recording(tmp_path / "a.mcap", compression=compression, **options)
    recording.scans(7)
    found, log = read(recording.done())
    assert (log.count, len(found), dropped(log)) == (7, 7, {})


def test_chunks_that_overlap_are_read_by_time(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap", chunk=1000)
    for k in (3, 0, 4, 1, 2, 5):
        recording.put("/scan", BEGUN + k * SECOND, scan_bytes(BEGUN + k * SECOND))
    assert read(recording.done())[0] == [0, 1, 2, 3, 4, 5]


@pytest.mark.parametrize("chunk", [0, 1000])
@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("fraction", [0.3, 0.55, 0.8])
def test_a_cut_mcap_is_partly_read(tmp_path: Path, chunk: int, compression: CompressionType, fraction: float) -> None:
    recording = Recording(tmp_path / "a.mcap", chunk=chunk, compression=compression)
    recording.scans(40)
    path = recording.done()
    whole = path.read_bytes()
    path.write_bytes(whole[: int(fraction * len(whole))])
    found, report = read(path)
    assert found == list(range(len(found)))
    assert 3 <= len(found) <= 40
    assert dropped(report) == {"cut_off": len(found)}


@pytest.mark.parametrize("fewer", [1, 20])
def test_an_mcap_that_lost_only_its_end_gives_all_messages(recording: Recording, fewer: int) -> None:
    recording.scans(6)
    path = recording.done()
    path.write_bytes(path.read_bytes()[:-fewer])
    assert read(path)[0] == [0, 1, 2, 3, 4, 5]


def test_a_broken_chunk_is_left_out_and_counted_once(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap", chunk=1500)
    recording.scans(20)
    path = recording.done()
    content = bytearray(path.read_bytes())
    place = content.index(scan_bytes(BEGUN + 9 * SECOND))
    content[place + 20] ^= 255
    path.write_bytes(content)
    found, report = read(path)
    assert set(found) < set(range(20))
    assert 9 not in found
    assert len(found) >= 15
    assert dropped(report) == {"broken_chunks": 1}


def test_messages_that_cannot_be_decoded_are_left_out_and_counted(recording: Recording) -> None:
    recording.scans(4)
    recording.put("/scan", BEGUN + 9 * SECOND, scan_bytes(BEGUN)[:90])
    recording.put("/scan", BEGUN + 9 * SECOND, b"")
    found, report = read(recording.done())
    assert (found, dropped(report)) == ([0, 1, 2, 3], {"broken_laserscan": 2})


def test_a_message_that_rosbag2_has_compressed(recording: Recording) -> None:
    recording.put("/scan", BEGUN, zstandard.compress(scan_bytes(BEGUN)))
    bomb = zstandard.compress(bytes(2**27))
    recording.put("/scan", BEGUN + SECOND, bomb)
    found, report = read(recording.done())
    assert (found, dropped(report)) == ([0], {"broken_laserscan": 1})


def folder(tmp_path: Path, files: int = 1, plugin: StoragePlugin = StoragePlugin.MCAP) -> Path:
    """Write the folder of a bag; of several files each has two scans of its own."""
    path, store = tmp_path / "drive", TYPES["cdr"]
    parts = []
    for part in range(files):
        made = tmp_path / f"part_{part}"
        with Writer(made, version=9, storage_plugin=plugin) as writer:
            connection = writer.add_connection("/scan", SCAN, typestore=store)
            for k in (2 * part, 2 * part + 1):
                writer.write(connection, BEGUN + k * SECOND, scan_bytes(BEGUN + k * SECOND))
        parts.append(made)
    path.mkdir()
    names = []
    for part, made in enumerate(parts):
        (file,) = [one for one in made.iterdir() if one.suffix != ".yaml"]
        names.append(f"drive_{part}{file.suffix}")
        shutil.copy(file, path / names[-1])
    text = (parts[0] / "metadata.yaml").read_text()
    text = text.replace(f"- part_0{file.suffix}", "\n".join(f"  - {name}" for name in names).strip())
    (path / "metadata.yaml").write_text(text)
    return path


def codes(log: Log) -> set[str]:
    return set(notes(log, "assumed", "dropped")) - {"no_odometry"}


@pytest.mark.parametrize("plugin", list(StoragePlugin))
@pytest.mark.parametrize("content", [None, b"", b"rosbag2_bagfile", b"\xff\xfe", b"rosbag2_bagfile_information: {}\n"])
def test_a_folder_without_a_whole_description(tmp_path: Path, plugin: StoragePlugin, content: bytes | None) -> None:
    path = folder(tmp_path, 12, plugin)
    metadata = path / "metadata.yaml"
    metadata.unlink()
    if content is not None:
        metadata.write_bytes(content)
    found, report = read(path)
    assert found == list(range(24))  # file 10 after file 9
    assert codes(report) == {"no_metadata" if content is None else "broken_metadata"}


def test_a_description_that_stands_for_too_much_is_not_built(tmp_path: Path) -> None:
    path = folder(tmp_path)
    lines = ["a0: &a0 {k: v}"] + [f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 9)}]}}" for k in range(1, 12)]
    (path / "metadata.yaml").write_text("\n".join(lines))
    found, report = read(path)
    assert (found, codes(report)) == ([0, 1], {"broken_metadata"})


def test_files_that_are_missing_are_counted(tmp_path: Path) -> None:
    path = folder(tmp_path, 3)
    (path / "drive_1.mcap").unlink()
    found, report = read(path)
    assert (found, dropped(report)) == ([0, 1, 4, 5], {"missing_files": 1})


def test_a_file_of_a_folder_that_was_only_begun(tmp_path: Path) -> None:
    path = folder(tmp_path, 2)
    (path / "metadata.yaml").unlink()
    (path / "drive_2.mcap").write_bytes(b"")
    found, report = read(path)
    assert (found, dropped(report)) == ([0, 1, 2, 3], {"broken_files": 1})


def unlisted(path: Path) -> None:
    (path / "metadata.yaml").unlink()


def emptied(path: Path) -> None:
    unlisted(path)
    (path / "drive_0.mcap").rename(path / "notes.mcap.txt")


def several(path: Path) -> None:
    unlisted(path)
    shutil.copy(path / "drive_0.mcap", path / "other_0.mcap")


def packed_under_its_name(path: Path) -> None:
    file = path / "drive_0.mcap"
    file.write_bytes(zstandard.compress(file.read_bytes()))


def packed(path: Path) -> None:
    packed_under_its_name(path)
    (path / "drive_0.mcap").rename(path / "drive_0.mcap.zstd")
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("drive_0.mcap", "drive_0.mcap.zstd"))


@pytest.mark.parametrize(
    ("how", "error", "message"),
    [
        (several, IncompleteFileError, "several recordings: drive_0.mcap, other_0.mcap; choose one"),
        (packed, MalformedFileError, "missing the files .*: drive_0.mcap.zstd; decompress them first with zstd -d"),
        (packed_under_its_name, FormatError, "compressed as a whole; decompress it first"),
        (emptied, FormatError, "expected the folder of a bag, or a file that ends in one of"),
    ],
)
def test_what_is_wrong_with_a_folder_is_said(
    tmp_path: Path, how: Callable[[Path], None], error: type[FormatError], message: str
) -> None:
    path = folder(tmp_path)
    how(path)
    with pytest.raises(error, match=message):
        read(path)


def test_a_folder_that_was_unpacked_is_read(tmp_path: Path) -> None:
    path = folder(tmp_path)
    kept = (path / "drive_0.mcap").read_bytes()
    packed(path)
    (path / "drive_0.mcap").write_bytes(kept)
    assert read(path)[0] == [0, 1]


@pytest.mark.parametrize(
    ("name", "message"), [("a.mcap.zstd", "zstd -d"), ("a.db3.zst", "zstd -d"), ("a.bag.gz", "unpack")]
)
def test_a_file_to_which_something_has_to_be_done_first(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / name).write_bytes(gzip.compress(b"a") if name.endswith(".gz") else zstandard.compress(b"a"))
    with pytest.raises(UnsupportedFormatError, match=message):
        read(tmp_path / name)


def test_a_write_ahead_log_is_not_passed_over_in_silence(tmp_path: Path) -> None:
    path = folder(tmp_path, plugin=StoragePlugin.SQLITE3)
    (path / "drive_0.db3-wal").write_bytes(b"x" * 100)
    assert "write_ahead_log" in dropped(read(path)[1])


def test_the_topics_are_named_where_there_is_no_scan(recording: Recording) -> None:
    recording.channel("/scan")
    recording.put("/chatter\x9b2J", BEGUN, b"", "std_msgs/msg/String")
    recording.put("/points", BEGUN, b"", "sensor_msgs/msg/PointCloud2")
    path = recording.done()
    told = r"/chatter\?2J \(std_msgs/msg/String, 1\), /points \(sensor_msgs/msg/PointCloud2, 1\), /scan \(.*, 0\)"
    with pytest.raises(IncompleteFileError, match=f"no messages of LaserScan; .*{told}"):
        read(path)
    with pytest.raises(IncompleteFileError, match="no messages on /scan; its topics"):
        read(path, "/scan")
    with pytest.raises(IncompleteFileError, match="no LaserScan on points, which is sensor_msgs/msg/PointCloud2;"):
        read(path, "points")
    with pytest.raises(IncompleteFileError, match="no LaserScan on /none; its topics"):
        read(path, "/none")


def test_topics_without_messages_are_passed_over_and_a_slash_may_be_left_out(recording: Recording) -> None:
    recording.channel("/a/scan")
    recording.scans(2, "/scan")
    path = recording.done()
    assert read(path)[0] == read(path, "scan")[0] == [0, 1]


@pytest.mark.parametrize("kind", ["sensor_msgs::msg::dds_::LaserScan_", "sensor_msgs::msg::LaserScan"])
def test_types_by_their_names_in_dds_and_cpp(recording: Recording, kind: str) -> None:
    recording.put("rt/scan", BEGUN, scan_bytes(BEGUN), kind=kind)
    assert len(list(read_log(recording.done()))) == 1


@pytest.mark.parametrize("kind", ["PointCloud2", "MultiEchoLaserScan"])
def test_scans_of_other_types_say_what_converts_them(recording: Recording, kind: str) -> None:
    recording.put("/scan", BEGUN, scan_bytes(BEGUN), kind=f"sensor_msgs/msg/{kind}")
    with pytest.raises(FormatError, match=f"convert {kind} with"):
        read_log(recording.done())


def test_a_bag_of_another_version(tmp_path: Path) -> None:
    (tmp_path / "a.bag").write_bytes(b"#ROSRECORD V1.2\n" + bytes(500))
    with pytest.raises(MalformedFileError, match=r"not begin as a bag of version 2\.0; of V1\.2, `rosbag fix`"):
        read_log(tmp_path / "a.bag")
