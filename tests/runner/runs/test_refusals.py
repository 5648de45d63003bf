"""Starts that an engine refuses, which only its log and its answers know: they are told with its own
words, and end as far as is proven. The real runner and stand-in robots, in virtual time."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import EmulatedIndex, EngineTraits, Start
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.refusals import StartLog, why_refused
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Parameter, Signature
from action_assistant.umrf.semantics import script_from
from runner.fake_network import Node, now, now_ms
from runner.harness import ANN, BEN, Harness, ended, engine, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet
from runner.robots_in_network import LOOKED, PATHS, RobotsInNetwork

CODES = ("quiet", "others", "actions", "actors", "H7", "unknown-action", "signature")
PATROL = sequence("patrol")


class Knowing(RobotsInNetwork):
    """Robots that know one action, and not that of patrols."""

    def robot(self, name: str) -> Node:
        """Add a robot whose engine comes up."""
        stand_in = EmulatedEngine(
            name,
            index=EmulatedIndex(actions={"Wave": Signature()}),
            script=script_from({"behaviours": self.script}),
            quirks=self.quirks,
            seed=self.chance.getrandbits(32),
            born_ms=now_ms(),
        )
        return self.network.join(stand_in, PATHS[name])


def asked(graph: Graph = PATROL, engine: str = "David") -> Any:
    override = Override(codes=CODES, reason="it is a test")
    return order(graph, engine=engine, override=override)


def lacking(graph: Graph = PATROL) -> Graph:
    """The first action has an input without a value."""
    first, *others = graph.actions
    need = Parameter("speed", '{"pvf_type": "number"}')
    return msgspec.structs.replace(
        graph, actions=(msgspec.structs.replace(first, inputs=(need,)), *others)
    )


def of_another(graph: Graph = PATROL) -> Graph:
    """The first action belongs to a robot that this one cannot synchronise with."""
    first, *others = graph.actions
    carols = msgspec.structs.replace(first, actor="Carol")
    return msgspec.structs.replace(graph, actions=(carols, *others))


async def told(scene: RobotsInNetwork, control: ExecutionService, request: Any) -> Run:
    """A start that the engine refuses, once it is over; it never begins anything."""
    run = (await control.start(request, ANN)).run
    assert await ended(control, run.id) == "refused", control.open.get(run.id)
    assert not any(node.robot.moving for node in scene.nodes.values())
    return scene.harness.journal.history(run.id)


@virtual
async def test_a_graph_that_the_engine_cannot_resolve_is_refused_in_its_own_words() -> None:
    scene = Knowing(1)
    async with scene.played() as control:
        run = await told(scene, control, asked())
    assert "Could not resolve graph 'patrol'" in run.detail
    assert [each.code for each in run.alarms] == ["start_refused"]
    assert run.alarms[0].text == "David says of this start: “Could not resolve graph 'patrol'”"
    assert run.proof_at is None


@virtual
async def test_a_robot_whose_engine_refused_a_start_is_free_for_the_next_one() -> None:
    scene = Knowing(2)
    async with scene.played() as control:
        await told(scene, control, asked())
        again = await told(scene, control, asked())
    assert again.end == "refused"
    assert len(scene.starts()) == 2


@virtual
async def test_a_graph_that_is_held_and_was_never_begun_is_refused_although_nobody_said_so() -> (
    None
):
    """H7: no word anywhere; the answers show a graph that the engine holds and has not begun."""
    scene = RobotsInNetwork(3)
    async with scene.played() as control:
        run = await told(scene, control, asked(lacking()))
    assert "speed" in run.detail
    assert "Work" in run.detail
    assert {each.state for each in run.actions.values()} == {"UNINITIALIZED"}


@virtual
async def test_a_broken_graph_that_stays_in_the_engine_is_refused_with_the_words_of_the_log() -> (
    None
):
    scene = RobotsInNetwork(4)
    async with scene.played() as control:
        run = await told(scene, control, asked(of_another()))
    assert "actor synchronizer not initialized" in run.detail


@virtual
async def test_without_a_word_an_engine_that_does_not_show_the_run_has_refused_nothing() -> None:
    """The start may still be under way: unknown, and Stop stays."""
    scene = Knowing(5, quirks=EngineTraits(narrates=False))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run
        await anyio.sleep(20)
        assert control.open[run.id].run.state == "unknown"
        await control.stop(run.id, BEN)
        await until(lambda: control.open[run.id].run.state == "lost")


@virtual
async def test_no_log_line_counts_as_a_refusal_while_there_are_two_engines() -> None:
    scene = Knowing(6, "David", "Carol")
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run
        await anyio.sleep(20)
        assert (control.open[run.id].run.state, control.open[run.id].run.alarms) == ("unknown", ())


@virtual
async def test_words_about_the_start_of_somebody_else_refuse_nothing_of_ours() -> None:
    """A stranger starts a running graph of that name: the engine refuses theirs."""
    scene = RobotsInNetwork(7)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run
        await anyio.sleep(1)
        text = codec.write(PATROL)
        scene.network.carry(Start(graph_name="patrol", targets=("David",), graph_json=text), "cli")
        await until(
            lambda: bool(control.open[run.id].run.loading)
        )  # no feedback tells of that stop
        await control.confirm_rest(run.id, LOOKED, BEN)
        await ended(control, run.id)
    codes = [each.code for each in scene.harness.journal.history(run.id).alarms]
    assert codes == ["foreign_start", "stop_unconfirmed"]
    assert scene.harness.journal.history(run.id).end == "error"


@virtual
async def test_a_stop_of_a_refused_start_does_not_wait_half_a_minute() -> None:
    scene = Knowing(8)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run
        await control.stop(run.id, BEN)
        began = now()
        assert await ended(control, run.id) == "refused"
        assert now() - began < 10


@virtual
async def test_the_words_of_a_refusal_outlive_the_runner() -> None:
    scene = Knowing(9)
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run
        scene.network.loss = {"get": 1.0}
        await anyio.sleep(0.5)
        assert control.open[run.id].run.alarms[0].code == "start_refused"
        await anyio.sleep(5)
    scene.network.loss = {}
    async with scene.played() as control:
        assert await ended(control, run.id) == "refused"
    assert "Could not resolve" in scene.harness.journal.history(run.id).detail


@virtual
async def test_words_that_somebody_else_may_have_caused_end_nothing_after_a_restart_either() -> (
    None
):
    scene = Knowing(10)
    text = codec.write(sequence("other"))
    async with scene.played() as control:
        run = (await control.start(asked(), ANN)).run
        scene.network.loss = {"get": 1.0}
        await anyio.sleep(0.5)
        scene.network.carry(Start(graph_name="other", targets=("David",), graph_json=text), "cli")
        await anyio.sleep(5)
        codes = [each.code for each in control.open[run.id].run.alarms]
        assert codes == ["start_refused", "foreign_other"]
    scene.network.loss = {}
    for _ in range(2):
        async with scene.played() as control:
            await anyio.sleep(15)
            assert control.open[run.id].run.state == "unknown"


# --- the lines themselves -----------------------------------------------------------------------------


@virtual
async def test_a_start_that_was_refused_and_yet_shows_something_moving_is_an_alarm() -> None:
    """The log and the engine's state contradict each other: motion is believed."""
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(PATROL, engine="David"), ANN)).run
        for line in (RECEIVED, REFUSAL):
            david.log(line)
        await until(lambda: len(control.open[run.id].run.alarms) > 1)
        alarms = {each.code: each.text for each in control.open[run.id].run.alarms}
        assert "yet shows the graph RUNNING" in alarms["half_begun"]
        assert "Could not resolve graph" in alarms["start_refused"]
        assert control.open[run.id].run.end is None
        await control.stop(run.id, BEN)
        assert await ended(control, run.id) == "stopped"
        assert not await david.moving("patrol")


