"""A run that was called over and moves again says so, and is stopped until that is proven.

An action that takes three seconds to load begins although a person has said that the robot rests. The
real runner and stand-in robots, in virtual time.
"""

import json
from typing import Any

import anyio

from action_assistant.errors import Unavailable
from action_assistant.runner.emulator.messages import EngineTraits
from action_assistant.runner.execution.interventions import confirm_rest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Order
from action_assistant.runner.robots.robot_events import stream_of_robot
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import Ended, MovesAgain, Proof, StopSent
from runner.fake_link import FakeLink
from runner.fake_network import now_ms
from runner.harness import ANN, BEN, Harness, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet
from runner.robots_in_network import LOOKED, OTHER, PATHS, PATROL, RobotsInNetwork, asked, shown

SLOW = EngineTraits(loading_ms=3_000.0)
TWO_SECONDS = {"*": [{"after_s": 2.0}]}


def scene(**more: Any) -> RobotsInNetwork:
    return RobotsInNetwork(11, **({"quirks": SLOW, "script": TWO_SECONDS} | more))


async def said_to_rest(control: ExecutionService) -> str:
    """A run that was stopped while its first action was still loading, which somebody did not know."""
    run = (await control.start(asked(), ANN)).run.id
    await anyio.sleep(0.3)
    await control.stop(run, BEN)
    await until(lambda: bool(control.open[run].run.loading))
    await control.confirm_rest(run, LOOKED, BEN)
    await until(lambda: run not in control.open)
    told = await control.find(run)
    assert (told.state, told.proof_at, told.at_rest is None) == ("error", None, False)
    return run


async def proven_stopped(control: ExecutionService) -> str:
    """A run that was stopped while its first action ran."""
    run = (await control.start(asked(), ANN)).run.id
    await anyio.sleep(0.3)
    await control.stop(run, BEN)
    await until(lambda: run not in control.open)
    told = await control.find(run)
    assert (told.state, told.proof_at is not None) == ("stopped", True)
    return run


@virtual
async def test_a_run_that_moves_again_is_not_called_stopped_until_that_is_proven_anew() -> None:
    here = scene()
    async with here.played() as control:
        run = await said_to_rest(control)
        await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
        await anyio.sleep(1.2)
        told = shown(control, run)
        assert (told.state, told.proof_at, told.ended_at) == ("stopping", None, None)
        assert told.moves_again_at is not None
        assert any("MOVES AGAIN: David shows Work_0" in each.text for each in told.alarms)
        assert [row.id for row in await here.harness.journal.query(queries.open_runs())] == [run]
        await until(lambda: run not in control.open)
        assert here.nodes["David"].robot.moving == ()
        told = await control.find(run)
        assert (told.state, told.moves_again_at) == ("stopped", None)
        assert told.proof_at is not None
    kinds = [type(each) for each in here.harness.journal.told(run)]
    again = kinds.index(MovesAgain)
    assert kinds[again - 1] is Ended
    assert [kinds.count(each) for each in (MovesAgain, Proof, Ended)] == [1, 1, 2]
    assert StopSent in kinds[again:]
    assert here.harness.journal.history(run) == told
    (row,) = await here.harness.journal.query(queries.listed(queries.Filter(), 5))
    assert (row.state, row.summary["proof_at"]) == ("stopped", told.proof_at)
    assert [each["code"] for each in row.summary["alarms"]].count("moves_again") == 1


@virtual
async def test_answers_show_it_where_all_feedback_is_lost() -> None:
    here = scene(quirks=EngineTraits(loading_ms=3_000.0, loss=1.0))
    async with here.played() as control:
        run = await said_to_rest(control)
        await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
        await until(lambda: run in control.open, patience=1.5)


