"""Opened sub-graphs of a led run: the actions inside are steps of their own, and go to robots one by one."""

from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.analysis import expected_runs
from action_assistant.runner.analysis.course_checks import check_courses
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.repeats.repeat import NextRequest, RepeatRequest
from action_assistant.runner.repeats.service import Repeats
from action_assistant.runner.runs.earlier import StartFrom
from action_assistant.runner.runs.events import Requested
from action_assistant.runner.runs.views import run_view, time
from action_assistant.runner.start.admission import GoOnRequest, StepRequest
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.files import codec
from runner.execution.test_conducted_subgraphs import PICK, TASK, going_on, looking, named, sent
from runner.execution.test_conductor import Lab, refused, shared
from runner.execution.test_questions import CONFIRM, line, open_question
from runner.harness import ANN, BEN, at_once, clock_us, ended, sequence, until, virtual
from runner.start.test_rights_registry import ANN as SIGNED_IN

#: `Pick_0` is a graph of two steps of Scout, then Carrier follows; and a graph whose second step is Carrier's.
MIXED = shared(sequence("Pick", 2), "Scout", "Carrier")


def opened(*inside: Any, **more: Any) -> Any:
    return sent(going_on(TASK), *map(going_on, inside), levels="opened", lost="wait", **more)


async def held(control: ExecutionService, run: str, *nodes: str) -> Any:
    """Wait until the run is held and exactly these actions wait to begin; return why, as people see it."""
    await until(
        lambda: (
            control.open[run].run.held is not None
            and {node for node, _ in control.open[run].run.waits.values()} == set(nodes)
        )
    )
    return run_view(control.open[run].run).held


async def steps_over(control: ExecutionService, run: str, *over: str) -> None:
    now = control.open[run].run.held
    assert now is not None
    await control.step(run, StepRequest(time(now.at), over=over), ANN)


@virtual
async def test_the_actions_of_an_opened_sub_graph_go_to_their_robots_one_by_one() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        run = (await control.start(opened(MIXED), ANN)).run.id
        assert await ended(control, run) == "finished"
        sent_names = [each.graph.name for each in (*lab.david.starts, *lab.carol.starts)]
        assert len(sent_names) == len(set(sent_names)) == 3
        assert [len(lab.david.starts), len(lab.carol.starts)] == [1, 2]
        shown = run_view(lab.harness.journal.history(run))
        inside = [name for name, each in shown.actions.items() if each.levels == ("Pick_0",)]
        assert len(inside) == 2
        assert shown.actions["Work_1"].levels == ()
        assert shown.sent_digest not in {shown.digest, msgspec.UNSET}


@virtual
async def test_a_step_goes_into_an_opened_sub_graph_and_over_it() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        before = (Breakpoint(action="Pick_0"),)
        run = (await control.start(opened(PICK, breakpoints=before), ANN)).run.id
        first = control.open[run].run
        inside = sorted(name for name, each in first.actions.items() if each.levels)
        await held(control, run, inside[0])
        assert lab.david.starts == []
        now = control.open[run].run.held
        assert now is not None
        await control.step(run, StepRequest(time(now.at)), ANN)
        await held(control, run, inside[1])
        assert len(lab.david.starts) == 1
        await steps_over(control, run, "Pick_0")
        why = await held(control, run, "Work_1")
        assert why.why == "It went over Pick_0: Work_1 waits to begin."
        assert (len(lab.david.starts), len(lab.carol.starts)) == (2, 0)
        with pytest.raises(Conflict, match="Work_1 waits to begin"):
            await steps_over(control, run, "Pick_0")
        with pytest.raises(BadInput, match="Lift_0 is no sub-graph that this run has opened"):
            await steps_over(control, run, "Lift_0")
        await control.go_on(run, GoOnRequest(why.since), ANN)
        assert await ended(control, run) == "finished"


