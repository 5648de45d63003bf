"""A person's word that a robot rests covers some runs, and not others."""

from contextlib import suppress
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, NotFound
from action_assistant.runner.emulator.messages import EngineTraits, Start, Stop
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.registry import Robots
from action_assistant.umrf.files import codec
from runner.harness import (
    ANN,
    BEN,
    at_once,
    clock_us,
    order,
    sequence,
    until,
    virtual,
)
from runner.robots_in_network import LOOKED, STUBBORN, RobotsInNetwork, asked, shown


@virtual
async def test_a_word_of_rest_given_while_the_engine_was_silent_does_not_cover_a_later_error() -> (
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
    async with scene.network.running():
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
    stored = scene.harness.journal.streams[f"run/{run}"]
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
    async with scene.network.running():
        journal, robots = scene.harness.journal, Robots(scene.harness.links)
        await anyio.sleep(0.5)
        scene.network.carry(
            Start(graph_name="theirs", targets=("David",), graph_json=text), "other"
        )
        await anyio.sleep(1)
        async with ExecutionService.opened(
            journal, robots, clock_us=clock_us, run_in_worker=at_once, past=past
        ):
            await anyio.sleep(60)
    assert asked_for == ["AAAAAAAAAAAA"]
