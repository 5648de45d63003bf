"""Converts parameters between their nested form in files and their paths, and handles their values
and examples."""

from collections.abc import Iterable, Iterator
from typing import Final

from action_assistant.umrf.json.text import Json, Number, dump, parse_small
from action_assistant.umrf.model import JsonText, Parameter

#: The most keys of a path. The engine has no limit; a file of ours could not be read again beyond this one.
MAX_PATH: Final = 60


def flatten(group: dict[str, Json]) -> tuple[Parameter, ...]:
    """Return the parameters below `group` in file order: every value that is not an object of
    further keys, that is, without `pvf_type` and not empty."""
    return tuple(
        Parameter("/".join(map(escape, keys)), dump(value)) for keys, value in _leaves(group, ())
    )


def nest(parameters: Iterable[Parameter]) -> dict[str, Json]:
    """Return parameters in the nested form of a file, the inverse of `flatten`. If the path of one
    lies inside that of another, the one with the shorter path stays; paths with more than
    `MAX_PATH` keys are dropped."""
    root: dict[str, Json] = {}
    listed = [(keys_of(p.path), p.text) for p in parameters]
    listed = [(keys, text) for keys, text in listed if len(keys) <= MAX_PATH]
    leaves = {keys for keys, _ in listed}
    for keys, text in listed:
        if any(keys[:n] in leaves for n in range(1, len(keys))):
            continue
        group = root
        for key in keys[:-1]:
            inner = group.setdefault(key, {})
            assert isinstance(inner, dict)
            group = inner
        group[keys[-1]] = parse_small(text)
    return root


def keys_of(path: str) -> tuple[str, ...]:
    """Split the path of a parameter into its keys, unescaped."""
    return tuple(part.replace("~1", "/").replace("~0", "~") for part in path.split("/"))


def escape(key: str) -> str:
    """Escape a key so that it can be one part of a path (`~` is `~0`, `/` is `~1`)."""
    return key.replace("~", "~0").replace("/", "~1")


def flat_name(path: str) -> str:
    """Return the name by which the engine knows the parameter with this path: `pose::position::x`
    for `pose/position/x`."""
    return "::".join(keys_of(path))


def example_of(text: JsonText) -> Json:
    """Return the `pvf_example` of a parameter without a value as a value of its type, or None.

    Old files spell examples as texts; a text that is no value of the type is not converted. Twin of
    `frontend/src/graph/edit/fixes.ts`.
    """
    leaf = parse_small(text)
    if not isinstance(leaf, dict) or "pvf_value" in leaf:
        return None
    kind, value = leaf.get("pvf_type"), leaf.get("pvf_example")
    if isinstance(value, str) and kind != "string":
        value = parse_small(value)
    if not isinstance(kind, str) or not fits(kind, value):
        return None
    allowed = leaf.get("pvf_allowed_values")
    return value if not isinstance(allowed, list) or not allowed or value in allowed else None


def with_example(parameter: Parameter) -> Parameter:
    """Return the parameter with its declared example as value; unchanged if it has no example that
    fits."""
    leaf, value = parse_small(parameter.text), example_of(parameter.text)
    if value is None or not isinstance(leaf, dict):
        return parameter
    return Parameter(parameter.path, dump({**leaf, "pvf_value": value}))


def without_value(parameter: Parameter) -> Parameter:
    """Return the parameter as an action's file describes it, without the value that an action of a
    graph gives it."""
    leaf = parse_small(parameter.text)
    if not isinstance(leaf, dict) or "pvf_value" not in leaf:
        return parameter
    rest = {name: value for name, value in leaf.items() if name != "pvf_value"}
    return Parameter(parameter.path, dump(rest))


#: The types whose values the engine reads.
NATIVE: Final = ("string", "number", "bool", "strings", "numbers", "bools")


def fits(kind: str, value: object) -> bool:
    """Return whether the engine can read a JSON value as a parameter of type `kind`; False for every
    type that is not native to the engine. Numbers may be `Number` or plain ones."""
    match kind:
        case "string":
            return isinstance(value, str)
        case "number":
            return isinstance(value, Number | float | int) and not isinstance(value, bool)
        case "bool":
            return isinstance(value, bool)
        case "strings" | "numbers" | "bools":
            return isinstance(value, list) and all(fits(kind[:-1], member) for member in value)
        case _:
            return False


def _leaves(
    group: dict[str, Json], above: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Json]]:
    for key, value in group.items():
        if isinstance(value, dict) and value and "pvf_type" not in value:
            yield from _leaves(value, (*above, key))
        else:
            yield (*above, key), value
