"""An engine's ERROR is no rest: it is what it says of an action that does not obey, and whose code goes
on. Nothing but a person who looks, or the end of the engine's process, ends such a run."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.emulator.messages import EngineTraits, Start, Stop
from action_assistant.runner.execution.interventions import RestRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Override
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Conditions
from runner.harness import (
    ANN,
    BEN,
    Harness,
    order,
    sequence,
    two_ends,
    until,
    virtual,
)
from runner.robots_in_network import LOOKED, STUBBORN, RobotsInNetwork, asked, shown

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
async def test_no_graph_starts_beside_an_unconfirmed_run_and_stop_stays_pressable() -> None:
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


@virtual
async def test_where_ids_do_not_tell_processes_apart_a_stop_is_repeated_and_never_proven() -> None:
    scene = RobotsInNetwork(5, script=STUBBORN | LATE, quirks=EngineTraits(loss=0.0))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        scene.network.ids_unknown = True
        await control.stop(run, BEN)
        await anyio.sleep(60)
        now = shown(control, run)
        assert (now.state, now.proof_at, now.ended_at) == ("stopping", None, None)
        assert "does not show which process an answer comes from" in now.alarms[-1].text
        stops = [each for _, each in scene.network.sent if isinstance(each, Stop)]
        assert len(stops) > 5


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
async def test_after_a_confirmed_rest_the_runs_own_error_blocks_no_start() -> None:
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
async def test_a_strangers_disobedient_action_blocks_a_start_until_somebody_answers_for_it() -> (
    None
):
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
        assert not control.foreign_stops.is_stopping("David")  # given up, without a proof
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
async def test_rest_cannot_be_confirmed_while_answers_show_movement() -> None:
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
