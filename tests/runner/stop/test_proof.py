"""Rest is proven by answers over some time, and graphs of others are not overlooked."""

from typing import Any, cast

import anyio

from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import Answer
from action_assistant.runner.robots.engine import foreign_graphs
from action_assistant.runner.stop.proof import RestProof, send_stop
from runner.harness import virtual


def held(graph: str, state: str, work: str, run: str | None = None) -> Snapshot:
    return Snapshot(at=0, graph=graph, state=state, nodes={"Work_0": work}, run=run)


def answer(*graphs: Snapshot) -> Answer:
    return Answer(asked_at=0, at=0, incarnation="life", graphs=graphs)


def test_a_graph_of_others_that_may_go_on_by_itself_is_one_that_runs() -> None:
    between = held("theirs", "RUNNING", "FINISHED")
    assert foreign_graphs(answer(between, held("over", "FINISHED", "FINISHED")), ()) == ["theirs"]


def test_sub_graphs_are_named_by_their_graph_and_our_own_runs_not_at_all() -> None:
    found = answer(
        held("theirs", "RUNNING", "RUNNING"),
        held("theirs__part", "RUNNING", "RUNNING"),
        held("ours", "RUNNING", "RUNNING", run="r1"),
        held("late", "STOPPED", "RUNNING", run="r2"),
    )
    assert foreign_graphs(found, {"r1"}) == ["late", "theirs"]


@virtual
async def test_a_graph_that_one_look_did_not_show_is_looked_for_again() -> None:
    rest = RestProof(exact=False)
    assert not rest.missing((), anyio.current_time())
    await anyio.sleep(0.2)
    assert not rest.missing((held("theirs__part", "RUNNING", "RUNNING"),), anyio.current_time())
    await anyio.sleep(0.2)
    assert not rest.missing((), anyio.current_time())
    await anyio.sleep(0.5)
    assert rest.missing((), anyio.current_time())


@virtual
async def test_a_graph_that_begins_again_by_itself_is_observed_for_longer() -> None:
    for spontaneous, proven in (((), True), (("Work_0",), False)):
        over = Snapshot(
            at=0,
            graph="patrol",
            state="STOPPED",
            nodes={"Work_0": "FINISHED"},
            spontaneous=spontaneous,
        )
        rest = RestProof(exact=False)
        assert not rest.seen((over,), anyio.current_time())
        await anyio.sleep(0.6)
        assert rest.seen((over,), anyio.current_time()) == proven
        await anyio.sleep(60)
        assert rest.seen((over,), anyio.current_time())


@virtual
async def test_a_link_that_holds_a_stop_message_back_is_told_and_waited_for_no_longer() -> None:
    class Stuck:
        async def stop(self, graph: str) -> None:
            await anyio.sleep_forever()

    began = anyio.current_time()
    assert "could not be handed over" in await send_stop(cast("Any", Stuck()), "patrol")
    assert anyio.current_time() - began == 1.0
