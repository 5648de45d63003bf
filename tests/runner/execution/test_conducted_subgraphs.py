"""Sub-graphs in a led run: one robot gets its own as one piece, several robots' are refused."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest, GroupRequest, WordRequest
from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.extraction import Extracted, extracted
from action_assistant.umrf.model import Conditions, Graph, Relation
from runner.execution.test_conductor import Lab, alarms, led, refused, shared
from runner.harness import ANN, BEN, ended, sequence, until, virtual

ALWAYS = Conditions(on_true="run", on_false="run", on_error="run")


def named(graph: Graph, *names: str) -> Graph:
    """The graph with its actions called like this, from the first on."""
    renamed = tuple(
        msgspec.structs.replace(each, name=name, instance_id=0)
        for each, name in zip(graph.actions, names, strict=False)
    )
    return msgspec.structs.replace(graph, actions=(*renamed, *graph.actions[len(renamed) :]))


def ending(graph: Graph, conditions: Conditions = ALWAYS) -> Graph:
    """The graph with all its arrows to the exit like this."""
    relations = tuple(
        msgspec.structs.replace(each, conditions=conditions) if each.child == "exit" else each
        for each in graph.relations
    )
    return msgspec.structs.replace(graph, relations=relations)


def going_on(graph: Graph) -> Graph:
    """The graph whose actions follow each other whatever their outcome is."""
    relations = tuple(
        each if each.parent == "entry" else msgspec.structs.replace(each, conditions=ALWAYS)
        for each in graph.relations
    )
    return msgspec.structs.replace(graph, relations=relations)


def sent(graph: Graph, *inside: Graph, **more: Any) -> Any:
    """A start of a led run of a graph with these graphs inside."""
    subgraphs = tuple(
        SentSubgraph(
            name=each.name, digest=digest(each), umrf=msgspec.Raw(codec.write(each).encode())
        )
        for each in inside
    )
    tree = tree_digest(digest(graph), ((each.name, each.digest) for each in subgraphs))
    return led(graph, subgraphs=subgraphs, tree_digest=tree, **more)


def looking(request: Any) -> GroupRequest:
    """The pre-flight of a start."""
    names = GroupRequest.__struct_fields__
    fields = {name: getattr(request, name) for name in request.__struct_fields__ if name in names}
    return GroupRequest(**fields, engines=(request.engine,))


#: Scout picks something up, which is a graph of two steps, and Carrier follows.
TASK = shared(named(sequence("task", 2), "Pick"), "Scout", "Carrier")
PICK = sequence("Pick", 2)


@virtual
async def test_a_sub_graph_of_one_robot_goes_as_one_piece_and_is_shown_by_its_levels() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        run = (await control.start(sent(TASK, PICK), ANN)).run.id
        assert await ended(control, run) == "finished"
        found = lab.harness.journal.history(run)
        (pick,) = lab.david.starts
        assert pick.graph.name == f"task--Pick_0--v{run}.1"
        assert [each.graph.name for each in lab.carol.starts] == ["task--Work_1"]
        assert found.result == "on_true"
        assert {name for name in found.actions if "/" in name} == {
            "task__Pick__0/Work_0",
            "task__Pick__0/Work_1",
        }
        first, second = (found.actions[f"task__Pick__0/Work_{n}"].visits[-1] for n in range(2))
        assert found.actions["Pick_0"].visits[-1].result == "true"
        assert first.not_after <= second.not_after <= found.actions["Work_1"].visits[-1].start
        assert all(each.state == "FINISHED" for each in found.actions.values())


@virtual
async def test_each_visit_of_a_sub_graph_has_a_name_of_its_own() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    first, second = (each.key for each in TASK.actions)
    back = Relation(parent=second, child=first, conditions=ALWAYS, required=False)
    kept = tuple(each for each in TASK.relations if each.child != "exit")
    loop = msgspec.structs.replace(TASK, relations=(*kept, back))
    async with lab.runner() as control:
        run = (await control.start(sent(loop, PICK), ANN)).run.id
        await until(lambda: len(lab.david.starts) == 3 and len(lab.carol.starts) == 3)
        names = [each.graph.name for each in lab.david.starts]
        assert len(set(names)) == len(names)
        assert {each.graph.name for each in lab.carol.starts} == {"task--Work_1"}
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        visits = lab.harness.journal.history(run).actions["task__Pick__0/Work_0"].visits
        assert len(visits) >= 3


@pytest.mark.parametrize("outcome", ["on_true", "on_false", "on_error"])
@virtual
async def test_the_outcome_of_a_sub_graph_is_that_of_its_last_action(outcome: str) -> None:
    lab = Lab({"Work_0": [{"after_s": 1, "result": outcome}], "*": [{"after_s": 1}]})
    graph = going_on(TASK)
    async with lab.runner() as control:
        inside = ending(sequence("Pick", 1))
        run = (await control.start(sent(graph, inside), ANN)).run.id
        assert await ended(control, run) == "finished"
        found = lab.harness.journal.history(run)
        assert found.actions["Pick_0"].visits[-1].result == outcome.removeprefix("on_")
        assert found.alarms == ()


#: Two actions beside each other, of which one ends false and one with an error.
DOUBTFUL = {
    "Work_0": [{"after_s": 1, "result": "on_error"}],
    "Work_1": [{"after_s": 2, "result": "on_false"}],
}


def side_by_side() -> Graph:
    """The graph of DOUBTFUL: its states do not tell its outcome."""
    line = sequence("Pick", 2)
    first, second = (each.key for each in line.actions)
    return msgspec.structs.replace(
        line,
        relations=tuple(
            Relation(parent=parent, child=child, conditions=ALWAYS)
            for parent, child in (
                ("entry", first),
                ("entry", second),
                (first, "exit"),
                (second, "exit"),
            )
        ),
    )


@virtual
async def test_a_sub_graph_that_may_have_ended_false_or_with_an_error_asks_a_person() -> None:
    lab = Lab(DOUBTFUL)
    async with lab.runner() as control:
        run = (await control.start(sent(going_on(TASK), side_by_side(), lost="wait"), ANN)).run.id
        await until(lambda: control.open[run].run.held is not None)
        found = control.open[run].run
        assert [each.code for each in found.alarms] == ["led_ended"]
        assert lab.carol.starts == []
        assert found.held is not None
        await control.give_outcome(run, WordRequest("Pick_0", "false", "I saw it."), BEN)
        await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        assert await ended(control, run) == "finished"


@pytest.mark.parametrize("is_stored", [True, False])
@virtual
async def test_no_word_is_taken_for_a_piece_that_moves_again_and_the_run_is_held(
    is_stored: bool,
) -> None:
    lab = Lab(DOUBTFUL)
    async with lab.runner() as control:
        run = (await control.start(sent(going_on(TASK), side_by_side(), lost="wait"), ANN)).run.id
        await anyio.sleep(0.5)
        lab.harness.journal.slow = 0 if is_stored else 3
        await until(lambda: control.open[run].run.held is not None)
        first = control.open[run].run.held
        assert first is not None
        await control.go_on(run, GoOnRequest(time(first.at)), BEN)
        await anyio.sleep(1)
        assert (f"{run}.1" in control.open) is not is_stored
        await lab.david.engine.start(lab.david.starts[0])
        await until(lambda: bool(alarms(control.open[run].run, "moves_again")))
        assert control.open[run].run.held is not None
        with pytest.raises(Conflict, match="not known to be at rest"):
            await control.give_outcome(run, WordRequest("Pick_0", "true", "I saw it."), BEN)
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert lab.harness.journal.history(f"{run}.1").end is not None
        assert not await lab.david.moving(lab.david.starts[0].graph.name)
        assert lab.carol.starts == []


@virtual
async def test_a_stop_reaches_what_is_inside_of_a_piece() -> None:
    lab = Lab({"*": [{"never": True, "stop_s": 0.5}]})
    async with lab.runner() as control:
        run = (await control.start(sent(TASK, PICK), ANN)).run.id
        inner = "task__Pick__0/Work_0"
        await until(
            lambda: (
                inner in (now := lab.harness.journal.history(run).actions)
                and now[inner].state == "RUNNING"
            )
        )
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        name = lab.david.starts[0].graph.name
        assert not await lab.david.moving(name)
        assert not await lab.david.moving(f"{name}__Pick__0")
        assert lab.carol.starts == []


@virtual
async def test_a_restarted_runner_follows_a_sub_graph_and_reads_its_outcome() -> None:
    lab = Lab({"*": [{"after_s": 4}]})
    async with lab.runner() as control:
        run = (await control.start(sent(TASK, PICK, lost="wait"), ANN)).run.id
        await until(lambda: bool(lab.david.starts))
        await anyio.sleep(2)
    async with lab.runner() as control:
        await anyio.sleep(30)
        found = control.open[run].run
        assert found.held is not None
        assert found.actions["Pick_0"].visits[-1].result == "true"
        assert found.actions["task__Pick__0/Work_1"].state == "FINISHED"
        await control.go_on(run, GoOnRequest(time(found.held.at)), BEN)
        assert await ended(control, run) == "finished"
        assert len(lab.david.starts) == len(lab.carol.starts) == 1


@virtual
async def test_a_sub_graph_of_several_robots_is_refused_with_what_to_do() -> None:
    lab = Lab()
    inside = shared(PICK, "", "Carrier")
    async with lab.runner() as control:
        with pytest.raises(Conflict) as why:
            await control.start(sent(TASK, inside), ANN)
        assert "Pick_0 is a sub-graph of several robots" in why.value.detail
        assert "Carol (Work_1), David (Work_0)" in why.value.detail
        assert why.value.where is not None
        (obstacle,) = why.value.where["obstacles"]
        assert obstacle["code"] == "subgraph-across"
        (look,) = await control.look(looking(sent(TASK, inside)))
        (item,) = look.items
        assert item.code == "subgraph-across"
        assert lab.david.starts == lab.carol.starts == []


@virtual
async def test_the_actor_of_a_sub_graph_is_that_of_its_actions() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    inside, robots = shared(PICK, "David"), {"David": "David", "Carrier": "Carol"}
    async with lab.runner() as control:
        for actor in ("", "David", "Carrier"):
            task = shared(named(sequence("task", 2), "Pick"), actor, "Carrier")
            request = msgspec.structs.replace(sent(task, inside), robots=robots)
            run = (await control.start(request, ANN)).run.id
            assert await ended(control, run) == "finished"
        assert [each.graph.name.split("--v")[0] for each in lab.david.starts] == [
            "task--Pick_0"
        ] * 3
        assert len(lab.carol.starts) == 3


@virtual
async def test_a_sub_graph_whose_actions_name_another_actor_than_its_robot_is_said_before() -> None:
    lab = Lab()
    async with lab.runner() as control:
        why = await refused(control, sent(TASK, shared(PICK, "Scout")))
        assert "inside of Pick belong to Scout, not to David" in why
        assert lab.david.starts == []


@virtual
async def test_a_sub_graph_of_the_simulator_is_played_with_names_that_robots_have_too() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    task = shared(named(sequence("task", 2), "Pick"), "Scout", "Carrier")
    robots = {"Scout": "simulator", "Carrier": "Carol"}
    async with lab.runner() as control:
        request = msgspec.structs.replace(sent(task, sequence("Pick", 2)), robots=robots)
        run = (await control.start(request, ANN)).run.id
        assert await ended(control, run) == "finished"
        assert lab.david.starts == []
        assert [each.graph.name for each in lab.carol.starts] == ["task--Work_1"]
        found = lab.harness.journal.history(run)
        assert found.actions["task__Pick__0/Work_1"].state == "FINISHED"


def beside(*actors: str) -> Graph:
    """`Work_0` starts `Work_1` and `Work_2`, and `Work_3` waits for both; their actors, in this order."""
    line = shared(sequence("task", 4), *actors)
    first, one, other, last = (each.key for each in line.actions)
    pairs = (
        ("entry", first),
        (first, one),
        (first, other),
        (one, last),
        (other, last),
        (last, "exit"),
    )
    relations = tuple(
        Relation(parent=a, child=b, conditions=ALWAYS, parent_order=n, child_order=n)
        for n, (a, b) in enumerate(pairs)
    )
    return msgspec.structs.replace(line, relations=relations)


def made(graph: Graph, name: str, *chosen: str) -> tuple[Graph, Graph]:
    """The graph with a sub-graph of these actions, and that, as somebody makes it in the editor."""
    keys = [each.key for each in graph.actions if each.full_name in chosen]
    found = extracted(graph, keys, name, "made00000000")
    assert isinstance(found, Extracted)
    assert found.differences == ()
    return codec.read(codec.write(found.outer)).graph, codec.read(codec.write(found.inner)).graph


@virtual
async def test_three_actions_in_a_row_go_as_one_piece_once_they_are_made_a_sub_graph() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    row = going_on(shared(sequence("task", 5), "Carrier", "Scout", "Scout", "Scout", "Carrier"))
    outer, inner = made(row, "Round", "Work_1", "Work_2", "Work_3")
    async with lab.runner() as control:
        run = (await control.start(sent(outer, inner), ANN)).run.id
        assert await ended(control, run) == "finished"
        assert [each.graph.name for each in lab.david.starts] == [f"task--Round_0--v{run}.2"]
        assert len(lab.carol.starts) == 2
        found = lab.harness.journal.history(run)
        assert {name.rpartition("/")[2] for name in found.actions if "/" in name} == {
            "Work_1",
            "Work_2",
            "Work_3",
        }


@virtual
async def test_what_a_sub_graph_would_take_away_is_said_and_it_does() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    graph = beside("Carrier", "Scout", "Scout", "Carrier")
    async with lab.runner() as control:
        why = await refused(control, led(graph))
        assert "Make a sub-graph of Work_1 and Work_2: then they go as one step." in why
        outer, inner = made(graph, "Both", "Work_1", "Work_2")
        run = (await control.start(sent(outer, inner), ANN)).run.id
        assert await ended(control, run) == "finished"
        assert len(lab.david.starts) == 1


@virtual
async def test_a_sub_graph_beside_another_action_of_its_robot_is_two_at_once() -> None:
    lab = Lab({"*": [{"after_s": 2}]})
    graph = named(beside("Carrier", "Scout", "Scout", "Carrier"), "Work", "Pick")
    accepted = Override(("two-at-once",), "They are far apart.")
    async with lab.runner() as control:
        why = await refused(control, sent(graph, PICK))
        assert "Pick_0 may run at the same time as Work_2" in why
        assert "Make a sub-graph" in why
        run = (await control.start(sent(graph, PICK, override=accepted), ANN)).run.id
        await until(lambda: len(lab.david.starts) == 2)
        assert await ended(control, run) == "finished"
        assert control.open.get(run) is None
        assert [each.code for each in lab.harness.journal.history(run).alarms] == []
