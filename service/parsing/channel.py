"""Objects from one process to another over a socket, large ones without a copy."""

from __future__ import annotations

import io
import pickle
import socket
import struct
from typing import Any

_COUNT = struct.Struct("<I")
_SIZE = struct.Struct("<Q")
_PIECE = 1 << 20


class Channel:
    """One end of a pair of sockets; whoever may write to the other end is trusted, since pickles come from there.

    Arrays, and bytes that stand by themselves in a tuple, go from the memory where they are into that of the receiver.
    """

    def __init__(self, end: socket.socket) -> None:
        self._end = end

    def send(self, values: tuple[Any, ...]) -> None:
        """Send a tuple.

        Raises
        ------
        OSError
            When the other end is gone.
        """
        buffers: list[pickle.PickleBuffer] = []
        places = [place for place, value in enumerate(values) if isinstance(value, bytes | bytearray)]
        rest = [None if place in places else value for place, value in enumerate(values)]
        head = pickle.dumps((rest, places), protocol=5, buffer_callback=buffers.append)
        pieces = [memoryview(head), *(buffer.raw() for buffer in buffers)]
        pieces += [memoryview(values[place]) for place in places]
        self._end.sendall(_COUNT.pack(len(pieces)) + b"".join(_SIZE.pack(len(piece)) for piece in pieces))
        for piece in pieces:
            self._end.sendall(piece)

    def receive(self) -> tuple[Any, ...]:
        """Wait for a tuple; a bytearray has become bytes, and arrays cannot be written to.

        Raises
        ------
        OSError, EOFError
            When the other end is gone.
        """
        (count,) = _COUNT.unpack(self._read(_COUNT.size))
        sizes = [size for (size,) in _SIZE.iter_unpack(self._read(count * _SIZE.size))]
        head, *pieces = [self._read(size) for size in sizes]
        values, places = pickle.loads(head, buffers=pieces)
        for place in reversed(places):
            values[place] = pieces.pop()
        return tuple(values)

    def close(self) -> None:
        """Close this end."""
        self._end.close()

    def _read(self, size: int) -> bytes:
        data = io.BytesIO()
        while size:
            come = self._end.recv(min(size, _PIECE))
            if not come:
                raise EOFError
            data.write(come)
            size -= len(come)
        return data.getvalue()
