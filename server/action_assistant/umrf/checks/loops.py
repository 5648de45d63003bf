"""Loops of a graph, and what they do to the engine.

See docs/umrf-and-the-engine.md 2.9, 2.10; H5, H9.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Final

from action_assistant.umrf.checks.places import Subject
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Action, Key, Precondition, Relation

#: How an action that runs can end; `on_stopped` needs somebody who stops it.
ENDS: Final[tuple[Precondition, ...]] = ("on_true", "on_false", "on_error")


def check_spontaneous(subject: Subject) -> None:
    """Spontaneous actions from which a loop can be reached."""
    spontaneous = [action for action in subject.real if action.type == "spontaneous"]
    if not spontaneous:
        return
    doomed = _leading_to(subject, set().union(*loops(subject)))
    for action in spontaneous:
        if action.key in doomed:
            message = (
                f"{action.full_name} is spontaneous and leads into a loop: at its first end the "
                "engine recurses until it dies, with every running graph."
            )
            subject.report("H9", "error", message, action=action, member="/type")


def check_instant_loops(
    subject: Subject, runs: Collection[Key], reports: Mapping[Key, Collection[Precondition]]
) -> None:
    """Loops that would block the engine if they took no time. `runs`: actions that can run;
    `reports`: with which outcomes they can end."""
    if "H5" not in subject.facts.hazards:
        return

    def goes_round(relation: Relation) -> bool:
        reported = reports.get(relation.parent, ())
        answers = {relation.conditions.answer(o) for o in ENDS if o in reported}
        return relation.parent != relation.child and bool(answers & {"run", "bypass"})

    for loop in loops(subject, goes_round):
        members = [subject.actions[key] for key in loop if key in runs]
        if len(members) < len(loop) or any(map(_takes_time, members)):
            continue
        names = [member.full_name for member in members]
        shown = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        message = (
            f"{shown} are a loop. If all of them end at once, the engine blocks itself within "
            "milliseconds and obeys no stop any more; let at least one take some time."
        )
        subject.report("H5", "warning", message, action=members[0])


def _takes_time(action: Action) -> bool:
    """Whether somebody has said so: `"takes_time": true` in its `gui_attributes` (decision 56)."""
    attributes = parse_small(dict(action.extra).get("gui_attributes", "null"))
    return isinstance(attributes, dict) and attributes.get("takes_time") is True


def _leading_to(subject: Subject, keys: set[Key]) -> set[Key]:
    """Everything from which there is a way to one of these, themselves included."""
    found = set(keys)
    stack = list(keys)
    while stack:
        for relation in subject.incoming.get(stack.pop(), []):
            if relation.parent not in found:
                found.add(relation.parent)
                stack.append(relation.parent)
    return found


def loops(
    subject: Subject, follows: Callable[[Relation], bool] = lambda _: True
) -> list[list[Key]]:
    """Actions that lie on loops, by loop or net of loops (Tarjan's components, iterative), along
    the relations that it `follows`."""

    def ways(key: Key) -> Iterator[Key]:
        return (r.child for r in subject.outgoing.get(key, []) if follows(r))

    index: dict[Key, int] = {}
    low: dict[Key, int] = {}
    on_stack: set[Key] = set()
    stack: list[Key] = []
    found: list[list[Key]] = []
    for action in subject.real:
        if action.key in index:
            continue
        work = [(action.key, ways(action.key))]
        index[action.key] = low[action.key] = len(index)
        stack.append(action.key)
        on_stack.add(action.key)
        while work:
            key, children = work[-1]
            for child in children:
                if child not in index:
                    index[child] = low[child] = len(index)
                    stack.append(child)
                    on_stack.add(child)
                    work.append((child, ways(child)))
                    break
                if child in on_stack:
                    low[key] = min(low[key], index[child])
            else:
                work.pop()
                if work:
                    above = work[-1][0]
                    low[above] = min(low[above], low[key])
                if low[key] == index[key]:
                    component = _taken_from(stack, key)
                    on_stack.difference_update(component)
                    if len(component) > 1 or key in ways(key):
                        found.append(component)
    return found


def _taken_from(stack: list[Key], lowest: Key) -> list[Key]:
    """Takes off everything down to that key, which comes first."""
    taken = [stack.pop()]
    while taken[-1] != lowest:
        taken.append(stack.pop())
    taken.reverse()
    return taken
