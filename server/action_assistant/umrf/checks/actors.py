"""Checks graphs whose actions belong to several actors: names the parts that a runner which leads
several robots would refuse, or ask people about.

See docs/umrf-and-the-engine.md 2.11 and docs/decisions/112-several-actors.md.
"""

from collections.abc import Container, Iterable, Mapping
from itertools import islice
from typing import Final, NamedTuple, TypeAlias

import msgspec

from action_assistant.umrf.checks.concurrency import Concurrency
from action_assistant.umrf.checks.flow import Flow, follow
from action_assistant.umrf.checks.places import Subject, joined, more
from action_assistant.umrf.checks.subgraphs import Resolution, SubGraphs, at_action, place_inside
from action_assistant.umrf.components import Mask, nodes_in, reachable
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.kept_values import KEEPER_PACKAGE, unreadable_arrows, value_arrows
from action_assistant.umrf.laps import repeated
from action_assistant.umrf.model import (
    ENTRY,
    EXIT,
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    PlaceInside,
    Precondition,
    Problem,
    Relation,
)
from action_assistant.umrf.questions import is_asked

#: The most problems of one sub-graph that are reported at each action that stands for it.
_INSIDE: Final = 20
#: The most levels of sub-graphs that are looked into. Deeper ones cannot become flat either.
_DEEPEST: Final = 32
_NAMED: Final = 3  # names in one sentence
_ALSO: Final = 20  # further places of one problem
_ON_LED: Final = "on a robot that is led, "

_Reports: TypeAlias = Mapping[Key, set[Precondition]]


class _Actors(NamedTuple):
    """The actors that perform an action, or the actions of a sub-graph: all of them (`every`), the
    actors of its first actions and of its last ones. "" is no actor; in a sub-graph it stands for
    the actor of the action around."""

    every: frozenset[str]
    first: frozenset[str]
    last: frozenset[str]


_ByKey: TypeAlias = Mapping[Key, _Actors]


def check_actors(subject: Subject, graphs: SubGraphs, flow: Flow | None = None) -> None:
    """Report in `subject` what a graph with several actors means on robots. A graph has several
    actors if its actions and those of its sub-graphs, at any depth, name more than one. `graphs`:
    its sub-graphs, which have been checked; `flow`: the result of `follow`, None if that was not
    called yet. Nothing is reported for the simulator, which performs the actions of all actors."""
    everywhere = (subject.graph, *(graphs.by_name[name] for name in graphs.found))
    played = (a for graph in everywhere for a in graph.actions if not a.missing)
    named = {a.actor for a in played if not is_asked(a)} - {""}
    facts = subject.facts
    if len(named) < 2 or (facts.simulated and facts.synchronises):
        return
    if facts.synchronises:
        message = (
            "The profile of this robot says that its engine synchronises with others. By the source of "
            "that mechanism, a robot that is not reached for 5 s aborts the engines of all others (S1), "
            "two actions that end at about the same time on two robots abort both engines (S2), and a "
            "graph that waits for another robot cannot be stopped (S3)."
        )
        subject.report("synchroniser", "warning", message)
        return
    message = (
        f"The actions belong to {len(named)} actors ({joined(named)}). Checks, dry-runs and the simulator "
        "play this graph. One robot cannot be given it, since its engine cannot synchronise with others; the "
        "runner can lead several robots through it, step by step."
    )
    subject.report("actors", "warning", message)
    _LedGraph(graphs).check(subject, "", 0, flow)


def led_problems(graph: Graph, facts: EngineFacts) -> list[Problem]:
    """Return the problems of leading a graph step by step, in which the robot of each action is its
    actor and "" is the simulator. The graph may have only one robot. Problems inside sub-graphs are
    not returned. `facts`: the engine build."""
    subject = Subject(graph, facts)
    _LedGraph(SubGraphs({}, (), Resolution()), is_cast=True).check(subject, "", 0)
    return subject.problems


