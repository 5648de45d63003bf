"""Limits of a robot: what is refused before a start, and what a second person says yes to."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Leaves, Order, Registration, unwatched
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import Requested
from action_assistant.runner.start.approvals import ApprovalRequest
from action_assistant.umrf.facts import PINNED, SECOND_PERSON
from action_assistant.umrf.files import codec
from action_assistant.umrf.limits import Limit
from action_assistant.umrf.model import Action, Graph
from runner.harness import Harness, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, change, fleet, group
from runner.start.test_rights_registry import ANN, OLGA, author, david, lab
from runner.start.test_starts_again import nested
from umrf.test_limits import parameter, task

TORQUE = Limit(parameter="torque", most=60)
LIMITED = Rules(limits=(TORQUE,))
HIGH, LOW = task(parameter("torque", "number", 80)), task(parameter("torque", "number", 50))


async def item(control: ExecutionService, graph: Any) -> tuple[str, str]:
    """Return verdict and text of the item about limits in David's pre-flight."""
    (found,) = await control.look(group(graph, "David"), "ann", ANN)
    return next((each.verdict, each.text) for each in found.items if each.code == "limit")


@virtual
async def test_a_start_outside_a_limit_is_refused_with_all_that_it_names() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, LIMITED) as control:
        said = "David would get 80 as torque of Grip_0. The limit there is torque at most 60."
        assert await item(control, HIGH) == ("blocked", said)
        for start in (
            control.start(order(HIGH, engine="David"), author(ANN), ANN),
            control.start_group(group(HIGH, "David"), author(ANN), ANN),
        ):
            with pytest.raises(Refused, match="80 as torque of Grip_0"):
                await start
        assert robot.starts == []
        verdict, text = await item(control, LOW)
        assert (verdict, "which the robot does not enforce: torque at most 60" in text) == (
            "passed",
            True,
        )
        run = (await control.start(order(LOW, engine="David"), author(ANN), ANN)).run.id
        assert control.open[run].run.limits == {"David": (TORQUE,)}
        simulated = (await control.start(order(HIGH), author(ANN), ANN)).run
        assert simulated.limits == {}
        await control.stop(run, author(ANN))
        await until(lambda: run not in control.open)
    (first,) = (each for each in harness.journal.told(run) if isinstance(each, Requested))
    assert first.limits == {"David": (TORQUE,)}


@virtual
async def test_a_limit_that_comes_while_a_start_is_stored_keeps_its_message_back() -> None:
    robot = david()
    harness = Harness({"David": robot})
    async with lab(harness, Rules()) as control:
        harness.journal.slow = 0.5
        found: list[str] = []

        async def begin() -> None:
            try:
                started = await control.start(order(HIGH, engine="David"), author(ANN), ANN)
                found.append(started.run.detail)
            except Refused as refused:
                found.append(refused.detail)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(begin)
            await anyio.sleep(0.2)
            await control.rights.set_rules("David", LIMITED, OLGA)
        assert robot.starts == []
        assert "The limits of David have changed since this was checked" in found[0]


@virtual
async def test_a_second_person_says_yes_to_the_limits_too() -> None:
    robot = david()
    async with lab(Harness({"David": robot}), LIMITED) as control:
        control.robots.add(Registration(name="David", profile={SECOND_PERSON: True}))
        await anyio.sleep(1)
        (found,) = await control.look(group(LOW, "David"), "ann", ANN)
        assert found.order_digest != found.tree_digest
        await control.approvals.give(ApprovalRequest(digest=found.order_digest), OLGA)
        (found,) = await control.look(group(LOW, "David"), "ann", ANN)
        assert {each.code: each.verdict for each in found.items}["approved"] == "passed"
        wider = msgspec.structs.replace(LIMITED, limits=(Limit(parameter="torque", most=70),))
        await control.rights.set_rules("David", wider, OLGA)
        with pytest.raises(Conflict, match="nobody else has said yes"):
            await control.start(order(LOW, engine="David"), author(ANN), ANN)
        await control.rights.set_rules("David", LIMITED, OLGA)
        await control.start(order(LOW, engine="David"), author(ANN), ANN)
        await until(lambda: len(robot.starts) == 1)


class Pausing(Open):
    """A robot on which pausing is safe."""

    pauses = True


@virtual
async def test_another_version_and_a_resume_are_held_to_the_limits_of_that_moment() -> None:
    robot = Pausing(NEVER)
    async with fleet(Harness(), David=robot) as control:
        await control.rights.set_rules("David", LIMITED, OLGA)
        run = (await control.start(order(sequence(), engine="David"), author(ANN))).run
        robot.texts = {run.graph_name: codec.write(sequence())}
        await until(lambda: control.open[run.id].run.state == "running")
        high = msgspec.structs.replace(
            sequence(), actions=tuple(replaced(each) for each in sequence().actions)
        )
        with pytest.raises(Refused, match="David would get 80 as torque of Work_0"):
            await control.modify(run.id, change(high), author(ANN))
        await control.pause(run.id, author(ANN))
        await control.rights.set_rules("David", Rules(), OLGA)
        with pytest.raises(Conflict, match="limits of David have changed since"):
            await control.resume(run.id, author(ANN))
        await control.rights.set_rules("David", LIMITED, OLGA)
        await control.resume(run.id, author(ANN))
        control.stop_all(author(ANN))
        await until(lambda: not control.open)


def replaced(action: Action) -> Action:
    """The action with a torque of 80."""
    return msgspec.structs.replace(action, inputs=(parameter("torque", "number", 80),))


def test_a_change_to_a_graph_that_only_the_robot_has_cannot_be_held_to_limits() -> None:
    """The engine looks up sub-graphs in a change, which brings none of their values."""

    class Changing(Pausing):
        sent = 0

        async def modify(
            self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
        ) -> None:
            """Count what leaves."""
            self.sent += 1

    @virtual
    async def asked() -> None:
        david = Changing(NEVER)
        david.known_graphs = (codec.write(inner_task(80)),)
        async with fleet(Harness(), David=david) as control:
            david.facts = msgspec.structs.replace(PINNED, restart_matches=True)
            control.robots.reachable("David").facts = david.facts
            await control.rights.set_rules("David", LIMITED, OLGA)
            run = (await control.start(order(sequence("outer"), engine="David"), author(ANN))).run
            await until(lambda: control.open[run.id].run.state == "running")
            with pytest.raises(Conflict, match="cannot be held to the limits of David"):
                await control.modify(run.id, change(nested()), author(ANN))
            assert david.sent == 0
            control.stop_all(author(ANN))
            await until(lambda: not control.open)

    asked()


@virtual
async def test_a_start_of_a_graph_that_only_the_robot_has_cannot_be_held_to_limits() -> None:
    david = Open(NEVER)
    david.known_graphs = (codec.write(inner_task(80)),)
    async with fleet(Harness(), David=david) as control:
        await control.rights.set_rules("David", LIMITED, OLGA)
        with pytest.raises(Conflict, match="the robot would run what nobody has seen here"):
            await control.start(order(nested(), engine="David"), author(ANN))
        assert david.starts == []


def inner_task(torque: float) -> Graph:
    """The graph of the action `Inner` of `nested`."""
    return msgspec.structs.replace(task(parameter("torque", "number", torque)), name="Inner")
