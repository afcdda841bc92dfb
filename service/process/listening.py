"""The socket that the service listens on; light to import, since the process above several workers does it for them."""

from __future__ import annotations

import logging
import socket

from ..settings import Settings

logger = logging.getLogger("linefix")
BACKLOG = 512


def listen(settings: Settings) -> socket.socket:
    """Return a socket that listens on the address that is set.

    Raises
    ------
    OSError
        When the address is taken or is none of this machine's.
    """
    family, _, _, _, address = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)[0]
    listener = socket.create_server(address[:2], family=family, backlog=BACKLOG)
    _prepare(listener, settings.request_timeout)
    host, port = listener.getsockname()[:2]
    logger.info("listening", extra={"host": host, "port": port})
    return listener


def _prepare(listener: socket.socket, seconds: float) -> None:
    """Set what accepted connections inherit: no delay, and an end when a client takes nothing of an answer for long."""
    # asyncio does this for sockets whose protocol number is given, which that of an accepted one is not. Without it the
    # second part of an answer waits 40 ms for the client to acknowledge the first.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1e3 * seconds))
