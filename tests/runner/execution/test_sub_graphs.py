"""Sub-graphs carry no mark and stay in the engine after their run: which of them are a run's own."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import index_of
from action_assistant.runner.execution.evidence import SubGraphs
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import Registration
from action_assistant.runner.runs.events import Override
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import script_from
from runner.fake_network import Node, now_ms
from runner.harness import ANN, ended, order, sequence, until, virtual
from runner.robots_in_network import PATHS, RobotsInNetwork

SUB = sequence("Sub", 1)
FACTS = msgspec.structs.replace(PINNED, restart_matches=True)
SCRIPT = {"Work_0": [{"after_s": 4}], "*": [{"after_s": 1}]}


class WithSub(RobotsInNetwork):
    """Robots whose engines have indexed a graph called Sub."""

    def __init__(self, seed: int, *, script: dict[str, Any], sub: Graph = SUB) -> None:
        self.sub = sub
        super().__init__(seed, script=script)

    def robot(self, name: str) -> Node:
        """An engine comes up."""
        stand_in = EmulatedEngine(
            name,
            index=index_of([], [codec.write(self.sub)]),
            script=script_from({"behaviours": self.script}),
            quirks=self.quirks,
            facts=FACTS,
            born_ms=now_ms(),
        )
        return self.network.join(stand_in, PATHS[name])


def named(*names: str) -> Graph:
    """These actions, one after the other."""
    line = sequence("patrol", len(names))
    actions = tuple(
        msgspec.structs.replace(action, name=name, instance_id=0)
        for action, name in zip(line.actions, names, strict=True)
    )
    return msgspec.structs.replace(line, actions=actions)


async def played(scene: RobotsInNetwork, graph: Graph) -> str:
    codes = ("quiet", "others", "actions", "actors", "H5", "H8", "unknown-action", "restart")
    override = Override(codes=codes, reason="it is a test")
    async with scene.played() as control:
        knows = Registration(name="David", profile={"restart_matches": True})
        await control.register(knows, ANN)
        await until(lambda: control.robots.robot("David").state == "answering")
        run = (await control.start(order(graph, engine="David", override=override), ANN)).run.id
        assert await ended(control, run) == "finished"
        await anyio.sleep(1)
    return run


@virtual
async def test_a_sub_graph_of_an_earlier_run_is_no_part_of_one_that_has_only_its_name() -> None:
    scene = WithSub(1, script=SCRIPT)
    first = scene.harness.journal.history(await played(scene, named("Sub")))
    assert set(first.actions) == {"Sub_0", "patrol__Sub__0/Work_0"}
    second = scene.harness.journal.history(await played(scene, named("Work")))
    assert set(second.actions) == {"Work_0"}
    assert second.parts == {}


@virtual
async def test_a_run_does_not_show_an_earlier_sub_graph_before_its_own_begins() -> None:
    scene = WithSub(2, script=SCRIPT)
    await played(scene, named("Sub"))
    run = scene.harness.journal.history(await played(scene, named("Work", "Sub")))
    (outer,) = run.actions["Work_0"].visits
    (inner,) = run.actions["patrol__Sub__0/Work_0"].visits
    assert outer.until is not None
    assert inner.start >= outer.until


# --- one look -----------------------------------------------------------------------------------------


def snapshot(graph: str, state: str, **nodes: str) -> Snapshot:
    return Snapshot(at=1, graph=graph, state=state, nodes=nodes)


OLD = snapshot("g__S__0", "FINISHED", W_0="FINISHED")


@pytest.mark.parametrize(
    ("state", "part", "ours"),
    [
        ("UNINITIALIZED", OLD, [False, False]),
        ("INITIALIZED", OLD, [False, False]),
        ("RUNNING", snapshot("g__S__0", "RUNNING", W_0="RUNNING"), [True, True]),
        ("RUNNING", OLD, [False, True]),  # its own may be about to take this one's place
        ("FINISHED", OLD, [True, True]),
        ("ERROR", OLD, [True, True]),
    ],
)
def test_a_part_is_a_runs_own_once_the_action_that_is_it_has_begun(
    state: str, part: Snapshot, ours: list[bool]
) -> None:
    parts, own = SubGraphs(), snapshot("g", "RUNNING", S_0=state)
    assert [bool(parts.ours(own, [part])) for _ in ours] == ours


def test_a_part_of_a_part_is_judged_by_that_and_a_graph_of_no_action_is_none() -> None:
    own = snapshot("g", "RUNNING", S_0="RUNNING")
    middle = snapshot("g__S__0", "RUNNING", T_0="RUNNING")
    inner = snapshot("g__S__0__T__0", "RUNNING", W_0="RUNNING")
    stray = snapshot("g__other__1", "RUNNING", W_0="RUNNING")
    assert SubGraphs().ours(own, [inner, stray, middle]) == [middle, inner]
