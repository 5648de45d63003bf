"""An expected course against another version of its graph: actions are known by their keys, so that one
that was renamed still does what it did. Pure."""

from collections.abc import Mapping, Sequence

import msgspec
from msgspec.structs import replace

from action_assistant.umrf.courses.coverage import TakenArrows, arrows_taken
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.files.fields import AID
from action_assistant.umrf.model import Graph, Key
from action_assistant.umrf.semantics.script import DEFAULT, Script
from action_assistant.umrf.semantics.simulate import DAY_MS, simulate
from action_assistant.umrf.semantics.steps import (
    MOST,
    Departure,
    ExpectedStep,
    departure,
    said,
    steps_of,
    unnamed,
)


class CourseCheck(msgspec.Struct, frozen=True):
    """How a graph goes under the script of an expected course: where it parts from that, if it does,
    and what it took on its way."""

    apart: Departure | None
    taken: TakenArrows

    @property
    def why(self) -> str:
        """Where they part, in words; empty if they do not."""
        if self.apart is None:
            return ""
        expected, found = said(self.apart.expected), said(self.apart.found)
        return f"Step {self.apart.place + 1}: expected {expected}, found {found}."


def check_expected(
    was: Graph,
    course: Sequence[ExpectedStep],
    script: Script,
    now: Graph,
    inside: Mapping[str, Graph] | None = None,
) -> CourseCheck:
    """Simulate a graph as it is now, with these graphs inside, under the script of a course that an
    earlier one took."""
    old = {action.full_name: action.key for action in was.actions}
    new = _identities(was, now)
    names = {key: name for name, key in new.items()}
    by_key = scripted_by_key(script, was).behaviours
    played = Script({names.get(key, key): calls for key, calls in by_key.items()})
    traces = list(
        simulate(
            now,
            script=played,
            library=inside,
            facts=SIMULATED,
            until_ms=DAY_MS,
            max_events=MOST,
        )
    )
    apart = departure(keyed(unnamed(course), old), keyed(unnamed(steps_of(traces)), new))
    names = {key: name for name, key in old.items()} | names
    return CourseCheck(None if apart is None else _named(apart, names), arrows_taken(now, traces))


def _identities(was: Graph, now: Graph) -> dict[str, Key]:
    """Which action of the earlier graph each full name stands for. A file without identities tells
    actions by their names alone."""
    keys = {action.key for action in was.actions if AID.fullmatch(action.key)}
    names = {action.full_name: action.key for action in was.actions}
    found: dict[str, Key] = {}
    for action in now.actions:
        by_name = names.get(action.full_name, f"new {action.key}")
        found[action.full_name] = action.key if action.key in keys else by_name
    return found


def keyed(steps: Sequence[ExpectedStep], keys: Mapping[str, Key]) -> list[ExpectedStep]:
    """Steps of the top graph with the keys of actions in place of their names."""
    return [
        step if step.graph else replace(step, node=keys.get(step.node, step.node)) for step in steps
    ]


def scripted_by_key(script: Script, graph: Graph) -> Script:
    """The script with actions by their keys, which stay when they are called otherwise."""
    found = dict(script.behaviours)
    for action in graph.actions:
        for name in (action.full_name, action.name, f"{graph.name}/{action.full_name}"):
            found.pop(name, None)
    for action in graph.actions:
        calls = script.calls_of(graph.name, graph.name, action.full_name, action.name)
        if not action.missing and calls != (DEFAULT,):
            found[action.key] = calls
    return Script(found)


def scripted_by_name(script: Script, graph: Graph) -> Script:
    """The same with the names that actions have in this graph."""
    names = {action.key: action.full_name for action in graph.actions}
    return Script({names.get(key, key): calls for key, calls in script.behaviours.items()})


def _named(apart: Departure, names: Mapping[Key, str]) -> Departure:
    def named(step: ExpectedStep | None) -> ExpectedStep | None:
        return None if step is None else replace(step, node=names.get(step.node, step.node))

    return replace(apart, expected=named(apart.expected), found=named(apart.found))
