"""A led run takes the course of its whole graph: random graphs, on robots that lose messages."""

import json
import random
from collections import defaultdict
from collections.abc import Iterable, Mapping
from contextlib import ExitStack, suppress
from typing import Any

import anyio
import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.errors import Refused
from action_assistant.runner.execution.conducted_steps import CONDUCTED_FACTS
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.observations import GraphResult, NodeResult, NodeState
from action_assistant.runner.links.port import Answer, Order, Registration, Report, Transitions
from action_assistant.runner.links.simulator import SimulatorLink, in_this_process
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Override, PieceEnded, RunEvent
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import keeper, value_arrows
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    OUTCOMES,
    Action,
    Conditions,
    Graph,
    Parameter,
    Relation,
    Remap,
)
from action_assistant.umrf.semantics import (
    Behaviour,
    Engine,
    GraphRefused,
    GraphResultEvent,
    NodeResultEvent,
    NodeStateEvent,
    Script,
    Trace,
)
from action_assistant.umrf.semantics.parts import Node, Running
from action_assistant.umrf.semantics.values import MISSING, slots_of
from runner.harness import (
    ANN,
    BEN,
    MemoryJournal,
    Robot,
    at_once,
    clock_us,
    order,
    run_in_virtual_time,
)
from support.doses import examples

#: By action: its visits in order, each with its begin and end in ms, and its outcome.
Course = dict[str, list[tuple[float, float | None, str | None]]]
#: By action: the values that it had at the begin of each visit.
Taken = dict[str, list[dict[str, Any]]]
ACCEPTED = Override(("two-at-once", "stop-across"), "They are far apart.")
_MOST = 600  # events of a course that is compared
_ACTORS = {"A": "Ann", "B": "Bob", "C": "Cy"}


def drawn(seed: int) -> tuple[Graph, dict[str, list[Behaviour]]]:
    """A graph of several actors, and what each call of its actions does."""
    chance = random.Random(seed)
    count = chance.randint(3, 7)
    actors = ["A", "B", "C"][: chance.randint(2, 3)]
    actions = tuple(
        Action(key=f"aid{number}", name=f"Do{number}", actor=chance.choice(actors))
        for number in range(count)
    )
    relations = [Relation(parent=ENTRY, child="aid0", conditions=ENTRY_CONDITIONS)]

    def arrow(parent: int, child: int, *, back: bool = False) -> None:
        kinds = ["run", "run", "run", "ignore"]
        if not back and chance.random() < 0.25:
            kinds.append("stop")
        answers: dict[str, Any] = {each: chance.choice(kinds) for each in OUTCOMES}
        answers["on_stopped"] = chance.choice(["ignore", "ignore", "run"])
        if set(answers.values()) == {"ignore"}:
            answers["on_true"] = "run"
        required = False if back else chance.random() < 0.6
        relations.append(
            Relation(
                parent=f"aid{parent}",
                child=f"aid{child}",
                conditions=Conditions(**answers),
                required=required,
                parent_order=len(relations),
                child_order=len(relations),
            )
        )

    for child in range(1, count):
        for parent in chance.sample(range(child), min(child, chance.choice([1, 1, 2]))):
            arrow(parent, child)
    if chance.random() < 0.4:
        last = chance.randrange(1, count)
        first = chance.randrange(0, last)
        if not any((r.parent, r.child) == (f"aid{last}", f"aid{first}") for r in relations):
            arrow(last, first, back=True)
    parents = {each.parent for each in relations}
    leaves = [each.key for each in actions if each.key not in parents] or [actions[-1].key]
    for key in leaves:
        answers = {each: chance.choice(["run", "run", "ignore"]) for each in OUTCOMES}
        relations.append(
            Relation(
                parent=key,
                child=EXIT,
                conditions=Conditions(**answers),
                required=chance.random() < 0.7,
                parent_order=len(relations),
                child_order=len(relations),
            )
        )
    outcomes = ["on_true", "on_false"] * 3 + ["on_error"]
    calls = {
        f"Do{number}_0": [
            Behaviour(
                after_s=round(chance.uniform(0.3, 5), 3) + number * 0.0137,
                result=chance.choice(outcomes),
                stop_s=0.05,
            )
            for _ in range(6)
        ]
        for number in range(count)
    }
    return Graph(name="g", actions=actions, relations=tuple(relations)), calls


