"""Calls keep the numbers by which they are known where another engine takes the place of one that led a run."""

import anyio
import msgspec
import pytest

from action_assistant.runner.links.led_calls import LedCalls, LedCourse, Played
from action_assistant.runner.links.port import CallBegan, CallPlayed, Order, Report
from action_assistant.runner.links.simulator import SimulatorLink, in_this_process
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.files import codec
from action_assistant.umrf.semantics import Call
from runner.harness import EPOCH, clock_us, two_lines, virtual

SCRIPT = msgspec.json.encode(
    {"behaviours": {"Work_0": [{"after_s": 2.0}], "Work_1": [{"after_s": 1.9995}]}}
).decode()
FIRST = {1: "Work_0", 2: "Work_1"}


def link() -> SimulatorLink:
    """A new engine for `two_lines`."""
    led = frozenset(each.full_name for each in two_lines().actions)
    return in_this_process(SIMULATED, SCRIPT, clock_us, led=led)


def begun(reports: list[Report]) -> dict[int, str]:
    return {each.call.number: each.call.node for each in reports if isinstance(each, CallBegan)}


@pytest.mark.parametrize("first", [0.2, 0.9])
def test_calls_that_began_at_nearly_the_same_time_keep_their_numbers_in_another_engine(
    first: float,
) -> None:
    @virtual
    async def lived() -> None:
        task = two_lines()
        order = Order(run="r", graph=task, umrf=codec.write(task))
        engine, other = link(), link()
        reports: list[Report] = []
        again: list[Report] = []
        async with anyio.create_task_group() as tasks:
            with engine.listen(reports.append), other.listen(again.append):
                tasks.start_soon(engine.run)
                await engine.start(order)
                await anyio.sleep(0.001)
                await engine.play(1)
                await anyio.sleep(0.0002)
                await engine.play(2)
                await anyio.sleep(3)
                known = begun(reports)
                assert known == FIRST | {3: "Work_3", 4: "Work_2"}
                # The runner noted the two at other times than those at which the engine heard of them.
                steps = ((first, Played(1, "Work_0")), (0.95, Played(2, "Work_1")))
                await other.take_up(order, LedCourse(began=EPOCH, steps=steps, calls=known))
                tasks.start_soon(other.run)
                assert begun(again) == {3: "Work_3", 4: "Work_2"}
                await other.play(3)
                await anyio.sleep(0.1)
                (graph,) = (await other.get()).graphs
                assert graph.nodes["Work_3"] == "RUNNING"
                await anyio.sleep(5)
                played = [each.number for each in again if isinstance(each, CallPlayed)]
                assert (played[-1], sorted(played)) == (3, [1, 2, 3])
                tasks.cancel_scope.cancel()

    lived()


def test_calls_without_a_known_number_get_one_that_no_other_call_has() -> None:
    calls = LedCalls({"Work_0"})
    calls.expect({2: "Work_0", 7: "Work_1"})
    call = Call(number=1, graph="g", node="Work_0", name="Work", inputs={}, outputs={})
    for number in (1, 2, 3):
        calls.begin(msgspec.structs.replace(call, number=number))
    assert [each.call.number for each in calls.news() if isinstance(each, CallBegan)] == [2, 8, 9]
    assert [calls.own(number) for number in (2, 8, 9)] == [1, 2, 3]
    assert calls.own(7) not in {1, 2, 3}
