"""Parameters between their nested form in files and their paths."""

from collections.abc import Iterable, Iterator
from typing import Final

from action_assistant.umrf.jsontext import Json, dump, parse_small
from action_assistant.umrf.model import Parameter

#: The engine has no limit; a file of ours could not be read again beyond it.
MAX_PATH: Final = 60


def flatten(group: dict[str, Json]) -> tuple[Parameter, ...]:
    """Every value below `group` that is not a non-empty object without `pvf_type`, in order."""
    return tuple(
        Parameter("/".join(map(escape, keys)), dump(value)) for keys, value in _leaves(group, ())
    )


def nest(parameters: Iterable[Parameter]) -> dict[str, Json]:
    """The inverse of `flatten`. Of two paths one of which lies inside the other the shorter wins;
    paths longer than `MAX_PATH` are left out."""
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
    """The keys that a path joins."""
    return tuple(part.replace("~1", "/").replace("~0", "~") for part in path.split("/"))


def escape(key: str) -> str:
    """A key as one part of a path."""
    return key.replace("~", "~0").replace("/", "~1")


def flat_name(path: str) -> str:
    """The name by which the engine knows a parameter: `pose::position::x`."""
    return "::".join(keys_of(path))


def _leaves(
    group: dict[str, Json], above: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Json]]:
    for key, value in group.items():
        if isinstance(value, dict) and value and "pvf_type" not in value:
            yield from _leaves(value, (*above, key))
        else:
            yield (*above, key), value
