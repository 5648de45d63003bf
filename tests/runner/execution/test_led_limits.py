"""Limits in led runs: each piece is held to those of its robot as it leaves."""

import os
import random
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Refused
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import Held, StopRequested
from action_assistant.runner.runs.views import time
from action_assistant.runner.start.admission import GoOnRequest
from action_assistant.umrf.files import codec
from action_assistant.umrf.limits import Limit
from action_assistant.umrf.model import Remap
from runner.execution.test_conducted_subgraphs import TASK, sent
from runner.execution.test_conducted_values import Lab, parameter, relay
from runner.execution.test_conductor import Lab as Plain
from runner.execution.test_conductor import led
from runner.execution.test_questions import asked_of, asking, line, open_question
from runner.harness import ANN, ended, until, virtual
from umrf.test_limits import task

HISTORIES = int(os.environ.get("TEST_LIMIT_HISTORIES", "20"))

TORQUE = parameter("torque", "number")
TORQUES = parameter("torque", "numbers")
#: `Do0_0` on David gives a torque to `Do1_0` on Carol, after which `Do2_0` begins on David.
GRAPH = relay(((), (TORQUE,)), ((TORQUE,), ()), ((), ()))
LISTED = relay(((), (TORQUES,)), ((TORQUES,), ()), ((), ()))
LIMITED = Rules(limits=(Limit(parameter="torque", most=60),))


def giving(value: Any) -> dict[str, Any]:
    """A script by which the first action gives this torque."""
    given = {} if value is None else {"outputs": {"torque": value}}
    return {"Do0_0": [{"after_s": 1, **given}], "*": [{"after_s": 1}]}


async def limit(control: ExecutionService, robot: str, rules: Rules = LIMITED) -> None:
    await control.rights.set_rules(robot, rules, ANN)


@pytest.mark.parametrize(("value", "shown"), [(80, "80"), (1e300, "1e+300")])
@virtual
async def test_a_piece_outside_a_limit_never_leaves_and_its_run_is_stopped(
    value: float, shown: str
) -> None:
    lab = Lab(giving(value))
    async with lab.runner(GRAPH) as control:
        await limit(control, "Carol")
        run = (await control.start(led(GRAPH, lost="wait"), ANN)).run.id
        assert await ended(control, run) == "stopped"
        said = f"Carol would get {shown} as torque of Do1_0. The limit there is torque at most 60."
        told = lab.harness.journal.told(run)
        assert [each.why for each in told if isinstance(each, Held)] == [said]
        assert [each.author.name for each in told if isinstance(each, StopRequested)] == [
            "the runner"
        ]
        found = lab.harness.journal.history(run)
        assert [(each.code, each.text) for each in found.alarms] == [("led_limit", said)]
        assert found.limits == {"Carol": LIMITED.limits}
        assert (len(lab.david.starts), len(lab.carol.starts)) == (1, 0)


@virtual
async def test_a_piece_within_the_limits_leaves() -> None:
    lab = Lab(giving(60))
    async with lab.runner(GRAPH) as control:
        await limit(control, "Carol")
        run = (await control.start(led(GRAPH), ANN)).run.id
        assert await ended(control, run) == "finished"
        assert (len(lab.david.starts), len(lab.carol.starts)) == (2, 1)


@virtual
async def test_each_element_of_a_list_is_held_to_the_limit() -> None:
    for value, end in (([1.0, 60.0], "finished"), ([1.0, 61.0, 2.0], "stopped")):
        lab = Lab(giving(value))
        async with lab.runner(LISTED) as control:
            await limit(control, "Carol")
            run = (await control.start(led(LISTED), ANN)).run.id
            assert await ended(control, run) == end
            assert len(lab.carol.starts) == (end == "finished")


@virtual
async def test_a_limit_that_is_set_during_a_run_counts_for_its_next_piece() -> None:
    lab = Lab(giving(80))
    async with lab.runner(GRAPH) as control:
        run = (await control.start(led(GRAPH), ANN)).run.id
        await until(lambda: len(lab.david.starts) == 1)
        await limit(control, "Carol")
        assert await ended(control, run) == "stopped"
        assert lab.carol.starts == []


@virtual
async def test_a_literal_outside_a_limit_refuses_the_start_of_a_led_run() -> None:
    high = relay(((), ()), ((parameter("torque", "number", 61),), ()))
    lab = Lab({})
    async with lab.runner(high) as control:
        await limit(control, "Carol")
        with pytest.raises(Refused, match="Carol would get 61 as torque of Do1_0"):
            await control.start(led(high), ANN)
        await limit(control, "Carol", Rules())
        await limit(control, "David")  # whose limits say nothing of Carol
        run = (await control.start(led(high), ANN)).run.id
        assert await ended(control, run) == "finished"


