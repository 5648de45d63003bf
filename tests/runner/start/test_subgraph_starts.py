"""Graphs inside of a start: proven by their digests, run by the simulator, held against a robot's index."""

from typing import Any

import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict, TooLarge
from action_assistant.runner.links.port import Registration
from action_assistant.runner.runs.events import Override, Requested
from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.start.admission import StartRequest, admit, prepared
from action_assistant.runner.start.approvals import ApprovalRequest
from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Action, Graph
from runner.harness import ANN, BEN, Harness, ended, order, sequence, virtual
from runner.registered_robots import Open, fleet, group, verdicts

FAST = {"*": [{"after_s": 0.2}]}


def outer(name: str = "tour", inner: str = "round") -> Graph:
    """A graph of one action, which stands for another graph."""
    graph = sequence(name, actions=1)
    only = msgspec.structs.replace(graph.actions[0], name=inner)
    return msgspec.structs.replace(graph, actions=(only,))


def sent(graph: Graph, **changes: Any) -> SentSubgraph:
    text = codec.write(graph, codec.Stamp("g2", None, None)).encode()
    fields: dict[str, Any] = {
        "name": graph.name,
        "digest": digest(graph),
        "umrf": msgspec.Raw(text),
        "version": "v2",
        "graph": "g2",
    }
    return SentSubgraph(**(fields | changes))


def start(*inside: SentSubgraph, **more: Any) -> StartRequest:
    whole = outer()
    pairs = [(each.name, each.digest) for each in inside]
    fields = {"subgraphs": inside, "tree_digest": tree_digest(digest(whole), pairs)}
    return order(whole, **(fields | more))


def test_graphs_inside_have_the_approved_digests() -> None:
    ready = prepared(start(sent(sequence("round"))), SIMULATED, "r1")
    (kept,) = ready.subgraphs
    assert (kept.name, kept.version, kept.graph) == ("round", "v2", "g2")
    assert kept.digest == digest(codec.read(kept.umrf).graph)
    assert ready.tree_digest == tree_digest(ready.digest, [("round", kept.digest)])
    assert ready.inner == ("Work",)


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"umrf": msgspec.Raw(codec.write(sequence("round", 2)).encode())}, "/subgraphs/0/digest"),
        ({"digest": "0" * 64}, "/subgraphs/0/digest"),
        ({"digest": ""}, "/subgraphs/0/digest"),
        ({"name": "other"}, "/subgraphs/0/name"),
        ({"umrf": msgspec.Raw(b'{"n": [}')}, "/subgraphs/0/umrf"),
    ],
)
def test_another_graph_inside_is_refused(change: dict[str, Any], path: str) -> None:
    with pytest.raises((Conflict, BadInput)) as refused:
        admit(start(sent(sequence("round"), **change)), SIMULATED)
    assert str((refused.value.where or {})["path"]).startswith(path)


def test_the_tree_has_the_approved_digest() -> None:
    whole = start(sent(sequence("round")), sent(sequence("more")))
    assert admit(whole, SIMULATED).inside.keys() == {"round", "more"}
    for inside in (whole.subgraphs[:1], ()):
        with pytest.raises(Conflict) as refused:
            admit(msgspec.structs.replace(whole, subgraphs=inside), SIMULATED)
        assert refused.value.where == {"path": "/tree_digest"}
    plain = msgspec.structs.replace(whole, subgraphs=(), tree_digest=None)
    assert admit(plain, SIMULATED).inside == {}
    with pytest.raises(BadInput, match="comes twice"):
        admit(start(sent(sequence("round")), sent(sequence("round"))), SIMULATED)


def test_graphs_inside_count_for_the_size_limit_of_a_start() -> None:
    with pytest.raises(TooLarge, match="at most 200 graphs"):
        admit(start(*[sent(sequence(f"g{n}", 1)) for n in range(201)]), SIMULATED)


def test_problems_of_graphs_inside_block_the_start() -> None:
    graph = sequence("round")
    endless = msgspec.structs.replace(graph, relations=graph.relations[:-1])
    with pytest.raises(Conflict, match="ends HALTED") as refused:
        admit(start(sent(endless)), SIMULATED)
    assert [each["code"] for each in (refused.value.where or {})["problems"]] == ["H8"]


@virtual
async def test_the_simulator_runs_what_is_inside_and_the_run_keeps_it() -> None:
    harness = Harness()
    async with harness.runner() as control:
        asked = start(sent(sequence("round", 2)), script=FAST)
        run = (await control.start(asked, ANN)).run
        assert await ended(control, run.id) == "finished"
        done = harness.journal.history(run.id)
        inner = [name for name in done.actions if name.startswith("tour__round__0/")]
        assert sorted(inner) == ["tour__round__0/Work_0", "tour__round__0/Work_1"]
        assert [len(done.actions[name].visits) for name in inner] == [1, 1]
        first = harness.journal.told(run.id)[0]
        assert isinstance(first, Requested)
        assert [each.name for each in first.subgraphs] == ["round"]
        assert first.tree_digest == asked.tree_digest
        again = await control.start(asked, ANN)
        assert (again.fresh, again.run.id) == (False, run.id)
        other = msgspec.structs.replace(asked, tree_digest="0" * 64)
        with pytest.raises(Conflict, match="another start"):
            await control.start(other, ANN)


