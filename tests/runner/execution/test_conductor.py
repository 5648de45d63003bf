"""A run on several robots, led by the runner: what each robot is sent, when, and what ends it."""

import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, NotFound, Refused
from action_assistant.runner.analysis import exports, statistics
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import EngineChanged, ForeignCommand, Registration
from action_assistant.runner.links.simulator import SimulatorLink, in_this_process
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.views import RobotRestShown, run_view, time
from action_assistant.runner.start.admission import GoOnRequest, WordRequest
from action_assistant.runner.start.rights_registry import IdentityNow, unchanged
from action_assistant.umrf.model import Graph
from runner.harness import (
    ANN,
    BEN,
    Harness,
    Robot,
    clock_us,
    ended,
    engine,
    order,
    run_in_virtual_time,
    sequence,
    stand_still,
    two_ends,
    two_lines,
    until,
    virtual,
)


def shared(graph: Graph, *actors: str) -> Graph:
    """The graph with its actions given to these actors in turn."""
    actions = tuple(
        msgspec.structs.replace(each, actor=actors[number % len(actors)])
        for number, each in enumerate(graph.actions)
    )
    return msgspec.structs.replace(graph, actions=actions)


class Lab:
    """Two robots that may be led."""

    def __init__(self, script: dict[str, Any] | None = None) -> None:
        self.david = Robot(engine(script), random.Random(1))
        self.carol = Robot(engine(script), random.Random(2))
        self.harness = Harness({"David": self.david, "Carol": self.carol})

    @asynccontextmanager
    async def runner(self, now: IdentityNow = unchanged) -> AsyncIterator[ExecutionService]:
        """A runner whose robots may be led, with their engines running. `now`: who was ended."""
        async with self.harness.runner(now) as control, anyio.create_task_group() as engines:
            engines.start_soon(self.david.engine.run)
            engines.start_soon(self.carol.engine.run)
            for name in ("David", "Carol"):
                control.robots.add(Registration(name=name, led=True))
            await anyio.sleep(1)
            yield control
            engines.cancel_scope.cancel()

    async def led_run(
        self, control: ExecutionService, *, actions: int = 2, lost: str = "stop"
    ) -> str:
        """Start a run whose actions alternate between the robots; return its id once the first one
        is seen moving."""
        graph = shared(sequence("task", actions), "Scout", "Carrier")
        run = (await control.start(led(graph, lost=lost), ANN)).run.id
        history = self.harness.journal.history
        await until(lambda: history(run).actions["Work_0"].state == "RUNNING")
        return run


def led(graph: Graph, **more: Any) -> Any:
    """A start of a led run in which Scout is David and Carrier is Carol."""
    robots = {"Scout": "David", "Carrier": "Carol"}
    return order(graph, engine="conducted", robots=robots, **more)


@virtual
async def test_each_robot_gets_its_own_actions_one_after_the_other() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        started = await control.start(led(shared(sequence("task", 3), "Scout", "Carrier")), ANN)
        run = started.run.id
        assert await ended(control, run) == "finished"
        found = lab.harness.journal.history(run)
        assert [each.graph.name for each in lab.david.starts] == ["task--Work_0", "task--Work_2"]
        assert [each.graph.name for each in lab.carol.starts] == ["task--Work_1"]
        assert found.result == "on_true"
        times = [found.actions[f"Work_{n}"].visits[-1] for n in range(3)]
        assert [each.result for each in times] == ["true", "true", "true"]
        assert times[0].not_after <= times[1].start <= times[2].start
        assert all(each.state == "FINISHED" for each in found.actions.values())
        shown = run_view(found).actions
        assert [shown[f"Work_{n}"].visits[-1].robot for n in range(3)] == [
            "David",
            "Carol",
            "David",
        ]


@virtual
async def test_a_stop_reaches_the_robot_that_moves_and_lets_nothing_further_begin() -> None:
    lab = Lab({"*": [{"never": True, "stop_s": 0.5}]})
    async with lab.runner() as control:
        started = await control.start(led(shared(sequence("task", 3), "Scout", "Carrier")), ANN)
        run = started.run.id
        await until(lambda: lab.harness.journal.history(run).actions["Work_0"].state == "RUNNING")
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert not await lab.david.moving("task--Work_0")
        assert lab.carol.starts == []
        assert [name for _, name in lab.david.stops] == ["task--Work_0"] * len(lab.david.stops)


