"""Reads UMRF files of every dialect into graphs, and writes canonical D3 (docs/contracts.md 2)."""

import msgspec

from action_assistant.umrf.files.action_files import (
    ACTION_DIALECTS,
    ActionReading,
    FileReading,
    read_action,
    write_action,
)
from action_assistant.umrf.files.dialects import dialect_of, translated
from action_assistant.umrf.files.origins import located, moved
from action_assistant.umrf.files.reading import Tree, read_tree
from action_assistant.umrf.files.writing import Stamp, write
from action_assistant.umrf.json.text import Json, Unreadable, decoded, parse, pointer
from action_assistant.umrf.model import Graph, Key, Problem, Where

__all__ = [
    "ActionReading", "Reading", "Stamp", "Unreadable", "read", "read_action", "stamp_of", "write",
    "write_action",
]  # fmt: skip


class Reading(FileReading, frozen=True, kw_only=True):
    """A graph as a text describes it. `states`, `graph_state`: run states that the text carries,
    other than UNINITIALIZED."""

    graph: Graph
    states: dict[Key, str] = msgspec.field(default_factory=dict)
    graph_state: str | None = None


def read(text: str | bytes) -> Reading:
    """Read a UMRF graph from its text. Raise `Unreadable` for a text that is no UMRF or beyond the
    limits. Everything else is read, and reported among the problems of the result if it is wrong.
    """
    text = decoded(text)
    value = parse(text)
    if not isinstance(value, dict):
        raise Unreadable("not-umrf", _no_object(value))
    dialect = dialect_of(value)
    if dialect is None:
        raise Unreadable(
            "not-umrf", "This is JSON, but no UMRF graph: it has neither a graph_name nor actions."
        )
    file, notes, problems, given = translated(value, dialect)
    tree = read_tree(file)
    placed_problems, remarks = located(
        text,
        [
            *problems,
            *(moved(problem, [given]) for problem in tree.problems),
            *(moved(problem, [tree.origins, given]) for problem in _carried_states(tree)),
        ],
        [*notes, *(moved(note, [given]) for note in tree.notes)],
    )
    return Reading(
        graph=tree.graph,
        dialect=dialect,
        remarks=remarks,
        problems=tuple(placed_problems),
        states=tree.states,
        graph_state=tree.graph_state,
        text=text,
        steps=(tree.origins, given),
    )


def _no_object(value: Json) -> str:
    """Return the sentence why a text that is no JSON object is not a graph, with what `value`, the
    data in it, is instead."""
    items = [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []
    dialects = [found for found in map(dialect_of, items) if found is not None]
    if not dialects:
        return "This is JSON, but no UMRF graph: the text is no object."
    actions = sum(dialect in ACTION_DIALECTS for dialect in dialects)
    counted = [
        f"{count} {what}{'s' if count > 1 else ''}"
        for count, what in ((len(dialects) - actions, "graph"), (actions, "single action"))
        if count
    ]
    return (
        f"This is no UMRF graph: the text is no object, but a list with {' and '.join(counted)}. "
        "A file has one graph: give each a file of its own."
    )


def _carried_states(tree: Tree) -> list[Problem]:
    """Return a problem (hazard H1) for each run state in a file: an engine that gets a state takes
    the action for loaded."""
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
    """Return the stamp of a UMRF file; an empty one if it has none. Raise `Unreadable` if the text
    is no JSON."""
    value = parse(text)
    attributes = value.get("gui_attributes") if isinstance(value, dict) else None
    ours = attributes.get("action_assistant") if isinstance(attributes, dict) else None
    if not isinstance(ours, dict):
        return Stamp()
    named = {key: ours.get(key) for key in ("graph", "version", "run")}
    return Stamp(**{key: text for key, text in named.items() if isinstance(text, str)})