_KINDS = {
    "string": "text",
    "number": "count",
    "bool": "flag",
    "strings": "texts",
    "numbers": "counts",
}


def with_values(
    graph: Graph, calls: dict[str, list[Behaviour]], seed: int
) -> tuple[Graph, dict[str, list[Behaviour]]]:
    """The graph with values that its actions hand on: each visit gives others, and some give none."""
    chance = random.Random(f"values of {seed}")
    names = [(kind, f"{name}{n}") for kind, name in _KINDS.items() for n in range(2)]
    outputs = {each.key: chance.sample(names, chance.randint(0, 6)) for each in graph.actions}
    inputs = {each.key: chance.sample(names, chance.randint(0, 6)) for each in graph.actions}

    def leaf(kind: str, *, own: bool) -> str:
        wants: dict[str, Any] = {"pvf_type": kind}
        if own and chance.random() < 0.5:
            wants["pvf_value"] = _value(chance, kind)
        elif own and chance.random() < 0.97:
            wants["pvf_required"] = False
        return json.dumps(wants)

    actions = tuple(
        msgspec.structs.replace(
            each,
            inputs=tuple(Parameter(name, leaf(kind, own=True)) for kind, name in inputs[each.key]),
            outputs=tuple(
                Parameter(name, leaf(kind, own=False)) for kind, name in outputs[each.key]
            ),
        )
        for each in graph.actions
    )
    relations: list[Relation] = []
    for each in graph.relations:
        given, taken = outputs.get(each.parent, []), inputs.get(each.child, [])
        pairs = [(a, b) for kind, a in given for other, b in taken if kind == other and a != b]
        if pairs and chance.random() < 0.3:
            source, target = chance.choice(pairs)
            each = msgspec.structs.replace(each, remap=(Remap(source, target),))
        relations.append(each)
    graph = msgspec.structs.replace(graph, actions=actions, relations=tuple(relations))
    handed = {
        each.parent for each, _ in value_arrows(graph)
    }  # else only the exit takes it, unread on false
    told = {
        f"{each.name}_0": [
            msgspec.structs.replace(
                call,
                outputs={
                    name: MISSING
                    if each.key in handed and chance.random() < 0.1
                    else _value(chance, kind)
                    for kind, name in outputs[each.key]
                },
            )
            for call in calls[f"{each.name}_0"]
        ]
        for each in graph.actions
    }
    return graph, told


def _value(chance: random.Random, kind: str) -> Any:
    match kind:
        case "string":
            return f'{chance.random()} "ä'
        case "number":
            return chance.choice([0.1, -3.0, 2e300]) * chance.randint(1, 9)
        case "bool":
            return chance.random() < 0.5
        case _:
            return [_value(chance, kind[:-1]) for _ in range(chance.randint(0, 3))]


class Noting(Engine):
    """Writes down with which values its actions begin."""

    def __init__(self, **more: Any) -> None:
        super().__init__(**more)
        self.taken: Taken = defaultdict(list)

    def _begin(self, graph: Running, node: Node) -> None:
        self.taken[node.full_name].append(
            {name: slot.value for name, slot in node.inputs.items() if slot.has_value()}
        )
        super()._begin(graph, node)


class LedRobot(Robot):
    """A robot whose actions do something else at each visit, and that has the values package."""

    def __init__(
        self, calls: Mapping[str, list[Behaviour]], counted: dict[str, int], seed: int
    ) -> None:
        link = SimulatorLink(Engine(facts=PINNED, script=Script({})), clock_us=clock_us)
        super().__init__(link, random.Random(seed))
        self.calls = calls
        self.counted = counted
        self.meant: dict[str, str] = {}  # by piece
        self.gives: dict[str, dict[str, Any]] = {}  # likewise
        self.taken: Taken = defaultdict(list)
        self.known: tuple[str, ...] = ()

    async def get(self) -> Answer:
        """The answer, with what is indexed."""
        return msgspec.structs.replace(await super().get(), known_actions=self.known)

    async def _begin(self, order: Order) -> None:
        (node,) = order.graph.actions
        visit = self.counted[node]
        self.counted[node] += 1
        behaviour = self.calls[node][min(visit, 5)]
        self.meant[order.run] = behaviour.result
        self.gives[order.run] = dict(behaviour.outputs or {})
        slots = slots_of(codec.read(order.umrf).graph.actions[0].inputs)
        self.taken[node].append(
            {name: slot.value for name, slot in slots.items() if slot.has_value()}
        )
        self.engine._engine.script.behaviours[f"{order.graph.name}/{node}"] = (behaviour,)
        await super()._begin(order)


