"""Computes how library actions and the graphs that use them would update each other. Runs in workers."""

from collections.abc import Callable, Sequence

import msgspec
from msgspec.structs import replace

from action_assistant.editor.documents.contents import GraphAtSeq, first_action, read
from action_assistant.editor.interchange import importing
from action_assistant.editor.interchange.document_edits import editing
from action_assistant.editor.library.action_uses import together
from action_assistant.errors import Conflict, NotFound, NotUmrf
from action_assistant.umrf.action_updates import (
    NO_RENAMES,
    Renames,
    is_like,
    suggested,
    updated,
    uses_of,
)
from action_assistant.umrf.check import check
from action_assistant.umrf.difference import Difference, difference
from action_assistant.umrf.files.action_files import ACTION_DIALECTS, read_action, write_action
from action_assistant.umrf.model import Action, Graph
from action_assistant.umrf.parameters import without_value


class ActionUse(msgspec.Struct, frozen=True, kw_only=True):
    """A graph that uses an action of the library. `seq`: its change that was examined; `count`: how
    many of its actions are uses.

    `changed`: an update would change the graph. `difference`: what the update would change.
    `suggested`: likely renames, which are not in it unless requested.
    """

    graph: str
    name: str
    seq: int
    count: int
    changed: bool
    difference: Difference | None = None
    suggested: Renames = NO_RENAMES


class BroughtAction(msgspec.Struct, frozen=True):
    """An action as its file describes it. `reading` is JSON of an `ImportReport`."""

    action: Action
    dialect: str
    notes: tuple[str, ...]
    reading: bytes


def brought(body: bytes) -> BroughtAction:
    """Return the action in a UMRF file of one action (`body`). Raise BadInput, NotUmrf or TooLarge,
    with the place, for any other file."""
    found = importing.read(body)
    if found.dialect not in ACTION_DIALECTS:
        raise NotUmrf(
            f"This is the file of a graph, {found.graph.name or 'without a name'}, and not of one "
            "action. Import it as a graph: its actions are in the library's list then.",
            where={"code": "graph-file", "line": 1, "column": 1},
        )
    importing.fitting(found)
    file = read_action(body)
    alone = check(Graph(name=file.action.name, actions=(file.action,)))
    # Problems of the graph are left out: the file has none around the action.
    own = [problem for problem in alone if problem.where.path.startswith("/actions/0")]
    told = importing.ImportReport(
        file.dialect, file.notes, (*file.problems, *file.placed(own)), file.remarks
    )
    return BroughtAction(file.action, file.dialect, file.notes, msgspec.json.encode(told))


def preview(body: bytes) -> bytes:
    """Read the file of an action (`body`) and return the JSON of its `Preview`. Raise the errors of
    `brought`."""
    found = brought(body)
    report = msgspec.json.decode(found.reading, type=importing.ImportReport)
    return msgspec.json.encode(
        importing.Preview(
            found.dialect, found.notes, report.problems, found.action.name, 1, report.remarks
        )
    )


def of_graphs(name: str, sights: Sequence[GraphAtSeq]) -> Action:
    """Return an action with the parameters that the uses of this name in graphs have, without
    values. `sights`: the graphs. Raise NotFound if no graph uses it."""
    uses = [use for sight in sights for use in uses_of(read(sight).moment.graph, name)]
    if not uses:
        raise NotFound(f"No graph has an action {name!r}.", where={"path": "/name"})
    return together(name, uses)


def written(sight: GraphAtSeq) -> bytes:
    """Return the UMRF file of the action of a library document (`sight`). Raise NotFound if the
    document has none."""
    return write_action(_action_of(sight)).encode()


def uses(sight: GraphAtSeq, graphs: Sequence[GraphAtSeq], renames: Renames) -> bytes:
    """Return a JSON list with an `ActionUse` for each of `graphs` that uses a library action.
    `sight`: the document of the action; `renames`: parameters that the library has renamed, and
    that an update of the uses would rename in the graphs. Raise NotFound if the document has no
    action."""
    action = _action_of(sight)
    found = (_use(action, each, renames) for each in graphs)
    return msgspec.json.encode([use for use in found if use is not None])


def _use(action: Action, sight: GraphAtSeq, renames: Renames) -> ActionUse | None:
    graph = read(sight).moment.graph
    count = len(uses_of(graph, action.name))
    if count == 0:
        return None
    after = updated(graph, action, renames)
    changed = after != graph
    return ActionUse(
        graph=sight.graph,
        name=graph.name,
        seq=sight.seq,
        count=count,
        changed=changed,
        difference=difference((sight.seq, graph), (sight.seq, after)) if changed else None,
        suggested=suggested(graph, action),
    )


def updating(sight: GraphAtSeq, graph: GraphAtSeq, renames: Renames) -> bytes:
    """Return the update of a graph's document that makes its uses of the action in the library
    document `sight` equal to that. `renames`: parameters that were renamed."""
    action = _action_of(sight)
    return editing(graph.state, lambda old: updated(old, action, renames))


def taking(sight: GraphAtSeq, graph: GraphAtSeq, aid: str | None) -> bytes:
    """Return the update of a library document (`sight`) that gives its action the parameters of a
    use in `graph`: the use with the key `aid`, or, for None, the first use that differs.
    Values in the library stay. Raise NotFound if the graph has no such use."""
    action = _action_of(sight)
    found = [
        use
        for use in uses_of(read(graph).moment.graph, action.name)
        if aid is None or use.key == aid
    ]
    if not found:
        raise NotFound(f"The graph has no such action {action.name!r}.", where={"path": "/aid"})
    use = next((use for use in found if not is_like(use, action)), found[0])
    known = replace(
        use,
        inputs=tuple(map(without_value, use.inputs)),
        outputs=tuple(map(without_value, use.outputs)),
    )

    def taken(old: Graph) -> Graph:
        return updated(old, replace(known, name=action.name))

    return editing(sight.state, taken)


def replacing(sight: GraphAtSeq, body: bytes) -> bytes:
    """Return the update of a library document (`sight`) that makes its action equal to that of a
    file (`body`), except for its position. Raise the errors of `brought`, and Conflict for the file
    of another action."""
    return editing(sight.state, _replaced(_action_of(sight), body))


def replacing_would(sight: GraphAtSeq, body: bytes) -> bytes:
    """Return the JSON of the `Difference` that `replacing` would make. The parameters and errors
    are those of `replacing`."""
    graph = read(sight).moment.graph
    after = _replaced(_action_of(sight), body)(graph)
    return msgspec.json.encode(difference((sight.seq, graph), (sight.seq, after)))


def _replaced(action: Action, body: bytes) -> Callable[[Graph], Graph]:
    file = brought(body).action
    if file.name != action.name:
        raise Conflict(
            f"This is the file of {file.name!r}, and the action is {action.name!r}.",
            where={"path": "/name"},
        )

    def replaced(old: Graph) -> Graph:
        new = replace(file, key=action.key, position=action.position)
        return replace(old, actions=tuple(new if a.key == new.key else a for a in old.actions))

    return replaced


def _action_of(sight: GraphAtSeq) -> Action:
    action = first_action(read(sight).moment.graph)
    if action is None:
        raise NotFound("This document of the library has no action; somebody has taken it out.")
    return action