@virtual
async def test_no_value_outside_a_limit_ever_leaves() -> None:
    """Random torques of three actions, with a limit that an owner sets at a random moment."""
    for seed in range(HISTORIES):
        pick = random.Random(seed)
        values = [pick.choice([59.0, 60.0, 60.1, 200.0]) for _ in range(2)]
        most = pick.choice([60, 100])
        script = {
            "Do0_0": [{"after_s": 1, "outputs": {"torque": values[0]}}],
            "Do1_0": [{"after_s": 1, "outputs": {"torque": values[1]}}],
        }
        graph = relay(((), (TORQUE,)), ((TORQUE,), (TORQUE,)), ((TORQUE,), ()))
        lab = Lab(script)
        set_at: dict[str, float] = {}
        async with lab.runner(graph) as control:
            run = (await control.start(led(graph, lost=pick.choice(["stop", "wait"])), ANN)).run.id
            for robot in ("David", "Carol"):
                await anyio.sleep(pick.random() * 2)
                rules = Rules(limits=(Limit(parameter="torque", most=most),))
                before = len(lab.david.starts if robot == "David" else lab.carol.starts)
                await limit(control, robot, rules)
                set_at[robot] = before
            end = await ended(control, run)
        left = {
            "Carol": [values[0]] * len(lab.carol.starts),
            "David": [0.0, *[values[1]] * (len(lab.david.starts) - 1)],
        }
        late = {name: left[name][int(set_at[name]) :] for name in left}
        assert all(each <= most for each in [*late["Carol"], *late["David"]]), seed
        assert end in {"finished", "stopped"}


@virtual
async def test_an_answer_outside_a_limit_stops_the_run_before_its_action() -> None:
    ask = asking("AaAskNumber", question="Which torque?")
    graph = line(ask, "Scout")
    asked, work = graph.actions
    work = msgspec.structs.replace(work, inputs=(TORQUE,))
    renamed = tuple(
        msgspec.structs.replace(each, remap=(Remap("number", "torque"),))
        if each.child == work.key
        else each
        for each in graph.relations
    )
    graph = msgspec.structs.replace(graph, actions=(asked, work), relations=renamed)
    for answer, end in ((80, "stopped"), (60, "finished")):
        lab = Lab({"*": [{"after_s": 1}]})
        async with lab.runner(graph) as control:
            await limit(control, "David")
            run = (await control.start(asked_of(graph), ANN)).run.id
            question = (await open_question(control, run)).question
            await control.questions.answer(run, question, AnswerRequest(value=answer), ANN)
            assert await ended(control, run) == end
            assert len(lab.david.starts) == (end == "finished")


@virtual
async def test_after_a_restart_of_the_runner_pieces_are_held_to_the_limits() -> None:
    lab = Lab(giving(80) | {"Do0_0": [{"after_s": 5, "outputs": {"torque": 80}}]})
    async with lab.runner(GRAPH) as control:
        await limit(control, "Carol")
        run = (await control.start(led(GRAPH), ANN)).run.id
        await until(lambda: control.open[run].run.actions["Do0_0"].state == "RUNNING")
    async with lab.runner(GRAPH) as control:
        await until(lambda: control.open[run].run.actions["Do0_0"].state == "FINISHED")
        held = control.open[run].run.held
        assert held is not None
        await control.go_on(run, GoOnRequest(time(held.at)), ANN)
        assert await ended(control, run) == "stopped"
    assert [each.code for each in lab.harness.journal.history(run).alarms][-1] == "led_limit"
    assert lab.carol.starts == []


@virtual
async def test_a_graph_inside_of_a_piece_is_held_to_the_limits() -> None:
    inner = msgspec.structs.replace(task(parameter("torque", "number", 61)), name="Pick")
    lab = Plain({"*": [{"after_s": 1}]})
    lab.david.known_graphs = (codec.write(inner),)
    async with lab.runner() as control:
        await limit(control, "Carol")
        await limit(control, "David", Rules(limits=(Limit(parameter="torque", most=61),)))
        run = (await control.start(sent(TASK, inner), ANN)).run.id  # David plays it
        assert await ended(control, run) == "finished"
        await limit(control, "David")
        with pytest.raises(Refused, match="David would get 61 as torque of Grip_0"):
            await control.start(sent(TASK, inner), ANN)
