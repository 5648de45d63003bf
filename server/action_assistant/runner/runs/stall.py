"""Stalls: a graph is running while none of its actions is, and waits for something.

The engine says nothing about it (docs/umrf-and-the-engine.md 2.3; H7, H8). The reasons follow from
the graph that was sent and from what was seen. Engines do not tell results, so an arrow counts with
every outcome that its parent may have had. Pure.
"""

from collections.abc import Iterator, Sequence
from typing import Final, TypeAlias, assert_never

import msgspec
from msgspec.structs import replace

from action_assistant.runner.links.observations import ACTIVE, Snapshot
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import ActionRun
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    Precondition,
    Relation,
    Response,
)
from action_assistant.umrf.semantics.values import RemapUnknown, Slot, renamed, slots_of

#: Code of the alarm for a stalled run.
STALLED: Final = "stalled"

_AFTER_S: Final = 6.0  # few actions load for longer, and for these the alarm is true as well
_LOOKS: Final = 4
_NAMED: Final = 3  # reasons in one sentence
_OUTCOMES: Final[dict[str, Precondition]] = {
    "true": "on_true", "false": "on_false", "error": "on_error", "stopped": "on_stopped",
}  # fmt: skip


class ForParent(msgspec.Struct, frozen=True, tag="parent", tag_field="for"):
    """`action` (None: the end of the graph) needs `parent` to have ended. That was not seen; its
    begin was seen only if it had `begun`."""

    action: str | None
    parent: str
    begun: bool = False


class ForInput(msgspec.Struct, frozen=True, tag="input", tag_field="for"):
    """The action `action` has no value for a required input, and no ended action gives one. If
    `action` is None, the end of the graph needs an output of `giver`, the last action that leads
    to it."""

    action: str | None
    input: str
    giver: str = ""


class ForOutcome(msgspec.Struct, frozen=True, tag="outcome", tag_field="for"):
    """The action `parent` has ended, and its arrow to `action` responds with `response` instead of
    running it. `certain`: for every outcome; else it depends on an outcome that the engine does
    not report."""

    action: str | None
    parent: str
    response: Response
    certain: bool


class ForPart(msgspec.Struct, frozen=True, tag="part", tag_field="for"):
    """The action `action` is a sub-graph in which nothing moves. `state`: of the sub-graph, "" for
    a time in the past."""

    action: str
    state: str


Wait: TypeAlias = ForParent | ForInput | ForOutcome | ForPart


class Standstill:
    """Decides from several answers whether a running graph stands still, that is, nothing of it
    moves and it does not end."""

    def __init__(self) -> None:
        self._since: float | None = None
        self._looks = 0

    def forget(self) -> None:
        """Forget for how long the graph has stood still, since it moves or was not in the answer."""
        self._since, self._looks = None, 0

    @property
    def lasts(self) -> bool:
        """True if the last answer showed that nothing moves."""
        return self._since is not None

    def seen(self, shown: Sequence[Snapshot], asked: float) -> bool:
        """Process one more answer, requested at `asked` (in seconds of any steady clock). `shown`:
        the snapshots of the graph, first, and its sub-graphs. Return whether it has stood still for
        so long that people must know."""
        if shown[0].state != "RUNNING" or moves(shown):
            self.forget()
            return False
        self._since = asked if self._since is None else self._since
        self._looks += 1
        return self._looks >= _LOOKS and asked - self._since >= _AFTER_S


def packed(run: Run) -> bytes:
    """Encode the parts of a run that `packed_alarm_text` needs; sending all of a large run to a
    worker would take long."""
    actions = {
        name: replace(each, visits=each.visits[-1:], messages=())
        for name, each in run.actions.items()
    }
    return msgspec.msgpack.encode(replace(run, actions=actions, log=(), alarms=()))


def packed_alarm_text(run: bytes, umrf: str | None) -> str:
    """Return the alarm text for a run (encoded by `packed`) that stands still. `umrf`: the text of
    the graph that was sent, None if unknown. Call it in a worker process."""
    return alarm_text(msgspec.msgpack.decode(run, type=Run), None if umrf is None else _read(umrf))


def lacking_in_words(umrf: str) -> str:
    """Return, in sentences, which values keep an engine that holds this graph (`umrf`: its text)
    from beginning it; "" if none is lacking. Call it in a worker process."""
    graph = _read(umrf)
    found = () if graph is None else unbegun(graph)
    return " ".join(in_words(each) for each in found[:_NAMED])


def _read(umrf: str) -> Graph | None:
    try:
        return codec.read(umrf).graph
    except codec.Unreadable:
        return None