class _LedGraph:
    """Checks a graph and its sub-graphs as a runner would lead them, one action after the other.
    `is_cast`: the actors are the robots of a start, "" being the simulator, which moves nothing."""

    def __init__(self, graphs: SubGraphs, *, is_cast: bool = False) -> None:
        self._graphs = graphs
        self._is_cast = is_cast
        self._actors: dict[str, _Actors] = {}
        self._found: dict[tuple[str, str], tuple[PlaceInside, ...]] = {}  # by name and actor around
        for name in graphs.found:  # the innermost graphs first
            self._actors[name] = self._of_graph(graphs.by_name[name])

    def check(self, subject: Subject, around: str, depth: int, flow: Flow | None = None) -> None:
        """Report the problems of one graph in its `subject`. `around`: the actor of the action for
        which the graph stands; `depth`: the number of graphs around it; `flow`: the result of
        `follow`, None if that was not called yet."""
        actors_of = {a.key: self._of_action(a, around) for a in subject.real}
        reachability, concurrency = flow or follow(subject)
        reports, runs = reachability.reports, reachability.runs
        arrows = [
            relation
            for relation in sorted(subject.sound, key=subject.place)
            if relation.parent != ENTRY and relation.child != EXIT and not relation.listing
        ]
        for relation in arrows:
            self._check_stop(subject, relation, actors_of, reports)
        self._check_at_once(subject, actors_of, runs, concurrency)
        self._check_repeated(subject, actors_of, runs, concurrency)
        if self._is_cast:  # what a start refuses is not among what it asks people about
            return
        _check_values(subject, arrows, actors_of, reports)
        _check_pauses(subject, arrows)
        _check_spontaneous(subject, actors_of, runs)
        for action in subject.real:
            every = actors_of[action.key].every
            if len(every) > 1 and depth == 0:
                _report_shared(subject, action, every)
            if len(every) > 1 and depth < _DEEPEST:
                self._check_inside(subject, action, action.actor or around, depth)

    def _check_stop(
        self, subject: Subject, relation: Relation, actors_of: _ByKey, reports: _Reports
    ) -> None:
        """Report an arrow (`relation`) that stops an action: on a robot that is led this is a
        message of the runner. `actors_of`: the actors of each action by key; `reports`: the
        outcomes that each action can report."""
        child = actors_of[relation.child]
        if "stop" not in _answers(relation, reports) or (self._is_cast and child.every == {""}):
            return
        one = self._named(subject, relation.parent, actors_of)
        other = self._named(subject, relation.child, actors_of)
        message = (
            f"{one} stops {other}. On robots this is a message of the runner that leads them: without "
            "the runner or its network it does not come."
        )
        subject.report("stop-across", "warning", message, relation=relation, member="/conditions")

    def _named(self, subject: Subject, key: Key, actors_of: _ByKey) -> str:
        if not self._is_cast:
            return _with_actor(subject, key, actors_of[key].every)
        robots = sorted(actors_of[key].every - {""})
        return (
            f"{subject.name(key)} {f'on {joined(set(robots))}' if robots else 'in the simulator'}"
        )

    def _check_at_once(
        self,
        subject: Subject,
        actors_of: _ByKey,
        runs: Container[Key],
        concurrency: Concurrency,
    ) -> None:
        """Report each action that may run at the same time as later ones of its actor. `actors_of`:
        the actors of each action by key; `runs`: the keys of the actions that can run. If the graph
        is too large for `concurrency` to follow it, report only the first action of each actor."""
        place = {action.key: number for number, action in enumerate(subject.real)}
        members: dict[str, list[Key]] = {}
        for action in subject.real:
            for actor in sorted(actors_of[action.key].every) if action.key in runs else ():
                members.setdefault(actor, []).append(action.key)
        for actor, keys in members.items():
            if self._is_cast and not actor:
                continue
            left = set(keys)
            for key in keys if concurrency.known else keys[:1]:
                left.discard(key)
                beside = sorted(left & concurrency.beside(key), key=place.__getitem__)
                if not beside:
                    continue
                names = joined({subject.name(each) for each in beside[:_NAMED]})
                whose = f"both of {actor}" if actor else "both without an actor"
                whose, where = (f"both on {actor}", "") if self._is_cast else (whose, _ON_LED)
                message = (
                    f"{subject.name(key)} may run at the same time as {names}, {whose}. An engine stops "
                    f"one graph after the other: {where}a Stop reaches the second action up to 5 s later."
                    f"{more(len(beside) - _NAMED, 'action', 'actions')}"
                )
                also = [subject.actions[each] for each in beside[:_ALSO]]
                subject.report(
                    "two-at-once", "warning", message, action=subject.actions[key], also=also
                )

    def _check_repeated(
        self, subject: Subject, actors_of: _ByKey, runs: Container[Key], concurrency: Concurrency
    ) -> None:
        """Report the actions that can run more than once, since a robot that is led loads them anew
        each time; but no sub-graphs, whose actions an engine loads anew in any case. `actors_of`:
        the actors of each action by key."""
        graph = msgspec.structs.replace(subject.graph, relations=tuple(subject.sound))
        again = repeated(graph) if concurrency.again is None else concurrency.again
        for action in subject.real:
            if action.key not in again or action.key not in runs or action.name in self._actors:
                continue
            robot = joined(set(actors_of[action.key].every)) if self._is_cast else ""
            if self._is_cast and not robot:
                continue
            where = f"On {robot}" if robot else "On a robot that is led"
            message = (
                f"{action.full_name} may run more than once. {where} it is loaded anew each time: what "
                "it remembers in itself is forgotten."
            )
            subject.report("loaded-anew", "warning", message, action=action)

    def _check_inside(self, subject: Subject, action: Action, actor: str, depth: int) -> None:
        """Report the problems of a sub-graph of several actors at the action that stands for it.
        `actor`: that of the action, for actions inside without one; `depth`: the number of graphs
        around."""
        if (action.name, actor) not in self._found:
            inner = Subject(self._graphs.by_name[action.name], subject.facts)
            self.check(inner, actor, depth + 1)
            places = (place_inside(inner, problem) for problem in inner.problems[:_INSIDE])
            self._found[action.name, actor] = tuple(places)
        for found in self._found[action.name, actor]:
            place = at_action(found, action)
            message = f"In the sub-graph “{place.graph}”: {place.message}"
            subject.report(
                place.code, "warning", message, action=action, member="/name", inside=place
            )

    def _of_action(self, action: Action, around: str) -> _Actors:
        actor = action.actor or around
        inner = self._actors.get(action.name)
        if inner is None or not inner.every:
            return _Actors(*[frozenset({actor})] * 3)
        return _Actors(*(frozenset(each or actor for each in side) for side in inner))

    def _of_graph(self, graph: Graph) -> _Actors:
        own = {a.key: self._of_action(a, "") for a in graph.actions if not a.missing}
        children = [own[r.child] for r in graph.relations if r.parent == ENTRY and r.child in own]
        parents = [own[r.parent] for r in graph.relations if r.child == EXIT and r.parent in own]
        none = frozenset[str]()
        return _Actors(
            none.union(*(each.every for each in own.values())),
            none.union(*(each.first for each in children)),
            none.union(*(each.last for each in parents)),
        )