@virtual
async def test_one_of_several_engines_that_lacks_the_run_proves_nothing() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(PATROL, engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        whole, other = david.engine, engine(NEVER)
        other._incarnation = whole._incarnation  # what answers does not say which it is
        david.engine, david.servers = other, 2
        await anyio.sleep(40)
        assert control.open[run.id].run.state == "unknown"
        david.engine, david.servers = whole, 1
        await until(lambda: control.open[run.id].run.state == "running")
        await control.stop(run.id, BEN)
        assert await ended(control, run.id) == "stopped"


def test_the_error_map_at_is_explained() -> None:
    assert "library of an action is not there" in why_refused("David", "map::at")
    assert why_refused("David", "No") == "David refused the start: No."


RECEIVED = "Received request to start UMRF graph: patrol"
REFUSAL = (
    "origin [in startGraphA]: Could not resolve graph 'patrol'\n   fwd [in startGraphA]: fwd\n"
)


def log() -> StartLog:
    run = Run(
        id="r", number=1, request_id="q", author=ANN, graph=None, graph_name="patrol", version="",
        digest="", engine="David", simulated=False, requested_at=0,
    )  # fmt: skip
    found = StartLog(run)
    found.begins()
    return found


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([RECEIVED, REFUSAL], "Could not resolve graph 'patrol'"),
        ([RECEIVED, "map::at"], "map::at"),
        ([RECEIVED, "Graph 'other' finished.", "map::at"], "map::at"),
        ([RECEIVED, "Received request to stop UMRF graph: other", "map::at"], ""),
        ([RECEIVED, "Received request to start UMRF graph: patrol", REFUSAL], ""),
        (["Received request to start UMRF graph: other", "map::at", RECEIVED], ""),
        ([RECEIVED, "The Action Engine is initialized.", "map::at"], ""),
        (["map::at"], ""),
        ([RECEIVED], ""),
    ],
)
def test_a_line_counts_by_its_place_behind_the_one_that_received_the_start(
    lines: list[str], words: str
) -> None:
    found = log()
    for line in lines:
        found.hear(line)
    assert found.words == words


def test_no_log_line_counts_after_a_start_of_somebody_else() -> None:
    found = log()
    found.hear(RECEIVED)
    found.doubt()
    found.hear("map::at")
    assert found.words == ""


def test_a_runner_that_takes_a_run_up_cannot_tell_whose_start_is_refused() -> None:
    run = Run(
        id="r", number=1, request_id="q", author=ANN, graph=None, graph_name="patrol", version="",
        digest="", engine="David", simulated=False, requested_at=0,
    )  # fmt: skip
    taken_up = StartLog(run)
    for line in (RECEIVED, REFUSAL):
        taken_up.hear(line)
    assert taken_up.words == ""
