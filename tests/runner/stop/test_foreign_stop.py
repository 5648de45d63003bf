"""A stop of somebody else's graph, where no answer can prove it. In virtual time."""

import anyio

from action_assistant.runner.links.port import Order
from action_assistant.runner.robots.robot_events import StopUnproven, StopWasProven
from runner.harness import BEN, Harness, engine, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet


@virtual
async def test_no_answer_proves_that_it_stopped_where_several_engines_answer_or_another_life() -> (
    None
):
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        robots = control.robots
        await david.engine.start(Order(run="theirs", graph=sequence("cleaning"), umrf=""))
        await anyio.sleep(15)
        david.servers = 2
        control.stop_robot("David", BEN)
        await until(
            lambda: "2 engines" in (control.foreign_stops.trouble("David", "cleaning") or "")
        )
        assert control.foreign_stops.is_stopping("David")
        david.engine, david.servers = engine(NEVER), 1
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        told = [event for _, event in await robots.robot_log.newest("David", 20)]
        (given_up,) = [event for event in told if isinstance(event, StopUnproven)]
        assert "restarted" in given_up.why
        assert not [event for event in told if isinstance(event, StopWasProven)]