@virtual
async def test_an_opened_run_is_stopped_and_continued_as_it_was_led() -> None:
    lab = Lab({"*": [{"after_s": 3, "stop_s": 0.2}]})
    request = opened(PICK, request_id="first")
    async with lab.runner() as control:
        run = (await control.start(request, ANN)).run.id
        await until(lambda: len(lab.david.starts) == 2)
        await control.stop(run, BEN)
        await ended(control, run)
        began = next(
            name
            for name, each in lab.harness.journal.history(run).actions.items()
            if each.levels and each.visits and each.visits[-1].result != "true"
        )
        since = StartFrom(run=run, choices={began: "again"})
        again = msgspec.structs.replace(
            request, start_from=since, request_id="second", levels="one_step"
        )
        with pytest.raises(BadInput, match="continued as it was"):
            await control.start(msgspec.structs.replace(again, levels="opened"), ANN)
        other = (await control.start(again, ANN)).run.id
        assert await ended(control, other) == "finished"
        assert (len(lab.david.starts), len(lab.carol.starts)) == (3, 1)
        actions = lab.harness.journal.history(other).actions
        assert {each.levels for each in actions.values()} == {("Pick_0",), ()}


@virtual
async def test_an_opened_run_goes_on_after_a_restart_of_the_runner_and_sends_nothing_twice() -> (
    None
):
    lab = Lab({"*": [{"after_s": 3}]})
    async with lab.runner() as control:
        run = (await control.start(opened(PICK), ANN)).run.id
        await until(lambda: len(lab.david.starts) == 1)
        await anyio.sleep(1)
    async with lab.runner() as control:
        await until(lambda: run in control.open)
        await until(lambda: bool(control.open[run].run.waits))
        now = control.open[run].run.held
        assert now is not None
        await control.go_on(run, GoOnRequest(time(now.at)), ANN)
        assert await ended(control, run) == "finished"
        assert (len(lab.david.starts), len(lab.carol.starts)) == (2, 1)


@virtual
async def test_a_repeated_start_of_an_opened_run_is_one_and_another_order_is_refused() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        request = opened(PICK, request_id="once")
        first = await control.start(request, ANN)
        assert (await control.start(request, ANN)).run.id == first.run.id
        with pytest.raises(Conflict, match="belongs to another start"):
            await control.start(msgspec.structs.replace(request, levels="one_step"), ANN)
        await ended(control, first.run.id)


@virtual
async def test_a_breakpoint_that_has_no_place_in_the_opened_graph_is_refused() -> None:
    lab = Lab()
    async with lab.runner() as control:
        nowhere = (Breakpoint(action="Pick_0", to="Work_9"),)
        with pytest.raises(BadInput, match="no place for a breakpoint after Pick_0"):
            await control.start(opened(PICK, breakpoints=nowhere), ANN)


@virtual
async def test_an_opened_run_waits_inside_of_each_sub_graph_and_so_does_one_that_continues_it() -> (
    None
):
    lab = Lab({"*": [{"after_s": 1}]})
    first, last = (each.full_name for each in going_on(PICK).actions)
    inside = (Breakpoint(action=first, to=last, inside="Pick"),)
    request = opened(PICK, request_id="first", breakpoints=inside)
    async with lab.runner() as control:
        run = (await control.start(request, ANN)).run.id
        await until(lambda: control.open[run].run.held is not None)
        assert len(lab.david.starts) == 1
        (mark,) = control.open[run].run.breakpoints
        assert (mark.inside, bool(mark.to)) == ("", True)
        await control.stop(run, BEN)
        await ended(control, run)
        again = msgspec.structs.replace(
            request, start_from=StartFrom(run=run), request_id="second", levels="one_step"
        )
        before = msgspec.structs.replace(
            again, breakpoints=(Breakpoint(action=last, inside="Pick"),)
        )
        other = (await control.start(before, ANN)).run.id
        await until(lambda: control.open[other].run.held is not None)
        assert control.open[other].run.breakpoints == (Breakpoint(action=mark.to),)
        assert len(lab.david.starts) == 1


