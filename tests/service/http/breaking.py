"""Changes of a contract that break clients of an older one.

A client sends what requests describe and reads what answers do. So of a request nothing may be asked for that was not,
and nothing refused that was taken; of an answer nothing may be missing that was there.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Schema = dict[str, Any]
METHODS = ("get", "put", "post", "delete")
LEAST, MOST = (
    ("minimum", "exclusiveMinimum", "minItems", "minLength"),
    ("maximum", "exclusiveMaximum", "maxItems", "maxLength"),
)


def breaking(old: Schema, new: Schema) -> list[str]:
    """Return what breaks, each with its place; nothing where the new contract only has more."""
    found = [*_operations(old, new)]
    asked, answered = _reached(old, "requestBody"), _reached(old, "responses")
    schemas, others = old["components"]["schemas"], new["components"]["schemas"]
    for name in sorted(schemas):
        if name not in others:
            found.append(f"schema {name}: gone")
            continue
        if name in asked:
            found += _asked(f"request {name}", schemas[name], others[name])
        if name in answered:
            found += _answered(f"answer {name}", schemas[name], others[name])
    return found


def _operations(old: Schema, new: Schema) -> Iterator[str]:
    for path, item in old["paths"].items():
        for method in METHODS:
            if method not in item:
                continue
            place = f"{method.upper()} {path}"
            there = new["paths"].get(path, {}).get(method)
            if there is None:
                yield f"{place}: gone"
                continue
            good = [status for status in item[method]["responses"] if status.startswith("2")]
            yield from (f"{place}: no {status} any more" for status in good if status not in there["responses"])
            before = {(one["in"], one["name"]) for one in item[method].get("parameters", ())}
            after = {(one["in"], one["name"]): one.get("required", False) for one in there.get("parameters", ())}
            yield from (f"{place}: parameter {name} gone" for where, name in sorted(before - after.keys()))
            more = sorted(key for key, required in after.items() if required and key not in before)
            yield from (f"{place}: parameter {name} is required" for _, name in more)


def _asked(place: str, old: Schema, new: Schema) -> Iterator[str]:
    """Yield what was taken and would be refused."""
    properties, others = old.get("properties", {}), new.get("properties", {})
    for name in sorted(set(new.get("required", ())) - set(old.get("required", ()))):
        yield f"{place}: {name} is required"
    for name in sorted(properties):
        if name not in others:
            yield f"{place}: {name} gone"
        else:
            yield from _asked(f"{place}.{name}", properties[name], others[name])
    yield from (f"{place}: no {kind} any more" for kind in sorted(_kinds(old) - _kinds(new)) if _kinds(new))
    for names, sign in ((LEAST, 1), (MOST, -1)):
        for bound in names:
            limit = new.get(bound)
            if limit is not None and (bound not in old or sign * limit > sign * old[bound]):
                yield f"{place}: {bound} {old.get(bound, 'none')} -> {limit}"


def _answered(place: str, old: Schema, new: Schema) -> Iterator[str]:
    """Yield what was always there and need not be."""
    properties, others = old.get("properties", {}), new.get("properties", {})
    for name in sorted(properties):
        if name not in others:
            yield f"{place}: {name} gone"
        else:
            yield from _answered(f"{place}.{name}", properties[name], others[name])
    for name in sorted((set(old.get("required", ())) - set(new.get("required", ()))) & set(others)):
        yield f"{place}: {name} may be missing"
    # One more code among those that a text may be is no break: clients must expect new codes.
    more = {kind for kind in _kinds(new) - _kinds(old) if not kind.startswith("'")}
    yield from (f"{place}: may be {kind}" for kind in sorted(more) if _kinds(old))


def _kinds(schema: Schema) -> set[str]:
    """Return what a value may be: types, schemas, constants."""
    if "anyOf" in schema or "oneOf" in schema:
        return set().union(*(_kinds(one) for one in schema.get("anyOf", schema.get("oneOf"))))
    if "enum" in schema:
        return {repr(value) for value in schema["enum"]}
    if "const" in schema:
        return {repr(schema["const"])}
    if "$ref" in schema:
        return {schema["$ref"].rsplit("/", 1)[-1]}
    kinds = schema.get("type", [])
    return {kinds} if isinstance(kinds, str) else set(kinds)


def _reached(document: Schema, part: str) -> set[str]:
    """Return the names of the schemas that requests, or answers, are made of."""
    todo = [operation.get(part, {}) for item in document["paths"].values() for operation in item.values()]
    found: set[str] = set()
    while todo:
        value = todo.pop()
        if isinstance(value, dict):
            name = str(value.get("$ref", "")).rsplit("/", 1)[-1]
            if name and name not in found:
                found.add(name)
                todo.append(document["components"]["schemas"][name])
            todo += list(value.values())
        elif isinstance(value, list):
            todo += value
    return found
