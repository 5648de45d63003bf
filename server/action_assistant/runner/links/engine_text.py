"""Reads the graphs that an engine writes into feedback and answers.

They come from machines that anybody on the network may own: whatever is not as engines write it is
refused with the reason, since a proof may rest on it.
"""

from collections.abc import Mapping
from typing import Final, Literal

import msgspec

from action_assistant.runner.links.observations import ACTIVE, Snapshot
from action_assistant.runner.links.parameter_texts import Values, reported
from action_assistant.umrf.kept_values import KEEPER, NOTHING_KEPT, is_given, kept_in

#: The log line that an engine writes when it receives a start, before it acts.
RECEIVED_START: Final = "Received request to start UMRF graph: "

#: Responses of a relation that end or hold an action which runs.
_HALTING: Final = frozenset({"stop", "pause"})


class NotAGraph(ValueError):
    """The text is not a graph as an engine writes it; the message says why."""


class _Runtime(msgspec.Struct, frozen=True):
    messages: msgspec.Raw = msgspec.Raw(b"[]")


class _Said(msgspec.Struct, frozen=True):
    message: str


class _Action(msgspec.Struct, frozen=True):
    name: str
    state: str
    type: str = ""
    instance_id: int = 0
    input_parameters: msgspec.Raw = msgspec.Raw(b"{}")
    gui_attributes: msgspec.Raw = msgspec.Raw(b"{}")
    runtime: msgspec.Raw = msgspec.Raw(b"{}")


class _Graph(msgspec.Struct, frozen=True):
    graph_name: str
    graph_state: str
    actions: tuple[_Action, ...] = ()


class _Parent(msgspec.Struct, frozen=True):
    name: str
    instance_id: int = 0
    conditions: tuple[str, ...] = ()


class _Child(msgspec.Struct, frozen=True):
    name: str
    type: str = ""
    instance_id: int = 0
    parents: tuple[_Parent, ...] = ()


class _Related(msgspec.Struct, frozen=True):
    actions: tuple[_Child, ...] = ()


class _NamedGraph(msgspec.Struct, frozen=True):
    graph_name: str


class _Marked(msgspec.Struct, frozen=True):
    gui_attributes: msgspec.Raw = msgspec.Raw(b"{}")


class _Sent(msgspec.Struct, frozen=True):
    actions: tuple[_Marked, ...] = ()


class _Ours(msgspec.Struct, frozen=True):
    run: str | None = None


class _Attributes(msgspec.Struct, frozen=True):
    action_assistant: _Ours = _Ours()


_GRAPH = msgspec.json.Decoder(_Graph)
_RELATED = msgspec.json.Decoder(_Related)
_SENT = msgspec.json.Decoder(_Sent)
_NAMED = msgspec.json.Decoder(_NamedGraph)
_ATTRIBUTES = msgspec.json.Decoder(_Attributes)
_RUNTIME = msgspec.json.Decoder(_Runtime)
_MESSAGES = msgspec.json.Decoder(tuple[_Said | str, ...])


def snapshot(
    text: str, *, at: int, source: Literal["get", "feedback"], asked_at: int | None = None
) -> Snapshot:
    """Read one graph as an engine wrote it, seen at `at` (µs UTC). `source`: an answer to a get or
    feedback; `asked_at`: when that get was sent. Keepers (actions that only hold values) are not
    among the nodes. Raise NotAGraph if the text is no such JSON."""
    try:
        graph = _GRAPH.decode(text)
    except (msgspec.DecodeError, RecursionError, UnicodeError) as error:
        raise NotAGraph(f"This is no graph as engines write them: {error}") from error
    keepers = tuple(each for each in graph.actions if _keeps(each))
    nodes = {
        f"{each.name}_{each.instance_id}": each
        for each in graph.actions
        if not keepers or each not in keepers
    }
    messages = {name: _messages(each) for name, each in nodes.items()}
    failed = frozenset(name for name, each in nodes.items() if each.state == "ERROR")
    return Snapshot(
        at=at,
        graph=graph.graph_name,
        state=graph.graph_state,
        nodes={name: each.state for name, each in nodes.items()},
        source=source,
        asked_at=asked_at,
        run=_run(graph.actions),
        messages={name: said for name, said in messages.items() if said},
        inputs=_inputs(nodes),
        stoppable=tuple(sorted(failed & _stoppable(text, failed))) if failed else (),
        spontaneous=tuple(
            name
            for name, each in nodes.items()
            if each.type == "spontaneous" and each.state != "UNINITIALIZED"
        ),
        kept=kept_in({each.instance_id: bytes(each.input_parameters) for each in keepers})
        if keepers
        else NOTHING_KEPT,
    )


