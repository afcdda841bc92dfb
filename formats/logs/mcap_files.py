"""Files in the MCAP format, read by Foxglove's library: of ROS 1 and 2, with other channels, cut ones too.

https://mcap.dev/spec
"""

from __future__ import annotations

import struct
from bisect import bisect_left
from collections import Counter
from collections.abc import Collection, Iterator
from io import BufferedReader, FileIO
from pathlib import Path

import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, ChunkIndex, Footer, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.summary import Summary

from ..errors import MalformedFileError
from ..files import name_of, require_content
from ..limits import MAX_CHUNK_BYTES
from .recording import Connection, Received, ros_type

# Errors of the library for bytes that are no record. Decompressors raise RuntimeError (lz4) and ZstdError.
BROKEN = (
    McapError, struct.error, ValueError, OSError, EOFError, LookupError, TypeError, RuntimeError, OverflowError,
    MemoryError, zstandard.ZstdError,
)  # fmt: skip

MAGIC = b"\x89MCAP0\r\n"


class _WholeReads(BufferedReader):
    """A file whose reads return all the bytes that were requested, or raise `EndOfFile`."""

    def read(self, size: int | None = -1) -> bytes:
        """Return `size` bytes."""
        data = super().read(size)
        if len(data) < (size or 0):
            raise EndOfFile
        return data


class McapFile:
    """An open MCAP file.

    The summary at the end names channels, counts and chunks. A file without one, such as that of a recorder that was
    killed, is read from its beginning, as far as it goes. Chunks that are broken are left out and counted.

    Attributes
    ----------
    name : str
    connections : list of Connection
    start : int
        Time of the first message, nanoseconds.

    Raises
    ------
    MalformedFileError
        When it does not begin as an MCAP file.
    """

    def __init__(self, path: Path) -> None:
        self.name = name_of(path)
        self.start = 0
        self._cut = False
        self._broken: set[int] = set()  # chunks, by where they begin in the file
        self._limit = path.stat().st_size
        require_content(path, but=".mcap")
        self._file = _WholeReads(FileIO(path))
        try:
            if not self._file.peek(len(MAGIC)).startswith(MAGIC):
                raise MalformedFileError("is not an mcap: its first bytes are not those of the format")
            summary = self._summary()
            self._chunks: list[ChunkIndex] = []
            self.connections = self._scanned() if summary is None else self._from_summary(summary)
            if self._cut and not any(one.msgcount for one in self.connections):
                raise MalformedFileError(
                    "is a broken bag: it ends before the first readable message; if it was cut off, "
                    "`mcap recover` repairs it"
                )
        except BaseException:
            self.close()
            raise

    @property
    def remarks(self) -> list[tuple[str, str, int]]:
        """Code, sentence and count of each part of the file that cannot be read."""
        found = []
        if self._cut:
            readable = sum(connection.msgcount for connection in self.connections)
            said = f"{self.name} ends early, as after a killed recorder, and is read up to there; messages"
            found.append(("cut_off", said, readable))
        if self._broken:
            found.append(("broken_chunks", "broken chunks of an mcap, left out with their messages", len(self._broken)))
        return found

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def messages(self, connections: Collection[Connection]) -> Iterator[Received]:
        """Yield the messages of some connections, by the time of their reception where the file has an index."""
        wanted = {connection.key: connection for connection in connections}
        found = (
            self._by_index(wanted.keys())
            if self._chunks
            else (one for one in self._records() if isinstance(one, Message))
        )
        for message in found:
            if message.channel_id in wanted:
                yield Received(wanted[message.channel_id], message.log_time, message.data)

    def _summary(self) -> Summary | None:
        """Return the summary; None where it does not name all that has to be known of the messages."""
        self._file.seek(0)
        try:
            found = SeekingReader(self._file, record_size_limit=self._limit).get_summary()
        except BROKEN:
            return None
        if found is None or found.statistics is None:
            return None
        counts, schemas = found.statistics.channel_message_counts, {one.schema_id for one in found.channels.values()}
        complete = found.statistics.message_count == sum(counts.values())
        return (
            found
            if complete and counts.keys() <= found.channels.keys() and schemas - {0} <= found.schemas.keys()
            else None
        )

    def _from_summary(self, summary: Summary) -> list[Connection]:
        assert summary.statistics is not None  # as `_summary` says
        self._chunks = summary.chunk_indexes
        self.start = summary.statistics.message_start_time
        counts = summary.statistics.channel_message_counts
        return self._named(list(summary.channels.values()), summary.schemas, counts)

    def _scanned(self) -> list[Connection]:
        """Read the file once, from its beginning."""
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        counts: Counter[int] = Counter()
        for record in self._records():
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
            elif isinstance(record, Message):
                self.start = record.log_time if not counts else min(self.start, record.log_time)
                counts[record.channel_id] += 1
        return self._named(list(channels.values()), schemas, counts)

    def _named(self, channels: list[Channel], schemas: dict[int, Schema], counts: dict[int, int]) -> list[Connection]:
        found = []
        for one in channels:
            kind = ros_type(schemas[one.schema_id].name) if one.schema_id in schemas else ""
            found.append(Connection(one.topic, kind, one.message_encoding, counts.get(one.id, 0), one.id))
        return found

    def _records(self) -> Iterator[McapRecord]:
        """Yield the records from the beginning to the end, or to where they cannot be read any further."""
        self._file.seek(0)
        reader = StreamReader(self._file, emit_chunks=True, record_size_limit=self._limit)
        self._cut = True
        try:
            for record in reader.records:
                if isinstance(record, Chunk):
                    yield from self._unpacked(record, self._file.tell())
                elif isinstance(record, Footer):
                    self._cut = False
                    return
                else:
                    yield record
        except BROKEN:
            return

    def _by_index(self, wanted: Collection[int]) -> Iterator[Message]:
        """Yield messages from the chunks that hold some of the wanted ones, by time; chunks may overlap in time."""
        waiting: list[Message] = []
        for chunk in sorted(self._chunks, key=lambda one: (one.message_start_time, one.chunk_start_offset)):
            held = chunk.message_index_offsets
            if held and not any(key in held for key in wanted):
                continue
            ready = bisect_left(waiting, chunk.message_start_time, key=lambda one: one.log_time)
            yield from waiting[:ready]
            found = (one for one in self._chunk_at(chunk) if isinstance(one, Message) and one.channel_id in wanted)
            waiting = sorted([*waiting[ready:], *found], key=lambda one: one.log_time)
        yield from waiting

    def _chunk_at(self, index: ChunkIndex) -> list[McapRecord]:
        self._file.seek(index.chunk_start_offset)
        reader = StreamReader(self._file, skip_magic=True, emit_chunks=True, record_size_limit=self._limit)
        try:
            chunk = next(iter(reader.records))
        except (*BROKEN, StopIteration):
            chunk = None
        end = index.chunk_start_offset + index.chunk_length
        if not isinstance(chunk, Chunk):
            self._broken.add(end)
            return []
        return self._unpacked(chunk, end)

    def _unpacked(self, chunk: Chunk, end: int) -> list[McapRecord]:
        """Return the records in a chunk that ends at a place in the file; none where it is broken."""
        try:
            size = zstandard.frame_content_size(chunk.data) if chunk.compression == "zstd" else chunk.uncompressed_size
            if chunk.compression not in ("", "lz4", "zstd") or max(size, chunk.uncompressed_size) > MAX_CHUNK_BYTES:
                raise ValueError(chunk.compression)
            return breakup_chunk(chunk, validate_crc=True)
        except BROKEN:
            self._broken.add(end)
            return []
