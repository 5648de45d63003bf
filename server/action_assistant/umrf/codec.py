"""UMRF files: every dialect read into one graph, canonical D3 written (DESIGN 5)."""

import msgspec

from action_assistant.umrf.action_files import ActionReading, read_action, write_action
from action_assistant.umrf.dialects import dialect_of, translated
from action_assistant.umrf.jsontext import Unreadable, parse, pointer
from action_assistant.umrf.model import Graph, Key, Problem, Where
from action_assistant.umrf.reading import Tree, read_tree
from action_assistant.umrf.writing import Stamp, write

__all__ = [
    "ActionReading", "Reading", "Stamp", "Unreadable", "read", "read_action", "stamp_of", "write",
    "write_action",
]  # fmt: skip


class Reading(msgspec.Struct, frozen=True):
    """A graph, and what is to be said about the text it came from.

    `notes`: what was translated or has no place in D3. `problems`: what is wrong in the text as it
    stands and cannot be seen in the graph any more (H1 among it); `check` finds the rest. `states`, `graph_state`:
    run states that the text carries (other than UNINITIALIZED).
    """

    graph: Graph
    dialect: str
    notes: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    states: dict[Key, str] = {}
    graph_state: str | None = None


def read(text: str | bytes) -> Reading:
    """Reads a graph. Raises `Unreadable` for what is no UMRF or beyond the limits; everything else
    is read, and reported where it is wrong."""
    value = parse(text)
    if not isinstance(value, dict):
        raise Unreadable("not-umrf", "This is JSON, but no UMRF graph: the text is no object.")
    dialect = dialect_of(value)
    if dialect is None:
        raise Unreadable(
            "not-umrf", "This is JSON, but no UMRF graph: it has neither a graph_name nor actions."
        )
    file, notes, problems = translated(value, dialect)
    tree = read_tree(file)
    found = (*problems, *tree.problems, *_carried_states(tree))
    return Reading(tree.graph, dialect, notes, found, tree.states, tree.graph_state)


def _carried_states(tree: Tree) -> list[Problem]:
    """H1: an engine that is given a node's state takes the action for loaded."""
    return [
        Problem(
            code="H1",
            severity="error",
            where=Where(path=pointer("actions", index, "state"), aid=action.key),
            message=f"The file says that {action.full_name} is {tree.states[action.key]}: started as "
            "it stands, the engine aborts with every running graph, or the action never runs. "
            "Reading the file and writing it again leaves the state out.",
        )
        for index, action in enumerate(tree.graph.actions)
        if action.key in tree.states
    ]


def stamp_of(text: str | bytes) -> Stamp:
    """The stamp that a file carries; empty where there is none. Raises `Unreadable`."""
    value = parse(text)
    attributes = value.get("gui_attributes") if isinstance(value, dict) else None
    ours = attributes.get("action_assistant") if isinstance(attributes, dict) else None
    if not isinstance(ours, dict):
        return Stamp()
    named = {key: ours.get(key) for key in ("graph", "version", "run")}
    return Stamp(**{key: text for key, text in named.items() if isinstance(text, str)})
