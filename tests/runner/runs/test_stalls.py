"""A graph that runs while none of its actions does: an alarm that names what it waits for, while it
goes on, and a cause afterwards. The real runner and stand-in robots, in virtual time."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.runner.analysis.cause_texts import cause_sentence
from action_assistant.runner.analysis.causes import causes
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.events import Override
from action_assistant.runner.runs.run import Run
from action_assistant.umrf.model import ENTRY, Conditions, Graph, Parameter, Relation
from runner.execution.test_sub_graphs import WithSub, named
from runner.harness import ANN, BEN, GO_ON, ended, order, sequence, two_ends, virtual
from runner.robots_in_network import RobotsInNetwork

CODES = ("quiet", "others", "actions", "actors", "H2b", "H5", "H7", "unknown-action", "H8", "H12")
QUICK: dict[str, Any] = {"*": [{"after_s": 0.5}]}


def asked(graph: Graph) -> Any:
    return order(graph, engine="David", override=Override(codes=CODES, reason="it is a test"))


def with_input(graph: Graph, place: int, text: str = '{"pvf_type": "number"}') -> Graph:
    actions = list(graph.actions)
    need = Parameter("speed", text)
    actions[place] = msgspec.structs.replace(actions[place], inputs=(need,))
    return msgspec.structs.replace(graph, actions=tuple(actions))


def answering(graph: Graph, parent: int, child: int, conditions: Conditions) -> Graph:
    ends = graph.actions[parent].key, graph.actions[child].key
    relations = tuple(
        msgspec.structs.replace(each, conditions=conditions)
        if (each.parent, each.child) == ends
        else each
        for each in graph.relations
    )
    return msgspec.structs.replace(graph, relations=relations)


def join() -> Graph:
    """`Work_1` needs `Work_0` and `Work_2`; nothing starts `Work_2` in time."""
    line = sequence("patrol", 3)
    _, second, third = (each.key for each in line.actions)
    kept = tuple(each for each in line.relations if (each.parent, each.child) != (second, third))
    needed = Relation(parent=third, child=second, conditions=GO_ON)
    return msgspec.structs.replace(line, relations=(*kept, needed))


LACKS = with_input(sequence("patrol", 2), 1)
JOIN = join()
IDLE = answering(sequence("patrol", 2), 0, 1, Conditions(on_true="stop", on_false="stop"))
MAYBE = answering(sequence("patrol", 2), 0, 1, Conditions(on_true="run", on_false="stop"))
#: Its first action leads nowhere.
HALTS = answering(sequence("Sub", 2), 0, 1, Conditions())


async def stalled(control: ExecutionService, graph: Graph, seconds: float = 25.0) -> str:
    run = (await control.start(asked(graph), ANN)).run.id
    await anyio.sleep(seconds)
    return run


@pytest.mark.parametrize(
    ("graph", "waits"),
    [
        (LACKS, "Work_1 waits for its input “speed”, which has no value and gets none."),
        (JOIN, "Work_1 waits for Work_2, which has not run."),
        (IDLE, "Work_0 ended, and its arrow tells Work_1 to stop, which does nothing"),
    ],
)
@virtual
async def test_the_reason_of_a_stall_is_one_alarm_and_the_cause_of_the_run(
    graph: Graph, waits: str
) -> None:
    scene = RobotsInNetwork(1, script=QUICK)
    async with scene.played() as control:
        run = await stalled(control, graph)
        (alarm,) = control.open[run].run.alarms
        assert alarm.code == "stalled"
        assert alarm.text.startswith("NOTHING MOVES: David calls patrol running")
        assert waits in alarm.text
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
    found = scene.harness.journal.history(run)
    stop, *named = causes(found, graph)
    assert cause_sentence(stop, found) == "Ben pressed Stop while no action was seen running."
    assert [each.action for each in named] == ["Work_1"], named
    assert named[0].at == found.alarms[0].at
    assert cause_sentence(named[0], found) in alarm.text


@virtual
async def test_an_arrow_that_may_have_answered_otherwise_is_told_as_a_possibility() -> None:
    scene = RobotsInNetwork(2, script={"*": [{"after_s": 0.5, "result": "on_false"}]})
    async with scene.played() as control:
        run = await stalled(control, MAYBE)
        (alarm,) = control.open[run].run.alarms
    assert "the engine does not tell results" in alarm.text


@virtual
async def test_a_run_in_which_something_moves_raises_no_such_alarm() -> None:
    scene = RobotsInNetwork(3, script={"*": [{"after_s": 30}]})
    async with scene.played() as control:
        run = await stalled(control, sequence("patrol", 2), 75)
        assert run not in control.open or not control.open[run].run.alarms
    assert scene.harness.journal.history(run).alarms == ()


@virtual
async def test_a_pause_between_two_actions_is_no_standstill() -> None:
    from action_assistant.runner.emulator.messages import EngineTraits

    scene = RobotsInNetwork(4, quirks=EngineTraits(loading_ms=3_000.0), script=QUICK)
    async with scene.played() as control:
        run = (await control.start(asked(sequence("patrol", 3)), ANN)).run.id
        assert await ended(control, run) == "finished"
    assert scene.harness.journal.history(run).alarms == ()


@virtual
async def test_a_graph_that_has_finished_while_an_action_goes_on_is_no_standstill() -> None:
    scene = RobotsInNetwork(5, script={"Work_0": [{"after_s": 0.5}], "*": [{"never": True}]})
    async with scene.played() as control:
        run = await stalled(control, two_ends())
        assert not control.open[run].run.alarms


@virtual
async def test_a_runner_that_takes_the_run_up_again_can_say_it_too() -> None:
    scene = RobotsInNetwork(6, script=QUICK)
    async with scene.played() as control:
        run = (await control.start(asked(LACKS), ANN)).run.id
        await anyio.sleep(2)
        assert not control.open[run].run.alarms
    async with scene.played() as control:
        await anyio.sleep(15)
        (alarm,) = control.open[run].run.alarms
    assert "“speed”" in alarm.text


@virtual
async def test_a_sub_graph_in_which_nothing_moves_is_named_and_stays_the_cause_after_a_stop() -> (
    None
):
    """A halted sub-graph is never told to its parent, which then runs for ever.

    See docs/umrf-and-the-engine.md 2.6.
    """
    scene = WithSub(7, script=QUICK, sub=HALTS)
    graph = named("Sub")
    async with scene.played() as control:
        run = await stalled(control, graph, 40)
        (alarm,) = control.open[run].run.alarms
        told = "Sub_0 waits for its sub-graph, in which nothing moves"
        assert f"{told}: it is HALTED." in alarm.text
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
    found = scene.harness.journal.history(run)
    stop, second, *_ = causes(found, graph)
    assert cause_sentence(stop, found).startswith("Ben pressed Stop while Sub ran")
    assert (second.action, cause_sentence(second, found)) == ("Sub_0", f"{told}.")


def test_an_entry_that_lacks_a_value_is_named_before_anything_ran() -> None:
    from action_assistant.runner.runs.stall import in_words, unbegun

    (wait,) = unbegun(with_input(sequence("patrol", 2), 0))
    assert in_words(wait) == "Work_0 waits for its input “speed”, which has no value and gets none."
    assert ENTRY not in in_words(wait)


def test_a_run_that_ended_well_has_no_such_cause() -> None:
    run = Run(
        id="r", number=1, request_id="q", author=ANN, graph=None, graph_name="patrol", version="",
        digest="", engine="David", simulated=False, requested_at=0, end="finished",
        result="on_true",
    )  # fmt: skip
    assert causes(run, LACKS) == ()