@virtual
async def test_a_silent_robot_holds_the_run_until_a_person_lets_it_go_on() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        graph = shared(sequence("task", 4), "Scout", "Carrier")
        run = (await control.start(led(graph, lost="wait"), ANN)).run.id
        await until(lambda: bool(lab.david.starts))
        lab.carol.silent = True
        await anyio.sleep(20)
        lab.carol.silent = False
        await anyio.sleep(20)
        found = control.open[run].run
        assert found.held is not None
        assert "Carol" in found.held.why
        assert found.state == "running"
        assert lab.carol.starts == []
        await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert len(lab.carol.starts) == 2


@pytest.mark.parametrize("slow", ["get", "journal"])
@pytest.mark.parametrize("tenths", range(3, 40, 4))
def test_a_runner_that_stood_still_holds_its_run_and_blames_nobody(tenths: int, slow: str) -> None:
    async def main() -> None:
        lab = Lab({"*": [{"after_s": 0.4}]})
        if slow == "get":  # it takes so long that it is often under way
            lab.david.old = lab.carol.old = 0.4
        else:
            lab.harness.journal.slow = 0.2
        async with lab.runner() as control:
            graph = shared(sequence("task", 60), "Scout", "Carrier")
            run = (await control.start(led(graph, lost="stop"), ANN)).run.id
            await anyio.sleep(1 + tenths / 10)
            stand_still(4 + tenths % 3)
            await until(lambda: control.open[run].run.held is not None, 10)
            sent = len(lab.david.starts) + len(lab.carol.starts)
            await anyio.sleep(10)
            found = control.open[run].run
            assert found.held is not None
            assert "stood still" in found.held.why
            assert (found.desired, found.alarms) == ("running", ())
            assert len(lab.david.starts) + len(lab.carol.starts) == sent
            await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
            await until(lambda: len(lab.david.starts) + len(lab.carol.starts) > sent + 1, 20)

    run_in_virtual_time(main)


@virtual
async def test_a_silent_robot_stops_everything_where_the_starter_chose_that() -> None:
    lab = Lab({"*": [{"after_s": 30}]})
    async with lab.runner() as control:
        run = (
            await control.start(led(shared(sequence("task", 4), "Scout", "Carrier")), ANN)
        ).run.id
        await until(lambda: bool(lab.david.starts))
        lab.david.silent = True
        await anyio.sleep(20)
        found = control.open[run].run
        assert found.state == "stopping"
        assert found.stopped_by is not None
        assert lab.david.stops
        lab.david.silent = False
        assert await ended(control, run) == "stopped"
        assert lab.carol.starts == []


@virtual
async def test_a_restarted_runner_follows_what_moves_and_begins_nothing_by_itself() -> None:
    lab = Lab({"*": [{"after_s": 8}]})
    graph = shared(sequence("task", 4), "Scout", "Carrier")
    async with lab.runner() as control:
        run = (await control.start(led(graph, lost="wait"), ANN)).run.id
        await until(lambda: bool(lab.carol.starts))
        await anyio.sleep(2)
    async with lab.runner() as control:
        await anyio.sleep(60)
        found = control.open[run].run
        assert found.held is not None
        assert found.actions["Work_1"].state == "FINISHED"
        assert found.actions["Work_1"].visits[-1].result == "true"
        assert len(lab.david.starts) == len(lab.carol.starts) == 1
        await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert [each.graph.name for each in lab.david.starts] == ["task--Work_0", "task--Work_2"]
        assert [each.graph.name for each in lab.carol.starts] == ["task--Work_1", "task--Work_3"]


@virtual
async def test_a_restarted_runner_goes_on_with_a_stop() -> None:
    lab = Lab({"*": [{"never": True, "stop_s": 3}]})
    graph = shared(sequence("task", 4), "Scout", "Carrier")
    async with lab.runner() as control:
        run = (await control.start(led(graph), ANN)).run.id
        await until(lambda: bool(lab.david.starts))
        await anyio.sleep(2)
        await control.stop(run, BEN)
        await anyio.sleep(0.05)
    async with lab.runner() as control:
        assert await ended(control, run) == "stopped"
        assert not await lab.david.moving("task--Work_0")
        assert lab.carol.starts == []


async def refused(control: ExecutionService, request: Any) -> str:
    """Return why a start is refused."""
    with pytest.raises(Refused) as why:
        await control.start(request, ANN)
    return why.value.detail