def course_of(traces: list[Trace]) -> tuple[Course, list[str]]:
    """The course that traces show, and the result of the graph."""
    found: Course = defaultdict(list)
    for each in traces:
        match each:
            case NodeStateEvent(graph="g", state="RUNNING"):
                found[each.node].append((each.t_ms, None, None))
            case NodeResultEvent(graph="g") if found[each.node]:
                began = found[each.node][-1][0]
                found[each.node][-1] = began, each.t_ms, each.result
            case _:
                pass
    ends = [
        each.value for each in traces if isinstance(each, GraphResultEvent) and each.graph == "g"
    ]
    return {name: visits for name, visits in found.items() if visits}, ends


def played(graph: Graph, calls: Mapping[str, Any]) -> tuple[list[Trace], Noting]:
    """The whole graph on one engine that has all actors."""
    engine = Noting(facts=CONDUCTED_FACTS, script=Script({k: tuple(v) for k, v in calls.items()}))
    traces = engine.start(graph, 0.0)
    while len(traces) < _MOST and not engine.crashed:
        due = engine.due
        if due is None or due > 200_000:
            break
        traces += engine.advance(due)
    return traces, engine


class Seen:
    """Records the course of the engine of the whole graph while its run is led."""

    def __init__(self) -> None:
        self.course: Course = defaultdict(list)
        self.results: list[str] = []
        self.listening = ExitStack()

    def made(self, *args: Any, **more: Any) -> SimulatorLink:
        """Make the engine, as the runner asks for it."""
        link = in_this_process(*args, **more)
        self.listening.enter_context(link.listen(self.hear))
        return link

    def hear(self, report: Report) -> None:
        """Note what it shows."""
        for each in report.changes if isinstance(report, Transitions) else ():
            match each:
                case NodeState(state="RUNNING"):
                    self.course[each.node].append((float(each.at), None, None))
                case NodeResult() if self.course[each.node]:
                    self.course[each.node][-1] = (
                        self.course[each.node][-1][0],
                        float(each.at),
                        each.result,
                    )
                case GraphResult():
                    self.results.append(each.result)
                case _:
                    pass


def as_seen(course: Course) -> Course:
    """The course in ms after its start."""
    began = min(visits[0][0] for visits in course.values())
    return {
        name: [
            ((a - began) / 1000, None if b is None else (b - began) / 1000, result)
            for a, b, result in visits
        ]
        for name, visits in course.items()
    }


def is_near(one: Course, other: Course) -> bool:
    """Return whether two courses are the same to 2 ms."""
    if one.keys() != other.keys():
        return False
    return all(
        len(one[name]) == len(other[name])
        and all(
            a[2] == b[2] and abs(a[0] - b[0]) <= 2 and abs((a[1] or 0) - (b[1] or 0)) <= 2
            for a, b in zip(one[name], other[name], strict=True)
        )
        for name in one
    )


def as_long_as_seen(
    course: Course, calls: Mapping[str, list[Behaviour]]
) -> dict[str, list[Behaviour]]:
    """Actions that take as long, and end as, they were seen to in a course. `calls`: what they give."""
    durations: dict[str, list[Behaviour]] = {}
    for name, visits in course.items():
        durations[name] = [
            Behaviour(after_s=(b - a) / 1000, result=result, outputs=calls[name][min(n, 5)].outputs)  # type: ignore[arg-type]
            if b is not None and result != "on_stopped"
            else Behaviour(never=True, stop_s=((b or a) - a) / 1000)
            for n, (a, b, result) in enumerate(visits)
        ] + [Behaviour(never=True)]
    return durations


def check_outcomes(seed: int, told: list[RunEvent], robots: Iterable[LedRobot]) -> None:
    """The outcomes are those of the code."""
    for each in told:
        if isinstance(each, PieceEnded) and each.outcome != "on_stopped":
            meant = [robot.meant[each.piece] for robot in robots if each.piece in robot.meant]
            assert meant == [each.outcome], (seed, each)


