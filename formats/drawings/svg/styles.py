"""CSS of elements: presentation attributes, style elements and style attributes, in the order of CSS."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any
from xml.etree.ElementTree import Element

import cssselect2
import tinycss2

from ...errors import TooLargeError
from ...limits import MAX_STYLE_BYTES, MAX_STYLE_RULES
from .xml import kind_of

# Those by which it is decided what is drawn, and where.
PROPERTIES = frozenset((
    "display", "visibility", "opacity", "stroke", "stroke-opacity", "stroke-width", "fill", "fill-opacity",
    "stroke-dasharray", "transform", "transform-origin", "transform-box", "clip-path", "mask",
))  # fmt: skip
OF_CSS_ALONE = frozenset({"translate", "rotate", "scale"})  # attributes of these names are something else
SCREEN = re.compile(r"(only )?(screen|all)?")  # the media whose rules hold

Declared = tuple[tuple[str, str, bool], ...]
"""Properties with their values, and whether these are important."""


class Styles:
    """The styles of a document's elements."""

    def __init__(self, root: Element) -> None:
        self._matched: dict[Element, list[Declared]] = {}
        sheets = [element.text for element in root.iter() if kind_of(element) == "style" and element.text]
        length = sum(map(len, sheets))
        if length > MAX_STYLE_BYTES:
            raise TooLargeError(f"expected at most {MAX_STYLE_BYTES} characters of style elements, found {length}")
        matcher, count = cssselect2.Matcher(), 0
        for sheet in sheets:
            for selector, declared in _rules(sheet):
                matcher.add_selector(selector, declared)
                count += 1
                if count > MAX_STYLE_RULES:
                    raise TooLargeError(
                        f"expected at most {MAX_STYLE_RULES} rules of style, found {count} or more; save plain SVG"
                    )
        if count:
            for wrapper in cssselect2.ElementWrapper.from_xml_root(root).iter_subtree():
                found = [declared for _, _, pseudo, declared in matcher.match(wrapper) if pseudo is None]
                if found:
                    self._matched[wrapper.etree_element] = found

    def of(self, element: Element) -> Mapping[str, str]:
        """Return the values of the properties that are set on an element itself, in lower case."""
        values = {key: element.get(key, "").strip() for key in PROPERTIES & element.attrib.keys()}
        layers = [*self._matched.get(element, ()), _declared_inline(element.get("style", ""))]
        for important in (False, True):
            for declared in layers:
                values |= {key: value for key, value, weight in declared if weight is important}
        return {key: value for key, value in values.items() if value.lower() != "inherit"}


def _rules(sheet: str) -> Iterable[tuple[Any, Declared]]:
    """Yield the selectors of a style sheet with their declarations; what is no valid rule is left out, as CSS says."""
    for rule in tinycss2.parse_stylesheet(sheet, skip_comments=True, skip_whitespace=True):
        if rule.type == "at-rule" and rule.lower_at_keyword == "media" and rule.content:
            if SCREEN.fullmatch(tinycss2.serialize(rule.prelude).strip().lower()):
                yield from _rules(tinycss2.serialize(rule.content))
            continue
        if rule.type != "qualified-rule":
            continue
        declared = _declared(tinycss2.parse_blocks_contents(rule.content, skip_comments=True, skip_whitespace=True))
        if not declared:
            continue
        try:
            selectors = cssselect2.compile_selector_list(rule.prelude)
        except cssselect2.SelectorError:
            continue
        yield from ((selector, declared) for selector in selectors)


@lru_cache(10_000)  # style attributes repeat
def _declared_inline(text: str) -> Declared:
    return _declared(tinycss2.parse_blocks_contents(text, skip_comments=True, skip_whitespace=True))


def _declared(nodes: Iterable[Any]) -> Declared:
    return tuple(
        (node.lower_name, tinycss2.serialize(node.value).strip(), bool(node.important))
        for node in nodes
        if node.type == "declaration" and node.lower_name in PROPERTIES | OF_CSS_ALONE
    )