@virtual
async def test_a_stop_reaches_what_is_inside() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(start(sent(sequence("round"))), ANN)).run
        await control.stop(run.id, ANN)
        assert await ended(control, run.id) == "stopped"


def index_of(robot: Open, *graphs: Graph) -> None:
    """Make the robot index these graphs."""
    robot.known_graphs = tuple(codec.write(each) for each in graphs)


@virtual
async def test_a_robot_s_index_is_held_against_what_is_inside() -> None:
    david = Open()
    pinned = sequence("round", 2)
    asked = group(outer(), "David", digest="", subgraphs=(sent(pinned),))
    index_of(david, pinned)
    async with fleet(Harness(), David=david) as control:
        (look,) = await control.look(asked)
        assert set(verdicts(look).values()) == {"passed"}
        assert look.tree_digest == start(sent(pinned)).tree_digest
    index_of(david, sequence("round", 3))
    async with fleet(Harness(), David=david) as control:
        (look,) = await control.look(asked)
        (item,) = [each for each in look.items if each.code == "subgraphs"]
        assert (item.verdict, item.codes, item.overridable) == (
            "blocked",
            ("subgraph-differs",),
            True,
        )
        assert "has indexed round otherwise" in item.text
        on_robot = start(sent(pinned), engine="David")
        with pytest.raises(Conflict, match="round otherwise"):
            await control.start(on_robot, ANN)
        over = Override(codes=("subgraph-differs",), reason="It is the better one.")
        run = (await control.start(msgspec.structs.replace(on_robot, override=over), ANN)).run
        assert [each.code for each in run.despite] == ["subgraphs"]
        await control.stop(run.id, ANN)
        await ended(control, run.id)


@virtual
async def test_a_robot_that_lacks_a_graph_deep_inside_is_not_started() -> None:
    david = Open()
    middle = outer("round", "leg")
    index_of(david, middle)
    async with fleet(Harness(), David=david) as control:
        asked = group(
            outer(), "David", digest="", subgraphs=(sent(middle), sent(sequence("leg", 1)))
        )
        (look,) = await control.look(asked)
        (item,) = [each for each in look.items if each.code == "subgraphs"]
        assert (item.verdict, item.codes) == ("blocked", ("unknown-action",))
        assert "David has not indexed leg" in item.text


@virtual
async def test_a_second_person_says_yes_to_what_is_inside_too() -> None:
    david, pinned = Open(), sequence("round", 2)
    index_of(david, pinned)
    async with fleet(Harness(), David=david) as control:
        await control.register(Registration(name="David", profile={"second_person": True}), ANN)
        asked = start(sent(pinned), engine="David")
        await control.approvals.give(ApprovalRequest(digest=asked.digest), BEN)
        with pytest.raises(Conflict, match="second person"):
            await control.start(asked, ANN)
        await control.approvals.give(ApprovalRequest(digest=asked.tree_digest or ""), BEN)
        run = (await control.start(asked, ANN)).run
        await control.stop(run.id, ANN)
        assert await ended(control, run.id) == "stopped"


@virtual
async def test_sub_graphs_of_a_robot_without_an_index_are_unknown() -> None:
    david = Open()
    david.known_actions = ()
    async with fleet(Harness(), David=david) as control:
        asked = group(outer(), "David", digest="", subgraphs=(sent(sequence("round")),))
        (look,) = await control.look(asked)
        assert verdicts(look)["subgraphs"] == "warned"


@virtual
async def test_an_action_of_the_robot_comes_before_a_graph() -> None:
    david = Open()
    david.known_actions = (codec.write_action(Action(key="round", name="round")),)
    async with fleet(Harness(), David=david) as control:
        asked = group(outer(), "David", digest="", subgraphs=(sent(sequence("round")),))
        (look,) = await control.look(asked)
        assert verdicts(look)["subgraphs"] == "blocked"


@virtual
async def test_a_robot_is_not_given_a_graph_with_actions_of_another_robot_inside() -> None:
    inner = sequence("round", actions=1)
    eves = msgspec.structs.replace(inner.actions[0], actor="Eve")
    inner = msgspec.structs.replace(inner, actions=(eves,))
    david, inside = Open(), sent(inner)
    index_of(david, inner)
    async with fleet(Harness(), David=david) as control:
        with pytest.raises(Conflict, match="belong to Eve") as refused:
            await control.start(start(inside, engine="David"), ANN)
        assert (refused.value.where or {})["item"] == "actors"
        run = (await control.start(start(inside), ANN)).run
        assert await ended(control, run.id) == "finished"
