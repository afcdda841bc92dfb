"""Objects from one process to another, large ones without a copy on the way.

`multiprocessing` sends a pickle, which holds a copy of every array and of the whole body. Here these go as they are.
"""

from __future__ import annotations

import pickle
from multiprocessing.connection import Connection
from typing import Any


def send(connection: Connection, value: Any) -> None:
    """Send an object; arrays, and bytes that are wrapped in a `pickle.PickleBuffer`, go without a copy.

    Raises
    ------
    OSError
        When the other end is gone.
    """
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    connection.send(len(buffers))
    connection.send_bytes(head)
    for buffer in buffers:
        connection.send_bytes(buffer.raw())


def receive(connection: Connection) -> Any:
    """Wait for an object; whoever may send here is trusted, since it comes as a pickle.

    What was a `bytearray` is `bytes`, and arrays cannot be written to.

    Raises
    ------
    OSError, EOFError
        When the other end is gone.
    """
    count = connection.recv()
    head, *buffers = [connection.recv_bytes() for _ in range(count + 1)]
    return pickle.loads(head, buffers=buffers)
