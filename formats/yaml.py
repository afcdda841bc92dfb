"""YAML of others, read within a bound."""

from __future__ import annotations

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from .errors import MalformedFileError, TooLargeError
from .limits import MAX_YAML_VALUES
from .report import shown


def yaml_of(text: str) -> object:
    """Return what a text in YAML holds.

    Aliases and merge keys let a few lines stand for any number of values; these are counted before any is built.

    Raises
    ------
    MalformedFileError
        When it is no YAML; the error names the line where it can.
    TooLargeError
        When it stands for too many values.
    """
    text = text.expandtabs()  # that people put behind a colon, which YAML does not allow
    try:
        root = YAML(typ="safe", pure=True).compose(text)
        if root is not None and _values(root, {}) > MAX_YAML_VALUES:
            raise TooLargeError(f"expected at most {MAX_YAML_VALUES} values, aliases counted each time")
        return YAML(typ="safe", pure=True).load(text)
    except (YAMLError, RecursionError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError) as error:
        if isinstance(error, TooLargeError):
            raise
        where = ""
        if isinstance(error, MarkedYAMLError) and error.problem_mark is not None:
            problem = (error.problem or "it cannot be read").partition(" with value")[0]
            where = f": line {error.problem_mark.line + 1}: {shown(problem)}; correct it"
        raise MalformedFileError(f"is not YAML{where}") from error


def _values(node: Node, known: dict[int, int]) -> int:
    """Return the number of values that a node stands for; one that holds itself is refused as a recursion."""
    if isinstance(node, ScalarNode):
        return 1
    if id(node) not in known:
        known[id(node)] = MAX_YAML_VALUES + 1  # while it is counted: what holds itself has no end
        held: list[Node] = []
        if isinstance(node, SequenceNode):
            held = list(node.value)
        elif isinstance(node, MappingNode):
            held = [one for pair in node.value for one in pair]
        known[id(node)] = 1 + sum(_values(one, known) for one in held)
    return known[id(node)]
