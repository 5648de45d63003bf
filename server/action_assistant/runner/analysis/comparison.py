"""Two runs side by side: what was sent, where they ran, and the first visit in which they part."""

from collections.abc import Iterator, Mapping
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.runner.runs import views
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import ActionRun, Visit
from action_assistant.umrf.difference import ActionChange, Difference, difference
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph

_MOST: Final = 2_000  # steps in an answer
_SLOWER: Final = 1.5  # times as long
_NOTABLE_US: Final = 500_000  # and this much longer

#: How the two visits of one step relate. `unknown`: a result is not known. `end`: one has ended, and of
#: the other no end was seen.
Relation: TypeAlias = Literal["same", "result", "only_a", "only_b", "unknown", "end"]


class ComparedVisit(msgspec.Struct, frozen=True, kw_only=True):
    """The `visit`-th visit (from 1) of an action in both runs. `slower` names the run in which it
    took notably longer, whatever of its bounds is true."""

    action: str
    aid: str | None
    visit: int
    a: views.VisitShown | None
    b: views.VisitShown | None
    relation: Relation
    slower: Literal["a", "b"] | None = None


class Parting(msgspec.Struct, frozen=True, kw_only=True):
    """The earliest step in which the runs differ, in a sentence, with what the action said."""

    step: ComparedVisit
    text: str
    messages_a: list[str]
    messages_b: list[str]


class RunComparison(msgspec.Struct, frozen=True, kw_only=True):
    """Run `a` against run `b`. `graph` is the difference of what was sent; `parameters` those of its
    changes that touch the values of actions."""

    a: views.RunSummary
    b: views.RunSummary
    same_graph: bool
    same_engine: bool
    graph: Difference
    parameters: list[ActionChange]
    steps: list[ComparedVisit]
    left_out: int
    parting: Parting | None
    text: str


def compare(a: Run, b: Run, umrf_a: str, umrf_b: str) -> RunComparison:
    """Compare two runs that may be of different graphs. Total."""
    graph = difference((0, _graph(umrf_a)), (0, _graph(umrf_b)))
    steps = _own_first(sorted(_steps(a, b), key=lambda step: _begun(step, a, b)))
    parting = next((_parting(step, a, b) for step in steps if _parts(step)), None)
    return RunComparison(
        a=views.summary(a),
        b=views.summary(b),
        same_graph=a.digest == b.digest,
        same_engine=a.engine == b.engine,
        graph=graph,
        parameters=[change for change in graph.actions if _of_values(change)],
        steps=steps[:_MOST],
        left_out=max(0, len(steps) - _MOST),
        parting=parting,
        text=_verdict(a, b, steps, parting),
    )


def _graph(umrf: str) -> Graph:
    try:
        return codec.read(umrf.encode()).graph
    except (
        codec.Unreadable
    ):  # a run of ours was readable when it began; an import may not have been
        return Graph(name="")


def _steps(a: Run, b: Run) -> Iterator[ComparedVisit]:
    pairs = _pairs(a, b)
    for name, (left, right) in pairs.items():
        visits_a, visits_b = _visits(left), _visits(right)
        for number in sorted(visits_a.keys() | visits_b.keys()):
            one, other = visits_a.get(number), visits_b.get(number)
            yield ComparedVisit(
                action=name,
                aid=(right or left or ActionRun()).aid,
                visit=number,
                a=views.visit(one) if one else None,
                b=views.visit(other) if other else None,
                relation=_relation(one, other),
                slower=_slower(one, other),
            )


def _pairs(a: Run, b: Run) -> dict[str, tuple[ActionRun | None, ActionRun | None]]:
    """Actions of both runs, by identity where they have one, so that a renamed action is the same.
    Sub-graphs' actions have none: their names count."""
    by_aid = {action.aid: name for name, action in a.actions.items() if action.aid}
    pairs: dict[str, tuple[ActionRun | None, ActionRun | None]] = {}
    taken: set[str] = set()
    for name, action in b.actions.items():
        twin = by_aid.get(action.aid, name) if action.aid else name
        pairs[name] = (a.actions.get(twin), action)
        taken.add(twin)
    for name, action in a.actions.items():
        if name not in taken:
            pairs[name] = (action, None)
    return pairs


def _visits(action: ActionRun | None) -> Mapping[int, Visit]:
    if action is None:
        return {}
    return {action.older + place: visit for place, visit in enumerate(action.visits, 1)}


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
    """When a step had begun, counted from the start of its run; the earlier of the two."""
    moments = [
        (shown.start - views.time(run.started_at or run.requested_at)).total_seconds()
        for shown, run in ((step.a, a), (step.b, b))
        if shown is not None
    ]
    return (min(moments), step.action, step.visit)


def _parts(step: ComparedVisit) -> bool:
    return step.relation in {"result", "only_a", "only_b"}


def _own_first(steps: list[ComparedVisit]) -> list[ComparedVisit]:
    """Where each run went on by an action that the other lacks, that of this run, `b`, comes first:
    which of them began earlier is chance, and only its own stand in its graph."""
    first = next((at for at, step in enumerate(steps) if _parts(step)), None)
    if first is None or steps[first].relation != "only_a":
        return steps
    for at, step in enumerate(steps[first + 1 :], first + 1):
        if step.a is not None and step.b is not None:
            return steps
        if step.relation == "only_b":
            return [*steps[:first], step, *steps[first:at], *steps[at + 1 :]]
    return steps


def _parting(step: ComparedVisit, a: Run, b: Run) -> Parting:
    said_a, said_b = _said(step, step.a, a), _said(step, step.b, b)
    text = f"{_named(step)}: {_did(step.a, a)}, {_did(step.b, b)}."
    return Parting(step=step, text=text, messages_a=said_a, messages_b=said_b)


def _named(step: ComparedVisit) -> str:
    return step.action if step.visit == 1 else f"visit {step.visit} of {step.action}"


def _did(shown: views.VisitShown | None, run: Run) -> str:
    where = f"in run {run.number}"
    if shown is None:
        return f"never run {where}"
    if shown.until is None:
        goes = "still going on" if run.end is None else "no end seen"
        return f"{goes} {where}"
    match shown.result:
        case None:
            return f"ended with an unknown result {where}"
        case "error":
            return f"error {where}"
        case "stopped":
            return f"stopped {where}"
        case _:
            return f"{shown.result} {where}"


def _said(step: ComparedVisit, shown: views.VisitShown | None, run: Run) -> list[str]:
    """What the action said during that visit, or right after it."""
    action = run.actions.get(step.action)
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
        return "No difference was seen, but some results are not known."
    return "Every visit ended the same."


def _count(steps: int) -> str:
    return "1 step was" if steps == 1 else f"{steps} steps were"
