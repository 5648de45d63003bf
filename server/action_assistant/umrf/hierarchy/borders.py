"""Where arrows cross the border of some chosen actions, and what that comes to when they become one action.

See docs/umrf-and-the-engine.md 2.3 and 2.6.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from action_assistant.umrf.hierarchy.joint_parts import in_order
from action_assistant.umrf.hierarchy.reasons import FlatteningReason, HierarchyLevel
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Conditions,
    Graph,
    Key,
    Precondition,
    Relation,
    Response,
)

#: How an action ends that nobody stops.
ENDS: Final[tuple[Precondition, ...]] = ("on_true", "on_false", "on_error")


class Border(NamedTuple):
    """Arrows of a graph by where they stand to the chosen actions; `leading` those that come from each of
    them. `entries`: the chosen actions to which others lead, or that nothing leads to where no arrow comes in
    at all."""

    graph: Graph
    chosen: Mapping[Key, Action]
    into: tuple[Relation, ...]
    within: tuple[Relation, ...]
    out: tuple[Relation, ...]
    entries: tuple[Key, ...]
    leading: Mapping[Key, Sequence[Relation]]

    def at(self, key: Key) -> tuple[HierarchyLevel, ...]:
        """The place of a chosen action."""
        return (HierarchyLevel(self.graph.name, key, self.chosen[key].full_name),)

    def named(self, key: Key) -> str:
        """What an action or an end of the graph is called."""
        if key in (ENTRY, EXIT):
            return f"the {key}"
        return next((a.full_name for a in self.graph.actions if a.key == key), key)

    def answers(self, key: Key, outcome: Precondition) -> dict[Key, Response]:
        """What the actions outside that a chosen one leads to answer to an end of it."""
        ways = (r for r in self.leading.get(key, ()) if r.child not in self.chosen)
        found = ((r.child, r.conditions.answer(outcome)) for r in ways)
        return {child: answer for child, answer in found if answer != "ignore"}

    def goes_on(self, key: Key, outcome: Precondition) -> bool:
        """Whether another chosen action answers to an end."""
        ways = (r for r in self.leading.get(key, ()) if r.child in self.chosen)
        return any(r.conditions.answer(outcome) != "ignore" for r in ways)


def border_of(graph: Graph, chosen: Collection[Key]) -> Border:
    """The border around these actions."""
    actions = {action.key: action for action in graph.actions if action.key in chosen}
    inside, ordered = actions.keys(), in_order(graph.relations, by_parent=False)
    into = tuple(r for r in ordered if r.child in inside and r.parent not in inside)
    within = tuple(r for r in ordered if r.child in inside and r.parent in inside)
    out = tuple(
        r
        for r in in_order(graph.relations, by_parent=True)
        if r.parent in inside and r.child not in inside
    )
    leading: dict[Key, list[Relation]] = {}
    for relation in (*within, *out):
        leading.setdefault(relation.parent, []).append(relation)
    reached = {r.child for r in (into or within)}
    entries = tuple(key for key in actions if (key in reached) == bool(into))
    return Border(graph, actions, into, within, out, entries, leading)


def between(border: Border) -> Iterator[FlatteningReason]:
    """What was not chosen though ways lead over it from chosen actions to others."""
    ahead, back = dict[Key, list[Key]](), dict[Key, list[Key]]()
    for relation in border.graph.relations:
        ahead.setdefault(relation.parent, []).append(relation.child)
        back.setdefault(relation.child, []).append(relation.parent)
    there = _reached(border, ahead) & _reached(border, back)
    for action in border.graph.actions:
        if action.key in there and action.key not in border.chosen:
            at = (HierarchyLevel(border.graph.name, action.key, action.full_name),)
            yield FlatteningReason("between", "It lies between them and is not chosen.", at)


def _reached(border: Border, ways: Mapping[Key, Sequence[Key]]) -> set[Key]:
    found: set[Key] = set()
    stack = list(border.chosen)
    while stack:
        for key in ways.get(stack.pop(), ()):
            if key not in found:
                found.add(key)
                stack.append(key)
    return found


def ways_in_differ(border: Border) -> Iterator[FlatteningReason]:
    """Why these entries cannot be one: each has to be told the same by the same."""
    if not border.entries:
        message = "Each of these actions follows another of them, so none would begin."
        yield FlatteningReason("ways-in", message)
        return
    first = border.entries[0]
    told = _told(border, first)
    for key in border.entries[1:]:
        other = _told(border, key)
        one, two = border.named(first), border.named(key)
        for parent in sorted(told.keys() ^ other.keys()):
            leads, not_ = (one, two) if parent in told else (two, one)
            subject = "The entry" if parent == ENTRY else border.named(parent)
            message = (
                f"{subject} leads to {leads} and not to {not_}: a sub-graph begins with all "
                "of its entry actions at once."
            )
            yield FlatteningReason("ways-in", message, border.at(key))
        for parent in sorted(told.keys() & other.keys()):
            if told[parent] != other[parent]:
                message = f"{one} and {two} answer otherwise when {border.named(parent)} ends."
                yield FlatteningReason("ways-in", message, border.at(key))


def _told(border: Border, key: Key) -> dict[Key, tuple[Conditions | None, bool]]:
    ways = (r for r in border.into if r.child == key)
    return {
        r.parent: (None, True) if r.parent == ENTRY else (r.conditions, r.required) for r in ways
    }


def ways_out_differ(border: Border) -> Iterator[FlatteningReason]:
    """Why these ends cannot be one: outside only the outcome is seen, and not who ended."""
    differing: dict[tuple[Key, Key], list[Precondition]] = {}
    for outcome in PRECONDITIONS:
        known: tuple[Key, dict[Key, Response]] | None = None
        for key in border.chosen:
            answers = border.answers(key, outcome)
            if not answers:
                continue
            if known is None:
                known = key, answers
            elif known[1] != answers:
                differing.setdefault((known[0], key), []).append(outcome)
    for (first, key), outcomes in differing.items():
        one, two = border.named(first), border.named(key)
        message = (
            f"When {one} ends {' or '.join(outcomes)}, something else follows than when {two} does: "
            "outside only the outcome of the sub-graph is seen, and not who ended it."
        )
        yield FlatteningReason("ways-out", message, border.at(key))


def answers_of(border: Border, child: Key) -> Conditions:
    """What an action outside answers to the ends of what stands for the chosen actions."""
    found: dict[str, Response] = {}
    for outcome in PRECONDITIONS:
        for key in border.chosen:
            answer = border.answers(key, outcome).get(child)
            if answer is not None:
                found[outcome] = answer
    return Conditions(**found)


def ends_within(border: Border, *, closing: bool, gives: bool) -> dict[Key, Conditions]:
    """The chosen actions that end the sub-graph, and with what. `closing`: also those after which nothing
    follows, which one graph would notice and a sub-graph would not; not with an outcome after which
    something follows elsewhere. `gives`: the exit waits for values."""
    free = [o for o in ENDS if not any(border.answers(key, o) for key in border.chosen)]
    found: dict[Key, Conditions] = {}
    for key in border.chosen:
        said: dict[str, Response] = {}
        for outcome in PRECONDITIONS:
            answers = set(border.answers(key, outcome).values())
            if answers:
                said[outcome] = "bypass" if answers == {"bypass"} else "run"
            elif closing and outcome in free and not border.goes_on(key, outcome):
                said[outcome] = "bypass" if gives or outcome == "on_error" else "run"
        if said:
            found[key] = Conditions(**said)
    return found
