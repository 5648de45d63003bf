"""Changes of JSON values that keep them near to UMRF."""

import random
from typing import Any

WORDS = (
    "graph_name", "graph_entry", "graph_exit", "actions", "umrf_actions", "name", "type", "instance_id",
    "parents", "children", "conditions", "condition", "remap", "from", "to", "required", "state",
    "graph_state", "runtime", "messages", "timestamp", "message", "actor", "description", "effect",
    "suffix", "id", "execute_first", "stop_when_received", "package_name", "input_parameters",
    "output_parameters", "pvf_type", "pvf_value", "pvf_required", "pvf_updatable",
    "pvf_allowed_values", "gui_attributes", "action_assistant", "aid", "position", "x", "y", "notes",
    "entry", "exit", "graph_description", "graph", "version", "run",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 1.5, 65_535, 65_536, 4_294_967_296, 1e308, -0.0, 10**30, "", "A", "B",
    "graph_entry", "graph_exit", "a1", "always -> run", "on_true -> run", "on_error -> bypass",
    "on_stopped -> pause", "on_false->ignore", "on_true -> restart", "spontaneous", "sync", "RUNNING",
    "UNINITIALIZED", "string", "number", "numbers", "bools", "true", "a::b", "~0~1/", "ünï\\u0000", [], {},
    [[]], [{}], {"name": "A"}, {"name": "B", "instance_id": 1}, {"pvf_type": "number", "pvf_value": 5},
    {"pvf_type": "string", "pvf_allowed_values": ["a"]}, {"from": "a", "to": "b"},
)  # fmt: skip


def mutated(value: Any, chance: random.Random) -> Any:
    """The value after one to four changes at places of it; the value given may be changed."""
    holder = [value]
    for _ in range(chance.randint(1, 4)):
        places = list(_places(holder))
        container, key = chance.choice(places)
        _change(container, key, places, chance)
    return holder[0] if holder else {}


def _places(value: Any) -> Any:
    """Every (container, key) inside."""
    stack = [value]
    while stack:
        container = stack.pop()
        items = container.items() if isinstance(container, dict) else enumerate(container)
        for key, member in items:
            yield container, key
            if isinstance(member, dict | list):
                stack.append(member)


def _change(container: Any, key: Any, places: list[Any], chance: random.Random) -> None:
    if isinstance(container, list) and key >= len(container):
        return
    if isinstance(container, dict) and key not in container:
        return
    match chance.randrange(6):
        case 0:
            container[key] = _fresh(chance)
        case 1:
            other, place = chance.choice(places)
            container[key] = _copy(_get(other, place))
        case 2 if isinstance(container, dict):
            del container[key]
        case 2 if len(container) > 1:
            del container[key]
        case 3 if isinstance(container, list):
            container.insert(key, _copy(container[key]))
        case 3:
            container[chance.choice(WORDS)] = container.pop(key)
        case 4 if isinstance(container, dict):
            container[chance.choice(WORDS)] = _fresh(chance)
        case _:
            container[key] = [_copy(container[key])] if chance.random() < 0.5 else _fresh(chance)


def _get(container: Any, key: Any) -> Any:
    try:
        return container[key]
    except (KeyError, IndexError):
        return None


def _fresh(chance: random.Random) -> Any:
    return _copy(chance.choice(VALUES))


def _copy(value: Any) -> Any:
    """A copy that does not grow without end."""
    match value:
        case dict():
            return {key: _copy(member) for key, member in list(value.items())[:20]}
        case list():
            return [_copy(member) for member in value[:20]]
        case _:
            return value
