"""The digest of a graph's meaning, independent of layout, spelling of numbers and run state."""

import hashlib
from collections.abc import Iterable
from typing import Any

import rfc8785

from action_assistant.umrf.files.writing import tree_of
from action_assistant.umrf.json.text import Json, Number
from action_assistant.umrf.model import Graph


def digest(graph: Graph) -> str:
    """Return the lower-case hex SHA-256 of the canonical graph (RFC 8785) without
    `gui_attributes`."""
    tree = tree_of(graph)
    tree.pop("gui_attributes", None)
    actions = tree["actions"]
    for action in actions if isinstance(actions, list) else []:
        if isinstance(action, dict):
            action.pop("gui_attributes", None)
    return hashlib.sha256(rfc8785.dumps(_plain(tree))).hexdigest()


def tree_digest(own: str, subgraphs: Iterable[tuple[str, str]]) -> str:
    """Return the digest of a graph with the digest `own` together with its sub-graphs.

    `subgraphs`: their names and digests in any order. It is the SHA-256 of `[own, [[name, digest],
    …]]` (RFC 8785) sorted by name. Without sub-graphs it is the graph's own digest.
    """
    parts = sorted(subgraphs)
    if not parts:
        return own
    text = rfc8785.dumps([own, [[name, each] for name, each in parts]])
    return hashlib.sha256(text).hexdigest()


def _plain(value: Json) -> Any:
    """Return a JSON value in which numbers are the doubles that the engine reads."""
    match value:
        case dict():
            return {key: _plain(member) for key, member in value.items()}
        case list():
            return [_plain(member) for member in value]
        case Number():
            return value.value
        case _:
            return value
