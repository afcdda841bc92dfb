"""The exceptions of the client.

::

    LinefixError
    ├── ProblemError         the service refused a request, with a problem document
    │   └── BusyError        and said when to come again: 429 and 503, after the last try
    └── UnreachableError     no answer, or one that is not Linefix's
"""

from __future__ import annotations

from typing import Any


class LinefixError(Exception):
    """Root of what this package raises."""


class UnreachableError(LinefixError):
    """Nobody answered, or what answered is no Linefix: too long, too slow, no JSON."""


class ProblemError(LinefixError):
    """The service refused a request.

    Attributes
    ----------
    status : int
        As over HTTP.
    code : str
        Stable, such as ``invalid_request``; ``unknown`` where something between said no.
    detail : str
        What is wrong; of an ``invalid_request`` the first of `errors`.
    errors : list of dict
        ``pointer`` and ``message`` of each place that is wrong.
    request_id : str
        To be found in the service's log.
    """

    def __init__(self, status: int, problem: dict[str, Any]) -> None:
        self.status = status
        self.code = str(problem.get("code", "unknown"))
        self.detail = str(problem.get("detail", ""))
        errors = problem.get("errors")
        self.errors: list[dict[str, str]] = (
            [one for one in errors if isinstance(one, dict)] if isinstance(errors, list) else []
        )
        self.request_id = str(problem.get("request_id", ""))
        super().__init__(f"{status} {self.code}: {self.detail}")


class BusyError(ProblemError):
    """The service has too much to do, or is not ready, and was so at the last try, too."""


def problem_of(status: int, phrase: str, told: Any) -> ProblemError:
    """Return the exception that a refusal stands for; a proxy may have refused without a problem document.

    Parameters
    ----------
    status : int
    phrase : str
        Of the status.
    told : object
        The body, where it is JSON.
    """
    problem = told if isinstance(told, dict) else {"detail": phrase}
    kind = BusyError if status in (429, 503) else ProblemError
    return kind(status, problem)
