"""Robots are registered, watched and recorded; a start is looked at before anything leaves."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, NotFound, Refused
from action_assistant.runner.api.live import Hub
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import (
    Candidate,
    EngineRefused,
    NotSent,
    Order,
    Registration,
)
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import Commanded, EngineBecame, StopWasProven
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import EngineSaid, Override
from action_assistant.runner.start.preflight import Preflight
from action_assistant.runner.start.start_checks import GroupRequest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from runner.harness import ANN, BEN, Harness, at_once, clock_us, order, sequence, until, virtual
from runner.registered_robots import Open, RegisteredRobots, given

NEVER = {"*": [{"never": True}]}


@asynccontextmanager
async def fleet(harness: Harness, **robots: Open) -> AsyncIterator[ExecutionService]:
    """A runner that knows these robots, after they have answered for the first time."""
    reach = Robots(reach=RegisteredRobots(**robots))
    async with ExecutionService.opened(
        harness.ledger, reach, clock_us=clock_us, run_in_worker=at_once
    ) as control:
        for name in robots:
            await control.register(Registration(name=name), ANN)
        await until(lambda: all(control.robots.robot(name).heard_at for name in robots))
        yield control


def group(graph: Graph, *engines: str, **fields: object) -> GroupRequest:
    asked = order(graph)
    request = GroupRequest(
        version="v1", digest=asked.digest, umrf=asked.umrf, engines=engines, request_id="g"
    )
    return msgspec.structs.replace(request, **fields)


def verdicts(look: Preflight) -> dict[str, str]:
    return {item.code: item.verdict for item in look.items}


# --- the registry -----------------------------------------------------------------------------


@virtual
async def test_a_robot_that_answers_says_so_and_what_it_has() -> None:
    async with fleet(Harness(), David=Open()) as control:
        robot = control.robots.robot("David")
        assert (robot.state, robot.why, robot.actions, robot.servers) == ("answering", "", 1, 1)
        index = await control.robots.index("David")
        assert list(index.actions) == ["Work"]


@virtual
async def test_each_beat_tells_when_an_idle_robot_answered_although_nothing_has_changed() -> None:
    async with fleet(Harness(), David=Open()) as control:
        hub = Hub(control, clock_us)
        changes: list[None] = []
        control.watch_robots(lambda: changes.append(None))
        first = msgspec.json.decode(hub.beat())["heard"]["David"]
        await anyio.sleep(15)
        assert msgspec.json.decode(hub.beat())["heard"]["David"] > first
        assert changes == []


@virtual
async def test_somebody_who_joins_the_domain_is_shown_without_a_word_of_the_engine() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        told: list[int] = []
        control.watch_robots(lambda: told.append(control.robots.robot("David").others))
        david.others = 1
        await until(lambda: told == [1], patience=2)


@virtual
async def test_a_robot_that_falls_silent_is_busy_and_one_that_left_is_gone() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        david.silent = True
        await until(lambda: control.robots.robot("David").state == "busy")
        assert "does not answer" in control.robots.robot("David").why
        david.become("gone", "Nobody answers there.")
        assert control.robots.robot("David").state == "gone"
        david.silent = False
        david.become("answering", "")
        await until(lambda: control.robots.robot("David").state == "answering")
        told = [event for _, event in await control.robots.robot_log.newest("David", 99)]
    states = [event.state for event in told if isinstance(event, EngineBecame)]
    assert states.index("busy") < states.index("gone")
    assert states[-1] == "answering"


@virtual
async def test_an_engine_that_came_back_is_called_restarted() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        david.engine = Open().engine
        await until(lambda: control.robots.robot("David").state == "restarted")
        assert control.robots.robot("David").restarted_at is not None


@virtual
async def test_a_changed_profile_makes_another_link_and_a_removed_robot_is_unknown() -> None:
    reach = RegisteredRobots(David=Open())
    async with ExecutionService.opened(
        Harness().ledger, Robots(reach=reach), clock_us=clock_us, run_in_worker=at_once
    ) as control:
        await control.register(Registration(name="David"), ANN)
        await control.register(Registration(name="David", profile={"pauses_safely": True}), ANN)
        assert reach.facts["David"].pauses_safely
        await control.remove("David", ANN)
        with pytest.raises(NotFound):
            control.robots.robot("David")


@pytest.mark.parametrize(
    ("registration", "path"),
    [
        (Registration(name="Da vid"), "/name"),
        (Registration(name="David", get_service="a b"), "/get_service"),
        (Registration(name="David", profile={"wings": 2}), "/profile/wings"),
    ],
)
def test_what_cannot_be_registered_is_refused_with_its_place(
    registration: Registration, path: str
) -> None:
    @virtual
    async def asked() -> None:
        async with fleet(Harness()) as control:
            with pytest.raises(BadInput) as refused:
                await control.register(registration, ANN)
            assert refused.value.where == {"path": path}

    asked()


@virtual
async def test_a_robot_with_a_run_is_neither_changed_nor_forgotten() -> None:
    async with fleet(Harness(), David=Open(NEVER)) as control:
        await control.start(order(sequence(), engine="David"), ANN)
        with pytest.raises(Conflict, match="stop it first"):
            await control.remove("David", ANN)
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_registered_robots_are_known_after_a_restart_and_removed_ones_are_not() -> None:
    harness = Harness()
    async with fleet(harness, David=Open(), Eve=Open()) as control:
        await control.remove("Eve", ANN)
    again = Robots(reach=RegisteredRobots(David=Open()))
    async with ExecutionService.opened(
        harness.ledger, again, clock_us=clock_us, run_in_worker=at_once
    ) as control:
        assert [robot.name for robot in control.robots.all()] == ["simulator", "David"]


@virtual
async def test_candidates_are_those_that_nobody_registered() -> None:
    reach = RegisteredRobots(David=Open())
    seen = Candidate(domain=0, rmw="x", get_service="/umrf_graph_get")
    other = Candidate(domain=3, rmw="x", get_service="/eve/umrf_graph_get", actor="Eve")
    reach.sight = (seen, other)
    async with ExecutionService.opened(
        Harness().ledger, Robots(reach=reach), clock_us=clock_us, run_in_worker=at_once
    ) as control:
        assert await control.robots.candidates() == (seen, other)
        await control.register(Registration(name="David"), ANN)
        assert await control.robots.candidates() == (other,)


# --- the look before a start ------------------------------------------------------------------


@virtual
async def test_a_sound_robot_passes_every_item_and_the_look_sends_nothing() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        asked = group(sequence(), "David", digest="")
        (look,) = await control.look(asked)
        assert set(verdicts(look).values()) == {"passed"}
        assert (look.override, look.never) == ((), False)
        assert look.digest == order(sequence()).digest
    assert david.starts == []


@pytest.mark.parametrize(
    ("code", "overridable"),
    [("answers", False), ("proof", True), ("actions", True), ("others", True), ("actors", True)],
)
def test_what_stands_in_the_way_is_shown_and_refused_alike(code: str, *, overridable: bool) -> None:
    @virtual
    async def asked() -> None:
        david, graph = Open(), sequence()
        async with fleet(Harness(), David=david) as control:
            match code:
                case "answers":
                    david.silent = True
                case "proof":
                    david.servers = 2
                case "actions":
                    graph = given(graph, "colour")
                case "others":
                    david.others = 1
                case _:
                    actor = msgspec.structs.replace(graph.actions[0], actor="Eve")
                    graph = msgspec.structs.replace(graph, actions=(actor, *graph.actions[1:]))
            (look,) = await control.look(group(graph, "David"))
            assert [item for item, verdict in verdicts(look).items() if verdict == "blocked"] == [
                code
            ]
            assert look.never is not overridable
            with pytest.raises(Refused) as refused:
                await control.start(order(graph, engine="David"), ANN)
            assert (refused.value.where or {})["item"] == code
            assert david.starts == []
            if overridable:
                override = Override(look.override, "I stand beside it")
                again = order(graph, engine="David", override=override)
                started = await control.start(again, ANN)
                assert started.run.override == override
                assert len(david.starts) == 1

    asked()


@virtual
async def test_a_graph_of_somebody_else_is_in_the_way_until_it_is_stopped() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        await david.engine.start(Order(run="theirs", graph=sequence("cleaning"), umrf=""))
        (look,) = await control.look(group(sequence(), "David"))
        assert verdicts(look)["quiet"] == "blocked"
        (same,) = await control.look(group(sequence("cleaning"), "David"))
        assert same.never
        assert control.robots.silence(BEN, lambda _: ()) == ["David: cleaning"]
        await until(lambda: not control.robots.foreign_stops.going("David"))
        assert not await david.moving("cleaning")
        told = [event for _, event in await control.robots.robot_log.newest("David", 9)]
        assert isinstance(told[-1], StopWasProven)
        (look,) = await control.look(group(sequence(), "David"))
        assert verdicts(look)["quiet"] == "passed"


@virtual
async def test_a_graph_of_its_own_index_is_never_started_under_the_same_name() -> None:
    david = Open()
    david.known_graphs = (codec.write(sequence("patrol")),)
    async with fleet(Harness(), David=david) as control:
        (look,) = await control.look(group(sequence("patrol"), "David"))
        assert look.never
        with pytest.raises(Conflict, match="its own index"):
            await control.start(order(sequence("patrol"), engine="David"), ANN)


@virtual
async def test_the_simulator_that_plays_a_robot_refuses_what_the_robot_would() -> None:
    graph = sequence(actions=2)
    first, second = graph.actions
    both = tuple(
        msgspec.structs.replace(action, actor=actor)
        for action, actor in ((first, "David"), (second, "Eve"))
    )
    graph = msgspec.structs.replace(graph, actions=both)
    async with fleet(Harness(), David=Open()) as control:
        with pytest.raises(Conflict, match="synchronise"):
            await control.start(order(graph, like="David"), ANN)
        await control.register(Registration(name="David", profile={"synchronises": True}), ANN)
        assert (await control.start(order(graph, like="David"), ANN)).run.like == "David"


# --- changing what runs -----------------------------------------------------------------------


def change(graph: Graph) -> bytes:
    asked = order(graph)
    return msgspec.json.encode({"version": "v2", "digest": asked.digest, "umrf": asked.umrf})


@virtual
async def test_a_running_graph_takes_another_version_where_pausing_is_safe() -> None:
    harness = Harness()
    async with harness.runner() as control:
        script = {"*": [{"after_s": 2}]}
        run = (await control.start(order(sequence(actions=2), script=script), ANN)).run
        await anyio.sleep(1)
        changed = await control.modify(run.id, change(sequence(actions=3)), BEN)
        assert (changed.version, changed.digest) == ("v2", order(sequence(actions=3)).digest)
        await until(lambda: not control.open)
    told = harness.ledger.history(run.id)
    assert (told.state, told.version) == ("finished", "v2")
    assert [a.state for a in told.actions.values()] == ["FINISHED"] * 3


@virtual
async def test_elsewhere_a_change_is_refused_before_anything_is_read_or_sent() -> None:
    async with fleet(Harness(), David=Open(NEVER)) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        with pytest.raises(Conflict, match="not safe on David"):
            await control.modify(run.id, b"", ANN)
        control.stop_all(ANN)
        await until(lambda: not control.open)


@pytest.mark.parametrize("why", [EngineRefused("no"), NotSent("no")])
def test_a_change_that_was_not_made_leaves_the_version_that_runs(why: Exception) -> None:
    class Refuses(Open):
        pauses = True

        async def modify(self, order: Order, continue_from: str = "") -> None:
            """Not this one."""
            raise why

    @virtual
    async def asked() -> None:
        david, harness = Refuses(NEVER), Harness()
        async with fleet(harness, David=david) as control:
            run = (await control.start(order(sequence(), engine="David"), ANN)).run
            david.texts = {run.graph_name: codec.write(sequence())}
            await until(lambda: control.open[run.id].run.state == "running")
            with pytest.raises(Refused, match="no"):
                await control.modify(run.id, change(sequence(actions=4)), BEN)
            await anyio.sleep(2)
            now = control.open[run.id].run
            assert (now.version, now.digest) == ("v1", run.digest)
            assert list(now.actions) == list(run.actions)
            assert [action.aid for action in now.actions.values()] == [
                action.aid for action in run.actions.values()
            ]
            assert now.alarms == ()
            control.stop_all(ANN)
            await until(lambda: not control.open)
        assert harness.ledger.history(run.id).version == "v1"

    asked()


@virtual
async def test_a_change_that_was_read_while_the_run_was_stopped_is_not_sent() -> None:
    async def slowly(work: Callable[..., Any], *args: Any) -> Any:
        """A large graph."""
        await anyio.sleep(1)
        return work(*args)

    harness = Harness()
    async with ExecutionService.opened(
        harness.ledger, Robots(), clock_us=clock_us, run_in_worker=slowly
    ) as control:
        run = (await control.start(order(sequence(), script=NEVER), ANN)).run
        await anyio.sleep(1)
        async with anyio.create_task_group() as tasks:

            async def ask() -> None:
                with pytest.raises(Conflict, match="Only a running run"):
                    await control.modify(run.id, change(sequence(actions=2)), ANN)

            tasks.start_soon(ask)
            await anyio.sleep(0.5)
            await control.stop(run.id, BEN)
        await until(lambda: not control.open)
    told = harness.ledger.history(run.id)
    assert (told.state, told.version) == ("stopped", "v1")


@virtual
async def test_a_graph_of_another_name_cannot_take_the_place_of_a_run() -> None:
    async with Harness().runner() as control:
        run = (await control.start(order(sequence(), script=NEVER), ANN)).run
        await anyio.sleep(1)
        with pytest.raises(Conflict, match="cannot take its place"):
            await control.modify(run.id, change(sequence("other")), ANN)
        control.stop_all(ANN)
        await until(lambda: not control.open)


# --- several robots ---------------------------------------------------------------------------


@virtual
async def test_a_group_starts_together_and_is_stopped_together() -> None:
    david, eve = Open(NEVER), Open(NEVER)
    harness = Harness()
    async with fleet(harness, David=david, Eve=eve) as control:
        started = await control.start_group(group(sequence(), "Eve", "David"), ANN)
        assert [run.engine for run in started.runs] == ["David", "Eve"]
        assert {run.group for run in started.runs} == {started.group}
        again = await control.start_group(group(sequence(), "Eve", "David"), ANN)
        assert (again.group, again.fresh) == (started.group, False)
        assert (len(david.starts), len(eve.starts)) == (1, 1)
        stopped = await control.stop(started.group, BEN)
        assert sorted(stopped) == sorted(run.id for run in started.runs)
        await until(lambda: not control.open)
    for run in started.runs:
        told = harness.ledger.history(run.id)
        assert (told.state, told.group) == ("stopped", started.group)


@virtual
async def test_a_start_that_is_under_way_says_so_until_its_runs_are_there() -> None:
    harness = Harness()
    async with fleet(harness, David=Open(NEVER), Eve=Open(NEVER)) as control:
        asked = group(sequence(), "David", "Eve")
        harness.ledger.slow = 1.0

        async def found() -> list[str]:
            rows = await control.history.rows(queries.of_start(asked.request_id))
            return sorted([(await control.find(row.id)).engine for row in rows])

        async with anyio.create_task_group() as tasks:
            assert not control.under_way(asked.request_id)
            tasks.start_soon(control.start_group, asked, ANN)
            await anyio.sleep(0.5)
            assert (control.under_way(asked.request_id), await found()) == (True, [])
        assert (control.under_way(asked.request_id), await found()) == (False, ["David", "Eve"])
        control.stop_all(BEN)
        await until(lambda: not control.open)


@virtual
async def test_nothing_of_a_group_starts_when_one_robot_is_not_fit() -> None:
    david, eve = Open(), Open()
    async with fleet(Harness(), David=david, Eve=eve) as control:
        eve.silent = True
        with pytest.raises(Conflict, match="Eve does not answer"):
            await control.start_group(group(sequence(), "David", "Eve"), ANN)
    assert (david.starts, eve.starts) == ([], [])


@virtual
async def test_a_group_that_starts_in_part_says_which_robot_was_left_out() -> None:
    harness, eve = Harness(), Open(NEVER)

    class Breaks(Open):
        async def start(self, order: Order) -> None:
            """The disk is full right after it."""
            harness.ledger.down = True
            await super().start(order)

    david = Breaks(NEVER)
    async with fleet(harness, David=david, Eve=eve) as control:
        started = await control.start_group(group(sequence(), "David", "Eve"), ANN)
        assert [run.engine for run in started.runs] == ["David"]
        assert "could not be recorded" in started.failed["Eve"]
        assert eve.starts == []
        harness.ledger.down = False
        control.stop_all(ANN)
        await until(lambda: not control.open)


# --- the flight recorder ----------------------------------------------------------------------


@virtual
async def test_a_start_of_somebody_else_is_recorded_with_its_graph_and_the_run_it_stopped() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        text = codec.write(sequence())
        david.command("start", run.graph_name, text)
        assert control.open[run.id].run.alarms[-1].code == "foreign_start"
        await anyio.sleep(1)
        ((seq, told),) = [
            (seq, event)
            for seq, event in await control.robots.robot_log.newest("David", 9)
            if isinstance(event, Commanded)
        ]
        assert (told.command, told.run, told.number) == ("start", run.id, run.number)
        assert await control.robots.robot_log.graph("David", seq) == text
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_the_log_of_the_engine_is_kept_with_the_run_and_proves_nothing() -> None:
    david, harness = Open(NEVER), Harness()
    async with fleet(harness, David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(2)
        david.log("UMRF graph 'sequence' stopped.", run.graph_name)
        david.log("about another one", "another")
        assert control.open[run.id].run.state == "running"
        control.stop_all(ANN)
        await until(lambda: not control.open)
    said = [each.text for each in harness.ledger.told(run.id) if isinstance(each, EngineSaid)]
    assert said == ["UMRF graph 'sequence' stopped."]


@virtual
async def test_an_engine_that_shows_another_graph_raises_an_alarm_and_goes_on() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        david.texts = {sequence().name: codec.write(sequence(actions=2))}
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: bool(control.open[run.id].run.alarms))
        (alarm,) = control.open[run.id].run.alarms
        assert alarm.code == "echo_differs"
        assert "lacks Work_2" in alarm.text
        assert control.open[run.id].run.state == "running"
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_with_two_engines_on_one_path_nothing_is_called_stopped() -> None:
    david, harness = Open(NEVER), Harness()
    async with fleet(harness, David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await anyio.sleep(2)
        david.servers = 2
        await control.stop(run.id, BEN)
        await anyio.sleep(20)
        now = control.open[run.id].run
        assert now.state == "stopping"
        assert any("2 engines" in alarm.text for alarm in now.alarms)
        david.servers = 1
        await until(lambda: not control.open)
    assert harness.ledger.history(run.id).state == "stopped"
