"""A led run takes the course of its whole graph, also where actions stand for graphs."""

import random
from collections import defaultdict
from collections.abc import Iterable, Mapping
from contextlib import ExitStack, asynccontextmanager, suppress
from typing import Any

import anyio
import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.observations import NodeResult
from action_assistant.runner.links.port import Order, Registration, Report, Transitions
from action_assistant.runner.links.simulator import SimulatorLink
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import PieceEnded
from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, WordRequest
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    OUTCOMES,
    Action,
    Conditions,
    Graph,
    Relation,
)
from action_assistant.umrf.semantics import Behaviour, Engine, GraphRefused, Script
from runner.execution.test_conducted_courses import (
    ACCEPTED,
    LedRobot,
    Seen,
    as_long_as_seen,
    as_seen,
    course_of,
    drawn,
    is_near,
    played,
)
from runner.harness import (
    ANN,
    BEN,
    MemoryJournal,
    at_once,
    clock_us,
    order,
    run_in_virtual_time,
)
from support.doses import examples

_ACTORS = {"A": "Ann", "B": "Bob", "C": "Cy"}


def inner_graph(chance: random.Random, place: int) -> Graph:
    """Two or three actions in a row or beside each other, which mostly go on after any outcome."""
    count, in_row = chance.choice([2, 2, 3]), chance.random() < 0.7
    actions = tuple(Action(key=f"in{place}{n}", name=f"In{place}{n}") for n in range(count))
    relations = [
        Relation(parent=ENTRY, child=each.key, conditions=ENTRY_CONDITIONS)
        for each in (actions[:1] if in_row else actions)
    ]
    for number, each in enumerate(actions):
        answers: dict[str, Any] = {
            outcome: chance.choice(["run"] * 7 + ["ignore"]) for outcome in OUTCOMES
        }
        relations.append(
            Relation(
                parent=each.key,
                child=actions[number + 1].key if in_row and number + 1 < count else EXIT,
                conditions=Conditions(**answers),
                required=chance.random() < 0.6,
                parent_order=number,
                child_order=number,
            )
        )
    return Graph(name=f"Sub{place}", actions=actions, relations=tuple(relations))


def nested(seed: int) -> tuple[Graph, dict[str, list[Behaviour]], dict[str, Graph]]:
    """A graph with one or two sub-graphs, what each call of its actions does, and the sub-graphs. An
    action inside does the same in each visit of its sub-graph."""
    graph, calls = drawn(seed)
    chance = random.Random(f"nested {seed}")
    inside: dict[str, Graph] = {}
    actions = list(graph.actions)
    for place in chance.sample(range(len(actions)), chance.choice([1, 1, 2])):
        inner = inner_graph(chance, place)
        inside[inner.name] = inner
        actions[place] = msgspec.structs.replace(actions[place], name=inner.name)
        calls[f"{inner.name}_0"] = calls.pop(f"Do{place}_0")
        for each in inner.actions:
            behaviour = Behaviour(
                after_s=round(chance.uniform(0.3, 3), 3) + 0.0071 * len(calls),
                result=chance.choice(["on_true", "on_true", "on_false", "on_error"]),
                stop_s=0.05,
            )
            calls[each.full_name] = [behaviour]
    return msgspec.structs.replace(graph, actions=tuple(actions)), calls, inside


class NestedRobot(LedRobot):
    """A robot whose engine tells what a sub-graph has really ended with."""

    def __init__(
        self, calls: Mapping[str, list[Behaviour]], counted: dict[str, int], seed: int
    ) -> None:
        super().__init__(calls, counted, seed)
        inner = {name: tuple(each) for name, each in calls.items() if name.startswith("In")}
        link = SimulatorLink(Engine(facts=PINNED, script=Script(inner)), clock_us=clock_us)
        self.engine = link
        self.graphs: dict[str, str] = {}  # pieces that are sub-graphs, by the name of their graph
        self.listening = ExitStack()
        self.listening.enter_context(link.listen(self._hear))

    async def _begin(self, order: Order) -> None:
        if not order.inside:
            await super()._begin(order)
            return
        self.graphs[order.graph.name] = order.run
        self._began[order.run] = anyio.current_time()
        await self.engine.start(order)

    def _hear(self, report: Report) -> None:
        for each in report.changes if isinstance(report, Transitions) else ():
            if isinstance(each, NodeResult) and each.graph in self.graphs:
                self.meant[self.graphs[each.graph]] = each.result


def meant(robots: Iterable[NestedRobot], piece: str) -> str:
    """What the code of a piece has really ended with; "" while it has not."""
    return next((each.meant[piece] for each in robots if piece in each.meant), "")