@virtual
async def test_a_start_that_cannot_be_led_is_refused_and_nothing_is_sent() -> None:
    lab = Lab()
    graph = shared(sequence("task", 3), "Scout", "Carrier")
    async with lab.runner() as control:
        none = order(graph, engine="conducted", robots={"Scout": "David"})
        assert "Carrier's actions" in await refused(control, none)
        more = {"Scout": "David", "Carrier": "Carol", "Ghost": "Carol"}
        assert "Ghost" in await refused(control, order(graph, engine="conducted", robots=more))
        control.robots.add(Registration(name="Carol"))
        assert "Led runs are off for Carol" in await refused(control, led(graph))
        assert lab.david.starts == lab.carol.starts == []


@virtual
async def test_two_steps_of_one_robot_at_once_have_to_be_accepted() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    graph = shared(two_ends("task"), "Scout")
    async with lab.runner() as control:
        robots = {"Scout": "David"}
        assert "at the same time" in await refused(
            control, order(graph, engine="conducted", robots=robots)
        )
        codes = ("two-at-once", "H12")
        request = order(
            graph, engine="conducted", robots=robots, override=Override(codes, "I look.")
        )
        run = (await control.start(request, ANN)).run.id
        await until(lambda: len(lab.david.starts) == 2)
        assert {each.code for each in control.open[run].run.despite} >= {"two-at-once"}
        assert await ended(control, run) == "finished"


@virtual
async def test_a_robot_is_kept_for_its_run_until_the_end() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        graph = shared(sequence("task", 3), "Scout", "Carrier")
        run = (await control.start(led(graph), ANN)).run.id
        assert "Carol is taken by run 1" in await refused(
            control, order(sequence("other"), engine="Carol")
        )
        assert "is taken by run 1" in await refused(control, led(graph))
        assert await ended(control, run) == "finished"
        other = await control.start(order(sequence("other"), engine="Carol"), ANN)
        assert await ended(control, other.run.id) == "finished"


@virtual
async def test_a_request_that_is_repeated_with_another_choice_is_another_start() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        request = led(shared(sequence("task", 2), "Scout", "Carrier"), lost="wait")
        run = (await control.start(request, ANN)).run.id
        assert (await control.start(request, ANN)).run.id == run
        other = msgspec.structs.replace(request, lost="stop")
        assert "belongs to another start" in await refused(control, other)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_stop_of_one_robot_stops_the_whole_run() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = (
            await control.start(led(shared(sequence("task", 3), "Scout", "Carrier")), ANN)
        ).run.id
        await until(lambda: bool(lab.david.starts))
        runs, _ = control.stop_robot("Carol", BEN)
        assert runs == [run]
        assert await ended(control, run) == "stopped"
        assert lab.carol.starts == []


@virtual
async def test_the_word_of_a_person_counts_once_rest_is_seen_and_is_not_called_observed() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        lab.david.engine = engine({"*": [{"after_s": 5}]})
        await until(lambda: bool(control.open[run].run.held))
        word = WordRequest(action="Work_0", outcome="true", reason="It stands at the door.")
        with pytest.raises(Conflict, match="not known to be at rest"):
            await control.give_outcome(run, word, BEN)
        piece = control.open[run].run.actions["Work_0"].piece
        await control.confirm_rest(piece, RestRequest("I stand beside it."), BEN)
        await until(lambda: "without an outcome" in control.open[run].run.alarms[-1].text)
        shown = run_view(control.open[run].run)
        assert [name for name, each in shown.actions.items() if each.asks] == ["Work_0"]
        assert [(each.robot, each.state, each.by) for each in rests_of(control.open[run].run)] == [
            ("Carol", "unused", None),
            ("David", "seen", BEN),
        ]
        earlier = msgspec.structs.replace(word, piece=f"{run}.0")
        with pytest.raises(Conflict, match="begun again") as stale:
            await control.give_outcome(run, earlier, BEN)
        assert stale.value.where == {"path": "/piece"}
        await control.give_outcome(run, msgspec.structs.replace(word, piece=piece), BEN)
        with pytest.raises(Conflict, match=r"known already|no outcome"):
            await control.give_outcome(run, WordRequest("Work_0", "false", "I looked, too."), ANN)
        await until(lambda: not run_view(control.open[run].run).actions["Work_0"].asks)
        held = control.open[run].run.held
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert await ended(control, run) == "finished"
        visit = lab.harness.journal.history(run).actions["Work_0"].visits[-1]
        assert (visit.result, visit.how) == ("true", "inferred")
        said = run_view(lab.harness.journal.history(run)).actions["Work_0"].visits[-1].said
        assert said is not msgspec.UNSET
        assert (said.by, said.reason) == (BEN, "It stands at the door.")
        lines = exports.intervals(lab.harness.journal.history(run)).decode().splitlines()
        assert [line.split(",")[-3:] for line in lines] == [
            ["robot", "said_by", "answered_by"],
            ["David", BEN.name, ""],
            ["Carol", "", ""],
        ]


