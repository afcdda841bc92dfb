"""Parameter files of ROS 2: the sections of the node ``linefix``, for one robot or for several."""

from __future__ import annotations

from collections.abc import Container
from pathlib import Path
from typing import Any

from .errors import WrongUseError

MAX_PARAMETERS = 65_536  # characters of a file of parameters
NODE = "linefix"  # the name of the node in parameter files
ANY = "**"  # stands for each node

Sections = dict[tuple[str, str], dict[str, Any]]


def parameters_of(file: Path, namespace: str | None = None, known: Container[str] = ()) -> dict[str, Any]:
    """Return the parameters of a file for a robot, by the names of options.

    The sections ``/**`` and ``linefix`` apply to each robot, ``/robot1/linefix`` to that one and with precedence.

    Parameters
    ----------
    file : Path
    namespace : str, optional
        Of the robot, such as ``/robot1``. None: that of the file, if all its sections have one at most.
    known : container of str
        Names of options; others in sections of all nodes are left out.

    Raises
    ------
    WrongUseError
        When there is no such file, it is no file of parameters, or it has none for this robot.
    """
    sections, robots = _sections_of(file), robots_of(file)
    only = robots[0] if len(robots) == 1 else ""
    chosen = (only if namespace is None else namespace).strip("/")
    keys = [("", ANY), ("", NODE), *([(chosen, ANY), (chosen, NODE)] if chosen else [])]
    if namespace is not None and not any(key in sections for key in keys):
        raise WrongUseError(
            f"{file}: found parameters of {', '.join(robots)}, expected those of /{chosen}; correct --namespace"
        )
    values: dict[str, Any] = {}
    for above, node in keys:
        section = _with_maps(sections.get((above, node), {}), file)
        # Parameters of all nodes may be meant for others.
        values.update({name: value for name, value in section.items() if node == NODE or name in known})
    return values


def given_parameter(rule: str) -> dict[str, Any]:
    """Return a parameter of the command line, ``name:=value``, by the name of its option; raises `WrongUseError`."""
    name, _, text = rule.partition(":=")
    node, _, name = name.rpartition(":")
    value = _yaml(text)
    if not name or value is None or node.strip("/").rpartition("/")[2] not in ("", NODE):
        raise WrongUseError(f"-p: found {rule[:80]!r}, expected NAME:=VALUE, such as agree:=5")
    return _with_maps({name: value}, Path("-p"))


def _yaml(text: str) -> Any:
    """Return the value of a text in YAML without merge keys; None where it is none, or too long."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        return YAML(typ="safe").load(text) if len(text) <= MAX_PARAMETERS and "<<" not in text else None
    except (YAMLError, ValueError, RecursionError):
        return None


def _with_maps(section: dict[str, Any], file: Path) -> dict[str, Any]:
    """Return a section with `map`, a text, or `maps`, a list, as the option that takes both; raises `WrongUseError`."""
    others = {name: value for name, value in section.items() if value is not None}
    one, several = others.pop("map", None), others.pop("maps", None)
    maps = [*([] if one is None else [one]), *(several if isinstance(several, list) else [several] if several else [])]
    if not all(isinstance(name, str) for name in maps):
        raise WrongUseError(
            f"{file}: found {str(maps)[:80]}, expected map: NAME, or maps: [NAME, ...] with names of maps"
        )
    return {**others, "on": maps} if maps else others


def robots_of(file: Path) -> list[str]:
    """Return the namespaces that sections of a file have, such as ``/robot1``; raises `WrongUseError`."""
    return sorted({f"/{above}" for above, _ in _sections_of(file) if above})


def _sections_of(file: Path) -> Sections:
    """Return the sections of the node by namespace and name of the node."""
    expected = f"expected {NODE}: ros__parameters: name: value"
    with file.open(encoding="utf-8", errors="replace") as stream:
        document = _yaml(stream.read(MAX_PARAMETERS + 1))
    sections: Sections = {}
    for name, inner in document.items() if isinstance(document, dict) else ():
        above, _, node = str(name).strip("/").rpartition("/")
        parameters = inner.get("ros__parameters") if isinstance(inner, dict) else None
        if node in (NODE, ANY) and isinstance(parameters, dict):
            sections[above, node] = {str(key): value for key, value in parameters.items()}
    if not sections:
        raise WrongUseError(f"{file}: {expected}, in YAML of at most {MAX_PARAMETERS} characters without merge keys")
    return sections
