"""An action that may still be loading keeps a Stop unconfirmed, and an end too, by name. The real runner
and emulated robots in virtual time."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Refused
from action_assistant.runner.emulator.messages import EngineTraits, Start
from action_assistant.runner.links.observations import ACTIVE, Snapshot
from action_assistant.runner.robots.robot_events import StopUnproven, StopWasProven
from action_assistant.runner.runs.events import Loading, Override
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.stop.loading import LoadingWatch
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import ENTRY, ENTRY_CONDITIONS, EXIT, Graph, Relation
from runner.fake_network import now, now_ms
from runner.harness import ANN, BEN, GO_ON, at_once, order, sequence, until, virtual
from runner.robots_in_network import LOOKED, OTHER, PATROL, RobotsInNetwork, asked, shown

SECOND = {"*": [{"after_s": 1.0}]}
KNOWINGLY = Override(codes=("proof",), reason="it is a test")
NAME = "Work_0 is still loading; it can begin to move the robot as soon as it has loaded"


def scene(loading_s: float, script: dict[str, Any] = SECOND, loss: float = 0.0) -> RobotsInNetwork:
    traits = EngineTraits(loading_ms=1000 * loading_s, loss=loss)
    return RobotsInNetwork(5, quirks=traits, script=script)


@pytest.mark.parametrize("loading_s", [0.5, 1.5, 3.0, 8.0])
@virtual
async def test_a_stop_while_the_first_action_loads_is_proven_only_after_it_has_run(
    loading_s: float,
) -> None:
    here = scene(loading_s)
    robot = here.nodes["David"].robot
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await anyio.sleep(0.2)
        await control.stop(run, BEN)
        await anyio.sleep(max(0.0, loading_s - 0.4))
        told = shown(control, run)
        assert (told.proof_at, told.ended_at) == (None, None)
        if loading_s > 2:
            assert told.unconfirmed.startswith(NAME)
            assert f"STOP UNCONFIRMED: {NAME}" in told.alarms[-1].text
        sent = control.open[run].run.stops_sent
        await until(lambda: robot.moving == ("patrol",))
        assert control.open[run].run.stops_sent >= sent
        await until(lambda: run not in control.open)
        assert robot.moving == ()
        ended = await control.find(run)
        assert (ended.state, ended.loading) == ("stopped", "")
        assert ended.proof_at is not None


@virtual
async def test_stop_goes_on_being_sent_while_an_action_loads() -> None:
    here = scene(8.0)
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await anyio.sleep(0.2)
        await control.stop(run, BEN)
        await anyio.sleep(3)
        before = control.open[run].run.stops_sent
        await anyio.sleep(4)
        assert control.open[run].run.stops_sent >= before + 3


@virtual
async def test_a_stop_between_two_actions_names_the_one_that_loads() -> None:
    here = scene(3.0)
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).actions["Work_0"].state == "FINISHED")
        assert here.nodes["David"].robot.moving == ()
        await control.stop(run, BEN)
        await anyio.sleep(2.2)
        assert shown(control, run).unconfirmed.startswith("Work_1 may still be loading")
        await until(lambda: run not in control.open)
        ended = await control.find(run)
        assert ended.actions["Work_1"].state == "FINISHED"
        assert ended.actions["Work_2"].state == "UNINITIALIZED"


@pytest.mark.parametrize("loading_s", [0.001, 0.05, 3.0])
@virtual
async def test_a_stop_that_meets_an_action_is_proven_although_others_never_began(
    loading_s: float,
) -> None:
    here = scene(loading_s, {"*": [{"never": True}]})
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).actions["Work_0"].state in ACTIVE)
        await control.stop(run, BEN)
        await until(lambda: run not in control.open, patience=2.0)
        ended = await control.find(run)
        assert (ended.state, ended.actions["Work_1"].state) == ("stopped", "UNINITIALIZED")
        assert not [each for each in ended.alarms if each.code == "stop_unconfirmed"]


@virtual
async def test_a_person_at_the_robot_frees_it_without_a_proof() -> None:
    here = scene(0.001, {"*": [{"never": True}]}, loss=1.0)  # no feedback tells whether it was met
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).actions["Work_0"].state in ACTIVE)
        await control.stop(run, BEN)
        await anyio.sleep(30)
        assert "Work_1 may still be loading" in shown(control, run).unconfirmed
        with pytest.raises(Refused, match="see it at rest and confirm"):
            await control.start(asked(), ANN)
        await control.confirm_rest(run, LOOKED, BEN)
        await until(lambda: run not in control.open)
        ended = await control.find(run)
        assert (ended.state, ended.proof_at) == ("error", None)
        assert ended.at_rest is not None
        assert ended.at_rest.by == BEN


@virtual
async def test_a_graph_that_ends_beside_an_action_that_loads_is_not_at_rest() -> None:
    """`Work_0` starts `Work_1` and ends the graph."""
    line = sequence("patrol", 2)
    first, second = (each.key for each in line.actions)
    graph = Graph(
        name="patrol",
        actions=line.actions,
        relations=(
            Relation(parent=ENTRY, child=first, conditions=ENTRY_CONDITIONS),
            Relation(parent=first, child=second, conditions=GO_ON),
            Relation(parent=first, child=EXIT, conditions=GO_ON),
        ),
    )
    here = scene(3.0)
    async with here.played() as control:
        run = (await control.start(order(graph, engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.graph_state == "FINISHED")
        await anyio.sleep(2.2)
        told = shown(control, run)
        assert (told.state, told.ended_at) == ("unknown", None)
        assert told.unconfirmed.startswith("Work_1 may still be loading")
        assert "STOP UNCONFIRMED: Work_1 may still be loading" in told.alarms[-1].text
        await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
        await until(lambda: run not in control.open)
        assert here.nodes["David"].robot.moving == ()
        assert (await control.find(run)).state == "finished"


@virtual
async def test_a_runner_that_was_restarted_still_names_it() -> None:
    here = scene(8.0)
    async with here.network.running():
        async with here.harness.runner() as control:
            await anyio.sleep(0.5)
            run = (await control.start(asked(), ANN)).run.id
            await control.stop(run, BEN)
            await until(lambda: bool(control.open[run].run.loading))
        async with here.harness.runner() as control:
            assert shown(control, run).unconfirmed == NAME
            await until(lambda: control.open[run].run.loading == f"{NAME} (4 s so far)")
            await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
            assert run in control.open
            await until(lambda: run not in control.open)
            assert (await control.find(run)).state == "stopped"
    told = here.harness.journal.told(run)
    first = next(each for each in told if isinstance(each, Loading))
    assert first.actions == (("patrol", "Work_0"),)
    without = replay(each for each in told if not isinstance(each, Loading))
    assert without is not None
    assert without == here.harness.journal.history(run)


@virtual
async def test_the_stop_of_a_graph_of_others_follows_the_same_rule() -> None:
    here = scene(8.0)
    async with here.played() as control:
        text = codec.write(PATROL)
        here.network.carry(Start(graph_name="patrol", targets=("David",), graph_json=text), "cli")
        await until(lambda: control.foreign_stops.stop(BEN, lambda _: ()) != [])
        stops = control.foreign_stops
        await anyio.sleep(3)
        assert stops.trouble("David", "patrol") == NAME
        await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
        assert stops.is_stopping("David")
        await until(lambda: not stops.is_stopping("David"))
        assert here.nodes["David"].robot.moving == ()
        await until(lambda: not control.robots.robot_log.waiting)
        heard = [each for _, each in await control.robots.robot_log.newest("David", 9)]
        assert any(isinstance(each, StopWasProven) for each in heard)
        assert not any(isinstance(each, StopUnproven) for each in heard)


@virtual
async def test_a_loading_time_that_a_person_has_set_lets_another_graph_start_with_a_reason() -> (
    None
):
    here = scene(0.001, {"*": [{"never": True}]}, loss=1.0)
    override = Override(codes=("loading",), reason="I see Carol standing still.")
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        await until(lambda: shown(control, run).actions["Work_0"].state in ACTIVE)
        await control.stop(run, BEN)
        await until(lambda: bool(control.open[run].run.loading))
        known = control.robots.reachable("David")
        other = order(OTHER, engine="David", override=override)
        with pytest.raises(Refused, match="see it at rest and confirm"):
            await control.start(other, ANN)  # nobody has set a time
        known.facts = msgspec.structs.replace(known.facts, longest_loading_ms=8_000)
        with pytest.raises(Refused, match="8 s at most is what was set for David"):
            await control.start(other, ANN)
        await anyio.sleep(8)
        with pytest.raises(Refused, match="A person may override this"):
            await control.start(order(OTHER, engine="David"), ANN)
        with pytest.raises(Refused, match="its Stop would hit this one"):
            await control.start(asked(override=override), ANN)
        second = (await control.start(other, ANN)).run
        assert second.despite[0].code == "free"
        assert (shown(control, run).ended_at, shown(control, run).proof_at) == (None, None)
        third = order(sequence("third"), engine="David", override=override)
        with pytest.raises(Refused, match="taken by run 2"):
            await control.start(third, ANN)
        await until(lambda: here.nodes["David"].robot.moving == ("other",))
        await control.confirm_rest(run, LOOKED, BEN)
        control.stop_all(BEN)
        await until(lambda: bool(control.open[second.id].run.loading))
        assert here.nodes["David"].robot.moving == ()


@virtual
async def test_a_graph_that_a_quick_leaf_halts_is_open_until_what_loads_beside_it_has_run() -> None:
    """`Work_0` starts `Work_1`, a leaf of 10 ms, and `Work_2`, which loads for 3 s."""
    line = sequence("patrol", 4)
    keys = [each.key for each in line.actions]
    pairs = [(0, 1), (0, 2), (2, 3)]
    graph = Graph(
        name="patrol",
        actions=line.actions,
        relations=(
            Relation(parent=ENTRY, child=keys[0], conditions=ENTRY_CONDITIONS),
            *(Relation(parent=keys[a], child=keys[b], conditions=GO_ON) for a, b in pairs),
            Relation(parent=keys[3], child=EXIT, conditions=GO_ON),
        ),
    )
    script = {
        "Work_0": [{"after_s": 0.3}],
        "Work_1": [{"after_s": 0.01}],
        "*": [{"load_s": 3.0, "after_s": 1.0}],
    }
    here = scene(0.001, script)
    async with here.played() as control:
        run = (await control.start(order(graph, engine="David"), ANN)).run.id
        await until(lambda: control.open[run].run.graph_state == "HALTED")
        await anyio.sleep(2.0)
        told = shown(control, run)
        assert (told.state, told.ended_at) == ("unknown", None)
        assert told.unconfirmed.startswith("Work_2 may still be loading")
        await until(lambda: here.nodes["David"].robot.moving == ("patrol",))
        await until(lambda: run not in control.open)
        assert here.nodes["David"].robot.moving == ()
        ended = await control.find(run)
        assert (ended.state, ended.actions["Work_3"].state) == ("halted", "UNINITIALIZED")


async def _loading_in(watch: LoadingWatch, *shown: Snapshot, **graphs: Graph) -> list[str]:
    texts = {name: codec.write(each) for name, each in graphs.items()}
    watch.see(shown)
    await watch.read(watch.unread(shown), texts, at_once)
    return [f"{each.graph}/{each.node}" for each in watch.actions(shown)]


def _look(graph: str, state: str, **nodes: str) -> Snapshot:
    return Snapshot(at=1, asked_at=1, graph=graph, state=state, nodes=nodes)


@virtual
async def test_an_action_of_a_sub_graph_may_be_loading_too() -> None:
    own = _look("g", "STOPPED", Part_0="FINISHED")
    inside = _look("g__Part__0", "STOPPED", Work_0="UNINITIALIZED", Work_1="UNINITIALIZED")
    found = await _loading_in(LoadingWatch("g"), own, inside, g__Part__0=sequence("Part", 2))
    assert found == ["g__Part__0/Work_0"]


@virtual
async def test_an_end_of_a_sub_graph_counts_only_once_the_graph_around_it_has_left_running() -> (
    None
):
    """The sub-graph may begin again until then, so earlier observations belong to another lap."""
    graphs = {"g__Part__0": sequence("Part", 2)}
    first = _look("g__Part__0", "STOPPING", Work_0="STOPPING", Work_1="UNINITIALIZED")
    last = _look("g__Part__0", "STOPPED", Work_0="FINISHED", Work_1="UNINITIALIZED")
    own = _look("g", "STOPPED", Part_0="FINISHED")
    within = LoadingWatch("g")
    within.see((_look("g", "RUNNING", Part_0="RUNNING"), first))
    assert await _loading_in(within, own, last, **graphs) == ["g__Part__0/Work_1"]
    after = LoadingWatch("g")
    after.see((_look("g", "STOPPING", Part_0="STOPPING"), first))
    assert await _loading_in(after, own, last, **graphs) == []


@virtual
async def test_any_action_of_an_unreadable_graph_that_has_not_begun_may_be_loading() -> None:
    own = _look("g", "STOPPED", Work_0="FINISHED", Work_1="UNINITIALIZED", Work_2="UNINITIALIZED")
    assert await _loading_in(LoadingWatch("g"), own) == ["g/Work_1", "g/Work_2"]


@virtual
async def test_feedback_that_says_how_a_graph_ended_takes_nothing_away() -> None:
    """Anybody may publish it; seed 621 of the random histories did."""
    own = _look("g", "STOPPED", Work_0="UNINITIALIZED", Work_1="UNINITIALIZED")
    made_up = msgspec.structs.replace(
        _look("g", "FINISHED", Work_0="FINISHED", Work_1="FINISHED"), source="feedback"
    )
    watch = LoadingWatch("g")
    watch.see((made_up,))
    assert await _loading_in(watch, own, g=sequence("g", 2)) == ["g/Work_0"]


@virtual
async def test_states_shown_by_a_second_engine_for_a_moment_prove_nothing() -> None:
    """Both engines were told to start. Discovery shows the second one late, so its words looked
    like those of the only engine."""
    here = scene(12.0, {"*": [{"after_s": 1.0}]})
    first = here.nodes["David"].robot
    async with here.played() as control:
        here.quirks = EngineTraits(loading_ms=1.0, loss=0.0)
        here.script = {"*": [{"never": True, "stop_s": 0.2}]}
        second = here.robot("David")
        second.seen_at = now() + 0.55
        await anyio.sleep(0.25)
        run = (await control.start(asked(), ANN)).run.id
        await anyio.sleep(0.1)
        await control.stop(run, BEN)
        await until(lambda: now() > second.seen_at + 0.5)
        second.robot.quit(now_ms())
        here.network.stir(second)
        await until(lambda: not second.seen)
        await anyio.sleep(3)
        assert first.moving == ()
        assert shown(control, run).proof_at is None
        assert shown(control, run).unconfirmed.startswith(NAME)
        await until(lambda: first.moving == ("patrol",))
        await until(lambda: run not in control.open)
        assert (first.moving, (await control.find(run)).state) == ((), "stopped")


@virtual
async def test_no_stop_is_proven_while_a_second_engine_hears_starts_and_is_not_seen_to_serve() -> (
    None
):
    """Both engines take up the start. Discovery shows one server, whose answers prove nothing of
    the other."""
    here = scene(0.001, {"*": [{"never": True}]}, loss=0.0)
    async with here.played() as control:
        here.script = {"*": [{"never": True, "ignores_stop": True}]}
        second = here.robot("David", gap_s=4.0)
        await anyio.sleep(0.3)
        run = (await control.start(asked(override=KNOWINGLY), ANN)).run.id
        await until(lambda: second.robot.moving == ("patrol",))
        await control.stop(run, BEN)
        await until(lambda: here.nodes["David"].robot.moving == ())
        await until(lambda: second.serves)
        assert second.robot.moving == ("patrol",)
        assert shown(control, run).proof_at is None
        assert "may be a second engine" in shown(control, run).alarms[-1].text
        await anyio.sleep(5)
        assert shown(control, run).proof_at is None


@virtual
async def test_feedback_of_a_moving_action_counts_only_while_the_answers_do_not_deny_it() -> None:
    """The answer says that nothing has begun: what feedback shows moving is of another engine."""
    moving = msgspec.structs.replace(
        _look("g", "STOPPING", Work_0="STOPPING", Work_1="UNINITIALIZED"), source="feedback"
    )
    own = _look("g", "STOPPED", Work_0="UNINITIALIZED", Work_1="UNINITIALIZED")
    watch = LoadingWatch("g")
    watch.see((moving,))
    assert await _loading_in(watch, own, g=sequence("g", 2)) == ["g/Work_0"]
    obeyed = _look("g", "STOPPED", Work_0="FINISHED", Work_1="UNINITIALIZED")
    assert await _loading_in(watch, obeyed, g=sequence("g", 2)) == []


@virtual
async def test_the_usual_loading_time_is_shown_after_three_observed_begins() -> None:
    here = scene(3.0, {"*": [{"after_s": 0.2}]}, loss=0.0)
    async with here.played() as control:
        told: list[str] = []
        for _ in range(4):
            run = (await control.start(asked(), ANN)).run.id
            await anyio.sleep(0.2)
            await control.stop(run, BEN)
            await until(lambda run=run: bool(control.open[run].run.loading))
            told.append(shown(control, run).unconfirmed)
            await until(lambda run=run: run not in control.open)
        assert told == [NAME, NAME, NAME, f"{NAME} (usually 3 s)"]
        assert (await control.find(run)).proof_at is not None
