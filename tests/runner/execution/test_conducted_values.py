"""Values that one step of a led run hands to another, also on another robot."""

import json
import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.links.port import Answer, Order, Registration
from action_assistant.runner.runs.events import PieceEnded
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, GroupRequest
from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import (
    KEEPER_PACKAGE,
    keeper,
    kept_outputs,
    unreadable_arrows,
    value_arrows,
)
from action_assistant.umrf.model import EXIT, Conditions, Graph, Parameter, Relation
from action_assistant.umrf.semantics import Behaviour
from action_assistant.umrf.semantics.values import MISSING, slots_of
from runner.execution.test_conducted_subgraphs import sent as with_inside
from runner.execution.test_conductor import led, shared
from runner.harness import ANN, BEN, GO_ON, Harness, Robot, ended, engine, sequence, until, virtual


class KeepingRobot(Robot):
    """A robot whose engine has indexed the helper package, and so names its actions."""

    known: tuple[str, ...] = ()
    known_graphs: tuple[str, ...] = ()

    async def get(self) -> Answer:
        """The answer with the index."""
        answer = await super().get()
        return msgspec.structs.replace(
            answer, known_actions=self.known, known_graphs=self.known_graphs
        )


def parameter(path: str, kind: str, *value: Any) -> Parameter:
    """A parameter of this type, with a value if one is given."""
    leaf: dict[str, Any] = {"pvf_type": kind}
    return Parameter(path, json.dumps(leaf | ({"pvf_value": value[0]} if value else {})))


class Lab:
    """Two robots that may be led, both with the helper package unless `keeping` says otherwise."""

    def __init__(
        self, script: dict[str, Any], keeping: tuple[str, ...] = ("David", "Carol")
    ) -> None:
        self.keeping = keeping
        self.david = KeepingRobot(engine(script), random.Random(1))
        self.carol = KeepingRobot(engine(script), random.Random(2))
        self.harness = Harness({"David": self.david, "Carol": self.carol})

    @asynccontextmanager
    async def runner(self, graph: Graph) -> AsyncIterator[ExecutionService]:
        """A runner whose robots have indexed the actions of a graph."""
        actions = {each.name: codec.write_action(each) for each in graph.actions}
        for name, robot in (("David", self.david), ("Carol", self.carol)):
            more = (codec.write_action(keeper()),) if name in self.keeping else ()
            robot.known = (*actions.values(), *more)
        async with self.harness.runner() as control, anyio.create_task_group() as engines:
            engines.start_soon(self.david.engine.run)
            engines.start_soon(self.carol.engine.run)
            for name in ("David", "Carol"):
                control.robots.add(Registration(name=name, led=True))
            await anyio.sleep(1)
            yield control
            engines.cancel_scope.cancel()

    def ends(self, run: str) -> list[PieceEnded]:
        """The ends of the steps of a run."""
        return [each for each in self.harness.journal.told(run) if isinstance(each, PieceEnded)]


def sent(robot: Robot, number: int) -> dict[str, Any]:
    """The values of the inputs of the action in a start message."""
    slots = slots_of(codec.read(robot.starts[number].umrf).graph.actions[0].inputs)
    return {name: slot.value for name, slot in slots.items() if slot.has_value()}


def relay(*given: tuple[tuple[Parameter, ...], tuple[Parameter, ...]]) -> Graph:
    """`Do0_0` on Scout, `Do1_0` on Carrier, and so on in turn, with these inputs and outputs."""
    line = shared(sequence("task", len(given)), "Scout", "Carrier")
    actions = tuple(
        msgspec.structs.replace(each, name=f"Do{n}", instance_id=0, inputs=ins, outputs=outs)
        for n, (each, (ins, outs)) in enumerate(zip(line.actions, given, strict=True))
    )
    return msgspec.structs.replace(line, actions=actions)


PLACE, SPEED = parameter("place", "string"), parameter("goal/speed", "number", 1)
HAND_OVER = relay(((), (PLACE, SPEED)), ((PLACE, SPEED), ()))
DOOR = {"place": "door", "goal::speed": 2.5}


