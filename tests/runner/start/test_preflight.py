"""The look before a start: what stands in the way is shown and refused alike."""

from pathlib import Path

import msgspec
import pytest

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.links.port import (
    Order,
    Registration,
)
from action_assistant.runner.robots.robot_events import StopWasProven
from action_assistant.runner.runs.events import Override
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Parameter
from action_assistant.umrf.packages.naming import snake_case
from runner.colcon_workspace import changed, workspace
from runner.harness import ANN, BEN, Harness, ended, order, sequence, until, virtual
from runner.registered_robots import NEVER, Open, fleet, given, group, verdicts


@virtual
async def test_a_sound_robot_passes_every_item_and_the_look_sends_nothing() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        asked = group(sequence(), "David", digest="")
        (look,) = await control.look(asked)
        assert set(verdicts(look).values()) == {"passed"}
        assert (look.override, look.never) == ((), False)
        assert look.digest == order(sequence()).digest
    assert david.starts == []


@pytest.mark.parametrize(
    ("code", "overridable"),
    [
        ("answers", False),
        ("proof", True),
        ("actions", True),
        ("built", True),
        ("others", True),
        ("actors", True),
    ],
)
def test_items_that_block_are_shown_and_refused_alike(
    code: str, *, overridable: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if code == "built":
        package = snake_case(sequence().actions[0].name)
        monkeypatch.setenv("AMENT_PREFIX_PATH", str(workspace(tmp_path, package=package)))
        changed(tmp_path, f"src/{package}.cpp", package)

    @virtual
    async def asked() -> None:
        david, graph = Open(), sequence()
        async with fleet(Harness(), David=david) as control:
            match code:
                case "answers":
                    david.silent = True
                case "proof":
                    david.servers = 2
                case "actions":
                    graph = given(graph, "colour")
                case "others":
                    david.others = 1
                case "built":
                    pass
                case _:
                    actor = msgspec.structs.replace(graph.actions[0], actor="Eve")
                    graph = msgspec.structs.replace(graph, actions=(actor, *graph.actions[1:]))
            (look,) = await control.look(group(graph, "David"))
            assert [item for item, verdict in verdicts(look).items() if verdict == "blocked"] == [
                code
            ]
            assert look.never is not overridable
            with pytest.raises(Refused) as refused:
                await control.start(order(graph, engine="David"), ANN)
            assert (refused.value.where or {})["item"] == code
            assert david.starts == []
            if overridable:
                override = Override(look.override, "I stand beside it")
                again = order(graph, engine="David", override=override)
                started = await control.start(again, ANN)
                assert started.run.override == override
                assert len(david.starts) == 1

    asked()


@virtual
async def test_a_graph_of_somebody_else_is_in_the_way_until_it_is_stopped() -> None:
    david = Open(NEVER)
    async with fleet(Harness(), David=david) as control:
        await david.engine.start(Order(run="theirs", graph=sequence("cleaning"), umrf=""))
        (look,) = await control.look(group(sequence(), "David"))
        assert verdicts(look)["quiet"] == "blocked"
        (same,) = await control.look(group(sequence("cleaning"), "David"))
        assert same.never
        assert control.foreign_stops.stop(BEN, lambda _: ()) == ["David: cleaning"]
        await until(lambda: not control.foreign_stops.is_stopping("David"))
        assert not await david.moving("cleaning")
        told = [event for _, event in await control.robots.robot_log.newest("David", 9)]
        assert isinstance(told[-1], StopWasProven)
        (look,) = await control.look(group(sequence(), "David"))
        assert verdicts(look)["quiet"] == "passed"


@virtual
async def test_a_graph_of_its_own_index_is_never_started_under_the_same_name() -> None:
    david = Open()
    david.known_graphs = (codec.write(sequence("patrol")),)
    async with fleet(Harness(), David=david) as control:
        (look,) = await control.look(group(sequence("patrol"), "David"))
        assert look.never
        with pytest.raises(Conflict, match="its own index"):
            await control.start(order(sequence("patrol"), engine="David"), ANN)


@virtual
async def test_the_simulator_that_plays_a_robot_refuses_what_the_robot_would() -> None:
    graph = sequence(actions=2)
    first, second = graph.actions
    both = tuple(
        msgspec.structs.replace(action, actor=actor)
        for action, actor in ((first, "David"), (second, "Eve"))
    )
    graph = msgspec.structs.replace(graph, actions=both)
    async with fleet(Harness(), David=Open()) as control:
        with pytest.raises(Conflict, match="synchronise"):
            await control.start(order(graph, like="David"), ANN)
        override = Override(codes=("actors",), reason="it is a test")
        run = (await control.start(order(graph, like="David", override=override), ANN)).run
        assert [each.code for each in run.despite] == ["actors"]
        assert await ended(control, run.id) == "refused"
        run = (await control.start(order(graph), ANN)).run
        assert await ended(control, run.id) == "finished"
        await control.register(Registration(name="David", profile={"synchronises": True}), ANN)
        assert (await control.start(order(graph, like="David"), ANN)).run.like == "David"


@virtual
async def test_a_robot_that_has_an_action_as_it_was_before_is_not_started() -> None:
    """The graph has a parameter that the robot's file of the action lacks."""
    david, graph = Open(), sequence()
    newer = tuple(
        msgspec.structs.replace(
            action, inputs=(Parameter("torque", '{"pvf_type": "number", "pvf_value": 1}'),)
        )
        for action in graph.actions
    )
    async with fleet(Harness(), David=david) as control:
        asked = group(msgspec.structs.replace(graph, actions=newer), "David", digest="")
        (look,) = await control.look(asked)
        assert verdicts(look)["actions"] == "blocked"
        (item,) = [each for each in look.items if each.code == "actions"]
        assert "torque" in msgspec.json.encode(item).decode()
    assert david.starts == []