def moves(shown: Sequence[Snapshot]) -> bool:
    """Return whether an action is active in these snapshots of a graph and its sub-graphs. An
    action that stands for one of the sub-graphs counts only by the actions inside."""
    held = {each.graph for each in shown}
    return any(
        state in ACTIVE and _part(each.graph, node) not in held
        for each in shown
        for node, state in each.nodes.items()
    )


def _part(graph: str, node: str) -> str:
    name, _, number = node.rpartition("_")
    return f"{graph}__{name}__{number}"


def unbegun(graph: Graph) -> tuple[ForInput, ...]:
    """Return the inputs that keep an engine from beginning a graph: required ones of entry actions
    that have no value (hazard H7)."""
    entries = {each.child for each in graph.relations if each.parent == ENTRY}
    return tuple(
        ForInput(action.full_name, name)
        for action in graph.actions
        if action.key in entries and not action.missing
        for name, slot in slots_of(action.inputs).items()
        if slot.required and not slot.has_value()
    )


def waits(run: Run, graph: Graph, moment: int | None = None) -> tuple[Wait, ...]:
    """Return what the actions of a graph that makes no progress wait for, as far as the
    observations of `run` show it. `graph`: as it was sent. An action that no arrow has reached yet
    is not listed: it waits for another one that is. `moment`: the time of an earlier standstill (µs
    UTC), after which no action has begun; None means now."""
    stalled = _Stalled(run, graph, moment)
    found: list[Wait] = [*stalled.parts()]
    for action in graph.actions:
        if not action.missing and not stalled.moves(action.full_name):
            found += stalled.waits_of(action)
    found += stalled.waits_of(None)
    return tuple(dict.fromkeys(found))


class _Stalled:
    """Compares the arrows of a graph with what was seen of its run, now or at a time in the past."""

    def __init__(self, run: Run, graph: Graph, moment: int | None) -> None:
        self._run = run
        self._moment = moment
        self._graph = graph
        self._actions = {each.key: each for each in graph.actions if not each.missing}

    def moves(self, name: str) -> bool:
        if self._moment is None:
            return self._seen(name).state in ACTIVE
        visits = self._seen(name).visits
        ended = (visits[-1].not_after or visits[-1].until) if visits else self._moment
        return ended is None or ended > self._moment

    def parts(self) -> Iterator[ForPart]:
        for name in self._run.actions:
            part = self._run.parts.get(_part(self._run.graph_name, name))
            if part is not None and self.moves(name):
                yield ForPart(name, part if self._moment is None else "")

    def waits_of(self, action: Action | None) -> list[Wait]:
        """Return what one action waits for, or (None) the end of the graph; empty if no arrow has
        reached it."""
        key = EXIT if action is None else action.key
        name = None if action is None else action.full_name
        arrows = [each for each in self._graph.relations if each.child == key]
        fired = [each for each in arrows if self._fired(each, name)]
        running = [each for each in fired if "run" in self._answers(each)]
        if action is None:
            running = [each for each in fired if self._answers(each) - {"ignore", "bypass"}]
        if not running:
            return list(self._unanswered(name, fired))
        missing = [each for each in arrows if each.required and not self._has_ended(each.parent)]
        if missing:
            parents = [self._name(each.parent) for each in missing]
            return [ForParent(name, each, bool(self._seen(each).visits)) for each in parents]
        lacking: list[Wait] = [*self._lacking(action, running)]
        return lacking or [*self._unsure(name, running)]

    def _fired(self, arrow: Relation, child: str | None) -> bool:
        """Return whether the arrow's parent has ended and the child has not begun since."""
        if not self._has_ended(arrow.parent):
            return False
        begun = [] if child is None else [each.start for each in self._seen(child).visits]
        if arrow.parent == ENTRY:
            return not begun
        ended = self._seen(self._name(arrow.parent)).visits[-1].until or 0
        return not begun or begun[-1] < ended

    def _has_ended(self, key: Key) -> bool:
        if key == ENTRY:
            return True
        if key not in self._actions:
            return False
        visits = self._seen(self._name(key)).visits
        return bool(visits) and visits[-1].until is not None and not self.moves(self._name(key))

    def _answers(self, arrow: Relation) -> set[Response]:
        """Return the responses that an arrow may have had, for every outcome that the action it
        comes from may have had."""
        if arrow.parent == ENTRY:
            return {"run"}
        name = self._name(arrow.parent)
        result = self._seen(name).visits[-1].result
        known = _OUTCOMES.get(result or "")
        if known is not None:
            return {arrow.conditions.answer(known)}
        is_part = _part(self._run.graph_name, name) in self._run.parts
        # A sub-graph may have failed, too.
        possible = PRECONDITIONS[:3] if is_part else PRECONDITIONS[:2]
        return {arrow.conditions.answer(outcome) for outcome in possible}

    def _unanswered(self, name: str | None, fired: list[Relation]) -> Iterator[Wait]:
        """Yield a reason to wait for each of the `fired` arrows whose parent has ended but whose
        response does not run the action `name` (None: the end of the graph)."""
        for arrow in fired:
            answers = self._answers(arrow) - {"bypass"}
            if answers:
                said: Response = "ignore" if "ignore" in answers else min(answers)
                yield ForOutcome(name, self._name(arrow.parent), said, certain=True)

    def _lacking(self, action: Action | None, fired: list[Relation]) -> Iterator[ForInput]:
        """Yield the required inputs of an action, or outputs at the end of the graph (None), that
        have no value and that no parent of the `fired` arrows gives."""
        giver = self._last_exit() if action is None else None
        if action is None and giver is None:
            return
        inputs = slots_of(giver.outputs if giver is not None else action.inputs if action else ())
        given = {name for each in fired for name in self._given(each, inputs)}
        for name, slot in inputs.items():
            if slot.required and not slot.has_value() and name not in given:
                if action is None:
                    yield ForInput(None, name, giver.full_name if giver else "")
                else:
                    yield ForInput(action.full_name, name)

    def _given(self, arrow: Relation, inputs: dict[str, Slot]) -> set[str]:
        parent = self._actions.get(arrow.parent)
        if parent is None:
            return set()
        outputs = slots_of(parent.outputs)
        try:
            places = renamed(outputs, arrow.remap, inputs)
        except RemapUnknown:
            return set()
        return {
            name
            for name, place in places.items()
            if inputs[name].updatable and outputs[place].type == inputs[name].type
        }

    def _last_exit(self) -> Action | None:
        """Return the last one listed of the actions that lead to the end, whose outputs the end of
        a graph needs; None if no arrow leads there. See docs/umrf-and-the-engine.md 2.6."""
        ends = sorted(
            (each for each in self._graph.relations if each.child == EXIT),
            key=lambda each: each.child_order,
        )
        return self._actions.get(ends[-1].parent) if ends else None

    def _unsure(self, name: str | None, fired: list[Relation]) -> Iterator[ForOutcome]:
        """Yield a reason to wait for each of the `fired` arrows that runs the action `name` only
        for some of the possible outcomes."""
        for arrow in fired:
            others = self._answers(arrow) - {"run"}
            if others and arrow.child != EXIT:
                yield ForOutcome(name, self._name(arrow.parent), min(others), certain=False)

    def _name(self, key: Key) -> str:
        return self._actions[key].full_name if key in self._actions else key

    def _seen(self, name: str) -> ActionRun:
        return self._run.actions.get(name, ActionRun())


