"""Finds the actions of a graph that an engine may have triggered, from the states that it shows.

See docs/umrf-and-the-engine.md 2.3, 2.4, 2.9 and 2.10. An action is triggered when a parent reports
its end while the graph is RUNNING. Until it has loaded, the engine shows it as one that was never
triggered. This module decides which actions may have reported which outcome; whatever the arrows
leave open counts as triggered. Pure.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Final, TypeAlias

import msgspec

from action_assistant.umrf.laps import laps
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    Precondition,
    Relation,
    Response,
)
from action_assistant.umrf.semantics.values import RemapUnknown, renamed, slots_of

#: The states of a graph or an action that has not begun.
NEVER_BEGAN: Final = frozenset({"UNINITIALIZED", "INITIALIZED"})
#: The states of a graph in which the end of an action triggers nothing any more.
LEFT: Final = frozenset({"STOPPING", "STOPPED", "FINISHED", "HALTED", "ERROR"})

_ALL: Final = frozenset[Precondition](PRECONDITIONS)
_ENDS: Final[tuple[Response, ...]] = ("run", "run", "run", "run")

_Outcomes: TypeAlias = frozenset[Precondition]


class TriggerArrow(msgspec.Struct, frozen=True, array_like=True):
    """One arrow, with the full names of its ends; `parent` may be ENTRY, and `child` may be EXIT.
    `responses` are in the order of PRECONDITIONS."""

    parent: str
    child: str
    required: bool
    responses: tuple[Response, ...]

    def answer(self, outcome: Precondition) -> Response:
        """Return the child's response to this outcome of its parent."""
        return self.responses[PRECONDITIONS.index(outcome)]


class Triggers(msgspec.Struct, frozen=True):
    """The arrows of one graph, with facts about how often the arrows trigger actions.

    `once`: full names of actions that run at most once. `barring_errors`: the actions of `once` for
    which this holds only until an action fails. `in_turn`: at each moment, at most one action
    loads, runs or reports, since no outcome has two consequences.
    """

    arrows: tuple[TriggerArrow, ...] = ()
    once: tuple[str, ...] = ()
    barring_errors: tuple[str, ...] = ()
    in_turn: bool = False


class SeenAfter(msgspec.Struct, frozen=True):
    """Observations that were made of a graph after it had left RUNNING.

    `active`: actions that moved then. `idle`: actions that had never begun then. No action of
    either set had reported an end before. `drained`: the graph had ended by itself.
    """

    active: frozenset[str] = frozenset()
    idle: frozenset[str] = frozenset()
    drained: bool = False


def triggers_of(graph: Graph, *, exits_known: bool) -> Triggers:
    """Return the arrows of a graph with facts about how often they trigger actions. `exits_known`:
    True if the graph was read from a text with the responses of the graph's exit. The text that an
    engine prints lacks them, and does not say which inputs are required."""
    names = {each.key: each.full_name for each in graph.actions if not each.missing}
    names |= {ENTRY: ENTRY, EXIT: EXIT}
    arrows = tuple(
        TriggerArrow(
            names[each.parent],
            names[each.child],
            each.required,
            _ENDS
            if each.child == EXIT and not exits_known
            else tuple(each.conditions.answer(outcome) for outcome in PRECONDITIONS),
        )
        for each in graph.relations
        if each.parent in names and each.child in names
    )
    if exits_known:  # otherwise the text does not say either whether an input is required
        lacking = frozenset(_lacking(graph))
        arrows = tuple(each for each in arrows if each.child not in lacking)
    known = laps(graph)
    unique = len(set(names.values())) == len(graph.actions) + 2
    in_turn = unique and not known.stops and _has_one_consequence(arrows)
    return Triggers(arrows, known.once, known.barring_errors, in_turn)


def _lacking(graph: Graph) -> Iterator[str]:
    """Yield the full names of actions that never run, since no parent gives them a required input.
    An action that the entry starts is never among them, since the graph around may give the
    input."""
    actions = {each.key: each for each in graph.actions if not each.missing}
    arriving: dict[str, list[Relation]] = {}
    for arrow in graph.relations:
        arriving.setdefault(arrow.child, []).append(arrow)
    for action in actions.values():
        arrows = arriving.get(action.key, [])
        needed = {
            name
            for name, slot in slots_of(action.inputs).items()
            if slot.required and not slot.has_value()
        }
        if needed and all(each.parent in actions for each in arrows):
            given = {name for each in arrows for name in _given(actions[each.parent], each, action)}
            if not needed <= given:
                yield action.full_name


def _given(parent: Action, arrow: Relation, child: Action) -> set[str]:
    outputs, inputs = slots_of(parent.outputs), slots_of(child.inputs)
    try:
        places = renamed(outputs, arrow.remap, inputs)
    except RemapUnknown:
        return set(inputs)
    return {
        name
        for name, place in places.items()
        if inputs[name].updatable and outputs[place].type == inputs[name].type
    }


