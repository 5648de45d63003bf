"""Led runs in the simulator: its actions pass the same gate as those of robots."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.execution.led_commands import operator_of
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.views import run_view
from action_assistant.runner.start.admission import (
    BreakpointsRequest,
    GoOnRequest,
    GroupRequest,
    StepRequest,
    WaitRequest,
)
from action_assistant.umrf.breakpoints import Breakpoint, ValueTest
from action_assistant.umrf.model import Graph, Parameter
from runner.execution.test_conducted_subgraphs import named, sent
from runner.execution.test_conductor import Lab, led, shared
from runner.execution.test_led_breakpoints import go_on, held_at
from runner.execution.test_led_steps import now, ready, step
from runner.harness import (
    ANN,
    BEN,
    Harness,
    carousel,
    ended,
    order,
    sequence,
    until,
    virtual,
)


def simulated(graph: Graph, *breakpoints: Breakpoint, **script: Any) -> Any:
    """A start of a led run in which the simulator plays all actions, each for two seconds unless the
    script says something else."""
    return order(
        graph,
        engine="conducted",
        robots={"": "simulator"},
        breakpoints=breakpoints,
        script={"*": [{"after_s": 2}]} | script,
    )


def visits(control: ExecutionService, run: str) -> dict[str, int]:
    actions = now(control, run).actions
    return {name: each.older + len(each.visits) for name, each in actions.items()}


@virtual
async def test_a_simulated_run_waits_before_an_action_which_has_not_begun() -> None:
    async with Harness().runner() as control:
        mark = Breakpoint(action="Work_1")
        run = (await control.start(simulated(sequence("task", 3), mark), ANN)).run.id
        assert await held_at(control, run) == ("breakpoint", "Breakpoint before Work_1.")
        await ready(control, run, "Work_1")
        await anyio.sleep(60)
        shown = run_view(now(control, run))
        assert shown.simulated
        assert shown.held is not None
        assert [(each.action, each.robot) for each in shown.held.next] == [("Work_1", "simulator")]
        assert visits(control, run) == {"Work_0": 1, "Work_1": 0, "Work_2": 0}
        assert now(control, run).actions["Work_1"].state == "UNINITIALIZED"
        await go_on(control, run)
        assert await ended(control, run) == "finished"


@virtual
async def test_a_breakpoint_in_a_simulated_loop_holds_at_its_visit() -> None:
    harness = Harness()
    async with harness.runner() as control:
        graph = carousel()
        node = graph.actions[0].full_name
        mark = Breakpoint(action=node, visit=7)
        run = (await control.start(simulated(graph, mark), ANN)).run.id
        how, why = await held_at(control, run)
        assert (how, why) == ("breakpoint", f"Breakpoint before {node}, visit 7.")
        assert visits(control, run)[node] == 6
        assert now(control, run).actions[node].state == "FINISHED"
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert (
            harness.journal.history(run).actions[node].older
            + len(harness.journal.history(run).actions[node].visits)
            == 6
        )


def giving(graph: Graph, name: str) -> Graph:
    """The graph whose first action gives a number of this name."""
    first, *others = graph.actions
    outputs = (Parameter(name, '{"pvf_type": "number"}'),)
    return msgspec.structs.replace(
        graph, actions=(msgspec.structs.replace(first, outputs=outputs), *others)
    )


@pytest.mark.parametrize(("force", "is_held"), [(70, True), (50, False)])
def test_a_breakpoint_after_an_action_looks_at_what_the_script_gives(
    force: int, is_held: bool
) -> None:
    @virtual
    async def lived() -> None:
        async with Harness().runner() as control:
            value = ValueTest(name="force", test=">", value=60.0)
            mark = Breakpoint(action="Work_0", outcomes=("true",), value=value)
            given = [{"after_s": 2, "outputs": {"force": force}}]
            asked = simulated(giving(sequence("task", 3), "force"), mark, Work_0=given)
            run = (await control.start(asked, ANN)).run.id
            if is_held:
                assert (await held_at(control, run))[0] == "breakpoint"
                await ready(control, run, "Work_1")
                await anyio.sleep(30)
                assert visits(control, run)["Work_1"] == 0
                await go_on(control, run)
            assert await ended(control, run) == "finished"

    lived()


@virtual
async def test_each_step_lets_one_simulated_action_begin() -> None:
    async with Harness().runner() as control:
        run = (await control.start(simulated(sequence("task", 4)), ANN)).run.id
        await until(lambda: now(control, run).actions["Work_0"].state == "RUNNING")
        await control.wait(run, WaitRequest("Show it."), BEN)
        for number in (1, 2, 3):
            await ready(control, run, f"Work_{number}")
            await control.step(run, step(control, run), ANN)
            await anyio.sleep(1)
            assert sum(visits(control, run).values()) == number + 1
        assert await ended(control, run) == "finished"


@virtual
async def test_a_simulated_run_goes_on_until_an_action_and_waits_there() -> None:
    async with Harness().runner() as control:
        run = (await control.start(simulated(sequence("task", 4)), ANN)).run.id
        await until(lambda: now(control, run).actions["Work_0"].state == "RUNNING")
        await control.wait(run, WaitRequest(), BEN)
        await ready(control, run, "Work_1")
        await control.step(run, step(control, run, until="Work_3"), ANN)
        assert await held_at(control, run) == (
            "step",
            "It went on until Work_3, which waits to begin.",
        )
        assert visits(control, run)["Work_3"] == 0
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"


@pytest.mark.parametrize("place", range(4))
def test_a_stop_ends_a_simulated_run_at_each_of_its_gates(place: int) -> None:
    @virtual
    async def lived() -> None:
        harness = Harness()
        async with harness.runner() as control:
            mark = Breakpoint(action=f"Work_{place}")
            run = (await control.start(simulated(sequence("task", 4), mark), ANN)).run.id
            await held_at(control, run)
            await ready(control, run, f"Work_{place}")
            seen = step(control, run)
            await control.stop(run, BEN)
            with pytest.raises(Conflict):
                await control.step(run, StepRequest(seen.since), ANN)
            assert await ended(control, run) == "stopped"
            found = harness.journal.history(run)
            begun = [name for name, each in found.actions.items() if each.visits]
            assert begun == [f"Work_{each}" for each in range(place)]

    lived()


@virtual
async def test_an_action_that_ignores_its_stop_ends_as_in_the_simulator() -> None:
    async with Harness().runner() as control:
        stubborn = [{"never": True, "ignores_stop": True}]
        run = (await control.start(simulated(sequence("task", 2), Work_0=stubborn), ANN)).run.id
        await until(lambda: now(control, run).actions["Work_0"].state == "RUNNING")
        await control.stop(run, BEN)
        assert await ended(control, run) in {"error", "lost"}


@virtual
async def test_a_simulated_run_waits_after_a_restart_and_is_where_it_was() -> None:
    harness = Harness()
    async with harness.runner() as control:
        mark = Breakpoint(action="Work_2")
        run = (await control.start(simulated(sequence("task", 4), mark), ANN)).run.id
        await until(lambda: now(control, run).actions["Work_1"].state == "RUNNING")
    async with harness.runner() as control:
        how, why = await held_at(control, run)
        assert how == "trouble"
        assert "restarted" in why
        await ready(control, run, "Work_2")
        assert now(control, run).actions["Work_1"].state == "FINISHED"
        assert visits(control, run)["Work_2"] == 0
        await go_on(control, run)
        assert (await held_at(control, run))[0] == "breakpoint"
        await go_on(control, run)
        assert await ended(control, run) == "finished"
    assert all(each.state == "FINISHED" for each in harness.journal.history(run).actions.values())


@virtual
async def test_an_action_that_cannot_be_loaded_ends_with_an_error_after_the_gate() -> None:
    harness = Harness()
    async with harness.runner() as control:
        mark = Breakpoint(action="Work_1")
        broken = [{"init_error": True}]
        asked = simulated(sequence("task", 2), mark, Work_1=broken)
        run = (await control.start(asked, ANN)).run.id
        await held_at(control, run)
        assert now(control, run).actions["Work_1"].state == "UNINITIALIZED"
        await go_on(control, run)
        await ended(control, run)
    assert harness.journal.history(run).actions["Work_1"].state == "ERROR"


@virtual
async def test_a_run_that_is_stopped_since_nothing_can_be_stored_is_not_called_finished() -> None:
    harness = Harness()
    async with harness.runner() as control:
        run = (await control.start(simulated(sequence("task", 2)), ANN)).run.id
        await until(lambda: now(control, run).actions["Work_0"].state == "RUNNING")
        harness.journal.down = True
        await anyio.sleep(20)
        harness.journal.down = False
        assert await ended(control, run) == "stopped"
    found = harness.journal.history(run)
    assert found.result != "on_true"
    assert found.actions["Work_1"].visits == ()


@virtual
async def test_breakpoints_of_a_simulated_run_are_set_while_it_goes_on() -> None:
    async with Harness().runner() as control:
        run = (await control.start(simulated(sequence("task", 3)), ANN)).run.id
        mark = Breakpoint(action="Work_1")
        await control.set_breakpoints(run, BreakpointsRequest((mark,), ()), BEN)
        assert (await held_at(control, run))[0] == "breakpoint"
        await control.set_breakpoints(run, BreakpointsRequest((), (mark,)), BEN)
        await go_on(control, run)
        assert await ended(control, run) == "finished"


@virtual
async def test_the_action_of_the_simulator_waits_beside_those_of_robots() -> None:
    lab = Lab({"*": [{"after_s": 2}]})
    async with lab.runner() as control:
        graph = shared(sequence("task", 4), "Scout", "Carrier")
        asked = led(graph, breakpoints=(Breakpoint(action="Work_1"),))
        cast = {"Scout": "David", "Carrier": "simulator"}
        run = (await control.start(msgspec.structs.replace(asked, robots=cast), ANN)).run.id
        await held_at(control, run)
        await ready(control, run, "Work_1")
        await anyio.sleep(30)
        assert visits(control, run)["Work_1"] == 0
        assert len(lab.david.starts) == 1
        await go_on(control, run)
        assert await ended(control, run) == "finished"
        assert len(lab.david.starts) == 2


@virtual
async def test_a_graph_inside_waits_as_a_whole_and_is_played_with_its_actions() -> None:
    harness = Harness()
    task = named(sequence("task", 2), "Pick")
    name = task.actions[0].full_name
    async with harness.runner() as control:
        asked = msgspec.structs.replace(
            sent(task, sequence("Pick", 2)),
            robots={"": "simulator"},
            breakpoints=(Breakpoint(action=name),),
        )
        run = (await control.start(asked, ANN)).run.id
        await held_at(control, run)
        await ready(control, run, name)
        assert set(now(control, run).actions) == {each.full_name for each in task.actions}
        await go_on(control, run)
        assert await ended(control, run) == "finished"
    found = harness.journal.history(run)
    assert found.actions["task__Pick__0/Work_1"].state == "FINISHED"
    assert found.actions[name].state == "FINISHED"


@virtual
async def test_the_look_says_that_a_led_run_in_the_simulator_waits_at_its_breakpoints() -> None:
    async with Harness().runner() as control:
        asked = simulated(sequence("task", 2), Breakpoint(action="Work_1"))
        same = ("umrf", "version", "digest", "robots", "graph", "breakpoints")
        fields = {each: getattr(asked, each) for each in same}
        group = GroupRequest(**fields, engines=("conducted",))
        look = (await control.look(group, operator_of(ANN)))[0]
        said = {each.code: (each.verdict, each.text) for each in look.items}
        assert said["breakpoints"] == ("passed", "The run waits at 1 breakpoint.")


@virtual
async def test_of_two_go_ons_at_once_a_simulated_run_takes_one() -> None:
    async with Harness().runner() as control:
        mark = Breakpoint(action="Work_1")
        run = (await control.start(simulated(sequence("task", 3), mark), ANN)).run.id
        await held_at(control, run)
        seen = step(control, run).since
        await control.go_on(run, GoOnRequest(seen, request_id="p1"), ANN)
        await control.go_on(run, GoOnRequest(seen, request_id="p1"), ANN)
        with pytest.raises(Conflict):
            await control.go_on(run, GoOnRequest(seen, request_id="p2"), BEN)
        assert await ended(control, run) == "finished"