@virtual
async def test_the_outputs_of_one_robot_are_the_inputs_of_the_other() -> None:
    lab = Lab({"Do0_0": [{"after_s": 1, "outputs": DOOR}]})
    async with lab.runner(HAND_OVER) as control:
        run = (await control.start(led(HAND_OVER), ANN)).run.id
        assert await ended(control, run) == "finished"
        assert sent(lab.carol, 0) == {"place": "door", "goal::speed": 2.5}
        assert lab.ends(run)[0].outputs == {"goal::speed": "2.5", "place": '"door"'}
        assert lab.ends(run)[0].unset == ()
        visit = lab.harness.journal.history(run).actions["Do0_0"].visits[-1]
        assert visit.outputs == {"goal::speed": "2.5", "place": '"door"'}


@virtual
async def test_values_of_an_action_that_ends_with_false_are_handed_on() -> None:
    lab = Lab({"Do0_0": [{"after_s": 1, "result": "on_false", "outputs": DOOR}]})
    async with lab.runner(HAND_OVER) as control:
        run = (await control.start(led(HAND_OVER), ANN)).run.id
        assert await ended(control, run) == "finished"
        assert lab.ends(run)[0].outcome == "on_false"
        assert sent(lab.carol, 0) == DOOR
        assert lab.harness.journal.history(run).alarms == ()


@virtual
async def test_an_action_that_fails_hands_nothing_on() -> None:
    taker = (msgspec.structs.replace(PLACE, text=parameter("place", "string", "home").text), SPEED)
    graph = relay(((), (PLACE, SPEED)), (taker, ()))
    lab = Lab({"Do0_0": [{"after_s": 1, "result": "on_error", "outputs": DOOR}]})
    async with lab.runner(graph) as control:
        run = (await control.start(led(graph), ANN)).run.id
        assert await ended(control, run) == "finished"
        assert [each.outcome for each in lab.ends(run)] == ["on_error", "on_true"]
        assert sent(lab.carol, 0) == {"place": "home", "goal::speed": 1.0}


@virtual
async def test_a_later_visit_overrides_what_an_earlier_one_gave() -> None:
    places = [{"after_s": 1, "outputs": {"place": name}} for name in ("door", "desk", "shelf")]
    graph = relay(((), (PLACE,)), ((PLACE,), ()))
    first, second = (each.key for each in graph.actions)
    back = Relation(parent=second, child=first, conditions=GO_ON, required=False)
    kept = tuple(each for each in graph.relations if each.child != EXIT)
    loop = msgspec.structs.replace(graph, relations=(*kept, back))
    lab = Lab({"Do0_0": places, "Do1_0": [{"after_s": 1}]})
    async with lab.runner(loop) as control:
        told = iter([each["outputs"] for each in places])  # each piece is a first call on its robot
        begin = lab.david._begin

        async def begun(order: Order) -> None:
            behaviour = Behaviour(after_s=1, outputs=next(told, {"place": "end"}))  # type: ignore[arg-type]
            lab.david.engine._engine.script.behaviours[f"{order.graph.name}/Do0_0"] = (behaviour,)
            await begin(order)

        lab.david._begin = begun  # type: ignore[method-assign]
        run = (await control.start(led(loop), ANN)).run.id
        await until(lambda: len(lab.carol.starts) == 3)
        assert [sent(lab.carol, n) for n in range(3)] == [each["outputs"] for each in places]
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"


@virtual
async def test_a_robot_without_the_package_is_refused_with_the_arrow() -> None:
    lab = Lab({}, keeping=("Carol",))
    async with lab.runner(HAND_OVER) as control:
        with pytest.raises(Conflict) as refused:
            await control.start(led(HAND_OVER), ANN)
        assert "Do0_0 hands “goal::speed”, “place” to Do1_0" in refused.value.detail
        assert KEEPER_PACKAGE in refused.value.detail
        assert "override" not in refused.value.detail
        assert lab.david.starts == []


@virtual
async def test_a_robot_that_hands_nothing_on_needs_no_package() -> None:
    lab = Lab({"Do0_0": [{"outputs": DOOR}]}, keeping=("David",))
    async with lab.runner(HAND_OVER) as control:
        run = (await control.start(led(HAND_OVER), ANN)).run.id
        assert await ended(control, run) == "finished"


