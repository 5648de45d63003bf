"""A running graph takes another version, or keeps the one that it has."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import anyio
import pytest

from action_assistant.errors import Conflict, OutcomeUnknown, Refused
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import (
    Answer,
    EngineRefused,
    Leaves,
    NoAnswer,
    NotSent,
    Order,
    unwatched,
)
from action_assistant.runner.robots.registry import Robots
from action_assistant.umrf.files import codec
from runner.harness import ANN, BEN, Harness, clock_us, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, change, fleet


@virtual
async def test_a_running_graph_takes_another_version_where_pausing_is_safe() -> None:
    harness = Harness()
    async with harness.runner() as control:
        script = {"*": [{"after_s": 2}]}
        run = (await control.start(order(sequence(actions=2), script=script), ANN)).run
        await anyio.sleep(1)
        changed = await control.modify(run.id, change(sequence(actions=3)), BEN)
        assert (changed.version, changed.digest) == ("v2", order(sequence(actions=3)).digest)
        await until(lambda: not control.open)
    told = harness.journal.history(run.id)
    assert (told.state, told.version) == ("finished", "v2")
    assert [a.state for a in told.actions.values()] == ["FINISHED"] * 3


@virtual
async def test_elsewhere_a_change_is_refused_before_anything_is_read_or_sent() -> None:
    async with fleet(Harness(), David=Open(NEVER)) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        await until(lambda: control.open[run.id].run.state == "running")
        with pytest.raises(Conflict, match="not safe on David"):
            await control.modify(run.id, b"", ANN)
        control.stop_all(ANN)
        await until(lambda: not control.open)


@pytest.mark.parametrize("why", [EngineRefused("no"), NotSent("no")])
def test_a_change_that_was_not_made_leaves_the_version_that_runs(why: Exception) -> None:
    class Refuses(Open):
        pauses = True

        async def modify(
            self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
        ) -> None:
            """Fail with the given error."""
            raise why

    @virtual
    async def asked() -> None:
        david, harness = Refuses(NEVER), Harness()
        async with fleet(harness, David=david) as control:
            run = (await control.start(order(sequence(), engine="David"), ANN)).run
            david.texts = {run.graph_name: codec.write(sequence())}
            await until(lambda: control.open[run.id].run.state == "running")
            with pytest.raises(Refused, match="no"):
                await control.modify(run.id, change(sequence(actions=4)), BEN)
            await anyio.sleep(2)
            now = control.open[run.id].run
            assert (now.version, now.digest) == ("v1", run.digest)
            assert list(now.actions) == list(run.actions)
            assert [action.aid for action in now.actions.values()] == [
                action.aid for action in run.actions.values()
            ]
            assert now.alarms == ()
            control.stop_all(ANN)
            await until(lambda: not control.open)
        assert harness.journal.history(run.id).version == "v1"

    asked()


@virtual
async def test_a_change_that_was_read_while_the_run_was_stopped_is_not_sent() -> None:
    async def slowly(work: Callable[..., Any], *args: Any) -> Any:
        """A large graph."""
        await anyio.sleep(1)
        return work(*args)

    harness = Harness()
    async with ExecutionService.opened(
        harness.journal, Robots(), clock_us=clock_us, run_in_worker=slowly
    ) as control:
        run = (await control.start(order(sequence(), script=NEVER), ANN)).run
        await anyio.sleep(1)
        async with anyio.create_task_group() as tasks:

            async def ask() -> None:
                with pytest.raises(Conflict, match="Only a running run"):
                    await control.modify(run.id, change(sequence(actions=2)), ANN)

            tasks.start_soon(ask)
            await anyio.sleep(0.5)
            await control.stop(run.id, BEN)
        await until(lambda: not control.open)
    told = harness.journal.history(run.id)
    assert (told.state, told.version) == ("stopped", "v1")


@virtual
async def test_a_graph_of_another_name_cannot_take_the_place_of_a_run() -> None:
    async with Harness().runner() as control:
        run = (await control.start(order(sequence(), script=NEVER), ANN)).run
        await anyio.sleep(1)
        with pytest.raises(Conflict, match="cannot take its place"):
            await control.modify(run.id, change(sequence("other")), ANN)
        control.stop_all(ANN)
        await until(lambda: not control.open)


class Changes(Open):
    """A robot that takes changes, and whose answers are `late_s` seconds old when they come."""

    pauses = True
    late_s = 0.0
    is_asked = False
    fault: Exception | None = None

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Show the new graph from now on."""
        if self.fault is not None:
            raise self.fault
        self.texts = {order.graph.name: order.umrf}

    async def get(self) -> Answer:
        """Return the answer of the moment of the question, after `late_s`."""
        answer = await super().get()
        self.is_asked = True
        await anyio.sleep(self.late_s)
        self.is_asked = False
        return answer


@asynccontextmanager
async def changing(david: Changes) -> AsyncIterator[tuple[ExecutionService, OpenRun]]:
    """A run on David, whose graph is compared with what was sent."""
    async with fleet(Harness(), David=david) as control:
        run = (await control.start(order(sequence(), engine="David"), ANN)).run
        david.texts = {run.graph_name: codec.write(sequence())}
        await until(lambda: control.open[run.id].run.state == "running")
        await anyio.sleep(40)  # from now on nobody but the monitor of the run asks
        yield control, control.open[run.id]
        control.stop_all(ANN)
        await until(lambda: not control.open)


@virtual
async def test_an_answer_from_before_the_change_is_not_compared_with_it() -> None:
    david = Changes(NEVER)
    async with changing(david) as (control, opened):
        david.late_s = 0.5
        await until(lambda: david.is_asked)
        await control.modify(opened.run.id, change(sequence(actions=4)), BEN)
        assert david.is_asked
        await anyio.sleep(10)
        assert opened.run.alarms == ()


@pytest.mark.parametrize("fault", [NoAnswer("no answer"), RuntimeError("broken"), TimeoutError()])
def test_a_change_that_may_or_may_not_have_left_is_told_as_not_known(fault: Exception) -> None:
    @virtual
    async def asked() -> None:
        david = Changes(NEVER)
        async with changing(david) as (control, opened):
            david.fault = fault
            with pytest.raises(OutcomeUnknown) as told:
                await control.modify(opened.run.id, change(sequence(actions=4)), BEN)
            assert told.value.detail.startswith(
                "Nobody knows whether the graph was changed on David"
            )
            await anyio.sleep(3)
            alarms = {each.code: each.text for each in opened.run.alarms}
            assert alarms["modify_unknown"] == told.value.detail
            assert "echo_differs" in alarms  # it shows the graph that it had

    asked()