def rests_of(run: Run) -> list[RobotRestShown]:
    """Return what a page is told of the rest of each robot of a run."""
    shown = run_view(run).rests
    assert shown is not msgspec.UNSET
    return shown


def rests(control: ExecutionService, run: str) -> dict[str, str]:
    """Return the state of the rest of each robot of an open run."""
    return {each.robot: each.state for each in rests_of(control.open[run].run)}


@virtual
async def test_the_rest_of_each_robot_is_told_apart_and_the_worst_is_never_hidden() -> None:
    lab = Lab({"*": [{"after_s": 30, "stop_s": 0.5}]})
    graph = shared(two_ends("task"), "Scout", "Carrier")
    async with lab.runner() as control:
        request = led(graph, lost="wait", override=Override(("H12",), "I look."))
        run = (await control.start(request, ANN)).run.id
        await until(lambda: bool(lab.david.starts) and bool(lab.carol.starts))
        assert rests(control, run) == {"Carol": "going", "David": "going"}
        lab.carol.silent = True
        await until(lambda: rests(control, run)["Carol"] == "silent")
        await control.stop(run, BEN)
        await until(lambda: rests(control, run)["David"] == "proven")
        (carol, david) = rests_of(control.open[run].run)
        assert (carol.state, carol.stops, carol.action) == ("silent", True, "Work_1")
        assert david.since is not None
        await anyio.sleep(20)
        assert rests(control, run) == {"Carol": "silent", "David": "proven"}
        lab.carol.silent = False
        assert await ended(control, run) == "stopped"
        found = lab.harness.journal.history(run)
        assert {each.state for each in rests_of(found)} == {"proven"}


@virtual
async def test_a_robot_that_was_given_nothing_is_called_neither_stopped_nor_moving() -> None:
    lab = Lab({"*": [{"never": True, "stop_s": 0.5}]})
    async with lab.runner() as control:
        run = await lab.led_run(control)
        assert rests(control, run) == {"Carol": "unused", "David": "going"}
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        shown = rests_of(lab.harness.journal.history(run))
        assert {each.robot: each.state for each in shown} == {"Carol": "unused", "David": "proven"}


@virtual
async def test_a_led_run_is_one_run_and_found_by_each_of_its_robots() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:

        async def found(**wanted: Any) -> list[str]:
            rows = await control.history.rows(queries.listed(queries.Filter(**wanted), 10))
            return [row.id for row in rows]

        run = await lab.led_run(control)
        assert await found() == await found(text="arol") == [run]
        assert await ended(control, run) == "finished"
        other = await control.start(order(sequence("other"), engine="Carol"), ANN)
        assert await ended(control, other.run.id) == "finished"
        assert await found(engine="David") == [run]
        assert await found(engine="Carol") == [other.run.id, run]
        assert await found(engine="Carol", graph="task") == await found(engine="conducted") == [run]
        assert await found(engine="Dave") == []
        assert await found(text="avid") == [run]
        stored = await control.history.rows(statistics.runs_of("task", "David", 10))
        assert [row.id for row in stored] == [run]


class Dying:
    """Makes the engines that lead a run: each dies when it is told to, and a further one needs
    `begins_s` seconds until it is where the run is."""

    def __init__(self, begins_s: float = 0.0) -> None:
        self.begins_s = begins_s
        self.made: list[SimulatorLink] = []

    def __call__(self, *facts: Any, **more: Any) -> SimulatorLink:
        """Return the next engine."""
        made = in_this_process(*facts, **more)
        take_up = made.take_up

        async def late(*what: Any) -> None:
            await anyio.sleep(self.begins_s)
            await take_up(*what)

        made.take_up = late  # type: ignore[method-assign]
        self.made.append(made)
        return made

    def die(self) -> None:
        """Let the newest one die, as the process of an engine does."""
        dead, why = self.made[-1], "It was killed."
        dead._dead = why
        dead._subscribers.tell(EngineChanged(at=clock_us(), state="gone", why=why))


