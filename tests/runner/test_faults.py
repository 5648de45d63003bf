"""A fault in one place keeps Stop from nothing: in a link, in what is kept beside runs, in what looks
back on them. In virtual time."""

import anyio
import pytest

from action_assistant.runner.links.port import Answer, Order
from runner.fleet import Open
from runner.test_robots import NEVER, fleet
from runner.world import ANN, BEN, World, order, sequence, until, virtual


class Faulty(Open):
    """A robot whose link fails in ways that nobody foresaw."""

    stops_fail = False
    gets_fail = False

    async def stop(self, graph_name: str) -> None:
        """The middleware breaks after the message has left."""
        await super().stop(graph_name)
        if self.stops_fail:
            raise RuntimeError("the context is not valid")

    async def get(self) -> Answer:
        """The middleware breaks before it has asked."""
        if self.gets_fail:
            raise RuntimeError("the context is not valid")
        return await super().get()


@virtual
async def test_a_link_that_breaks_while_it_stops_is_stopped_by_again_and_told_as_unconfirmed() -> (
    None
):
    david = Faulty(NEVER)
    async with fleet(World(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        david.stops_fail, david.loss = True, 1.0
        await control.stop(run.id, BEN)
        await anyio.sleep(10)
        told = control.open[run.id].run
        assert len(david.stops) > 5
        assert any("not valid" in each.text for each in told.alarms if "unconf" in each.code)
        david.stops_fail, david.loss = False, 0.0
        await until(lambda: not control.open)
        assert (await control.find(run.id)).state == "stopped"


@virtual
async def test_a_link_that_breaks_when_it_asks_leaves_the_run_unknown() -> None:
    david = Faulty(NEVER)
    async with fleet(World(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        david.gets_fail = True
        await anyio.sleep(10)
        assert control.open[run.id].run.state == "unknown"
        assert control.robots.robot("David").state == "busy"
        david.gets_fail = False
        await until(lambda: control.open[run.id].run.state == "running")


@pytest.mark.parametrize("fault", ["stops_fail", "gets_fail"])
def test_a_link_that_breaks_while_a_graph_of_somebody_else_is_stopped_ends_nothing(
    fault: str,
) -> None:
    @virtual
    async def lived() -> None:
        david, eve = Faulty(NEVER), Open(NEVER)
        async with fleet(World(), David=david, Eve=eve) as control:
            run = (await control.start(order(sequence(), engine="Eve"), ANN)).run
            await david.engine.start(Order(run="theirs", graph=sequence("cleaning"), umrf=""))
            await anyio.sleep(15)
            setattr(david, fault, True)
            control.stop_robot("David", BEN)
            await anyio.sleep(10)
            assert control.robots.silencing.trouble("David", "cleaning")
            assert control.open[run.id].run.state == "running"
            setattr(david, fault, False)
            await until(lambda: not control.robots.silencing.going("David"))
            assert not await david.moving("cleaning")

    lived()
