"""The log: one JSON object a line, on stderr.

The log's reader may be slow, or stopped. The service does not wait for it: lines that find no room are counted, and
the count is logged when there is room again.
"""

from __future__ import annotations

import json
import logging
import os
import queue
import threading
import time
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

STDERR = 2
WAITING_LINES = 4096  # that are buffered for a late reader
GATHER_SECONDS = 0.05  # between two writes: to wake the thread for each line would cost a request a twentieth more
LAST_SECONDS = 0.5  # that an ending process waits for the reader
_JSON = json.JSONEncoder(default=str, separators=(",", ":"))
_USUAL = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName", "color_message"}


class JsonFormatter(logging.Formatter):
    """Writes a record with everything that was passed as `extra`."""

    def format(self, record: logging.LogRecord) -> str:
        """Return one line."""
        line: dict[str, Any] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        line |= {name: value for name, value in vars(record).items() if name not in _USUAL}
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        # ASCII without controls: terminals obey some characters that JSON leaves as they are.
        return _JSON.encode(line).replace("\x7f", "\\u007f")


class PatientHandler(logging.Handler):
    """Hands lines to a thread that writes them to stderr."""

    def __init__(self) -> None:
        super().__init__()
        # Of the queues of the library the one that does not take as long as the rest of a line.
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._handed = self._written = 0
        self._lost = 0
        self._thread = threading.Thread(target=self._write_all, name="log", daemon=True)
        self._thread.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Format a record and hand it over; called by one thread at a time, as `logging` does."""
        try:
            if self._handed - self._written >= WAITING_LINES:
                self._lost += 1
                return
            self._lines.put(self.format(record))
            self._handed += 1
        except Exception:
            self.handleError(record)

    def flush(self) -> None:
        """Wait for the queued lines to be written, for a moment."""
        give_up = time.monotonic() + LAST_SECONDS
        while self._written < self._handed and self._thread.is_alive() and time.monotonic() < give_up:
            time.sleep(0.002)

    def close(self) -> None:
        """Write the remaining lines and end."""
        self.flush()
        self._lines.put(None)
        super().close()

    def _write_all(self) -> None:
        line = self._lines.get()
        while line is not None:
            lines = [line]
            for _ in range(self._lines.qsize()):
                line = self._lines.get()
                if line is not None:
                    lines.append(line)
            count, lost, self._lost = len(lines), self._lost, 0
            if lost:
                record = logging.LogRecord("linefix", logging.WARNING, "", 0, "lines of the log were lost", None, None)
                record.count = lost
                lines.append(self.format(record))
            with suppress(OSError):  # the reader has gone
                _write("".join(f"{one}\n" for one in lines).encode("utf-8", "backslashreplace"))
            self._written += count
            if line is not None:
                time.sleep(GATHER_SECONDS)
                line = self._lines.get()


def _write(data: bytes) -> None:
    rest = memoryview(data)
    while rest:
        rest = rest[os.write(STDERR, rest) :]


def log_config(level: str) -> dict[str, Any]:
    """Return what sends every logger of a process to stderr, as JSON; in the form of `logging.config.dictConfig`."""
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"json": {"()": JsonFormatter}},
        "handlers": {"stderr": {"class": f"{__name__}.PatientHandler", "formatter": "json"}},
        "root": {"level": level.upper(), "handlers": ["stderr"]},
        "loggers": {"numba": {"level": "WARNING"}},  # at debug, it logs every pass of its compiler
    }