@virtual
async def test_a_run_can_be_stopped_when_nothing_leads_it_any_more() -> None:
    lab, engines = Lab({"*": [{"after_s": 60, "stop_s": 1}]}), Dying()
    lab.harness.simulator = engines
    async with lab.runner() as control:
        run = await lab.led_run(control, actions=3, lost="wait")
        for _ in range(5):
            engines.die()
            await anyio.sleep(2)
        found = control.open[run].run
        assert found.state == "running"
        assert found.held is not None
        with pytest.raises(Conflict, match="only Stop"):
            await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        await control.stop(run, BEN)
        await anyio.sleep(0.5)
        assert control.open[run].run.state == "stopping"
        assert await ended(control, run) == "stopped"
        assert not await lab.david.moving("task--Work_0")
        assert lab.carol.starts == []


@virtual
async def test_an_action_that_ends_while_the_run_gets_another_engine_is_not_sent_again() -> None:
    lab, engines = Lab({"*": [{"after_s": 5}]}), Dying(begins_s=3)
    lab.harness.simulator = engines
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        await anyio.sleep(3)
        engines.die()
        await anyio.sleep(6)
        found = control.open[run].run
        assert found.actions["Work_0"].state == "FINISHED"
        assert found.unknown_since is None
        assert found.alarms == ()
        assert found.held is not None
        await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert [each.graph.name for each in lab.david.starts] == ["task--Work_0"]
        assert [each.graph.name for each in lab.carol.starts] == ["task--Work_1"]


@virtual
async def test_a_restarted_runner_shows_what_was_done_as_done() -> None:
    lab, engines = Lab({"*": [{"after_s": 3}]}), Dying(begins_s=2)
    lab.harness.simulator = engines
    graph = shared(sequence("task", 3), "Scout", "Carrier")
    async with lab.runner() as control:
        run = (await control.start(led(graph, lost="wait"), ANN)).run.id
        await until(lambda: bool(lab.carol.starts))
        await anyio.sleep(1)
    async with lab.runner() as control:
        await anyio.sleep(10)
        found = lab.harness.journal.history(run)
        assert found.actions["Work_0"].state == "FINISHED"
        assert found.actions["Work_0"].visits[-1].result == "true"
        assert found.alarms == ()
        assert found.lost == ""
        assert found.held is not None
        await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert len(lab.david.starts) == 2


@virtual
async def test_a_run_is_not_at_rest_by_word_while_a_robot_may_move_in_it() -> None:
    lab, engines = Lab({"*": [{"after_s": 60}]}), Dying(begins_s=20)
    lab.harness.simulator = engines
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        engines.die()
        await anyio.sleep(10)
        assert control.open[run].run.state == "unknown"
        with pytest.raises(Conflict, match="David may still be moving"):
            await control.confirm_rest(run, RestRequest("I stand beside it."), BEN)
        assert control.open[run].run.end is None
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert not await lab.david.moving("task--Work_0")


@virtual
async def test_a_piece_whose_robot_is_lost_is_stopped_with_its_run() -> None:
    lab = Lab({"*": [{"after_s": 60}]})
    async with lab.runner() as control:
        run = await lab.led_run(control)
        lab.david.engine = engine({"*": [{"after_s": 60}]})
        await until(lambda: control.open[run].run.desired == "stopped")
        await anyio.sleep(1)
        piece = control.open[control.open[run].run.actions["Work_0"].piece]
        assert piece.run.lost
        assert piece.run.desired == "stopped"
        assert piece.run == lab.harness.journal.history(piece.run.id)


@virtual
async def test_a_stop_reaches_a_piece_that_moves_again() -> None:
    lab = Lab({"*": [{"after_s": 100}]})
    async with lab.runner() as control:
        graph = shared(sequence("task", 2), "Scout", "Carrier")
        run = (await control.start(led(graph, lost="wait"), ANN)).run.id
        await until(lambda: bool(lab.carol.starts), 200)
        await anyio.sleep(5)
        await lab.david.engine.start(lab.david.starts[0])
        await until(lambda: control.open[run].run.held is not None)
        assert await lab.david.moving("task--Work_0")
        assert rests(control, run)["David"] == "going"
        await control.stop(run, BEN)
        with anyio.fail_after(20):
            assert await ended(control, run) == "stopped"
        assert not await lab.david.moving("task--Work_0")
        found = await control.find(run)
        assert found.held is None
        assert {each.state for each in rests_of(found)} == {"proven"}