@virtual
async def test_a_run_that_moves_again_is_shown_also_while_the_journal_fails() -> None:
    here = scene()
    async with here.played() as control:
        run = await said_to_rest(control)
        here.harness.journal.down = True
        await until(lambda: run in control.open)
        await until(lambda: not control.open[run].recorder.recorded)
        assert shown(control, run).moves_again_at is not None
        await until(lambda: shown(control, run).state == "stopped")
        here.harness.journal.down = False
        await until(lambda: run not in control.open)
        assert here.harness.journal.history(run) == await control.find(run)


@virtual
async def test_a_run_that_moves_again_is_shown_also_before_its_first_end_is_recorded() -> None:
    here = scene()
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await anyio.sleep(0.3)
        here.harness.journal.down = True
        await control.stop(run, BEN)
        await until(lambda: bool(control.open[run].run.loading))
        confirm_rest(control.open[run], LOOKED, BEN)
        assert shown(control, run).state == "error"
        await until(lambda: shown(control, run).moves_again_at is not None)
        here.harness.journal.down = False
        await until(lambda: run not in control.open)
        assert here.harness.journal.history(run).state == "stopped"
    kinds = [type(each) for each in here.harness.journal.told(run)]
    assert [kinds.count(each) for each in (MovesAgain, Ended)] == [1, 2]


@virtual
async def test_a_runner_that_was_restarted_meanwhile_stops_it() -> None:
    here = scene()
    async with here.network.running():
        async with here.harness.runner() as control:
            await anyio.sleep(0.5)
            run = await said_to_rest(control)
        async with here.harness.runner() as control:
            await until(lambda: run in control.open)
            assert shown(control, run).state == "stopping"
            await until(lambda: run not in control.open)
            assert (await control.find(run)).state == "stopped"


@virtual
async def test_a_run_that_its_robot_shows_before_it_is_taken_up_again_is_still_one_of_ours() -> (
    None
):
    here = scene()
    read = here.harness.journal.read

    async def slowly(*given: Any, **more: Any) -> Any:
        """A journal on a busy disk."""
        await anyio.sleep(0.2)
        return await read(*given, **more)

    async with here.network.running():
        async with here.harness.runner() as control:
            await anyio.sleep(0.5)
            run = (await control.start(asked(), ANN)).run.id
            await until(lambda: "Work_0" in control.open[run].run.active)
        here.harness.journal.read = slowly  # type: ignore[method-assign]
        async with here.harness.runner() as control:
            await until(lambda: run in control.open)
            await until(lambda: not control.open[run].run.active)  # the next one is being loaded
            await control.stop(run, BEN)
            await until(lambda: bool(control.open[run].run.loading))
            await control.confirm_rest(run, LOOKED, BEN)
            await until(lambda: run not in control.open)
            await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
            await until(lambda: run in control.open, patience=3)
            await until(lambda: run not in control.open)
            assert (await control.find(run)).state == "stopped"


@virtual
async def test_feedback_that_an_answer_contradicts_opens_nothing() -> None:
    here = scene(quirks=EngineTraits(), script={"*": [{"never": True}]})
    async with here.played() as control:
        run = await proven_stopped(control)
        _made_up(here)
        await anyio.sleep(10)
        assert run not in control.open


@virtual
async def test_feedback_that_nobody_can_contradict_is_believed_until_somebody_does() -> None:
    here = scene(quirks=EngineTraits(), script={"*": [{"never": True}]})
    async with here.played() as control:
        run = await proven_stopped(control)
        here.nodes["David"].robot.freeze(now_ms())
        _made_up(here)
        await until(lambda: run in control.open)
        await until(lambda: shown(control, run).state == "unknown")
        here.nodes["David"].robot.thaw(now_ms())
        here.network.stir(here.nodes["David"])
        await until(lambda: shown(control, run).actions["Work_0"].state != "RUNNING")
        await until(lambda: "may still be loading" in control.open[run].run.loading)
        await control.confirm_rest(run, LOOKED, BEN)  # what it had shown as it stopped is forgotten
        await until(lambda: run not in control.open)


