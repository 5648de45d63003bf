"""Limits of owners on numbers that a robot gets: "torque at most 60".

They are checked on the values in what is sent, before it is sent. No robot enforces them, and what an
engine hands on by itself is seen by nobody: where an arrow does that, a limit cannot be held. Pure.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Any, Final, TypeAlias

import msgspec

from action_assistant.safe_text import one_line
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.kept_values import as_json, receiving, value_arrows
from action_assistant.umrf.model import ENTRY, Action, Graph, Key
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.values import plain

#: Limits of one robot.
MOST: Final = 100
_NUMBERS: Final = ("number", "numbers")
_SHOWN: Final = 60  # characters of a value in a sentence
_MISSING: Final = "no value"


class Limit(msgspec.Struct, frozen=True, kw_only=True):
    """The bounds of an input. `parameter`: its flat name, as `arm::torque`, or the end of it after `::`;
    `action`: the name of the action that has it, "" for every action; `least`, `most`: null for no bound."""

    parameter: str
    action: str = ""
    least: float | None = None
    most: float | None = None

    @property
    def fault(self) -> str:
        """The reason why this limits nothing, as a sentence; "" if it does."""
        bounds = [each for each in (self.least, self.most) if each is not None]
        if not bounds or not all(map(isfinite, bounds)):
            return f"Say the least or the most of {one_line(self.parameter)}, as a finite number."
        if len(bounds) > 1 and bounds[0] > bounds[1]:
            return f"The least of {one_line(self.parameter)} is above its most."
        return ""

    def covers(self, action: str, name: str) -> bool:
        """Return whether this limits the input with a flat name of an action with this name."""
        if self.action not in ("", action):
            return False
        return name == self.parameter or name.endswith(f"::{self.parameter}")

    def words(self) -> str:
        """Return the limit in words: "torque of Grip at most 60"."""
        of = f" of {self.action}" if self.action else ""
        return f"{self.parameter}{of} {self.bounds()}"

    def bounds(self) -> str:
        """Return the bounds in words: "at most 60"."""
        if self.least is None:
            return f"at most {self.most:g}"
        if self.most is None:
            return f"at least {self.least:g}"
        return f"from {self.least:g} to {self.most:g}"

    def is_outside(self, number: float) -> bool:
        """Return whether a number is outside the bounds; one that is not finite always is."""
        return (
            not isfinite(number)
            or (self.least is not None and number < self.least)
            or (self.most is not None and number > self.most)
        )


#: The limits of robots, by name; robots without any are left out.
Limits: TypeAlias = Mapping[str, tuple[Limit, ...]]
NO_LIMITS: Final[Limits] = {}


class LimitedInput(msgspec.Struct, frozen=True, kw_only=True):
    """An input of an action as it is sent. `node`, `action`, `name`: the full and plain name of the
    action, and the flat name; `numbers`: its value, None where it is no number and no list of them;
    `shown`: the value in words. `is_brought`: an arrow brings it while the engine runs;
    `from_outside`: it has the value of the input of this name of the action that stands for its graph."""

    node: str
    action: str
    name: str
    numbers: tuple[float, ...] | None
    shown: str
    is_brought: bool = False
    from_outside: bool = False


class OverLimit(msgspec.Struct, frozen=True, kw_only=True):
    """A value outside a limit, or one that cannot be held to it (`why`: the reason, "" for a value)."""

    node: str
    name: str
    shown: str
    limit: Limit
    why: str = ""

    def sentence(self, robot: str) -> str:
        """Return the sentence that names robot, action, parameter, value and limit."""
        place = f"{self.name} of {self.node}"
        rule = f"The limit there is {self.limit.words()}"
        if self.why:
            return f"{place} cannot be held to its limit on {robot}: {self.why} {rule}."
        return f"{robot} would get {self.shown} as {place}. {rule}."


#: Inputs by the last part of their flat name, so that those of a limit are found at once.
LimitedInputs: TypeAlias = Mapping[str, tuple[LimitedInput, ...]]


def inputs_of(
    graph: Graph,
    inside: Mapping[str, Graph],
    received: Mapping[Key, Collection[str]] | None = None,
) -> LimitedInputs:
    """Return the inputs of all actions of a graph and of its sub-graphs, grouped by the last part
    of their flat names. `inside`: the sub-graphs by name. `received`: the flat names of inputs of
    the outer graph that are left out, by the key of the action. In a led run the runner gets the
    values of these inputs from earlier actions, and knows them only when it sends the action."""
    found: dict[str, list[LimitedInput]] = {}
    for key, each in _inputs(graph):
        if received is None or each.name not in received.get(key, ()):
            found.setdefault(_last(each.name), []).append(each)
    for name in sorted(inside):
        for _, each in _inputs(inside[name], is_inside=True):
            found.setdefault(_last(each.name), []).append(each)
    return {name: tuple(inputs) for name, inputs in found.items()}


def extremes(inputs: LimitedInputs) -> LimitedInputs:
    """Return few of these inputs, of which one is outside a limit exactly if one of all is: those of one
    name and action with the least and greatest numbers, and one that has others."""
    found: dict[str, tuple[LimitedInput, ...]] = {}
    for last, alike in inputs.items():
        groups: dict[tuple[object, ...], LimitedInput] = {}
        for each in alike:
            place = (each.action, each.name, each.is_brought, each.from_outside)
            numbers = each.numbers
            if numbers is None or not all(map(isfinite, numbers)):
                groups.setdefault((*place, "no number"), each)
            elif numbers:
                least = groups.setdefault((*place, "least"), each).numbers or ()
                most = groups.setdefault((*place, "most"), each).numbers or ()
                if min(numbers) < min(least):
                    groups[*place, "least"] = each
                if max(numbers) > max(most):
                    groups[*place, "most"] = each
            else:
                groups.setdefault((*place, "empty"), each)
        found[last] = tuple(dict.fromkeys(groups.values()))
    return found


def with_received(
    inputs: LimitedInputs, action: Action, values: Mapping[str, Any], received: Iterable[str]
) -> LimitedInputs:
    """Return the inputs of an action that is sent by itself, with those that were `received`. `values`:
    by flat name; one that is not there is missing."""
    found = dict(inputs)
    for name in received:
        numbers, shown = _value(values.get(name)) if name in values else (None, _MISSING)
        given = LimitedInput(
            node=action.full_name, action=action.name, name=name, numbers=numbers, shown=shown
        )
        found[_last(name)] = (*found.get(_last(name), ()), given)
    return found


def over_limits(limits: Sequence[Limit], inputs: LimitedInputs) -> Iterator[OverLimit]:
    """Yield each input that is outside a limit, or that cannot be held to it."""
    for limit in limits:
        for each in inputs.get(_last(limit.parameter), ()):
            if not limit.covers(each.action, each.name):
                continue
            why = _why_not_held(limit, each)
            is_held_outside = each.from_outside and not why
            is_in = each.numbers is not None and not any(map(limit.is_outside, each.numbers))
            if why or not (is_held_outside or is_in):
                yield OverLimit(
                    node=each.node, name=each.name, shown=each.shown, limit=limit, why=why
                )


def _why_not_held(limit: Limit, given: LimitedInput) -> str:
    """Return why a value cannot be held to a limit, as a sentence; "" if it can."""
    if given.is_brought:
        return (
            "the robot's engine brings the value there by an arrow, and nobody can check it. Let the "
            "runner lead the run step by step, or give the value in the graph."
        )
    if given.from_outside and limit.action:
        return "it is given from outside of its sub-graph, under another action."
    return ""


def _inputs(graph: Graph, *, is_inside: bool = False) -> Iterator[tuple[Key, LimitedInput]]:
    brought = receiving(graph, tuple(value_arrows(graph)))
    entries = {each.child for each in graph.relations if each.parent == ENTRY} if is_inside else ()
    renamed = {each.child for each in graph.relations if each.parent == ENTRY and each.remap}
    for action in graph.actions:
        if not action.missing:
            is_renamed = is_inside and action.key in renamed
            given = brought.get(action.key, frozenset())
            for each in _inputs_of(action, given, action.key in entries, is_renamed=is_renamed):
                yield action.key, each


def _inputs_of(
    action: Action, brought: frozenset[str], is_entry: bool, *, is_renamed: bool
) -> Iterator[LimitedInput]:
    for parameter in action.inputs:
        name, leaf = flat_name(parameter.path), parse_small(parameter.text)
        numbers: tuple[float, ...] | None = None
        shown = _clipped(parameter.text)
        has_value = isinstance(leaf, dict) and "pvf_value" in leaf
        if isinstance(leaf, dict):
            numbers, shown = _value(plain(leaf["pvf_value"])) if has_value else (None, _MISSING)
            if leaf.get("pvf_type") not in _NUMBERS:
                numbers = None
        comes = is_entry and not has_value
        yield LimitedInput(
            node=action.full_name,
            action=action.name,
            name=name,
            numbers=numbers,
            shown=shown,
            is_brought=name in brought or is_renamed,
            from_outside=comes,
        )


def _value(value: Any) -> tuple[tuple[float, ...] | None, str]:
    """Return the numbers of a value, None if it is no number and no list of them, and its words."""
    members = value if isinstance(value, list | tuple) else [value]
    is_of_numbers = all(
        isinstance(each, int | float) and not isinstance(each, bool) for each in members
    )
    try:
        shown = _clipped(_words(value))
    except (TypeError, ValueError):  # of a type that only actions know
        shown = "a value that is no number"
    return (tuple(map(float, members)) if is_of_numbers else None), shown


def _words(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list | tuple) and all(isinstance(each, float) for each in value):
        return f"[{', '.join(f'{each:g}' for each in value)}]"
    return as_json(value)


def _clipped(text: str) -> str:
    shown = one_line(text)
    return shown if len(shown) <= _SHOWN else f"{shown[: _SHOWN - 1]}…"


def _last(name: str) -> str:
    return name.rpartition("::")[2]