def _has_one_consequence(arrows: tuple[TriggerArrow, ...]) -> bool:
    """Return whether each outcome of each action starts, bypasses or ends at most one other thing
    by these arrows."""
    found: set[tuple[str, Precondition]] = set()
    for arrow in arrows:
        outcomes = PRECONDITIONS[:1] if arrow.parent == ENTRY else PRECONDITIONS
        for outcome in outcomes:
            if arrow.answer(outcome) in {"ignore", "restart"}:
                continue
            if (arrow.parent, outcome) in found:
                return False
            found.add((arrow.parent, outcome))
    return True


def may_be_loading(
    known: Triggers,
    graph_state: str,
    states: Mapping[str, str],
    seen: SeenAfter,
    *,
    parts: Collection[str] = (),
) -> tuple[str, ...]:
    """Return the full names of actions that may have been triggered although they have not begun,
    in a graph of which no action moves. `known`: the arrows of the graph. `states`: the state of
    each action, by full name. `seen`: earlier observations of this graph. `parts`: full names of
    the actions that are sub-graphs."""
    idle = {name for name, state in states.items() if state in NEVER_BEGAN}
    if not idle or graph_state in NEVER_BEGAN:
        return ()
    begun = {name for name in idle if states[name] == "INITIALIZED"}  # loaded, about to run
    if known.in_turn and (seen.active or seen.drained):
        return tuple(sorted(begun))
    it = _Reports(known, states, seen, frozenset(parts))
    return tuple(name for name in states if name in begun or (name in idle and it.triggers(name)))


class _Reports:
    """Finds the outcomes that each action may have reported while the graph was RUNNING, including
    outcomes that a bypassed action passed on."""

    def __init__(
        self,
        known: Triggers,
        states: Mapping[str, str],
        seen: SeenAfter,
        parts: frozenset[str],
    ) -> None:
        self._states = states
        self._parts = parts
        self._leaving: dict[str, list[TriggerArrow]] = {}
        self._arriving: dict[str, list[TriggerArrow]] = {}
        for arrow in known.arrows:
            self._leaving.setdefault(arrow.parent, []).append(arrow)
            self._arriving.setdefault(arrow.child, []).append(arrow)
        failed = bool(parts) or "ERROR" in states.values()
        self._once = frozenset(known.once)
        if failed:
            self._once -= frozenset(known.barring_errors)
        self._unreported = seen.active | seen.idle
        self._reported: dict[str, set[Precondition]] = {}
        self._run: set[str] = set()
        for name, outcome in self._ends():
            self._report(name, outcome)

    def triggers(self, name: str) -> bool:
        """Return whether some reported outcome runs the action `name`, and all its required parents
        have reported."""
        if name not in self._run:
            return False
        needed = (each.parent for each in self._arriving.get(name, ()) if each.required)
        return all(each in self._reported for each in needed)

    def _ends(self) -> Iterator[tuple[str, Precondition]]:
        yield ENTRY, "on_true"
        for name, state in self._states.items():
            if state in NEVER_BEGAN or (name in self._once and name in self._unreported):
                continue
            for outcome in self._outcomes(name, state):
                yield name, outcome

    def _outcomes(self, name: str, state: str) -> _Outcomes:
        """Return the outcomes that the action `name` may have reported, which has begun and is now
        in this state."""
        if name not in self._once or name in self._parts:
            return _ALL
        possible = frozenset[Precondition](
            {"on_error"} if state == "ERROR" else {"on_true", "on_false"}
        )
        for arrow in self._leaving.get(name, ()):
            if arrow.child != EXIT and self._is_begun_by(arrow):
                possible &= {each for each in PRECONDITIONS if arrow.answer(each) == "run"}
        return possible or _ALL

    def _is_begun_by(self, arrow: TriggerArrow) -> bool:
        """Return whether the child of this arrow has begun and no other arrow leads to the child,
        so that this arrow must have run it."""
        begun = self._states.get(arrow.child, "UNINITIALIZED") not in NEVER_BEGAN
        return begun and len(self._arriving[arrow.child]) == 1

    def _report(self, parent: str, outcome: Precondition) -> None:
        waiting = [(parent, outcome)]
        while waiting:
            parent, outcome = waiting.pop()
            reported = self._reported.setdefault(parent, set())
            if outcome in reported:
                continue
            reported.add(outcome)
            for arrow in self._leaving.get(parent, ()):
                match arrow.answer(outcome):
                    case "run":
                        self._run.add(arrow.child)
                    case "bypass" if arrow.child != EXIT:
                        waiting.append((arrow.child, outcome))
                    case _:
                        pass
