"""The socket that the service listens on; light to import, since the process above several workers does it for them."""

from __future__ import annotations

import logging
import socket

from ..settings import Settings

logger = logging.getLogger("linefix")
BACKLOG = 512
BUFFER = 262_144  # bytes; enough for some megabytes a second across a continent


def listen(settings: Settings) -> socket.socket:
    """Return a socket that listens on the address that is set.

    Raises
    ------
    OSError
        When the address is taken or is none of this machine's.
    """
    family, _, _, _, address = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)[0]
    listener = socket.create_server(address[:2], family=family, backlog=BACKLOG)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        # Accepted connections inherit it: an end when a client acknowledges nothing of an answer for so long.
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1e3 * settings.request_timeout))
    # By itself the system lets each connection have several megabytes of what nobody takes, in both directions.
    for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
        listener.setsockopt(socket.SOL_SOCKET, option, BUFFER)
    host, port = listener.getsockname()[:2]
    logger.info("listening", extra={"host": host, "port": port})
    return listener