def _report_shared(subject: Subject, action: Action, every: frozenset[str]) -> None:
    """Report that `action` stands for a sub-graph of several actors (`every`), which cannot be one
    step of a led run."""
    whose = joined(set(every) - {""}) + ("; some name none" if "" in every else "")
    message = (
        f"{action.full_name} stands for a graph of several actors ({whose}). A runner that leads the "
        "robots sends a sub-graph to one robot as it is, so it refuses this one: make one graph without "
        "graphs inside, or give all of it to one robot."
    )
    subject.report("subgraph-across", "warning", message, action=action, member="/name")


def _answers(relation: Relation, reports: _Reports) -> set[str]:
    """Return the responses of an arrow that can really occur, given the outcomes that its parent
    can report (`reports`, by key)."""
    reported = reports.get(relation.parent, set())
    return {relation.conditions.answer(outcome) for outcome in PRECONDITIONS if outcome in reported}


def _check_values(
    subject: Subject, arrows: Iterable[Relation], actors_of: _ByKey, reports: _Reports
) -> None:
    """Report each arrow whose values cannot be read from a robot, and each that hands values to an
    action of another actor; those that hand values to an action of the same actor are reported as
    one problem."""
    handed = tuple(value_arrows(subject.graph))
    outputs = {(each.parent, each.child): set(names) for each, names in handed}
    refused = {
        (each.parent, each.child): why for each, _, why in unreadable_arrows(subject.graph, handed)
    }
    own: list[Relation] = []
    for relation in arrows:
        ends = relation.parent, relation.child
        if ends not in outputs:
            continue
        values = joined(outputs[ends])
        parent, child = actors_of[relation.parent], actors_of[relation.child]
        one, other = (
            _with_actor(subject, relation.parent, parent.every),
            _with_actor(subject, relation.child, child.every),
        )
        if ends in refused:  # also where the arrow is never taken
            message = f"{one} hands {values} to {other}. A led start of this graph is refused: {refused[ends]}"
            subject.report("values-unreadable", "warning", message, relation=relation)
        elif _answers(relation, reports) <= {"ignore", "bypass"}:
            continue
        elif len(parent.last | child.first) < 2:
            own.append(relation)
        else:
            message = (
                f"{one} hands {values} to {other}. A runner that leads the robots can hand values from "
                f"one to another only where the first one has the package {KEEPER_PACKAGE}."
            )
            subject.report("values-across-robots", "warning", message, relation=relation)
    if own:
        first = own[0]
        message = (
            f"{subject.name(first.parent)} hands {joined(outputs[first.parent, first.child])} to "
            f"{subject.name(first.child)}. A robot that is led can hand values from one action to the "
            f"next only where it has the package {KEEPER_PACKAGE}."
            f"{more(len(own) - 1, 'arrow', 'arrows')}"
        )
        subject.report("values-across", "warning", message, relation=first, also=own[1:_ALSO])