def _keeps(action: _Action) -> bool:
    """Return whether an action of an engine's text is a keeper: it holds the outputs of the action
    of a piece, and never runs."""
    idle = action.name == KEEPER and action.state == "UNINITIALIZED"
    return idle and not is_given(bytes(action.input_parameters))


def name_of(text: str) -> str:
    """Return the name of the graph in a UMRF text; "" if it has none."""
    try:
        return _NAMED.decode(text).graph_name
    except (msgspec.DecodeError, RecursionError, UnicodeError):
        return ""


def run_in(text: str) -> str | None:
    """Return the id of the run that the actions of a sent graph text carry; None if they carry none
    or different ones."""
    try:
        return _run(_SENT.decode(text).actions)
    except (msgspec.DecodeError, RecursionError, UnicodeError):
        return None


def _run(actions: tuple[_Action, ...] | tuple[_Marked, ...]) -> str | None:
    """Return the id of the run that every action carries; None if they differ, as in a graph
    combined from others."""
    marks = {_mark(each) for each in actions}
    return marks.pop() if len(marks) == 1 else None


def _mark(action: _Action | _Marked) -> str | None:
    try:
        return _ATTRIBUTES.decode(action.gui_attributes).action_assistant.run
    except msgspec.DecodeError:  # others may keep there what they like
        return None


def _messages(action: _Action) -> tuple[str, ...]:
    try:
        said = _MESSAGES.decode(_RUNTIME.decode(action.runtime).messages)
    except msgspec.DecodeError:
        return ()
    return tuple(each if isinstance(each, str) else each.message for each in said)


def _stoppable(text: str, failed: frozenset[str]) -> frozenset[str]:
    """Return the `failed` nodes that their graph itself may stop or pause: by a response of a
    relation, or since a spontaneous action leads to them. `text`: the graph as the engine wrote it;
    if it cannot be read, return all of them."""
    try:
        actions = _RELATED.decode(text).actions
    except (msgspec.DecodeError, RecursionError, UnicodeError):
        return failed
    leads_to: dict[str, list[str]] = {}
    found: set[str] = set()
    reachable: set[str] = set()
    for each in actions:
        name = f"{each.name}_{each.instance_id}"
        for parent in each.parents:
            leads_to.setdefault(f"{parent.name}_{parent.instance_id}", []).append(name)
            if any(said.rpartition("->")[2].strip() in _HALTING for said in parent.conditions):
                found.add(name)
    open_ = [f"{each.name}_{each.instance_id}" for each in actions if each.type == "spontaneous"]
    while open_:
        reached = [each for each in leads_to.get(open_.pop(), ()) if each not in reachable]
        reachable.update(reached)
        open_ += reached
    return frozenset(found | reachable)


def _inputs(nodes: Mapping[str, _Action]) -> dict[str, Values]:
    """Return the input values of the actions that move, by full name. Ended actions are not
    included: the engine drops their values."""
    found: dict[str, Values] = {}
    for name, each in nodes.items():
        if each.state in ACTIVE and (values := reported(bytes(each.input_parameters))) is not None:
            found[name] = values
    return found
