"""Breakpoints: places in a graph before which, or after which, a led run waits for a person.

A breakpoint is none of the graph that robots get: no digest and no UMRF has it. Pure.
"""

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.model import EXIT, Graph, JsonText, Precondition, Relation, Response
from action_assistant.umrf.parameters import flat_name

Told: TypeAlias = Literal["true", "false", "error"]
_Name = Annotated[str, msgspec.Meta(min_length=1, max_length=1000)]
_TESTS: Final[Mapping[str, Callable[[Any, Any], bool]]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_OUTCOMES: Final[Mapping[Told, Precondition]] = {
    "true": "on_true",
    "false": "on_false",
    "error": "on_error",
}
#: The outcomes at which a run can wait, in order.
TOLD: Final[tuple[Told, ...]] = tuple(_OUTCOMES)
#: Responses by which the child of an arrow may begin, or the graph end.
_GOES_ON: Final[frozenset[Response]] = frozenset({"run", "restart", "bypass"})


class ValueTest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A condition on a value by its flat name (`pose::x`). No value is unequal to all."""

    name: _Name
    test: Literal["==", "!=", "<", "<=", ">", ">="]
    value: bool | float | Annotated[str, msgspec.Meta(max_length=1000)]

    def holds(self, values: Mapping[str, Any]) -> bool:
        """Return whether the value in `values` meets the condition. Values of different kinds are
        unequal, and have no order."""
        found = values.get(self.name)
        if _kind(found) != _kind(self.value):
            return self.test == "!="
        return _TESTS[self.test](found, self.value)


class Breakpoint(
    msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True, forbid_unknown_fields=True
):
    """Lets a led run wait before the action with the full name `action` begins; after it has ended, if
    it has `outcomes`; or when it has ended and the arrow to the action `to` ("exit": the end of the
    graph) lets that go on. `visit`: only at this visit of `action`, from 1; 0 for each. `value`: only
    if an input meets this, or, after its end, an output. `inside`: the name of the sub-graph in which
    both actions stand: it counts wherever the start of the run opens that; "" for the graph itself."""

    action: _Name
    to: Annotated[str, msgspec.Meta(max_length=1000)] = ""
    visit: Annotated[int, msgspec.Meta(ge=0, le=1_000_000)] = 0
    outcomes: tuple[Told, ...] = ()
    value: ValueTest | None = None
    inside: Annotated[str, msgspec.Meta(max_length=1000)] = ""

    @property
    def is_at_end(self) -> bool:
        """True if it counts at the end of its action."""
        return bool(self.to or self.outcomes)

    def holds(self, visit: int, values: Mapping[str, Any]) -> bool:
        """Return whether its conditions are met at this visit of its action, with these values."""
        return self.visit in {0, visit} and (self.value is None or self.value.holds(values))

    def words(self) -> str:
        """Return the place and the conditions, as part of a sentence."""
        when = " or ".join(self.outcomes)
        place = f"after {self.action}" if self.is_at_end else f"before {self.action}"
        return "".join(
            (
                place,
                f" of {self.inside}" if self.inside else "",
                f" ended {when}" if self.outcomes and not self.to else "",
                f", towards {self.to}" if self.to else "",
                f", visit {self.visit}" if self.visit else "",
                f", {self.value.name} {self.value.test} {self.value.value}" if self.value else "",
            )
        )


class _Kept(msgspec.Struct, frozen=True):
    """A breakpoint as the document keeps it, with its action or arrow."""

    visit: Annotated[int, msgspec.Meta(ge=0, le=1_000_000)] = 0
    outcomes: tuple[Told, ...] = ()
    value: ValueTest | None = None


def breakpoints_in(graph: Graph) -> tuple[Breakpoint, ...]:
    """Return the breakpoints that people have set in a graph, as a start of it names them, one for each
    place. A text that says none is left out, and so is an arrow by which nothing goes on. The twin of
    `startBreakpoints` in `graph/breakpoints.ts`."""
    names = {each.key: each.full_name for each in graph.actions if not each.missing}
    texts = [(names[each.key], "", each.breakpoint) for each in graph.actions if each.key in names]
    ends = names | {EXIT: EXIT}
    texts += [
        (names[each.parent], ends[each.child], each.breakpoint)
        for each in graph.relations
        if each.parent in names and each.child in ends and goes_on(each)
    ]
    found: dict[tuple[str, str], Breakpoint] = {}
    for action, to, text in texts:
        kept = _kept(text)
        if kept is not None:
            outcomes = tuple(each for each in _OUTCOMES if each in kept.outcomes)
            one = Breakpoint(
                action=action, to=to, visit=kept.visit, outcomes=outcomes, value=kept.value
            )
            found.setdefault((action, to), one)
    return tuple(found.values())


def _kept(text: JsonText) -> _Kept | None:
    try:
        return msgspec.json.decode(text, type=_Kept) if text else None
    except (msgspec.ValidationError, msgspec.DecodeError):
        return None


def goes_on(arrow: Relation) -> tuple[Told, ...]:
    """Return the outcomes by which an arrow lets its child begin, or the graph end."""
    return tuple(
        told for told, outcome in _OUTCOMES.items() if arrow.conditions.answer(outcome) in _GOES_ON
    )


def bypasses(arrow: Relation) -> tuple[Told, ...]:
    """Return the outcomes by which an arrow bypasses its child: that hands them on and never begins."""
    return tuple(
        told for told, outcome in _OUTCOMES.items() if arrow.conditions.answer(outcome) == "bypass"
    )


class NoSuchPlace(ValueError):
    """A breakpoint names no place of its graph where a run could wait; the text says why."""


def pinned(graph: Graph, breakpoints: Iterable[Breakpoint]) -> tuple[Breakpoint, ...]:
    """Return the breakpoints of a run of this graph, with the outcomes by which arrows go on filled in.
    Raise NoSuchPlace for one that no run could wait at."""
    found: dict[tuple[str, str, bool], Breakpoint] = {}
    names = {each.full_name: each for each in graph.actions if not each.missing}
    for each in breakpoints:
        if each.inside:
            raise NoSuchPlace(f"No sub-graph {each.inside} is opened.")
        action = names.get(each.action)
        if action is None:
            raise NoSuchPlace(f"There is no action {each.action}.")
        place = (each.action, each.to, each.is_at_end)
        if place in found:
            raise NoSuchPlace(f"There are two breakpoints {each.words()}.")
        if each.value is not None:
            own = action.outputs if each.is_at_end else action.inputs
            if each.value.name not in {flat_name(one.path) for one in own}:
                kind = "output" if each.is_at_end else "input"
                raise NoSuchPlace(f"{each.action} has no {kind} {each.value.name}.")
        found[place] = _on_arrow(graph, each, action.key) if each.to else each
    return tuple(found.values())


def _on_arrow(graph: Graph, each: Breakpoint, parent: str) -> Breakpoint:
    keys = {one.full_name: one.key for one in graph.actions} | {EXIT: EXIT}
    arrows = [
        one for one in graph.relations if (one.parent, one.child) == (parent, keys.get(each.to))
    ]
    if not arrows:
        raise NoSuchPlace(f"There is no arrow from {each.action} to {each.to}.")
    goes = {told for one in arrows for told in goes_on(one)}
    outcomes = tuple(
        told for told in _OUTCOMES if told in goes and (not each.outcomes or told in each.outcomes)
    )
    if not outcomes:
        raise NoSuchPlace(f"Nothing goes on by the arrow from {each.action} to {each.to} then.")
    return msgspec.structs.replace(each, outcomes=outcomes)


def _kind(value: Any) -> str:
    match value:
        case bool():
            return "bool"
        case int() | float():
            return "number" if math.isfinite(value) else "none"
        case str():
            return "text"
        case _:
            return "none"
