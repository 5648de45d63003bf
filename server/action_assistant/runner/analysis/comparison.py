"""Compares two runs: what was sent, where they ran, and the first visit in which they differ."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Final, Literal, TypeAlias

import msgspec
from msgspec.structs import replace

from action_assistant.runner.analysis.cause_texts import cause_sentence
from action_assistant.runner.analysis.causes import (
    OPERATOR,
    Cause,
    ForeignCause,
    OperatorChange,
    Silence,
    causes,
    operator,
)
from action_assistant.runner.analysis.levels import INTO, LevelPlace, places_of
from action_assistant.runner.runs import views
from action_assistant.runner.runs.counts import visit_counts
from action_assistant.runner.runs.question_views import answers_by_visit
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import ActionRun, Visit
from action_assistant.safe_text import hold_names
from action_assistant.umrf.difference import ActionChange, Difference, difference
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import Action, Graph, Key

_MOST: Final = 2_000  # steps in an answer
_SLOWER: Final = 1.5  # times as long
_NOTABLE_US: Final = 500_000  # and this much longer

#: The relation of the visits of one action in both runs. `unknown`: a result is not known, or the other visit
#: may have been missed. `end`: one has ended, and of the other no end was seen.
Relation: TypeAlias = Literal["same", "result", "only_a", "only_b", "unknown", "end"]


class ComparedVisit(msgspec.Struct, frozen=True, kw_only=True):
    """The visit number `visit` (from 1) of an action in both runs; null where a run lacks it.
    `levels`: the actions around it, outermost first; `name`: its own; `action`: the name that
    its engine used. `slower`: the run in which it certainly took notably longer."""

    action: str
    levels: tuple[str, ...]
    name: str
    aid: str | None
    visit: int
    a: views.VisitShown | None
    b: views.VisitShown | None
    relation: Relation
    slower: Literal["a", "b"] | None = None


class Parting(msgspec.Struct, frozen=True, kw_only=True):
    """The earliest visit in which the runs differ, in a sentence, with the messages of the
    action."""

    step: ComparedVisit
    text: str
    messages_a: list[str]
    messages_b: list[str]

    def __post_init__(self) -> None:
        hold_names(self, "text")


class PartingCause(msgspec.Struct, frozen=True, kw_only=True):
    """An event of one run that explains why the runs differ: a command of a person, an alarm, or
    the script of the simulator. `run`: the number of that run."""

    kind: str
    run: int
    text: str

    def __post_init__(self) -> None:
        hold_names(self, "text")


class RunComparison(msgspec.Struct, frozen=True, kw_only=True):
    """The comparison of run `a` with run `b`. `graph`: the difference of the sent graphs;
    `parameters`: its changes of values of actions; `subgraphs`: the names of graphs inside that
    differ. `because`: an event that explains the first difference of the runs, rather than any
    difference of the graphs; null if unknown."""

    a: views.RunSummary
    b: views.RunSummary
    same_graph: bool
    same_engine: bool
    graph: Difference
    parameters: list[ActionChange]
    subgraphs: list[str]
    steps: list[ComparedVisit]
    left_out: int
    parting: Parting | None
    because: PartingCause | None = None
    text: str

    def __post_init__(self) -> None:
        hold_names(self, "text")


class SentTree(msgspec.Struct, frozen=True):
    """A graph that was sent, the digests of the graphs inside by name, and the script of a
    simulated run."""

    umrf: str
    inside: Mapping[str, str] = {}
    script: str = ""


def compare(a: Run, b: Run, sent_a: SentTree, sent_b: SentTree) -> RunComparison:
    """Compare two runs, which may be of different graphs. `sent_a`, `sent_b`: the graphs that were
    sent for them."""
    graph_b = _graph(sent_b.umrf)
    graph_a, identities = aligned(_graph(sent_a.umrf), graph_b)
    graph = difference((0, graph_a), (0, graph_b))
    action_pairs = _pairs(a, b, identities)
    begun = sorted(
        _steps(a, b, action_pairs, MissedVisits(a, b)), key=lambda step: _begun(step, a, b)
    )
    steps = _own_first(_inner_first(begun))
    parts = (step for step in steps if _parts(step))
    parting = next((_parting(step, a, b, action_pairs) for step in parts), None)
    inside = _changed_inside(sent_a.inside, sent_b.inside)
    led_otherwise = parting is not None and _led_otherwise(parting.step, graph_a, graph_b, inside)
    because = _because(parting, (a, sent_a), (b, sent_b), action_pairs, led_otherwise=led_otherwise)
    return RunComparison(
        a=views.summary(a),
        b=views.summary(b),
        same_graph=a.digest == b.digest,
        same_engine=a.engine == b.engine,
        graph=graph,
        parameters=[change for change in graph.actions if _of_values(change)],
        subgraphs=inside,
        steps=steps[:_MOST],
        left_out=max(0, len(steps) - _MOST),
        parting=parting,
        because=because,
        text=_verdict(a, b, steps, parting),
    )


def _graph(umrf: str) -> Graph:
    try:
        return codec.read(umrf.encode()).graph
    except codec.Unreadable:  # only an imported run: those started here were readable
        return Graph(name="")


def aligned(a: Graph, b: Graph) -> tuple[Graph, dict[Key, Key]]:
    """Return graph `a` with the keys of `b` for each action that is the same in both; and the
    replaced keys, as new keys by old ones.

    An action is the same by its key; else by its full name; else by its name, type and parameters,
    if each graph has only one such action. Keys change when actions are removed and put back, or a
    file is imported again.
    """
    same = {each.key: each.key for each in b.actions if each.key in {one.key for one in a.actions}}
    for says in (_called, _described):
        left_a = _alone_by(says, (each for each in a.actions if each.key not in same))
        left_b = _alone_by(says, (each for each in b.actions if each.key not in same.values()))
        same |= {left_a[what]: left_b[what] for what in left_a.keys() & left_b.keys()}
    changed = {old: new for old, new in same.items() if old != new}
    taken = {each.key for each in b.actions} - set(same.values())
    if not changed or taken & {each.key for each in a.actions if each.key not in same}:
        return a, changed
    actions = tuple(replace(each, key=changed.get(each.key, each.key)) for each in a.actions)
    relations = tuple(
        replace(
            each,
            parent=changed.get(each.parent, each.parent),
            child=changed.get(each.child, each.child),
        )
        for each in a.relations
    )
    return replace(a, actions=actions, relations=relations), changed


def _called(action: Action) -> tuple[object, ...]:
    return (action.full_name,)


def _described(action: Action) -> tuple[object, ...]:
    return action.name, action.type, action.inputs, action.outputs


def _alone_by(
    says: Callable[[Action], tuple[object, ...]], actions: Iterable[Action]
) -> dict[tuple[object, ...], Key]:
    """Return the keys of actions by the description that `says` gives each of them; only
    descriptions that exactly one action has."""
    found: dict[tuple[object, ...], list[Key]] = {}
    for each in actions:
        found.setdefault(says(each), []).append(each.key)
    return {what: keys[0] for what, keys in found.items() if len(keys) == 1}


def _changed_inside(a: Mapping[str, str], b: Mapping[str, str]) -> list[str]:
    """Return the names of sub-graphs whose digests (by name, in `a` and `b`) differ, or that one
    run lacks; empty if one run was stored without its sub-graphs, as older versions did."""
    if not a or not b:
        return []
    return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))


class MissedVisits:
    """Knows for which actions of two runs visits may have been missed. For these it is unknown
    which visits correspond, and a missing visit may have happened."""

    def __init__(self, a: Run, b: Run) -> None:
        self._a, self._b = _MissedVisitsOfRun(a), _MissedVisitsOfRun(b)

    def relation(self, pair: "_ActionPair", seen: Relation) -> Relation:
        """Return `seen`, the relation of the visits of one action in both runs, or "unknown" if
        missed visits may explain it."""
        in_a = self._a.may_miss(pair.a, pair.place)
        in_b = self._b.may_miss(pair.b, pair.place)
        unsure = (
            (seen == "only_a" and in_b)
            or (seen == "only_b" and in_a)
            or (seen == "result" and (in_a or in_b))
        )
        return "unknown" if unsure else seen


class _MissedVisitsOfRun:
    def __init__(self, run: Run) -> None:
        self._names = {name for name, count in visit_counts(run).items() if count.at_least}
        self._by_looks = any(each.by for each in run.actions.values())

    def may_miss(self, name: str | None, place: LevelPlace) -> bool:
        """Return whether visits of this action may have been missed. `name`: None if the run lacks
        the action; then return whether all of the sub-graph around its `place` may have been
        missed."""
        return name in self._names if name is not None else bool(place.levels) and self._by_looks


def _steps(
    a: Run, b: Run, action_pairs: Sequence["_ActionPair"], missed: MissedVisits
) -> Iterator[ComparedVisit]:
    for pair in action_pairs:
        left, right = pair.of(a, b)
        visits_a, visits_b = _visits(left), _visits(right)
        words_a = views.words_for(a.said.get(pair.a or "", ()))
        words_b = views.words_for(b.said.get(pair.b or "", ()))
        answers_a = answers_by_visit(a.answers.get(pair.a or "", ()))
        answers_b = answers_by_visit(b.answers.get(pair.b or "", ()))
        for number in sorted(visits_a.keys() | visits_b.keys()):
            one, other = visits_a.get(number), visits_b.get(number)
            yield ComparedVisit(
                action=pair.action,
                levels=pair.place.levels,
                name=pair.place.name,
                aid=(right or left or ActionRun()).aid,
                visit=number,
                a=views.visit_view(
                    one,
                    _robot(left),
                    words_a.get(number, msgspec.UNSET),
                    answers_a.get(number, msgspec.UNSET),
                )
                if one
                else None,
                b=views.visit_view(
                    other,
                    _robot(right),
                    words_b.get(number, msgspec.UNSET),
                    answers_b.get(number, msgspec.UNSET),
                )
                if other
                else None,
                relation=missed.relation(pair, _relation(one, other)),
                slower=_slower(one, other),
            )


class _ActionPair(msgspec.Struct, frozen=True):
    """One action by its name in each run (None if that run lacks it), and its place, in the second
    run if possible."""

    a: str | None
    b: str | None
    place: LevelPlace

    @property
    def action(self) -> str:
        return self.b or self.a or ""

    def of(self, a: Run, b: Run) -> tuple[ActionRun | None, ActionRun | None]:
        return a.actions.get(self.a or ""), b.actions.get(self.b or "")


def _pairs(a: Run, b: Run, identities: Mapping[Key, Key]) -> list[_ActionPair]:
    """Return the actions of both runs in pairs: top-level actions by key, so that renamed ones
    match; inner actions by their names below the outermost action. `identities`: keys of `b` by
    the keys of the same actions in `a`."""
    in_a, in_b = places_of(a), places_of(b)
    same = {_identity(a, name, place, identities): name for name, place in in_a.items()}
    found = {name: same.get(_identity(b, name, place, {})) for name, place in in_b.items()}
    matched = set(found.values())
    named = {place.way: name for name, place in in_a.items() if name not in matched}
    found |= {name: named.get(in_b[name].way) for name, twin in found.items() if twin is None}
    taken = set(found.values())
    return [
        *(_ActionPair(twin, name, in_b[name]) for name, twin in found.items()),
        *(_ActionPair(name, None, place) for name, place in in_a.items() if name not in taken),
    ]


def _identity(
    run: Run, name: str, place: LevelPlace, identities: Mapping[Key, Key]
) -> tuple[str, ...]:
    """Return what makes the action `name` the same in all runs: the key of the outermost action
    around it, or its own, and the names below. `identities`: keys to use instead of others, as
    `aligned` returns."""
    first, *below = place.way
    outermost = run.actions.get(first if below else name)
    aid = outermost.aid if outermost is not None else None
    return (identities.get(aid, aid) if aid else first, *below)


def _visits(action: ActionRun | None) -> Mapping[int, Visit]:
    if action is None:
        return {}
    return {action.older + place: visit for place, visit in enumerate(action.visits, 1)}


def _robot(action: ActionRun | None) -> str:
    return "" if action is None else action.robot


def _relation(a: Visit | None, b: Visit | None) -> Relation:
    if a is None:
        return "only_b"
    if b is None:
        return "only_a"
    if a.result is not None and b.result is not None:
        return "same" if a.result == b.result else "result"
    return "unknown" if (a.until is None) == (b.until is None) else "end"


def _slower(a: Visit | None, b: Visit | None) -> Literal["a", "b"] | None:
    if a is None or b is None or a.until is None or b.until is None:
        return None
    if _longer(a, b):
        return "a"
    return "b" if _longer(b, a) else None


def _longer(one: Visit, other: Visit) -> bool:
    most = other.most
    return most is not None and one.least >= max(_SLOWER * most, most + _NOTABLE_US)


def _begun(step: ComparedVisit, a: Run, b: Run) -> tuple[float, str, int]:
    """Return the sort key of a visit: the seconds from the start of its run until it began (the
    smaller number of both runs `a` and `b`), its action and number."""
    moments = [
        (shown.start - views.time(run.started_at or run.requested_at)).total_seconds()
        for shown, run in ((step.a, a), (step.b, b))
        if shown is not None
    ]
    return (min(moments), step.action, step.visit)


def _parts(step: ComparedVisit) -> bool:
    return step.relation in {"result", "only_a", "only_b"}


def _inner_first(steps: list[ComparedVisit]) -> list[ComparedVisit]:
    """Return the steps in an order in which a visit with a different result comes after the visit
    inside of it that explains this result."""
    within: dict[tuple[str, ...], list[ComparedVisit]] = {}
    for step in filter(_parts, steps):
        for depth in range(len(step.levels)):
            within.setdefault(step.levels[: depth + 1], []).append(step)
    ordered: list[ComparedVisit] = []
    held: list[ComparedVisit] = []
    for step in steps:
        inner = within.get((*step.levels, step.name), ())
        if step.relation == "result" and any(_is_inside(each, step) for each in inner):
            held.append(step)
            continue
        ordered.append(step)
        if _parts(step):
            around = [each for each in held if _is_inside(step, each)]
            ordered += reversed(around)
            held = [each for each in held if each not in around]
    return ordered + held


def _is_inside(step: ComparedVisit, other: ComparedVisit) -> bool:
    """Return whether the visit `step` may have run during the visit `other`."""
    way = (*other.levels, other.name)
    pairs = ((step.a, other.a), (step.b, other.b))
    return step.levels[: len(way)] == way and any(
        inner is not None
        and outer is not None
        and inner.start >= outer.not_before
        and (outer.not_after is None or inner.not_before <= outer.not_after)
        for inner, outer in pairs
    )


def _own_first(steps: list[ComparedVisit]) -> list[ComparedVisit]:
    """Return the steps, in their order except in one case: if each run continued with an action
    that the other lacks, the first visit of run `b` comes before that of run `a`. Their order is
    chance, and the page shows the graph of `b`."""
    first = next((at for at, step in enumerate(steps) if _parts(step)), None)
    if first is None or steps[first].relation != "only_a":
        return steps
    for at, step in enumerate(steps[first + 1 :], first + 1):
        if step.a is not None and step.b is not None:
            return steps
        if step.relation == "only_b":
            return [*steps[:first], step, *steps[first:at], *steps[at + 1 :]]
    return steps


def _parting(step: ComparedVisit, a: Run, b: Run, action_pairs: Sequence[_ActionPair]) -> Parting:
    one, other = next(pair for pair in action_pairs if pair.action == step.action).of(a, b)
    said_a, said_b = _said(one, step.a), _said(other, step.b)
    text = f"{_named(step)}: {_outcome_text(step.a, a)}, {_outcome_text(step.b, b)}."
    return Parting(step=step, text=text, messages_a=said_a, messages_b=said_b)


#: Alarms that may be behind an action that did not run, or did not end as in the other run.
_ALARMS: Final = frozenset(
    {"engine_restarted", "engine_gone", "foreign_stop", "foreign_start", "foreign_pause"}
    | {"foreign_resume", "foreign_modify", "stalled"}
)


def _because(
    parting: Parting | None,
    a: tuple[Run, SentTree],
    b: tuple[Run, SentTree],
    action_pairs: Sequence[_ActionPair],
    *,
    led_otherwise: bool,
) -> PartingCause | None:
    """Return the event that explains the first difference of two runs, or None: commands of people
    first, then alarms, then scripts of the simulator. `a`, `b`: each run with the graph that was
    sent. Without such a visit (`parting` is None) the event explains the different ends. For a
    visit of only one run, the event must be of the other run; no event does if the graphs lead to
    the action in different ways (`led_otherwise`)."""
    step = parting.step if parting is not None else None
    if step is None and a[0].end == b[0].end:
        return None
    sides = [(b[0], step.b if step else None), (a[0], step.a if step else None)]
    both = step is None or (step.a is not None and step.b is not None)
    for found in (_operators, _troubles):
        for run, shown in sides:
            for cause in found(run):
                lacking = shown is None and not led_otherwise
                may_explain = both or lacking or _changes_graph(cause)
                if may_explain and _explains(cause.at, run, shown):
                    return _happened(
                        str(cause.__struct_config__.tag), run, cause_sentence(cause, run)
                    )
    if step is None or step.levels or not both:
        return None
    pair = next(pair for pair in action_pairs if pair.action == step.action)
    scripted = [_scripted(sent, name) for (_, sent), name in ((a, pair.a), (b, pair.b))]
    if scripted[0] == scripted[1]:
        return None
    run = b[0] if scripted[1] is not None else a[0]
    return _happened("script", run, f"The script of the simulator says what {step.name} did.")


def _changes_graph(cause: Cause) -> bool:
    """Return whether a cause is a change of the graph during a run."""
    return isinstance(cause, OperatorChange) or (
        isinstance(cause, ForeignCause) and cause.command == "modify"
    )


def _led_otherwise(step: ComparedVisit, a: Graph, b: Graph, inside: Sequence[str]) -> bool:
    """Return whether graph `a` leads to the action of the visit `step` by other arrows than graph
    `b`, or one graph lacks it. `inside`: names of sub-graphs that differ."""
    if step.levels:
        return any(level.rpartition("_")[0] in inside for level in step.levels)
    return _arrows_to(step, a) != _arrows_to(step, b)


def _arrows_to(step: ComparedVisit, graph: Graph) -> frozenset[tuple[object, ...]] | None:
    if all(each.key != step.aid for each in graph.actions):
        return None
    return frozenset(
        (each.parent, each.conditions, each.required)
        for each in graph.relations
        if each.child == step.aid
    )


def _operators(run: Run) -> Iterator[Cause]:
    yield from operator(run)


def _troubles(run: Run) -> Iterator[Cause]:
    """Yield the causes of a run that are alarms or silence; alarms that later events contradict are
    not among them."""
    moments = {each.at for each in run.alarms if each.code in _ALARMS}
    for cause in causes(run, None):
        if isinstance(cause, Silence) or (not isinstance(cause, OPERATOR) and cause.at in moments):
            yield cause


def _explains(at: int, run: Run, shown: views.VisitShown | None) -> bool:
    """Return whether an event at the time `at` can explain a visit of its run, or the absence of
    one (`shown` None). A visit with an own result ended by itself."""
    if shown is None:
        return run.ended_at is None or at <= run.ended_at
    if shown.result in {"true", "false"}:
        return False
    return shown.not_after is None or views.time(at) <= shown.not_after


def _happened(kind: str, run: Run, text: str) -> PartingCause:
    said = text.removesuffix(".")
    if said.startswith(("Somebody", "The ", "What ")):
        said = said[0].lower() + said[1:]
    return PartingCause(kind=kind, run=run.number, text=f"in run {run.number} {said}")


def _scripted(sent: SentTree, name: str | None) -> object:
    """Return what the script of a simulated run says about the action `name`, as JSON data; None if
    it says nothing."""
    script = parse_small(sent.script) if sent.script else None
    says = script.get("behaviours") if isinstance(script, dict) else None
    if not isinstance(says, dict) or name is None:
        return None
    said: object = says.get(name, says.get("*"))
    return said


def _named(step: ComparedVisit) -> str:
    action = INTO.join((*step.levels, step.name))
    return action if step.visit == 1 else f"visit {step.visit} of {action}"


def _outcome_text(shown: views.VisitShown | None, run: Run) -> str:
    where = f"in run {run.number}"
    if shown is None:
        return f"never run {where}"
    if shown.until is None:
        goes = "still going on" if run.end is None else "no end seen"
        return f"{goes} {where}"
    if shown.said is not msgspec.UNSET and shown.result is not None:
        return f"{shown.result} {where}, by the word of {shown.said.by.name}"
    match shown.result:
        case None:
            return f"ended with an unknown result {where}"
        case "error":
            return f"error {where}"
        case "stopped":
            return f"stopped {where}"
        case _:
            return f"{shown.result} {where}"


def _said(action: ActionRun | None, shown: views.VisitShown | None) -> list[str]:
    """Return the messages of an action during the visit `shown`, or right after it; none if either
    is None."""
    if action is None or shown is None:
        return []
    until = shown.not_after
    return [
        each.text
        for each in action.messages
        if views.time(each.at) >= shown.not_before
        and (until is None or views.time(each.at) <= until)
    ]


def _of_values(change: ActionChange) -> bool:
    return any(field.field.startswith(("in/", "out/")) for field in change.fields)


def _verdict(a: Run, b: Run, steps: list[ComparedVisit], parting: Parting | None) -> str:
    if parting is not None:
        same = steps.index(parting.step)
        lead = "From the first step on they differ" if not same else f"{_count(same)} alike; then"
        return f"{lead}: {parting.text}" if not same else f"{lead} {parting.text}"
    if not steps:
        return "Nothing was seen of either run."
    if a.end is None or b.end is None:
        return "No difference so far."
    if any(step.relation == "end" for step in steps):
        return (
            "No difference is proven: of some visits no end was seen in one of the runs, so that "
            "their results are not known."
        )
    if any(step.relation == "unknown" for step in steps):
        return "No difference was seen, but some results are not known, or some visits may have been missed."
    different = _different_values(a, b)
    if different:
        return f"Every visit ended the same, with {different} at the start."
    return "Every visit ended the same."


def _different_values(a: Run, b: Run) -> str:
    """Return in words how many values of their starts differ; "" if none does."""
    places = {
        (action, name) for run in (a, b) for action, given in run.values.items() for name in given
    }
    count = sum(
        a.values.get(action, {}).get(name) != b.values.get(action, {}).get(name)
        for action, name in places
    )
    return "" if not count else "1 different value" if count == 1 else f"{count} different values"


def _count(steps: int) -> str:
    return "1 step was" if steps == 1 else f"{steps} steps were"
