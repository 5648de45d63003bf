"""Breakpoints of a led run: it waits where its conditions are met, once for each visit."""

from typing import Any

import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.execution.led_commands import operator_of
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.earlier import StartFrom
from action_assistant.runner.runs.views import run_view
from action_assistant.runner.start.admission import (
    BreakpointsRequest,
    GoOnRequest,
    GroupRequest,
    WaitRequest,
)
from action_assistant.umrf.breakpoints import Breakpoint
from runner.execution.test_conductor import Lab, led, shared
from runner.execution.test_led_steps import now, ready, step
from runner.harness import ANN, BEN, carousel, ended, order, sequence, until, virtual


async def held_at(control: ExecutionService, run: str) -> tuple[str, str]:
    """Wait until a run is held; return how, and the reason."""
    await until(lambda: now(control, run).held is not None, 600)
    held = now(control, run).held
    assert held is not None
    return held.how, held.why


async def go_on(control: ExecutionService, run: str) -> None:
    await control.go_on(run, GoOnRequest(step(control, run).since), BEN)


def task(*breakpoints: Breakpoint) -> Any:
    graph = shared(sequence("task", 4), "Scout", "Carrier")
    return led(graph, lost="wait", breakpoints=breakpoints)


@virtual
async def test_a_run_waits_before_an_action_and_says_where() -> None:
    lab = Lab({"*": [{"after_s": 2}]})
    async with lab.runner() as control:
        run = (await control.start(task(Breakpoint(action="Work_2")), ANN)).run.id
        assert await held_at(control, run) == ("breakpoint", "Breakpoint before Work_2.")
        await ready(control, run, "Work_2")
        assert len(lab.david.starts) == len(lab.carol.starts) == 1
        shown = run_view(now(control, run))
        assert shown.held is not None
        assert shown.held.how == "breakpoint"
        await go_on(control, run)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_breakpoint_in_a_loop_holds_at_its_visit_also_after_a_restart() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    graph = shared(carousel(), "Scout", "Carrier")
    node = graph.actions[0].full_name
    begun: list[int] = []
    async with lab.runner() as control:
        asked = led(graph, lost="wait", breakpoints=(Breakpoint(action=node, visit=7),))
        run = (await control.start(asked, ANN)).run.id
        await until(lambda: len(lab.david.starts) == 3, 600)
    async with lab.runner() as control:
        assert (await held_at(control, run))[0] == "trouble"
        await go_on(control, run)
        how, why = await held_at(control, run)
        assert (how, why) == ("breakpoint", f"Breakpoint before {node}, visit 7.")
        await ready(control, run, node)
        robots = (lab.david, lab.carol)
        begun = [sum(node in each.graph.actions for each in robot.starts) for robot in robots]
        assert sum(begun) == 6
        await control.stop(run, BEN)
        await ended(control, run)


@virtual
async def test_an_arrow_holds_by_the_outcomes_that_go_on_before_anything_follows() -> None:
    lab = Lab({"*": [{"after_s": 2}]})
    async with lab.runner() as control:
        run = (await control.start(task(Breakpoint(action="Work_0", to="Work_1")), ANN)).run.id
        assert await held_at(control, run) == (
            "breakpoint",
            "Breakpoint after Work_0, towards Work_1.",
        )
        await ready(control, run, "Work_1")
        assert lab.carol.starts == []
        assert "true" in now(control, run).breakpoints[0].outcomes
        await go_on(control, run)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_breakpoint_is_set_and_taken_away_while_the_run_goes_on() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = (await control.start(task(), ANN)).run.id
        await until(lambda: bool(lab.david.starts))
        mark = Breakpoint(action="Work_1")
        await control.set_breakpoints(run, BreakpointsRequest((mark,), ()), BEN)
        with pytest.raises(Conflict, match="other breakpoints meanwhile"):
            await control.set_breakpoints(run, BreakpointsRequest((), ()), ANN)
        asked = BreakpointsRequest((Breakpoint(action="Work_9"),), (mark,))
        with pytest.raises(BadInput, match="There is no action Work_9"):
            await control.set_breakpoints(run, asked, ANN)
    async with lab.runner() as control:
        assert (await held_at(control, run))[0] == "trouble"
        assert now(control, run).breakpoints == (mark,)
        await go_on(control, run)
        assert (await held_at(control, run))[0] == "breakpoint"
        await control.set_breakpoints(run, BreakpointsRequest((), (mark,)), ANN)
        assert now(control, run).held is not None  # that releases nothing
        await go_on(control, run)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_breakpoint_that_is_reached_while_a_person_made_the_run_wait_is_shown() -> None:
    lab = Lab({"*": [{"after_s": 5}]})
    async with lab.runner() as control:
        run = (await control.start(task(Breakpoint(action="Work_1")), ANN)).run.id
        await until(lambda: bool(lab.david.starts))
        await control.wait(run, WaitRequest(), BEN)
        seen = step(control, run).since
        await ready(control, run, "Work_1")
        with pytest.raises(Conflict, match="Breakpoint before Work_1"):
            await control.go_on(run, GoOnRequest(seen), BEN)
        await go_on(control, run)
        assert await ended(control, run) == "finished"


@pytest.mark.parametrize(
    ("mark", "why"),
    [
        (Breakpoint(action="Work_9"), "There is no action Work_9"),
        (Breakpoint(action="Work_0", to="Work_3"), "There is no arrow from Work_0 to Work_3"),
    ],
)
@virtual
async def test_a_breakpoint_without_a_place_is_refused(mark: Breakpoint, why: str) -> None:
    lab = Lab()
    async with lab.runner() as control:
        with pytest.raises(BadInput, match=why):
            await control.start(task(mark), ANN)
        assert lab.david.starts == []


@virtual
async def test_the_look_says_that_a_graph_handed_over_whole_has_no_breakpoints() -> None:
    lab = Lab()
    async with lab.runner() as control:
        mark = Breakpoint(action="Work_1")
        whole = GroupRequest(
            umrf=order(sequence("task", 2)).umrf, engines=("David",), breakpoints=(mark,)
        )
        (look,) = await control.look(whole, operator_of(ANN))
        said = {each.code: (each.verdict, each.text) for each in look.items}
        assert said["breakpoints"][0] == "warned"
        assert "1 breakpoint of it will hold nothing" in said["breakpoints"][1]
        asked = order(sequence("task", 2), engine="David", breakpoints=(mark,))
        run = (await control.start(asked, ANN)).run
        assert run.breakpoints == ()
        await control.stop(run.id, BEN)
        await ended(control, run.id)


@virtual
async def test_breakpoints_at_what_a_run_from_the_middle_skips_are_left_out() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    marks = (Breakpoint(action="Work_0"), Breakpoint(action="Work_1", to="Work_2"))
    async with lab.runner() as control:
        since = StartFrom(at=("Work_2",))
        start = msgspec.structs.replace(task(*marks, Breakpoint(action="Work_3")), start_from=since)
        run = (await control.start(start, ANN)).run.id
        assert await held_at(control, run) == ("breakpoint", "Breakpoint before Work_3.")
        await go_on(control, run)
        assert await ended(control, run) == "finished"