def _check_pauses(subject: Subject, arrows: Iterable[Relation]) -> None:
    """Report each arrow that pauses an action: a led robot can only begin and stop an action."""
    for relation in arrows:
        if "pause" in map(relation.conditions.answer, PRECONDITIONS):
            message = (
                f"{subject.name(relation.parent)} pauses {subject.name(relation.child)}. A robot that is "
                "led can only begin and stop an action, so a led start of this graph is refused."
            )
            subject.report(
                "pause-across", "warning", message, relation=relation, member="/conditions"
            )


def _check_spontaneous(subject: Subject, actors_of: _ByKey, runs: Container[Key]) -> None:
    """Report spontaneous actions, with the actions of other actors to which arrows lead from them.
    `actors_of`: the actors of each action by key; `runs`: the keys of the actions that can run."""
    place = {action.key: number for number, action in enumerate(subject.real)}
    lively = [a for a in subject.real if a.type == "spontaneous"]
    after = reachable(
        [
            [place[r.child] for r in subject.outgoing.get(key, []) if r.child != EXIT]
            for key in (place if lively else ())
        ]
    )
    alike: dict[frozenset[str], Mask] = {}
    for key, number in place.items():
        every = actors_of[key].every
        alike[every] = alike.get(every, 0) | 1 << number
    for action in lively:
        own = actors_of[action.key].every
        same = alike[own] if len(own) == 1 else 1 << place[action.key]
        others = after[place[action.key]] & ~same if action.key in runs else 0
        first = [subject.real[number] for number in islice(nodes_in(others), _ALSO)]
        message = (
            f"{_with_actor(subject, action.key, own)} is spontaneous: each time it ends, all that comes "
            f"after it is stopped, also {joined({each.full_name for each in first[:_NAMED]})} of another "
            "actor. A runner that leads the robots cannot do that, so a led start is refused."
            f"{more(others.bit_count() - _NAMED, 'action', 'actions')}"
            if others
            else f"{_with_actor(subject, action.key, own)} is spontaneous: it begins again by itself. A "
            "runner that leads the robots cannot do that, so a led start is refused."
        )
        subject.report(
            "spontaneous-across", "warning", message, action=action, member="/type", also=first
        )


def _with_actor(subject: Subject, key: Key, actors: Iterable[str]) -> str:
    """Return the name of the action with this key together with its actors, as in a sentence:
    "grip_0 of Carrier"."""
    whose = joined(set(actors) - {""})
    return f"{subject.name(key)} of {whose}" if whose else f"{subject.name(key)} without an actor"
