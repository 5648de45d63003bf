"""Reads and writes files that describe one action (docs/umrf-and-the-engine.md 5)."""

from collections.abc import Iterable
from typing import Final

import msgspec

from action_assistant.umrf.files.dialects import action_dialect, dialect_of, translated
from action_assistant.umrf.files.older_dialects import RELATIONS
from action_assistant.umrf.files.origins import located, moved, placed
from action_assistant.umrf.files.reading import read_tree
from action_assistant.umrf.files.writing import tree_of
from action_assistant.umrf.json.text import Json, Unreadable, decoded, dump, dump_indented, parse
from action_assistant.umrf.model import Action, Graph, Note, Problem

ACTION_DIALECTS: Final = frozenset({"D3-action", "D0"})
_PLACE: Final = "/actions/0"


class FileReading(msgspec.Struct, frozen=True, kw_only=True):
    """The remarks and problems about a text from which a graph or an action was read.

    `remarks`: notes on everything that was translated, left out, or has no place in D3. `problems`:
    errors in the text that cannot be seen in the graph any more (H1 among them); `check` finds the
    others. Both have their places in the text. `steps` lead from the canonical text of the graph to
    `text` (`origins.Steps`).
    """

    dialect: str
    remarks: tuple[Note, ...] = ()
    problems: tuple[Problem, ...] = ()
    text: str = ""
    steps: tuple[dict[str, str], ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """The remarks as sentences, in the order in which their messages first occurred."""
        return tuple(note.sentence for note in self.remarks)

    def placed(self, problems: Iterable[Problem]) -> list[Problem]:
        """Return problems of the graph, or of the graph that has only the action, with their places
        in the text that was read."""
        return placed(problems, self.text, self.steps)


class ActionReading(FileReading, frozen=True, kw_only=True):
    """An action as its own file describes it. `dialect`: `D3-action`, or `D0` of 2019."""

    action: Action


def read_action(text: str | bytes) -> ActionReading:
    """Read a text that must be the file of one action (`codec.read` recognises it among others).
    Raise `Unreadable` for any other text, or one beyond the limits."""
    text = decoded(text)
    value = parse(text)
    dialect = action_dialect(value) if isinstance(value, dict) else None
    if not isinstance(value, dict) or dialect is None:
        is_graph = isinstance(value, dict) and dialect_of(value) is not None
        what = "This is JSON, but not the file of an action."
        raise Unreadable("not-umrf", f"{what} It is a graph." if is_graph else what)
    own: dict[str, Json] = {k: v for k, v in value.items() if k not in RELATIONS}
    file, notes, problems, given = translated(own, dialect)
    tree = read_tree(file)
    (action,) = tree.graph.actions
    kept = tuple((k, dump(value[k])) for k in RELATIONS if k in value)
    action = msgspec.structs.replace(action, extra=action.extra + kept)
    own_problems = (p for p in tree.problems if p.where.path.startswith(_PLACE))
    placed_problems, remarks = located(
        text,
        [*problems, *(moved(problem, [given]) for problem in own_problems)],
        [
            *(note for note in notes if "became a graph" not in note.message),
            *(moved(note, [given]) for note in tree.notes),
        ],
    )
    return ActionReading(
        action=action,
        dialect=dialect,
        remarks=remarks,
        problems=tuple(placed_problems),
        text=text,
        steps=(tree.origins, given),
    )


def write_action(action: Action) -> str:
    """Return the canonical file of an action, without run state. Its number (`instance_id`) is
    written only if it is not 0."""
    actions = tree_of(Graph(name=action.name, actions=(action,)))["actions"]
    assert isinstance(actions, list)
    (file,) = actions
    assert isinstance(file, dict)
    if not action.instance_id and "instance_id" not in dict(action.extra):
        del file["instance_id"]
    return dump_indented(file) + "\n"