@virtual
async def test_outputs_that_nobody_takes_are_shown_and_need_no_package() -> None:
    graph = relay(((), (PLACE,)), ((), (SPEED,)))
    lab = Lab({"Do0_0": [{"outputs": {"place": "door"}}]}, keeping=("David",))
    async with lab.runner(graph) as control:
        run = (await control.start(led(graph), ANN)).run.id
        assert await ended(control, run) == "finished"
        found = lab.harness.journal.history(run).actions
        assert found["Do0_0"].visits[-1].outputs == {"place": '"door"'}
        assert found["Do1_0"].visits[-1].outputs is None


@pytest.mark.parametrize("kind", ["geometry_msgs::Pose", "strings2", ""])
@virtual
async def test_a_value_of_a_type_that_is_not_native_is_refused_with_the_arrow(kind: str) -> None:
    odd = parameter("pose", kind)
    graph = relay(((), (PLACE, odd)), ((PLACE, odd), ()))
    lab = Lab({})
    async with lab.runner(graph) as control:
        with pytest.raises(Conflict) as refused:
            await control.start(led(graph), ANN)
        assert "Do0_0 hands “place”, “pose” to Do1_0" in refused.value.detail
        assert "“pose”" in refused.value.detail
        assert lab.david.starts == []


@virtual
async def test_an_output_that_is_not_set_is_told_and_hands_nothing_on() -> None:
    taker = (msgspec.structs.replace(PLACE, text=parameter("place", "string", "home").text), SPEED)
    graph = relay(((), (PLACE, SPEED)), (taker, ()))
    lab = Lab({})
    outputs = {"place": MISSING, "goal::speed": 3.0}
    async with lab.runner(graph) as control:
        for result in ("on_true", "on_false"):
            behaviour = Behaviour(after_s=1, result=result, outputs=outputs)  # type: ignore[arg-type]
            lab.david.engine._engine.script.behaviours["task--Do0_0/Do0_0"] = (behaviour,)
            run = (await control.start(led(graph), ANN)).run.id
            assert await ended(control, run) == "finished"
            first = lab.ends(run)[0]
            assert (first.outcome, first.unset) == (result, ("place",))
            assert sent(lab.carol, -1) == {"place": "home", "goal::speed": 3.0}
            alarms = lab.harness.journal.history(run).alarms
            assert [each.code for each in alarms] == ["led_unset"]
            assert "without giving “place”" in alarms[0].text


@pytest.mark.parametrize(
    "value", ["x" * 70_000, 3.0, ["a"], True], ids=["too large", "a number", "a list", "a bool"]
)
@virtual
async def test_a_value_that_cannot_be_taken_is_told_and_nothing_further_begins(value: Any) -> None:
    lab = Lab({"Do0_0": [{"after_s": 1, "outputs": DOOR | {"place": "door"}}]})
    async with lab.runner(HAND_OVER) as control:
        behaviour = Behaviour(after_s=1, outputs=DOOR | {"place": value})
        lab.david.engine._engine.script.behaviours["task--Do0_0/Do0_0"] = (behaviour,)
        run = (await control.start(led(HAND_OVER, lost="wait"), ANN)).run.id
        await until(lambda: control.open[run].run.held is not None)
        held = control.open[run].run.held
        assert held is not None
        assert "What Do0_0 on David has given is not known" in held.why
        await anyio.sleep(10)
        assert lab.carol.starts == []
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"


@virtual
async def test_values_are_the_same_after_a_restart_of_the_runner() -> None:
    graph = relay(((), (PLACE, SPEED)), ((), ()), ((PLACE, SPEED), ()))
    first, _, third = (each.key for each in graph.actions)
    across = Relation(parent=first, child=third, conditions=Conditions(on_true="run"))
    graph = msgspec.structs.replace(graph, relations=(*graph.relations, across))
    lab = Lab({"Do0_0": [{"after_s": 1, "outputs": DOOR}], "Do1_0": [{"after_s": 10}]})
    async with lab.runner(graph) as control:
        run = (await control.start(led(graph), ANN)).run.id
        await until(lambda: bool(lab.carol.starts))
    async with lab.runner(graph) as control:
        await until(lambda: run in control.open)
        await anyio.sleep(15)
        found = control.open[run].run
        assert found.held is not None
        await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert sent(lab.david, -1) == DOOR


