"""Directive ``ros-parameters``: the parameters of ``linefix ros2``, from the options of the command."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


def parameters() -> Iterator[tuple[str, str, str, str]]:
    """Give name, type, default and meaning of each parameter."""
    from typer.main import get_command

    from cli.program import app
    from cli.ros2 import NOT_IN_FILES

    command: Any = get_command(app).commands["ros2"]  # type: ignore[attr-defined]
    for option in command.params:
        if option.name in NOT_IN_FILES:
            continue
        if option.name == "on":
            yield "map", "text", "", "The same as `maps` with one map."
        name = "maps" if option.name == "on" else str(option.name)
        default = option.default
        shown = "" if default in (None, "", []) else str(default).lower() if isinstance(default, bool) else str(default)
        yield name, _kind(option), shown, " ".join((option.help or "").split())


def _kind(option: Any) -> str:
    choices = getattr(option.type_descriptor, "choices", None)
    if choices:
        return " or ".join(f"`{one}`" for one in choices)
    if isinstance(option.default, bool):
        return "true or false"
    number = {int: "integer", float: "number"}.get(type(option.default))
    if number is None:
        return "list of text" if option.multiple else "text"
    return number if option.min is None else f"{number} from {option.min:g} to {option.max:g}"


class RosParameters(SphinxDirective):
    """List the parameters of ``linefix ros2``."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        lines = ["| parameter | type | default | meaning |", "|---|---|---|---|"]
        lines += [f"| `{name}` | {kind} | {default} | {meaning} |" for name, kind, default, meaning in parameters()]
        container = nodes.container()
        self.state.nested_parse(StringList(lines, source="options"), 0, container)
        return container.children


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the directive to Sphinx."""
    app.add_directive("ros-parameters", RosParameters)
    return {"parallel_read_safe": True}
