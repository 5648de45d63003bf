"""An engine's ERROR is no rest: it is what it says of an action that does not obey, and whose code goes
on. Nothing but a person who looks, or the end of the engine's process, ends such a run."""

import subprocess
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.runner.emulator.messages import EngineTraits, Start, Stop
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.engine_process import EngineProcess, has_ended, process
from action_assistant.runner.links.engine_text import snapshot
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.runs.events import Override
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Conditions
from runner.harness import (
    ANN,
    BEN,
    Harness,
    Robot,
    at_once,
    clock_us,
    engine,
    order,
    sequence,
    two_ends,
    until,
    virtual,
)
from runner.robots_in_network import RobotsInNetwork, asked, shown

LOOKED = RestRequest("I stand beside it; nothing moves.")
STUBBORN: dict[str, Any] = {"*": [{"never": True, "ignores_stop": True}]}
LATE: dict[str, Any] = {"*": [{"never": True, "stop_s": 9.0}]}
THROWS: dict[str, Any] = {"*": [{"after_s": 60, "ignores_stop": True, "stop_error": True}]}


@asynccontextmanager
async def stopped(
    script: dict[str, Any],
) -> AsyncIterator[tuple[RobotsInNetwork, ExecutionService, str]]:
    """A run that somebody wants stopped, 8 seconds later."""
    scene = RobotsInNetwork(5, script=script, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        await control.stop(run, BEN)
        await anyio.sleep(8)
        yield scene, control, run


@pytest.mark.parametrize("script", [STUBBORN, LATE, THROWS], ids=["never", "late", "throws"])
@virtual
async def test_an_action_that_does_not_obey_is_never_called_at_rest(script: dict[str, Any]) -> None:
    async with stopped(script) as (scene, control, run):
        assert scene.nodes["David"].robot.moving == ("patrol",)
        now = shown(control, run)
        assert (now.state, now.proof_at, now.ended_at) == ("stopping", None, None)
        assert "Work_0 did not obey within 5 s" in now.unconfirmed
        assert "its code may" not in now.state
        assert any("STOP UNCONFIRMED: Work_0 did not obey" in each.text for each in now.alarms)
        await anyio.sleep(120)
        assert shown(control, run).state == "stopping"


@virtual
async def test_nothing_is_started_beside_it_and_stop_stays_pressable() -> None:
    async with stopped(STUBBORN) as (scene, control, run):
        with pytest.raises(Conflict, match="did not obey"):
            await control.start(asked(), ANN)
        sent = len([each for _, each in scene.network.sent if isinstance(each, Stop)])
        await anyio.sleep(300)
        vain = len([each for _, each in scene.network.sent if isinstance(each, Stop)])
        assert vain - sent < 30  # they can bring nothing more, and are all recorded
        assert await control.stop(run, ANN) == [run]
        await anyio.sleep(0.1)
        now = len([each for _, each in scene.network.sent if isinstance(each, Stop)])
        assert now == vain + 1


@virtual
async def test_a_person_who_has_seen_it_at_rest_ends_it_and_that_is_no_proof() -> None:
    async with stopped(STUBBORN) as (_, control, run):
        with pytest.raises(BadInput, match="how it was seen"):
            await control.confirm_rest(run, RestRequest("   "), BEN)
        told = await control.confirm_rest(run, LOOKED, BEN)
        assert (told.state, told.proof_at) == ("error", None)
        assert told.at_rest is not None
        assert (told.at_rest.by, told.at_rest.how) == (BEN, LOOKED.how)
        await until(lambda: run not in control.open)
        (row,) = [each for each in await control.history.rows(_listed()) if each.id == run]
        assert (row.state, row.summary["at_rest"]["how"]) == ("error", LOOKED.how)
        assert "did not obey" in (await control.find(run)).detail


def _listed() -> Any:
    from action_assistant.runner.runs import queries

    return queries.listed(queries.Filter(), 100)


@virtual
async def test_the_block_outlives_the_runner_the_engine_and_what_strangers_start() -> None:
    scene = RobotsInNetwork(5, script=STUBBORN, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        await control.stop(run, BEN)
        await until(lambda: bool(shown(control, run).unconfirmed))
    async with scene.played() as control:
        assert shown(control, run).state == "stopping"
        with pytest.raises(Conflict, match="did not obey"):
            await control.start(asked(), ANN)
        text = codec.write(sequence("other"))
        scene.network.carry(
            Start(graph_name="other", targets=("David",), graph_json=text), "terminal"
        )
        await anyio.sleep(2)
        scene.network.kill(scene.nodes["David"])
        await anyio.sleep(1)
        scene.script = {}
        scene.robot("David")
        await until(lambda: shown(control, run).state == "lost")
        with pytest.raises(Conflict, match="confirm that in the run"):
            await control.start(asked(), ANN)
    async with scene.played() as control:
        with pytest.raises(Conflict, match="confirm that in the run"):
            await control.start(asked(), ANN)
        assert (await control.confirm_rest(run, LOOKED, BEN)).state == "error"
        await until(lambda: run not in control.open)
        second = (await control.start(asked(), ANN)).run.id
        await until(lambda: second not in control.open)
        assert (await control.find(second)).state == "finished"


@virtual
async def test_after_that_the_engine_s_own_error_of_this_run_stands_in_nobody_s_way() -> None:
    script = STUBBORN | {"other/Work_0": [{"after_s": 1}], "other/Work_1": [{"after_s": 1}]}
    async with stopped(script) as (_, control, run):
        await control.confirm_rest(run, LOOKED, BEN)
        await until(lambda: run not in control.open)
        other = order(sequence("other"), engine="David")
        assert (await control.start(other, ANN)).fresh


@virtual
async def test_an_action_that_had_thrown_by_itself_does_not_keep_a_confirmed_run_in_doubt() -> None:
    thrower = {"patrol/Work_0": [{"after_s": 1, "result": "on_error"}]}
    stubborn = {"patrol/Work_1": [{"never": True, "ignores_stop": True}]}
    scene = RobotsInNetwork(
        5, script=thrower | stubborn | {"*": [{"after_s": 1}]}, quirks=EngineTraits(loss=0.0)
    )
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: "Work_1" in control.open[run].run.active)
        await anyio.sleep(3)
        await control.stop(run, BEN)
        await until(lambda: bool(shown(control, run).unconfirmed))
        await control.confirm_rest(run, LOOKED, BEN)
        await until(lambda: run not in control.open)
        assert (await control.start(order(sequence("other"), engine="David"), ANN)).fresh


@virtual
async def test_what_a_stranger_s_graph_left_blocks_a_start_until_somebody_answers_for_it() -> None:
    scene = RobotsInNetwork(
        5, script=STUBBORN | {"patrol/Work_0": [{"after_s": 1}]}, quirks=EngineTraits(loss=0.0)
    )
    async with scene.played() as control:
        text = codec.write(sequence("other"))
        scene.network.carry(
            Start(graph_name="other", targets=("David",), graph_json=text), "terminal"
        )
        await anyio.sleep(2)
        control.stop_robot("David", BEN)
        await anyio.sleep(70)
        assert not control.robots.foreign_stops.going("David")  # given up, without a proof
        with pytest.raises(Conflict, match="other on David did not obey"):
            await control.start(asked(), ANN)
        over = Override(codes=("rest",), reason="I stand beside it.")
        assert (await control.start(asked(override=over), ANN)).fresh


@virtual
async def test_a_stranger_s_stop_that_is_not_obeyed_leaves_the_run_unknown() -> None:
    scene = RobotsInNetwork(5, script=STUBBORN, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        scene.network.carry(Stop(graph_name="patrol", targets=("David",)), "terminal")
        await until(lambda: bool(shown(control, run).unconfirmed))
        await anyio.sleep(30)
        now = shown(control, run)
        assert (now.state, now.desired, now.ended_at) == ("unknown", "running", None)


@virtual
async def test_a_stop_inside_the_graph_that_is_not_obeyed_is_no_end_either() -> None:
    """Work_0 ends and stops Work_1, which goes on; the graph then finishes by its exit."""
    graph = two_ends("patrol")
    first, second = (action.key for action in graph.actions[:2])
    arrow = msgspec.structs.replace(
        graph.relations[-1],
        parent=first,
        child=second,
        conditions=Conditions(on_true="stop", on_false="ignore", on_error="ignore"),
        required=False,
        parent_order=-1.0,
    )
    graph = msgspec.structs.replace(graph, relations=(*graph.relations, arrow))
    script = {"Work_0": [{"after_s": 2}], "Work_1": [{"after_s": 30, "ignores_stop": True}]}
    scene = RobotsInNetwork(5, script=script, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        over = Override(codes=("H3", "H4", "H8", "H12"), reason="practice")
        run = (await control.start(order(graph, engine="David", override=over), ANN)).run.id
        await until(lambda: bool(shown(control, run).unconfirmed))
        assert scene.nodes["David"].robot.moving == ("patrol",)
        await anyio.sleep(20)
        assert shown(control, run).ended_at is None


@virtual
async def test_an_action_that_threw_by_itself_is_over() -> None:
    script = {"Work_0": [{"after_s": 1, "result": "on_error"}], "*": [{"after_s": 2}]}
    scene = RobotsInNetwork(5, script=script, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: run not in control.open)
        told = await control.find(run)
        assert (told.state, told.unconfirmed) == ("finished", "")
        assert told.actions["Work_0"].state == "ERROR"


@virtual
async def test_what_answers_show_moving_cannot_be_confirmed_away() -> None:
    scene = RobotsInNetwork(5)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        with pytest.raises(Conflict, match="answers for this run"):
            await control.confirm_rest(run, LOOKED, BEN)
        simulated = (
            await control.start(order(sequence(), script={"*": [{"never": True}]}), ANN)
        ).run
        with pytest.raises(Conflict, match="simulation"):
            await control.confirm_rest(simulated.id, LOOKED, BEN)


@virtual
async def test_a_run_that_was_confirmed_and_moves_again_is_open_again() -> None:
    scene = RobotsInNetwork(5)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        robot = scene.nodes["David"].robot
        robot.freeze(anyio.current_time() * 1000)
        await until(lambda: shown(control, run).state == "unknown")
        assert (await control.confirm_rest(run, LOOKED, BEN)).state == "error"
        await anyio.sleep(3)
        robot.thaw(anyio.current_time() * 1000)
        scene.network.stir(scene.nodes["David"])
        await until(lambda: run in control.open and shown(control, run).moves_again_at is not None)
        assert shown(control, run).at_rest is None


@virtual
async def test_a_simulated_action_that_does_not_obey_is_switched_off_with_its_engine() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(order(sequence(), script=STUBBORN), ANN)).run
        await anyio.sleep(1)
        await control.stop(run.id, ANN)
        await until(lambda: run.id not in control.open)
        told = await control.find(run.id)
        assert (told.state, told.proof_at) == ("error", None)
        assert told.at_rest is not None
        assert told.at_rest.by is None
        assert "switched off" in told.at_rest.how


# --- the process of an engine -----------------------------------------------------------------


@pytest.fixture
def child() -> Iterator[subprocess.Popen[bytes]]:
    """A process of this computer."""
    with subprocess.Popen(["sleep", "600"]) as started:
        yield started
        started.kill()


def test_a_process_of_this_computer_is_seen_to_end_and_no_other(
    child: subprocess.Popen[bytes],
) -> None:
    known = process(child.pid)
    assert known is not None
    assert not has_ended(known)
    assert has_ended(msgspec.structs.replace(known, started=known.started - 1))  # number reused
    assert not has_ended(msgspec.structs.replace(known, boot="another"))
    assert not has_ended(msgspec.structs.replace(known, namespace="pid:[1]"))
    child.kill()
    while not has_ended(known):  # also before anybody has waited for it
        pass
    child.wait()
    assert has_ended(known)
    assert process(child.pid) is None


@virtual
async def test_a_run_ends_with_the_process_of_its_engine(child: subprocess.Popen[bytes]) -> None:
    robot = WithProcess(engine(STUBBORN), process(child.pid))
    harness = Harness({"David": robot})
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(robot.engine.run)
        async with harness.runner() as control:
            run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
            await control.stop(run, ANN)
            await until(lambda: bool(control.open[run].run.unconfirmed))
            child.kill()
            child.wait()
            await until(lambda: run not in control.open)
            told = await control.find(run)
            assert (told.state, told.proof_at) == ("error", None)
            assert told.at_rest is not None
            assert told.at_rest.by is None
        tasks.cancel_scope.cancel()


class WithProcess(Robot):
    """A robot whose engine is a process of this computer."""

    def __init__(self, inside: Any, known: EngineProcess | None) -> None:
        super().__init__(inside)
        self.known = known

    @property
    def standing(self) -> Any:
        """As ever, with the process."""
        return msgspec.structs.replace(super().standing, process=self.known)


# --- which errors are doubtful ----------------------------------------------------------------


def _shown(state: str, **nodes: str) -> Snapshot:
    return Snapshot(at=1, graph="g", state=state, nodes=nodes)


def test_an_error_from_before_any_stop_stays_the_action_s_own() -> None:
    doubts = DoubtfulErrors(reached=False)
    assert doubts.look([_shown("RUNNING", A_0="ERROR", B_0="RUNNING")]) == ""
    doubts.reach()
    assert doubts.look([_shown("STOPPED", A_0="ERROR", B_0="FINISHED")]) == ""
    assert "B_0 did not obey" in doubts.look([_shown("STOPPED", A_0="ERROR", B_0="ERROR")])


def test_an_action_that_began_again_since_is_looked_at_anew() -> None:
    doubts = DoubtfulErrors(reached=False)
    doubts.look([_shown("RUNNING", A_0="ERROR")])
    doubts.look([_shown("RUNNING", A_0="RUNNING")])
    doubts.reach()
    assert "A_0 did not obey" in doubts.look([_shown("STOPPED", A_0="ERROR")])


def test_a_graph_in_error_names_somebody_even_when_no_action_is() -> None:
    assert "g did not obey" in DoubtfulErrors(reached=False).look([_shown("ERROR", A_0="FINISHED")])


def test_a_sub_graph_in_error_counts_and_a_doubt_stays() -> None:
    doubts = DoubtfulErrors(reached=False)
    part = Snapshot(at=1, graph="g__Sub__0", state="ERROR", nodes={"C_0": "ERROR"})
    assert "C_0 did not obey" in doubts.look([_shown("STOPPED", Sub_0="FINISHED"), part])
    assert "C_0 did not obey" in doubts.look([_shown("STOPPED", Sub_0="FINISHED")])


@pytest.mark.parametrize(
    ("conditions", "type_", "expected"),
    [
        (["on_true -> run"], "sync", ()),
        (["on_true -> run", "on_error->stop"], "sync", ("B_0",)),
        (["on_true -> pause"], "sync", ("B_0",)),
        (["on_true -> run"], "spontaneous", ("B_0",)),
    ],
)
def test_an_answer_tells_which_errors_its_graph_may_have_caused_itself(
    conditions: list[str], type_: str, expected: tuple[str, ...]
) -> None:
    parent = {"name": "A", "instance_id": 0, "conditions": conditions}
    actions = [
        {"name": "A", "type": type_, "state": "FINISHED"},
        {"name": "B", "type": "sync", "state": "ERROR", "parents": [parent]},
    ]
    text = msgspec.json.encode({"graph_name": "g", "graph_state": "RUNNING", "actions": actions})
    assert snapshot(text.decode(), at=1, source="get").stoppable == expected


# --- what a person's word covers, and what it does not ------------------------------------------


@virtual
async def test_who_saw_rest_while_the_engine_was_silent_did_not_see_the_error_that_came_later() -> (
    None
):
    script = {"patrol/Work_0": [{"never": True, "ignores_stop": True}], "*": [{"after_s": 1}]}
    scene = RobotsInNetwork(5, script=script, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        robot = scene.nodes["David"].robot
        await control.stop(run, BEN)
        await anyio.sleep(0.5)
        robot.freeze(anyio.current_time() * 1000)
        await until(lambda: shown(control, run).state == "unknown")
        await anyio.sleep(10)
        await control.confirm_rest(run, LOOKED, BEN)
        await anyio.sleep(3)
        robot.thaw(anyio.current_time() * 1000)
        scene.network.stir(scene.nodes["David"])
        await anyio.sleep(30)
        assert robot.moving == ("patrol",)
        with pytest.raises(Conflict, match="patrol on David did not obey"):
            await control.start(order(sequence("other"), engine="David"), ANN)


@virtual
async def test_a_start_that_was_played_again_while_nobody_listened_is_not_what_somebody_saw() -> (
    None
):
    late, stubborn = {"never": True, "stop_s": 40.0}, {"never": True, "ignores_stop": True}
    script = {"patrol/Work_0": [late, stubborn], "*": [{"after_s": 1}]}
    scene = RobotsInNetwork(5, script=script, quirks=EngineTraits(loss=0.0))
    async with anyio.create_task_group() as wind:
        wind.start_soon(scene.network.blow)
        async with scene.harness.runner() as control:
            await anyio.sleep(0.5)
            run = (await control.start(asked(), ANN)).run.id
            await until(lambda: shown(control, run).state == "running")
            await control.stop(run, BEN)
            await anyio.sleep(45)
            await control.confirm_rest(run, LOOKED, BEN)
            await until(lambda: run not in control.open)
        scene.network.carry(scene.starts()[0], "bag")
        await anyio.sleep(3)
        scene.network.carry(Stop(graph_name="patrol", targets=("David",)), "terminal")
        await anyio.sleep(10)
        async with scene.harness.runner() as control:
            await anyio.sleep(5)
            assert scene.nodes["David"].robot.moving == ("patrol",)
            with pytest.raises(Conflict, match="patrol on David did not obey"):
                await control.start(order(sequence("other"), engine="David"), ANN)
        wind.cancel_scope.cancel()


@virtual
async def test_a_run_that_moves_again_is_stopped_at_once_however_vain_stops_had_become() -> None:
    script = {"patrol/Work_0": [{"never": True, "stop_s": 110.0}, {"never": True}]}
    scene = RobotsInNetwork(5, script=script, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        await control.stop(run, BEN)
        await anyio.sleep(150)
        assert scene.nodes["David"].robot.moving == ()
        scene.network.carry(scene.starts()[0], "bag")
        await until(lambda: bool(control.open[run].run.active), 20)
        began = anyio.current_time()
        await until(
            lambda: [t for t, each in scene.network.sent if isinstance(each, Stop)][-1] > began
        )
        assert anyio.current_time() - began < 1


@virtual
async def test_a_run_of_which_an_event_cannot_be_read_still_holds_its_robot() -> None:
    scene = RobotsInNetwork(5, script=STUBBORN, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        await control.stop(run, BEN)
        await until(lambda: bool(shown(control, run).unconfirmed))
        await until(lambda: control.open[run].recorder.idle)
    stored = scene.harness.ledger.streams[f"run/{run}"]
    body = b'{"at":1,"seen":[{"kind":"of a later version"}]}'
    stored.append(msgspec.structs.replace(stored[-1], seq=len(stored) + 1, body=body,
                                          kind="run.observed.v1"))  # fmt: skip
    scene.network.kill(scene.nodes["David"])
    async with scene.played() as control:
        assert shown(control, run).state == "lost"
        assert await control.stop(run, BEN) == [run]
        with pytest.raises(Conflict, match="cannot be read"):
            await control.start(asked(), ANN)


@virtual
async def test_a_run_that_moves_again_while_a_start_is_looked_at_stands_in_its_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The index of the robot is read in a worker meanwhile."""
    real = KnownEngine.index

    async def index(self: KnownEngine, run_in_worker: Any) -> Any:
        await anyio.sleep(0.1)
        return await real(self, run_in_worker)

    monkeypatch.setattr(KnownEngine, "index", index)
    for wait in range(0, 30, 3):
        quirks = EngineTraits(loading_ms=3_000.0, loss=0.0)
        scene = RobotsInNetwork(11, quirks=quirks, script={"*": [{"after_s": 20.0}]})
        async with scene.played() as control:
            run = (await control.start(asked(), ANN)).run.id
            await anyio.sleep(0.3)
            await control.stop(run, BEN)
            await until(lambda run=run, control=control: run not in control.open)
            await anyio.sleep(0.9 + 0.05 * wait)
            with suppress(Conflict):
                second = await control.start(order(sequence("other"), engine="David"), ANN)
                again = control.open[run].run.moves_again_at if run in control.open else None
                assert again is None or again >= second.run.requested_at


@virtual
async def test_a_mark_of_a_run_that_is_not_here_is_asked_for_once() -> None:
    scene = RobotsInNetwork(11, quirks=EngineTraits(loss=0.0), script={"*": [{"never": True}]})
    asked_for: list[str] = []

    async def past(run: str, _: bool) -> Any:
        asked_for.append(run)
        raise NotFound("There is no such run.")

    graph = msgspec.json.decode(codec.write(sequence("theirs")))
    for action in graph["actions"]:
        action["gui_attributes"] = {"action_assistant": {"run": "AAAAAAAAAAAA"}}
    text = msgspec.json.encode(graph).decode()
    async with anyio.create_task_group() as wind:
        wind.start_soon(scene.network.blow)
        ledger, robots = scene.harness.ledger, Robots(scene.harness.links)
        await anyio.sleep(0.5)
        scene.network.carry(
            Start(graph_name="theirs", targets=("David",), graph_json=text), "other"
        )
        await anyio.sleep(1)
        async with ExecutionService.opened(
            ledger, robots, clock_us=clock_us, run_in_worker=at_once, past=past
        ):
            await anyio.sleep(60)
        wind.cancel_scope.cancel()
    assert asked_for == ["AAAAAAAAAAAA"]
