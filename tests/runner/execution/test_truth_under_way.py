"""An older answer changes nothing, and each run hears the starts of others that concern it. In
virtual time."""

import anyio
import msgspec

from action_assistant.runner.emulator.messages import EngineTraits, Start
from action_assistant.runner.links.port import Answer, Feedback, Leaves, Order, unwatched
from action_assistant.umrf.files import codec
from runner.harness import ANN, BEN, Harness, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet
from runner.robots_in_network import LOOKED, OTHER, PATROL, RobotsInNetwork, asked, shown


class Overtaken(Open):
    """A robot whose next answer is on its way for a while when `slow`."""

    slow = False

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """The message takes longer than a question does."""
        await super().start(order, leaves)
        self.slow = True

    async def get(self) -> Answer:
        """Return the answer of the moment of the question, once 0.8 s late."""
        answer = await super().get()
        if self.slow:
            self.slow = False
            await anyio.sleep(0.8)
        return answer

    async def show(self) -> None:
        """Feedback, of how it is now."""
        held = (await self.engine.get()).graphs
        seen = tuple(msgspec.structs.replace(each, source="feedback") for each in held)
        self.tell(Feedback(actor="David", snapshots=seen))


@virtual
async def test_an_answer_from_before_the_start_ends_no_run_that_was_shown_meanwhile() -> None:
    david = Overtaken(NEVER)
    async with fleet(Harness(), David=david) as control, anyio.create_task_group() as tasks:
        david.tasks, david.start_delay = tasks, 0.05
        run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
        await anyio.sleep(0.3)
        await david.show()
        assert shown(control, run).state == "running"
        await anyio.sleep(5)
        assert (shown(control, run).state, shown(control, run).alarms) == ("running", [])
        await control.stop(run, BEN)
        await until(lambda: not control.open)


@virtual
async def test_each_run_that_is_open_on_a_robot_hears_what_others_start_there() -> None:
    scene = RobotsInNetwork(
        11,
        quirks=EngineTraits(loading_ms=3_000.0),
        script={"*": [{"after_s": 20.0, "ignores_stop": True}]},
    )
    async with scene.played() as control:
        first = (await control.start(asked(), ANN)).run.id
        await anyio.sleep(0.3)
        await control.stop(first, BEN)
        await until(lambda: bool(control.open[first].run.loading))
        await control.confirm_rest(first, LOOKED, BEN)
        await until(lambda: first not in control.open)
        second = (await control.start(order(OTHER, engine="David"), ANN)).run.id
        await until(
            lambda: first in control.open
        )  # an action of it begins although somebody looked
        assert list(control.open) == [second, first]
        text = codec.write(PATROL)
        scene.network.carry(Start(graph_name="patrol", targets=("David",), graph_json=text), "cli")
        await anyio.sleep(0.1)
        told = {run: {each.code for each in shown(control, run).alarms} for run in control.open}
        assert "foreign_start" in told[first]
        assert "foreign_other" in told[second]
        heard = [each for _, each in await control.robots.robot_log.newest("David", 9)]
        assert [each.run for each in heard if each.kind == "robot.commanded.v1"] == [first]