@pytest.mark.parametrize(
    "names", [("!", "#", "a", "b", "c"), ("0", "1", "2", "3"), ("A", "A1", "A10", "B")]
)
def test_an_arrow_is_refused_where_the_engine_would_lose_a_renamed_output(
    names: tuple[str, ...],
) -> None:
    odd = tuple(parameter(name, "string") for name in names)
    graph = relay(((), odd), (odd, ()))
    assert kept_outputs(graph.actions[0]) == ()
    ((arrow, _, why),) = unreadable_arrows(graph, tuple(value_arrows(graph)))
    assert (arrow.parent, arrow.child) == tuple(each.key for each in graph.actions)
    assert "under other names" in why


@virtual
async def test_nothing_is_said_of_outputs_that_nobody_could_see() -> None:
    only_true = tuple(
        msgspec.structs.replace(each, conditions=Conditions(on_true="run"))
        for each in HAND_OVER.relations
    )
    graph = msgspec.structs.replace(HAND_OVER, relations=only_true)
    lab = Lab({"Do0_0": [{"after_s": 1, "result": "on_false", "outputs": DOOR}]})
    async with lab.runner(graph) as control:
        run = (await control.start(led(graph), ANN)).run.id
        assert await ended(control, run) == "halted"
        (first,) = lab.ends(run)
        assert (first.outcome, first.outputs, first.unset) == ("on_false", {}, ())
        assert lab.harness.journal.history(run).alarms == ()


@virtual
async def test_a_stopped_action_is_not_said_to_lack_outputs() -> None:
    lab = Lab({"Do0_0": [{"never": True, "stop_s": 0.5, "outputs": DOOR}]})
    async with lab.runner(HAND_OVER) as control:
        run = (await control.start(led(HAND_OVER), ANN)).run.id
        await until(lambda: lab.harness.journal.history(run).actions["Do0_0"].state == "RUNNING")
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert lab.harness.journal.history(run).alarms == ()
        assert (lab.ends(run)[0].outputs, lab.ends(run)[0].unset) == ({}, ())


@pytest.mark.parametrize("outcome", ["on_true", "on_false"])
@virtual
async def test_the_outputs_of_a_sub_graph_are_handed_on_too(outcome: str) -> None:
    look = msgspec.structs.replace(
        sequence("Do0", 1).actions[0], name="Look", outputs=(PLACE, SPEED)
    )
    inside = msgspec.structs.replace(sequence("Do0", 1), actions=(look,))
    lab = Lab({"Look_0": [{"after_s": 1, "result": outcome, "outputs": DOOR}]})
    async with lab.runner(HAND_OVER) as control:
        known = (look, HAND_OVER.actions[1], keeper())
        for robot in (lab.david, lab.carol):
            robot.known = tuple(map(codec.write_action, known))
            robot.known_graphs = (codec.write(inside),)
        run = (await control.start(with_inside(HAND_OVER, inside), ANN)).run.id
        assert await ended(control, run) == "finished"
        first = lab.ends(run)[0]
        assert first.outcome == outcome
        assert sent(lab.carol, 0) == DOOR
        assert lab.harness.journal.history(run).alarms == ()


@virtual
async def test_the_look_before_a_start_names_the_arrow_and_the_package() -> None:
    lab = Lab({}, keeping=("Carol",))
    async with lab.runner(HAND_OVER) as control:
        request = led(HAND_OVER)
        group = GroupRequest(
            umrf=request.umrf, engines=("conducted",), robots=request.robots, lost="stop"
        )
        looks = {each.engine: each for each in await control.look(group, ANN.id)}
        (item,) = (each for each in looks["David"].items if each.code == "values")
        assert item.verdict == "blocked"
        assert not item.overridable
        assert "Do0_0 hands “goal::speed”, “place” to Do1_0" in item.text
        assert "values" not in {each.code for each in looks["Carol"].items}
        assert looks["David"].never
