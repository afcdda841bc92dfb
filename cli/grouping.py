"""Options that belong together, as one argument of a command.

typer makes an option of each argument, and knows no groups.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature
from typing import Any


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Have each argument of a command that is a dataclass stand for options, one for each of its fields."""
    parameters = inspect.signature(command, eval_str=True).parameters.values()
    groups: dict[str, Any] = {one.name: one.annotation for one in parameters if is_dataclass(one.annotation)}
    flat: list[Parameter] = []
    for one in parameters:
        group = groups.get(one.name)
        flat += [one] if group is None else inspect.signature(group, eval_str=True).parameters.values()

    @wraps(command)
    def called(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group)})
        command(**values)

    called.__signature__ = Signature([one.replace(kind=Parameter.KEYWORD_ONLY) for one in flat])  # type: ignore[attr-defined]
    return called
