"""Requests with hostile texts at every place that an OpenAPI document names for a text."""

import itertools
import json
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

#: Raw bytes of a path or query, percent-encoded: NUL, half a character, bytes that are no
#: UTF-8; and a number that no database has.
RAW = ("a%00b", "%ED%A0%80", "%FF", f"{10**30}")
#: Numbers that no place of an address takes.
NUMBERS = (10**30, 1 << 63, -1, -(10**30))
#: Texts of a body, as JSON has them.
TEXTS = ("a\\u0000b", "\\ud800", "\\udfffx")
_MARK = "hostile-text"
_DEPTH = 6


class BodyText(NamedTuple):
    """A text of a request body: `keys` lead to it in the body, which has the mark there."""

    method: str
    url: str
    keys: tuple[str, ...]
    body: Any

    def filled(self, text: str) -> bytes:
        """Return the body with `text`, as JSON writes it, at this place."""
        return _filled(self.body, text) or b""


def body_texts(document: dict[str, Any]) -> Iterator[BodyText]:
    """Yield each text of each JSON body that a document names."""
    for path, item in document["paths"].items():
        for method, operation in item.items():
            url = re.sub(r"\{[^}]*\}", "1", path)
            for body in _bodies(document, operation):
                yield BodyText(method, url, _keys(body), body)


def _keys(body: Any) -> tuple[str, ...]:
    """Return the keys that lead to the mark; "" stands for an index, and for the key itself."""
    match body:
        case dict():
            for name, each in body.items():
                if name == _MARK:
                    return ("",)
                if _MARK in json.dumps(each):
                    return (name, *_keys(each))
        case list():
            return ("", *_keys(body[0]))
    return ()


class HostileRequest(NamedTuple):
    """One request; `content` is its body, None without one."""

    method: str
    url: str
    content: bytes | None


def requests(document: dict[str, Any], *, every: bool) -> Iterator[HostileRequest]:
    """Yield a request for each place: in the path, in the query, and in each text of the body, the
    other fields being as the schema asks; with `every` one for each text there, else the next of the
    texts."""
    turn = itertools.count()

    def of(texts: tuple[str, ...]) -> tuple[str, ...]:
        return texts if every else (texts[next(turn) % len(texts)],)

    for path, item in document["paths"].items():
        for method, operation in item.items():
            plain = re.sub(r"\{[^}]*\}", "1", path)
            bodies = list(_bodies(document, operation))
            one = bodies[0] if bodies else None
            addresses = [path] if "{" in path else []
            addresses += [
                f"{plain}?{each['name']}={{}}"
                for each in operation.get("parameters", [])
                if each["in"] == "query"
            ]
            for address in addresses:
                for raw in of(RAW):
                    url = re.sub(r"\{[^}]*\}", raw, address)
                    yield HostileRequest(method, url, _filled(one, "x"))
            for body in bodies:
                for text in of(TEXTS):
                    yield HostileRequest(method, plain, _filled(body, text))


def number_requests(
    document: dict[str, Any], values: dict[str, str]
) -> Iterator[tuple[str, str, dict[str, str]]]:
    """Yield method, path and query with each hostile number at each place of an address for a whole
    number. `values`: those of other parameters, "1" where there is none."""
    for path, item in document["paths"].items():
        for method, operation in item.items():
            given = operation.get("parameters", [])
            queried = [each for each in given if each["in"] == "query"]
            for each in given:
                if '"integer"' not in json.dumps(each["schema"]):
                    continue
                for number in NUMBERS:
                    filled = values | {each["name"]: str(number)}
                    parts = re.split(r"\{(\w+)\}", path)
                    parts[1::2] = [filled.get(name, "1") for name in parts[1::2]]
                    needed = {
                        one["name"]: filled.get(one["name"], "1")
                        for one in queried
                        if one.get("required") or one is each
                    }
                    yield method, "".join(parts), needed


def _filled(body: Any, text: str) -> bytes | None:
    return None if body is None else json.dumps(body).replace(_MARK, text).encode()


def _bodies(document: dict[str, Any], operation: dict[str, Any]) -> Iterator[Any]:
    """Yield a body for each text of the request body: that text is the mark."""
    content = operation.get("requestBody", {}).get("content", {})
    for each in content.values():
        yield from _samples(document, each["schema"], 0)


def _samples(document: dict[str, Any], schema: dict[str, Any], depth: int) -> Iterator[Any]:
    """Yield samples of a schema, each with the mark as one of its texts."""
    schema = _resolved(document, schema)
    if depth > _DEPTH:
        return
    for way in ("anyOf", "oneOf", "allOf"):
        for each in schema.get(way, ()):
            yield from _samples(document, each, depth + 1)
    match schema.get("type"):
        case "string" if "enum" not in schema:
            yield _MARK
        case "array" if isinstance(schema.get("items"), dict):
            for each in _samples(document, schema["items"], depth + 1):
                yield [each]
        case "object":
            needed = {
                name: _plain(document, schema["properties"][name], depth)
                for name in schema.get("required", ())
            }
            for name, part in schema.get("properties", {}).items():
                for each in _samples(document, part, depth + 1):
                    yield {**needed, name: each}
            if isinstance(more := schema.get("additionalProperties"), dict):
                for each in _samples(document, more, depth + 1):
                    yield {**needed, "key": each}
                yield {**needed, _MARK: _plain(document, more, depth)}
            if not schema.get("properties"):
                yield {_MARK: _MARK}


def _plain(document: dict[str, Any], schema: dict[str, Any], depth: int) -> Any:
    """Return a value that a schema admits, as a rule."""
    schema = _resolved(document, schema)
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return schema["enum"][0]
    for way in ("anyOf", "oneOf", "allOf"):
        if way in schema:
            return _plain(document, schema[way][0], depth + 1)
    match schema.get("type"):
        case "string" if schema.get("format") == "date-time":
            return "2030-01-01T00:00:00Z"
        case "string":
            return "0" * max(1, schema.get("minLength", 1))
        case "integer" | "number":
            return 1
        case "boolean":
            return True
        case "array":
            return []
        case "object" if depth < _DEPTH:
            return {
                name: _plain(document, schema["properties"][name], depth + 1)
                for name in schema.get("required", ())
            }
    return {}


def _resolved(document: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    while "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    return schema
