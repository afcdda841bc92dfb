"""Entry point of ``linefix``: runs a command, and turns an error into one line and an exit code."""

from __future__ import annotations

import os
import sys

from .errors import CommandError

# Its threads cost more than they bring, for arrays of some hundred rows.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
DEFECT = "a defect of linefix; please report it"
INTERRUPTED, PIPE_CLOSED = 130, 141  # as shells number the end by a signal


def main() -> None:
    """Run the command that the command line names."""
    arguments = sys.argv[1:]
    if arguments[:1] == ["serve"]:  # a service carries nothing of the other commands in its memory
        from service.serving import serve

        sys.exit(serve(arguments[1:]))
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    sys.exit(run(arguments))


def run(arguments: list[str]) -> int:
    """Run a command; return the exit code."""
    try:
        from .program import call

        code = call(arguments)
        sys.stdout.flush()
        return code
    except CommandError as error:
        return _ended(error.exit_code, str(error))
    except ModuleNotFoundError as error:
        from service.serving import EXTRA, needed

        if error.name in EXTRA:
            return _ended(2, needed(error))
        return _ended(1, f"{DEFECT}: {error}")
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of the output, such as head, has closed it; nothing is to be written to it at the end, either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_CLOSED
    except OSError as error:
        named = f"{error.filename}: " if error.filename else ""
        return _ended(2, f"{named}{error.strerror or error}")
    except Exception as error:
        return _ended(1, f"{DEFECT}: {type(error).__name__}: {error}")


def _ended(code: int, message: str) -> int:
    line = "".join(letter if letter.isprintable() else " " for letter in message)
    print(f"linefix: {line}", file=sys.stderr)
    return code