@virtual
async def test_a_run_is_not_proven_where_only_a_person_has_seen_a_robot_at_rest() -> None:
    lab = Lab({"*": [{"after_s": 60}]})
    async with lab.runner() as control:
        run = await lab.led_run(control)
        lab.david.engine = engine({"*": [{"after_s": 60}]})
        await until(lambda: control.open[run].run.desired == "stopped")
        await anyio.sleep(1)
        piece = control.open[run].run.actions["Work_0"].piece
        await control.confirm_rest(piece, RestRequest("I stand beside it."), BEN)
        assert await ended(control, run) == "error"
        found = lab.harness.journal.history(run)
        assert found.proof_at is None
        assert found.at_rest is not None
        assert found.at_rest.by == BEN
        assert found.actions["Work_0"].visits[-1].how == "inferred"


def alarms(run: Run, code: str) -> list[str]:
    """Return the texts of a run's alarms with this code."""
    return [each.text for each in run.alarms if each.code == code]


async def forked(lab: Lab, control: ExecutionService) -> str:
    """Start a run with a step on each robot at once, both of which wait for a further one."""
    request = led(shared(two_lines("task"), "Scout", "Carrier"), lost="wait")
    return (await control.start(request, ANN)).run.id


@virtual
async def test_a_run_does_not_go_on_while_one_of_its_robots_is_silent() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = await forked(lab, control)
        await until(lambda: bool(lab.david.starts and lab.carol.starts))
        lab.carol.silent = True
        await until(lambda: control.open[run].run.held is not None, 4.5)
        await anyio.sleep(10)
        held = control.open[run].run.held
        assert held is not None
        with pytest.raises(Conflict, match="Carol: it has not answered"):
            await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert control.open[run].run.held == held
        assert len(lab.david.starts) == 1
        lab.carol.silent = False
        await anyio.sleep(20)
        assert len(lab.david.starts) == 1
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert await ended(control, run) == "finished"


@virtual
async def test_each_silence_of_a_robot_is_one_alarm() -> None:
    lab = Lab({"*": [{"after_s": 60}]})
    async with lab.runner() as control:
        run = await forked(lab, control)
        held = None
        await until(lambda: bool(lab.david.starts and lab.carol.starts))
        for silences in (1, 2):
            lab.carol.silent = True
            await anyio.sleep(12)
            held = control.open[run].run.held
            assert held is not None
            with pytest.raises(Conflict):
                await control.go_on(run, GoOnRequest(time(held.at)), BEN)
            await anyio.sleep(5)
            assert len(alarms(control.open[run].run, "led_silent")) == silences
            lab.carol.silent = False
            await anyio.sleep(3)
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_command_of_others_holds_a_run_once() -> None:
    lab = Lab({"*": [{"after_s": 20}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, lost="wait")
        lab.david.subscribers.tell(
            ForeignCommand(at=clock_us(), command="start", graph="theirs", targets=("David",))
        )
        await until(lambda: control.open[run].run.held is not None)
        held = control.open[run].run.held
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert len(alarms(lab.harness.journal.history(run), "led_foreign_other")) == 1


@virtual
async def test_orders_to_a_piece_that_has_ended_are_answered_with_the_reason() -> None:
    lab = Lab({"*": [{"after_s": 3}]})
    async with lab.runner() as control:
        run = await lab.led_run(control, actions=3)
        piece = f"{run}.1"
        with pytest.raises(Conflict, match="stopped, not paused"):
            await control.pause(piece, BEN)
        await until(lambda: piece not in control.open)
        rest = RestRequest("I stand beside it.")
        for asked in (control.confirm_rest(piece, rest, BEN), control.resume(piece, BEN)):
            with pytest.raises(Conflict, match=f"part of run {run} .* is over: finished"):
                await asked
        assert not await control.simulates(piece)
        assert await control.stop(piece, BEN) == [run]
        assert await ended(control, run) == "stopped"
        assert await control.stop(piece, BEN) == []
        with pytest.raises(NotFound):
            await control.stop(f"{run}.9", BEN)
