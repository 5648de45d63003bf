"""A name that an engine holds: what was started once under it decides what can be started again.

The engine does not look up sub-graphs when a name is started again, and dies of it at the next get.
The robots are emulated; `test_standin_refusals.py` holds them against what the real node did.
"""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.emulator.messages import EngineTraits, Start, index_of
from action_assistant.runner.links.port import Leaves, Order, unwatched
from action_assistant.runner.runs.events import Override
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action, Graph
from runner.fake_network import now_ms
from runner.harness import ANN, Harness, order, sequence, until, virtual
from runner.registered_robots import Open, change, fleet, group, verdicts
from runner.robots_in_network import PATHS, EmulatedEngine, RobotsInNetwork, script_from

WORK = codec.write_action(Action(key="work", name="Work"))
INNER = sequence("Inner", 1)


def nested(name: str = "outer") -> Graph:
    """A chain of three, of which the second is a sub-graph."""
    graph = sequence(name)
    first, second, third = graph.actions
    actions = (first, msgspec.structs.replace(second, name="Inner", instance_id=0), third)
    return msgspec.structs.replace(graph, actions=actions)


class Indexed(RobotsInNetwork):
    """Robots that have indexed an action and a graph."""

    def robot(self, name: str) -> Any:
        """An engine comes up, in a new life."""
        stand_in = EmulatedEngine(
            name,
            index=index_of([WORK], [codec.write(INNER)]),
            script=script_from({"behaviours": self.script}),
            quirks=self.quirks,
            born_ms=now_ms(),
        )
        return self.network.join(stand_in, PATHS[name])


def scene() -> Indexed:
    return Indexed(1, quirks=EngineTraits(loss=0.0), script={"*": [{"after_s": 0.2}]})


async def run(control: Any, graph: Graph) -> str:
    """Start it and wait for its end."""
    started = (await control.start(order(graph, engine="David"), ANN)).run
    await until(lambda: started.id not in control.open)
    state: str = (await control.find(started.id)).state
    return state


@virtual
async def test_a_graph_with_a_sub_graph_is_not_started_twice_in_one_life_of_its_engine() -> None:
    network = scene()
    async with network.played() as control:
        assert await run(control, nested()) == "finished"
        (look,) = await control.look(group(nested(), "David"))
        assert [each.code for each in look.items if each.verdict == "blocked"] == ["again"]
        assert look.never
        with pytest.raises(Conflict, match="does not look up Inner_0") as refused:
            await run(control, nested())
        assert (refused.value.where or {})["item"] == "again"
        assert "Restart the engine, or give the graph another name" in refused.value.detail
        override = Override(look.override, "I stand beside it")
        with pytest.raises(Conflict):
            await control.start(order(nested(), engine="David", override=override), ANN)
        await anyio.sleep(5)
        assert not network.nodes["David"].robot.gone
        assert len(network.starts()) == 1


@virtual
async def test_another_name_or_another_life_of_the_engine_is_the_way_out() -> None:
    network = scene()
    async with network.played() as control:
        assert await run(control, nested()) == "finished"
        assert await run(control, nested("other")) == "finished"
        network.network.kill(network.nodes["David"])
        await anyio.sleep(15)
        network.nodes["David"] = network.robot("David")
        await anyio.sleep(5)
        assert await run(control, nested()) == "finished"
        assert not network.nodes["David"].robot.gone


@virtual
async def test_a_graph_without_lookups_can_be_started_any_number_of_times() -> None:
    async with scene().played() as control:
        for _ in range(3):
            assert await run(control, sequence("patrol")) == "finished"


@virtual
async def test_a_name_that_somebody_else_has_used_is_held_as_well() -> None:
    """A name is held even if its graph has left the engine's index since, or has no sub-graphs."""
    network = scene()
    async with network.played() as control:
        text = codec.write(sequence("outer"))
        network.network.carry(
            Start(graph_name="outer", targets=("David",), graph_json=text), "them"
        )
        await anyio.sleep(5)
        with pytest.raises(Conflict, match="does not look up Inner_0"):
            await run(control, nested())
        assert await run(control, sequence("outer")) == "finished"
        assert not network.nodes["David"].robot.gone


