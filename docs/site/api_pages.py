"""The HTTP interface of a process as a page, from its OpenAPI document."""

import json
import re
from collections import defaultdict
from pathlib import Path
from typing import Any, Final

Spec = dict[str, Any]

_TEXT: Final = {
    "editor": (
        "Graphs, versions, the library and people. The same text for programs is at "
        "`/schema/openapi.json`."
    ),
    "runner": (
        "Robots, runs and Stop. It listens on the port after the editor's, behind a proxy below "
        "`runner/`. The same text for programs is at `/schema/openapi.json` there."
    ),
}


def page(name: str, document: Path) -> str:
    """All routes of `editor` or `runner`, by what they are about, then the shapes that they name."""
    spec: Spec = json.loads(document.read_text())
    groups: dict[str, list[str]] = defaultdict(list)
    for path, methods in spec["paths"].items():
        about = path.split("/")[2] if path.startswith("/api/") else "the process itself"
        groups[about] += [_route(method, path, route) for method, route in methods.items()]
    shapes = spec["components"]["schemas"]
    return "\n\n".join(
        [
            f"# HTTP: {name}",
            _TEXT[name],
            "Who may call, how refusals look and what does not change is in "
            "[contracts](../contracts.md). *Needs* names what a caller's role has to allow; "
            "a route without it is for everybody who is signed in.",
            *(
                "\n\n".join([f"## {about}", *groups[about]])
                for about in sorted(groups, key=lambda each: (each.startswith("the "), each))
            ),
            "## Shapes",
            *(_shape(each, shapes[each]) for each in sorted(shapes)),
        ]
    )


def _plain(text: str) -> str:
    """Within a cell and a paragraph: one line, nothing that begins a tag."""
    return re.sub(r"\s+", " ", text).replace("|", "\\|").replace("<", "&lt;").strip()


def _route(method: str, path: str, route: Spec) -> str:
    parts = [f"### {method.upper()} {path}".replace("{", "\\{"), f"{_plain(route['summary'])}."]
    if "description" in route:
        parts.append(_plain(route["description"]))
    if route.get("security") == []:
        parts.append("Answers without credentials.")
    elif "x-needs" in route:
        parts.append(f"Needs: *{route['x-needs']}*.")
    asked = [
        (each["name"], each["in"], each["schema"], each.get("required"), each.get("description"))
        for each in route.get("parameters", ())
    ]
    if asked:
        parts.append(_table([(n, f"{_type(t)}, {place}", r, d) for n, place, t, r, d in asked]))
    for media, body in route.get("requestBody", {}).get("content", {}).items():
        parts.append(f"Takes {_type(body['schema'])} (`{media}`).")
    for status, answer in route["responses"].items():
        parts += [
            f"Answers {status} with {_type(body['schema'])} (`{media}`)."
            for media, body in answer.get("content", {}).items()
            if status != "default" and "schema" in body
        ]
    return "\n\n".join(parts)


def _shape(name: str, shape: Spec) -> str:
    parts = [f"### {name}"]
    if "description" in shape:
        parts.append(_plain(shape["description"]))
    fields = shape.get("properties", {})
    needed = set(shape.get("required", ()))
    if fields:
        rows: list[tuple[str, str, bool | None, str | None]] = [
            (field, _type(what), field in needed, what.get("description"))
            for field, what in fields.items()
        ]
        parts.append(_table(rows))
    else:
        parts.append(f"{_type(shape)}.")
    return "\n\n".join(parts)


def _table(rows: list[tuple[str, str, bool | None, str | None]]) -> str:
    told = any(text for *_, text in rows)
    head = ["| | | |" + (" |" if told else ""), "|---|---|---|" + ("---|" if told else "")]
    lines = [
        f"| `{name}` | {what} | {'' if needed else 'optional'} |"
        + (f" {_plain(text or '')} |" if told else "")
        for name, what, needed, text in rows
    ]
    return "\n".join([*head, *lines])


def _type(schema: Spec) -> str:
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    for word in ("anyOf", "oneOf", "allOf"):
        if word in schema:
            return " or ".join(dict.fromkeys(_type(each) for each in schema[word]))
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return " or ".join(f"`{json.dumps(each)}`" for each in schema["enum"])
    kind = schema.get("type", "any value")
    if isinstance(kind, list):
        return " or ".join(kind)
    if "prefixItems" in schema:
        return f"[{', '.join(_type(each) for each in schema['prefixItems'])}]"
    if kind == "array":
        return f"list of {_type(schema.get('items', {}))}"
    inside = schema.get("additionalProperties")
    if kind == "object" and isinstance(inside, dict) and inside:
        return f"object of {_type(inside)}"
    return f"{kind}{_format(schema)}"


def _format(schema: Spec) -> str:
    return f" ({schema['format']})" if "format" in schema else ""
