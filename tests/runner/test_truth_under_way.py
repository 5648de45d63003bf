"""What is said of a run is not what an older answer told, and what others start is heard by every run
that it concerns. In virtual time."""

import anyio

from action_assistant.runner.standin_wire import Quirks, Start
from action_assistant.umrf import codec
from runner.scene import OTHER, PATROL, Scene, asked, shown
from runner.world import ANN, BEN, order, until, virtual


@virtual
async def test_each_run_that_is_open_on_a_robot_hears_what_others_start_there() -> None:
    scene = Scene(
        11,
        quirks=Quirks(loading_ms=3_000.0),
        script={"*": [{"after_s": 20.0, "ignores_stop": True}]},
    )
    async with scene.played() as control:
        first = (await control.start(asked(), ANN)).run.id
        await anyio.sleep(0.3)
        await control.stop(first, BEN)
        await until(lambda: first not in control.open)
        second = (await control.start(order(OTHER, engine="David"), ANN)).run.id
        await until(lambda: first in control.open)  # an action of it begins after the proof
        assert list(control.open) == [second, first]
        text = codec.write(PATROL)
        scene.air.carry(Start(graph_name="patrol", targets=("David",), graph_json=text), "cli")
        await anyio.sleep(0.1)
        told = {run: {each.code for each in shown(control, run).alarms} for run in control.open}
        assert "foreign_start" in told[first]
        assert "foreign_other" in told[second]
        heard = [each for _, each in await control.robots.flight.newest("David", 9)]
        assert [each.run for each in heard if each.kind == "robot.commanded.v1"] == [first]