def check_values(seed: int, sent: list[Taken], whole: Taken) -> None:
    """Each piece was sent the values with which its action begins in the whole graph. `sent`: by robot."""
    for name, visits in whole.items():  # the last one may be over before it was sent
        taken = next((each[name] for each in sent if name in each), [])
        assert taken == visits[: len(taken)], (seed, name, taken, visits)
        assert len(visits) - len(taken) <= 1, (seed, name, taken, visits)


async def led_through(seed: int, *, values: bool = False) -> str:
    """Lead a random graph on three robots; return what was compared. `values`: its actions hand some
    on."""
    graph, calls = with_values(*drawn(seed), seed) if values else drawn(seed)
    try:
        _, engine = played(graph, calls)
    except GraphRefused:
        return "refused"
    if engine.crashed or engine.locked:
        return "an engine would abort"
    counted: dict[str, int] = defaultdict(int)
    robots = {name: LedRobot(calls, counted, seed) for name in _ACTORS.values()}
    for robot in robots.values():
        robot.blind = 0.03
        robot.known = tuple(map(codec.write_action, (*graph.actions, keeper()))) if values else ()
    seen, journal = Seen(), MemoryJournal()
    async with (
        ExecutionService.opened(
            journal, Robots(robots), clock_us=clock_us, run_in_worker=at_once, simulator=seen.made
        ) as control,
        anyio.create_task_group() as engines,
    ):
        for name, robot in robots.items():
            engines.start_soon(robot.engine.run)
            control.robots.add(Registration(name=name, led=True))
        await anyio.sleep(1)
        actors = {each.actor for each in graph.actions}
        request = order(
            graph,
            engine="conducted",
            robots={actor: _ACTORS[actor] for actor in actors},
            lost="wait",
            override=ACCEPTED,
        )
        try:
            run = (await control.start(request, ANN)).run.id
        except Refused:
            engines.cancel_scope.cancel()
            return "not offered"
        with suppress(TimeoutError), anyio.fail_after(100):
            while run in control.open:  # noqa: ASYNC110 - its end has many causes
                await anyio.sleep(0.5)
        course = as_seen(seen.course)
        over = run not in control.open
        check_outcomes(seed, journal.told(run), robots.values())
        if not over:
            control.stop_all(BEN)
            await anyio.sleep(20)
            for piece in [each for each in control.open.values() if each.run.piece is not None]:
                if piece.run.unconfirmed:  # it failed while a stop was on its way
                    assert not await robots[piece.run.engine].moving(piece.run.graph_name)
                    confirm_rest(piece, RestRequest("I stand beside it."), BEN)
            await anyio.sleep(2)
            assert run not in control.open, (seed, control.open[run].run)
        assert journal.history(run).held is None, (seed, journal.history(run).held)
        for robot in robots.values():
            sent = [each.run for each in robot.starts]
            assert len(sent) == len(set(sent)), seed
        engines.cancel_scope.cancel()
    if not over:
        return "goes on for ever"
    again, alone = played(graph, calls | as_long_as_seen(course, calls))
    whole, results = course_of(again)
    if any(visit[2] == "on_stopped" for visits in course.values() for visit in visits):
        return "stopped by an arrow"
    ends = [visit[1] for visits in course.values() for visit in visits if visit[1] is not None]
    if len(set(ends)) < len(ends):  # which came first only the robots know
        return "two ends at one moment"
    assert is_near(whole, course), (seed, whole, course)
    assert results == seen.results, (seed, results, seen.results)
    check_values(seed, [robot.taken for robot in robots.values()], alone.taken)
    return "same"


def test_a_run_is_over_only_when_the_outcome_of_its_last_piece_is_told() -> None:
    run_in_virtual_time(lambda: led_through(218111301))


def test_a_run_whose_graph_ends_every_engine_can_be_stopped() -> None:
    run_in_virtual_time(lambda: led_through(10075))


@pytest.mark.timeout(0)
@settings(max_examples=examples(40), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32))
def test_a_led_graph_takes_its_own_course(seed: int) -> None:
    run_in_virtual_time(lambda: led_through(seed))


@pytest.mark.timeout(0)
@settings(max_examples=examples(25), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32))
def test_values_arrive_as_in_the_whole_graph(seed: int) -> None:
    run_in_virtual_time(lambda: led_through(seed, values=True))
