"""Files that describe one action (SPEC 5), read and written."""

from collections.abc import Iterator
from typing import Final

import msgspec

from action_assistant.umrf.dialects import dialect_of, translated
from action_assistant.umrf.jsontext import Json, Unreadable, dump, dump_indented, parse
from action_assistant.umrf.model import Action, Graph, Problem
from action_assistant.umrf.reading import read_tree
from action_assistant.umrf.writing import tree_of

ACTION_DIALECTS: Final = frozenset({"D3-action", "D0"})
#: What says how an action stands in a graph; kept as text, for an action by itself has no place.
_RELATIONS: Final = ("parents", "children")
_PLACE: Final = "/actions/0"


class ActionReading(msgspec.Struct, frozen=True):
    """An action as its own file describes it. `dialect`: `D3-action`, or `D0` of 2019."""

    action: Action
    dialect: str
    notes: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()


def read_action(text: str | bytes) -> ActionReading:
    """Reads the file of one action. Raises `Unreadable` for what is none or beyond the limits."""
    value = parse(text)
    dialect = dialect_of(value) if isinstance(value, dict) else None
    if not isinstance(value, dict) or dialect not in ACTION_DIALECTS:
        what = "This is JSON, but not the file of an action."
        raise Unreadable("not-umrf", what if dialect is None else f"{what} It is a graph.")
    own: dict[str, Json] = {k: v for k, v in value.items() if k not in _RELATIONS}
    file, notes, problems = translated(own, dialect)
    tree = read_tree(file)
    (action,) = tree.graph.actions
    kept = tuple((k, dump(value[k])) for k in _RELATIONS if k in value)
    action = msgspec.structs.replace(action, extra=action.extra + kept)
    told = tuple(note for note in notes if "became a graph" not in note)
    found = at_top(problem for problem in (*problems, *tree.problems) if _is_of_action(problem))
    return ActionReading(action, dialect, told, tuple(found))


def write_action(action: Action) -> str:
    """The canonical file of an action: no run state, number only if it is not 0."""
    actions = tree_of(Graph(name=action.name, actions=(action,)))["actions"]
    assert isinstance(actions, list)
    (file,) = actions
    assert isinstance(file, dict)
    if not action.instance_id and "instance_id" not in dict(action.extra):
        del file["instance_id"]
    return dump_indented(file) + "\n"


def at_top(problems: Iterator[Problem]) -> Iterator[Problem]:
    """Problems of the graph that has only this action, with the places of the action's own file."""
    for problem in problems:
        where = msgspec.structs.replace(problem.where, path=problem.where.path.removeprefix(_PLACE))
        yield msgspec.structs.replace(problem, where=where)


def _is_of_action(problem: Problem) -> bool:
    return problem.code == "dialect-old" or problem.where.path.startswith(_PLACE)
