"""Compares an expected course with another version of its graph. Actions are matched by key, so
that a renamed action still counts as the same. Pure."""

from collections.abc import Callable, Mapping, Sequence

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
    step_text,
    steps_of,
    unnamed,
)
from action_assistant.umrf.semantics.trace import Trace


class CourseCheck(msgspec.Struct, frozen=True):
    """The result of comparing a graph with an expected course. `apart`: the first step that
    differs, or None. `taken`: the arrows that the graph took."""

    apart: Departure | None
    taken: TakenArrows

    @property
    def why(self) -> str:
        """The first difference in words; "" if there is none."""
        if self.apart is None:
            return ""
        expected, found = step_text(self.apart.expected), step_text(self.apart.found)
        return f"Step {self.apart.place + 1}: expected {expected}, found {found}."


def check_expected(
    was: Graph,
    course: Sequence[ExpectedStep],
    script: Script,
    now: Graph,
    inside: Mapping[str, Graph] | None = None,
    arrows_in: Callable[[Graph, Sequence[Trace]], TakenArrows] = arrows_taken,
) -> CourseCheck:
    """Simulate the graph `now` under the script of a course that its earlier version `was` took,
    and compare the new course with that `course`.

    `inside`: the graphs that can be sub-graphs of `now`, by name; `arrows_in`: finds the arrows that are
    taken in its course.
    """
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
    return CourseCheck(None if apart is None else _named(apart, names), arrows_in(now, traces))


def _identities(was: Graph, now: Graph) -> dict[str, Key]:
    """Return, by full name of each action of `now`, the key by which the comparison knows it: the
    key of the action of `was` that it continues.

    Actions are matched by key, and by full name if the keys of `was` are no identities.
    """
    keys = {action.key for action in was.actions if AID.fullmatch(action.key)}
    names = {action.full_name: action.key for action in was.actions}
    found: dict[str, Key] = {}
    for action in now.actions:
        by_name = names.get(action.full_name, f"new {action.key}")
        found[action.full_name] = action.key if action.key in keys else by_name
    return found


def keyed(steps: Sequence[ExpectedStep], keys: Mapping[str, Key]) -> list[ExpectedStep]:
    """Return the steps with the key instead of the full name for each action of the top graph.
    `keys`: keys by full name."""
    return [
        step if step.graph else replace(step, node=keys.get(step.node, step.node)) for step in steps
    ]


def scripted_by_key(script: Script, graph: Graph) -> Script:
    """Return the script in which the behaviours of the graph's actions stand under their keys,
    which survive a renaming."""
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
    """Return a script of `scripted_by_key` with the full names that the actions have in this graph
    in place of their keys."""
    names = {action.key: action.full_name for action in graph.actions}
    return Script({names.get(key, key): calls for key, calls in script.behaviours.items()})


def _named(apart: Departure, names: Mapping[Key, str]) -> Departure:
    def named(step: ExpectedStep | None) -> ExpectedStep | None:
        return None if step is None else replace(step, node=names.get(step.node, step.node))

    return replace(apart, expected=named(apart.expected), found=named(apart.found))