@virtual
async def test_a_breakpoint_inside_that_the_run_would_not_keep_refuses_the_start() -> None:
    lab = Lab()
    async with lab.runner() as control:
        for levels, inside, why in (
            ("one_step", "Pick", "No sub-graph Pick is opened"),
            ("opened", "Drop", "There is no sub-graph Drop"),
            ("opened", "Pick", "In Pick: There is no action Work_9"),
        ):
            marks = (Breakpoint(action="Work_9", inside=inside),)
            request = msgspec.structs.replace(opened(PICK, breakpoints=marks), levels=levels)
            with pytest.raises(BadInput, match=why):
                await control.start(request, ANN)
        assert not control.open


@virtual
async def test_a_sub_graph_that_is_not_known_to_do_the_same_is_not_opened() -> None:
    lab = Lab()
    ends_never = named(sequence("Pick", 2), "Work")
    cut = tuple(each for each in ends_never.relations if each.child != "exit")
    ends_never = msgspec.structs.replace(ends_never, relations=cut)
    async with lab.runner() as control:
        why = await refused(control, sent(TASK, ends_never, levels="opened"))
        assert "cannot be led one by one" in why
        (look, *_) = await control.look(looking(sent(TASK, ends_never, levels="opened")), ANN)
        assert look.never
        assert lab.david.starts == []


@virtual
async def test_people_are_asked_inside_of_an_opened_sub_graph() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    inner = msgspec.structs.replace(line("Scout", CONFIRM), name="Pick")
    async with lab.runner() as control:
        assert "open the sub-graphs" in await refused(
            control, sent(going_on(TASK), going_on(inner))
        )
        run = (await control.start(opened(inner), ANN)).run.id
        asked = await open_question(control, run)
        assert asked.node.startswith("AaConfirm_")
        assert (len(lab.david.starts), len(lab.carol.starts)) == (1, 0)
        await control.questions.answer(run, asked.question, AnswerRequest(value=True), BEN)
        assert await ended(control, run) == "finished"
        assert (len(lab.david.starts), len(lab.carol.starts)) == (1, 1)


@virtual
async def test_only_a_led_run_opens_sub_graphs() -> None:
    lab = Lab()
    async with lab.runner() as control:
        request = msgspec.structs.replace(opened(PICK), engine="David", robots={})
        with pytest.raises(BadInput, match="Only a run that is led"):
            await control.start(request, ANN)


@virtual
async def test_a_repeat_opens_the_sub_graphs_in_each_of_its_runs() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with (
        lab.runner() as control,
        Repeats.opened(
            control, lab.harness.journal, clock_us=clock_us, run_in_worker=at_once
        ) as repeats,
    ):
        request = RepeatRequest(start=opened(MIXED), times=2)
        repeat, _ = await repeats.open(request, ANN, SIGNED_IN)
        for cell in (1, 2):
            started = await repeats.start(repeat.id, NextRequest(cell), ANN, SIGNED_IN)
            assert await ended(control, started.run.id) == "finished"
        assert [len(lab.david.starts), len(lab.carol.starts)] == [2, 4]


@virtual
async def test_an_opened_run_is_expected_and_repeated_as_it_went_with_what_is_inside() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        start = opened(MIXED)
        run = (await control.start(start, ANN)).run.id
        await ended(control, run)
    found, first = lab.harness.journal.history(run), lab.harness.journal.told(run)[0]
    assert isinstance(first, Requested)
    saved = expected_runs.of_run(found, first.umrf, "x", ANN, 1, first.subgraphs)
    now = bytes(start.umrf)
    checked = check_courses([saved], now, subgraphs=start.subgraphs)
    (course,), covered = checked.courses, checked.coverage
    assert (course.same, course.why) == (True, "")
    assert {each.outcome for each in course.taken} == {"on_true"}
    assert (covered.taken, covered.visited) == (len(course.taken), 2) == (3, covered.actions)
    other = sent(going_on(TASK), going_on(shared(sequence("Pick", 3), "Scout", "Carrier")))
    (course,) = check_courses([saved], now, subgraphs=other.subgraphs).courses
    assert course.same is False
    graph = codec.read(now).graph
    closed = expected_runs.fitted(expected_runs.recorded(found), found, graph)
    assert "Pick_0" in {each.action for each in closed.doubts}
