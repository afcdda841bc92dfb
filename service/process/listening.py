"""The address that the service listens on."""

from __future__ import annotations

import resource
import socket

from ..settings import Settings

RESERVED = 96  # descriptors for everything else: databases, the parser's pipes, files that are being loaded
FEWEST = 8


def free_address(settings: Settings) -> tuple[str, int]:
    """Return the IP address and the port of the settings, port 0 replaced by a free one.

    Each worker opens a socket of its own on the port, and the system would let a second service do the same: half of
    the requests would reach the other. So the port is tried first with a socket that shares it with none.

    Raises
    ------
    OSError
        When the address is in use or does not belong to this machine.
    """
    family, _, _, _, address = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)[0]
    with socket.create_server(address[:2], family=family) as tried:
        host, port = tried.getsockname()[:2]
    return host, port


def most_connections(wanted: int) -> int:
    """Return how many of the wanted connections there are descriptors for; raise the process's limit first.

    Past the system's limit not even a file can be opened: the store would seem to be read-only.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = wanted + RESERVED
    if soft != resource.RLIM_INFINITY and soft < needed:
        soft = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        return max(FEWEST, min(wanted, soft - RESERVED))
    return wanted