def in_words(wait: Wait) -> str:
    """Return a sentence that says for what an action, or the end of the graph, waits."""
    who = wait.action if wait.action is not None else "The end of the graph"
    match wait:
        case ForParent(parent=parent, begun=True):
            return f"{who} waits for {parent}, which has not been seen to end."
        case ForParent(parent=parent):
            return f"{who} waits for {parent}, which has not run."
        case ForInput(input=name, giver=giver) if giver:
            return f"{who} waits for “{name}” of {giver}, which has not given it."
        case ForInput(input=name):
            return f"{who} waits for its input “{name}”, which has no value and gets none."
        case ForOutcome(parent=parent, response="ignore", certain=True):
            return f"{who} was passed over: {parent} ended, and its arrow ignores that."
        case ForOutcome(parent=parent, response=response, certain=True):
            return (
                f"{parent} ended, and its arrow tells {who} to {response}, which does nothing: it "
                "does not run."
            )
        case ForOutcome(parent=parent, response=response):
            return (
                f"{who} begins only as {parent} ends: for one of its results the arrow says "
                f"{response}, and the engine does not tell results."
            )
        case ForPart(state=state):
            what = f": it is {state}." if state else "."
            return f"{who} waits for its sub-graph, in which nothing moves{what}"
        case _:
            assert_never(wait)


def alarm_text(run: Run, graph: Graph | None) -> str:
    """Return the alarm text of a run that stands still. `graph`: as it was sent, None if unknown.
    The same reasons always give the same text."""
    found = waits(run, graph) if graph is not None else ()
    why = " ".join(in_words(each) for each in found[:_NAMED])
    more = f" And {len(found) - _NAMED} more." if len(found) > _NAMED else ""
    unknown = "What it waits for cannot be told from what was seen."
    return (
        f"NOTHING MOVES: {run.engine} calls {run.graph_name} running, and none of its actions runs. "
        f"{why or unknown}{more} Unless one is still being loaded it will not go on: stop "
        "it."
    )