@virtual
async def test_no_start_of_a_group_when_one_of_its_engines_would_not_survive() -> None:
    network = Indexed(
        1, "David", "Carol", quirks=EngineTraits(loss=0.0), script={"*": [{"after_s": 0.2}]}
    )
    async with network.played() as control:
        assert await run(control, nested()) == "finished"
        with pytest.raises(Conflict, match=r"David: .*does not look up Inner_0"):
            await control.start_group(group(nested(), "David", "Carol"), ANN)
        assert len(network.starts()) == 1


@virtual
async def test_one_sub_graph_twice_is_refused_before_anything_is_sent() -> None:
    network, graph = scene(), nested()
    doubled = msgspec.structs.replace(graph.actions[2], name="Inner", instance_id=1)
    twice = msgspec.structs.replace(graph, actions=(*graph.actions[:2], doubled))
    async with network.played() as control:
        (look,) = await control.look(group(twice, "David"))
        assert [each.code for each in look.items if each.verdict == "blocked"] == ["actions"]
        assert look.never
        with pytest.raises(Conflict, match="“Inner” comes a second time"):
            await run(control, twice)
        assert network.starts() == []


@virtual
async def test_an_action_that_nobody_knows_is_never_overridden_under_a_name_that_is_held() -> None:
    """The first time an engine only refuses it."""
    david, graph = Open(), sequence("patrol", 2)
    stranger = msgspec.structs.replace(graph.actions[1], name="Nobody", instance_id=0)
    unknown = msgspec.structs.replace(graph, actions=(graph.actions[0], stranger))
    async with fleet(Harness(), David=david) as control:
        (look,) = await control.look(group(unknown, "David"))
        assert (verdicts(look)["actions"], look.never) == ("blocked", False)
        assert await run(control, graph) == "finished"
        (look,) = await control.look(group(unknown, "David"))
        assert (verdicts(look)["again"], look.never) == ("blocked", True)


@virtual
async def test_an_engine_that_names_no_actions_is_judged_by_what_it_holds() -> None:
    david = Open()
    david.known_actions = ()
    inner = Order(run="theirs", graph=sequence("outer__Inner__0", 1), umrf="")
    outer = Order(run="theirs", graph=sequence("outer", 1), umrf="")
    async with fleet(Harness(), David=david) as control:
        await david.engine.start(outer)
        await anyio.sleep(5)
        (look,) = await control.look(group(nested(), "David"))
        assert verdicts(look)["again"] == "passed"
        await david.engine.start(inner)
        await anyio.sleep(5)
        (look,) = await control.look(group(nested(), "David"))
        assert verdicts(look)["again"] == "blocked"


@virtual
async def test_an_engine_that_looks_them_up_again_is_let_do_so() -> None:
    david = Open()
    async with fleet(Harness(), David=david) as control:
        robot = control.robots.reachable("David")
        assert await run(control, sequence("outer", 1)) == "finished"
        (look,) = await control.look(group(nested(), "David"))
        assert verdicts(look)["again"] == "blocked"
        robot.facts = msgspec.structs.replace(PINNED, restart_matches=True)
        (look,) = await control.look(group(nested(), "David"))
        assert verdicts(look)["again"] == "passed"


def test_a_change_with_a_sub_graph_in_it_is_not_sent() -> None:
    """The engine takes a change without looking it up, even where the run has the sub-graph
    already."""

    class Pausing(Open):
        pauses = True
        sent = 0

        async def modify(
            self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
        ) -> None:
            """Fail the test: this must not be called."""
            self.sent += 1

    @virtual
    async def asked() -> None:
        david = Pausing({"*": [{"never": True}]})
        async with fleet(Harness(), David=david) as control:
            started = (await control.start(order(sequence("outer"), engine="David"), ANN)).run
            await until(lambda: control.open[started.id].run.state == "running")
            with pytest.raises(Refused, match="does not look up Inner_0 in a change"):
                await control.modify(started.id, change(nested()), ANN)
            assert david.sent == 0
            control.stop_all(ANN)
            await until(lambda: not control.open)

    asked()