@virtual
async def test_a_start_of_ours_that_somebody_plays_again_is_theirs() -> None:
    here = scene(quirks=EngineTraits(), script={"*": [{"never": True}]})
    async with here.played() as control:
        run = await proven_stopped(control)
        here.network.carry(here.starts()[0], "bag")
        await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
        await anyio.sleep(5)
        assert run not in control.open
        assert here.nodes["David"].robot.moving == ("patrol",)  # a Stop of it is asked for by name


@virtual
async def test_a_start_that_it_overtakes_while_that_is_being_stored_is_refused_and_never_sent() -> (
    None
):
    here = scene()
    async with here.played() as control:
        began = now_ms()
        first = await said_to_rest(control)
        await anyio.sleep((began + 2_500 - now_ms()) / 1000)  # half a second before it moves
        assert here.nodes["David"].robot.moving == ()
        here.harness.journal.slow = 2.0
        asked_for = order(OTHER, engine="David")
        refused = (await control.start(asked_for, ANN)).run
        assert shown(control, first).moves_again_at is not None
        assert refused.state == "refused"
        here.harness.journal.slow = 0.0
        await until(lambda: not control.open)
        await anyio.sleep(5)
    assert [each.graph_name for each in here.starts()] == ["patrol"]
    assert here.harness.journal.history(refused.id).state == "refused"


@virtual
async def test_a_second_name_of_its_robot_hides_nothing_of_it() -> None:
    here = scene(quirks=EngineTraits(loading_ms=3_000.0, loss=1.0))
    here.harness.links["Twin"] = FakeLink(here.network, "Twin", PATHS["David"])
    async with here.played() as control:
        run = await said_to_rest(control)
        twin = control.robots.link("Twin")
        assert twin is not None
        await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
        await twin.get()  # it is seen under that name first
        await until(lambda: run in control.open, patience=3)
        assert shown(control, run).moves_again_at is not None
        await until(lambda: run not in control.open)
        assert (await control.find(run)).state == "stopped"


@virtual
async def test_a_second_name_of_which_nothing_can_be_read_holds_nothing_up() -> None:
    here = scene(quirks=EngineTraits(loading_ms=3_000.0, loss=1.0))
    here.harness.links["Twin"] = FakeLink(here.network, "Twin", PATHS["David"])
    newest = here.harness.journal.newest

    async def failing(stream: str) -> int:
        if stream == stream_of_robot("Twin"):
            raise Unavailable("a disk fails")
        return await newest(stream)

    async with here.network.running():
        async with here.harness.runner() as control:
            await anyio.sleep(0.5)
            run = await said_to_rest(control)
        here.harness.journal.newest = failing  # type: ignore[method-assign]
        async with here.harness.runner() as control:
            twin = control.robots.link("Twin")
            assert twin is not None
            await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
            await twin.get()
            await until(lambda: run in control.open, patience=3)
            await until(lambda: run not in control.open)


@virtual
async def test_another_robots_graph_takes_back_no_end_that_is_not_recorded_yet() -> None:
    david, eve = Open(NEVER), Open(NEVER)
    harness = Harness()
    async with fleet(harness, David=david, Eve=eve) as control:
        run = (await control.start(order(PATROL, engine="David"), ANN)).run.id
        await until(lambda: shown(control, run).state == "running")
        harness.journal.down = True
        await control.stop(run, BEN)
        await until(lambda: shown(control, run).state == "stopped")
        await eve.engine.start(Order(run=run, graph=sequence("cleaning"), umrf=""))
        await anyio.sleep(15)
        assert shown(control, run).state == "stopped"
        harness.journal.down = False
        await until(lambda: not control.open)


def _made_up(here: RobotsInNetwork) -> None:
    """Feedback that shows the run moving, sent by nobody's engine."""
    graph = json.loads(here.starts()[-1].graph_json) | {"graph_state": "STOPPED"}
    graph["actions"] = [each | {"state": "RUNNING"} for each in graph["actions"]]
    here.network.show("David", [json.dumps(graph)])