async def answered(control: ExecutionService, run: str, robots: Iterable[NestedRobot]) -> bool:
    """Say what the code did where a run asks for an outcome, and let it go on; return whether it was
    held."""
    now = control.open[run].run if run in control.open else None
    if now is None or now.held is None:
        return False
    for node in [name for name, each in now.actions.items() if each.piece]:
        found = meant(robots, now.actions[node].piece).removeprefix("on_")
        if found in {"true", "false", "error"}:
            with suppress(Conflict):  # it is known already
                await control.give_outcome(run, WordRequest(node, found, "I saw it."), BEN)  # type: ignore[arg-type]
    with suppress(Conflict):  # nothing can lead it any more
        await control.go_on(run, GoOnRequest(time(now.held.at)), BEN)
    return True


async def stopped(control: ExecutionService, robots: Mapping[str, NestedRobot]) -> None:
    """Stop everything. Somebody sees the rest of what failed while a stop was on its way, and of what
    may be loading."""
    control.stop_all(BEN)
    await anyio.sleep(20)
    for piece in [each for each in control.open.values() if each.run.piece is not None]:
        if piece.run.doubt:
            for name in (piece.run.graph_name, *piece.run.parts):
                assert not await robots[piece.run.engine].moving(name), piece.run
            confirm_rest(piece, RestRequest("I stand beside it."), BEN)
    await anyio.sleep(2)


@asynccontextmanager
async def runner(robots: Mapping[str, NestedRobot], journal: MemoryJournal, seen: Seen) -> Any:
    """A runner that may lead these robots."""
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
        yield control
        engines.cancel_scope.cancel()


def request_of(graph: Graph, inside: Mapping[str, Graph]) -> Any:
    """The start of a graph on three robots."""
    return order(
        graph,
        engine="conducted",
        robots={actor: _ACTORS[actor] for actor in {each.actor for each in graph.actions}},
        lost="wait",
        override=ACCEPTED,
        subgraphs=tuple(
            SentSubgraph(
                name=name, digest=digest(each), umrf=msgspec.Raw(codec.write(each).encode())
            )
            for name, each in inside.items()
        ),
    )


async def led_through(seed: int) -> str:
    """Lead a random graph with sub-graphs on three robots; return what was compared."""
    graph, calls, inside = nested(seed)
    try:
        _, engine = played(graph, calls)
    except GraphRefused:
        return "refused"
    if engine.crashed or engine.locked:
        return "an engine would abort"
    counted: dict[str, int] = defaultdict(int)
    robots = {name: NestedRobot(calls, counted, seed) for name in _ACTORS.values()}
    seen, journal, asked = Seen(), MemoryJournal(), False
    async with runner(robots, journal, seen) as control:
        try:
            run = (await control.start(request_of(graph, inside), ANN)).run.id
        except Refused:
            return "not offered"
        with suppress(TimeoutError), anyio.fail_after(100):
            while run in control.open:
                await anyio.sleep(0.5)
                asked = await answered(control, run, robots.values()) or asked
        course, over = as_seen(seen.course), run not in control.open
        for each in journal.told(run):
            if isinstance(each, PieceEnded) and each.how == "shape":
                is_true = each.outcome in {"on_stopped", meant(robots.values(), each.piece)}
                assert is_true, (seed, each)
        if not over:
            await stopped(control, robots)
            assert run not in control.open, (seed, control.open[run].run)
        for robot in robots.values():
            sent = [each.run for each in robot.starts]
            names = [each.graph.name for each in robot.starts if each.inside]
            assert len(sent) == len(set(sent)), seed
            assert len(names) == len(set(names)), seed
    if not over:
        return "goes on for ever"
    if asked:
        return "asked"
    whole, results = course_of(played(graph, calls | as_long_as_seen(course, calls))[0])
    if any(visit[2] == "on_stopped" for visits in course.values() for visit in visits):
        return "stopped by an arrow"
    ends = [visit[1] for visits in course.values() for visit in visits if visit[1] is not None]
    if len(set(ends)) < len(ends):  # which came first only the robots know
        return "two ends at one moment"
    assert is_near(whole, course), (seed, whole, course)
    assert results == seen.results, (seed, results, seen.results)
    return "same"


@pytest.mark.timeout(0)
@settings(max_examples=examples(40), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**32))
def test_a_led_graph_with_sub_graphs_takes_its_own_course(seed: int) -> None:
    run_in_virtual_time(lambda: led_through(seed))
