"""Questions and waits of led runs over a restart of the runner, a jump of its clock, and an old yes."""

import anyio
import pytest

from action_assistant.errors import Conflict
from action_assistant.runner.execution.question_commands import AnswerRequest
from action_assistant.runner.runs.question_events import PauseBegan, QuestionClosed
from action_assistant.runner.runs.views import time
from runner import harness
from runner.execution.test_conductor import Lab
from runner.execution.test_led_breakpoints import go_on
from runner.execution.test_led_steps import now
from runner.execution.test_questions import CONFIRM, asked_of, asking, line, open_question, told
from runner.harness import ANN, BEN, ended, until, virtual

_YES = AnswerRequest(value=True)


@virtual
async def test_a_restarted_runner_asks_again_only_after_go_on() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, "Scout")), ANN)).run.id
        first = await open_question(control, run)
    async with lab.runner() as control:
        await anyio.sleep(100)
        assert now(control, run).held is not None
        assert now(control, run).questions == {}
        with pytest.raises(Conflict, match="restarted"):
            await control.questions.answer(run, first.question, _YES, BEN)
        await go_on(control, run)
        second = await open_question(control, run)
        assert lab.david.starts == []
        await control.questions.answer(run, second.question, _YES, BEN)
        assert await ended(control, run) == "finished"
        assert [each.why for each in told(lab.harness, run, QuestionClosed)] == ["restarted"]
        assert len(lab.david.starts) == 1


@virtual
async def test_a_stop_after_a_restart_ends_a_run_that_had_asked() -> None:
    lab = Lab()
    async with lab.runner() as control:
        run = (await control.start(asked_of(line(CONFIRM, "Scout")), ANN)).run.id
        await open_question(control, run)
    async with lab.runner() as control:
        await anyio.sleep(5)
        await control.stop(run, BEN)
        assert await ended(control, run) == "stopped"
        assert lab.david.starts == []


@virtual
async def test_an_answer_before_a_restart_counts_and_is_not_asked_again() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        number = asking("AaAskNumber", question="?")
        run = (await control.start(asked_of(line(number, "Scout")), ANN)).run.id
        asked = await open_question(control, run)
        await control.questions.answer(run, asked.question, AnswerRequest(value=4.5), ANN)
    async with lab.runner() as control:
        await anyio.sleep(5)
        if run in control.open:
            await go_on(control, run)
        assert await ended(control, run) == "finished"
        assert len(lab.david.starts) == 1


@virtual
async def test_a_wait_goes_on_over_a_restart() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        wait = asking("AaWait", seconds=100.0)
        run = (await control.start(asked_of(line(wait, "Scout")), ANN)).run.id
        await until(lambda: bool(now(control, run).pauses))
        began = anyio.current_time()
        await anyio.sleep(40)
    async with lab.runner() as control:
        await anyio.sleep(10)
        await go_on(control, run)
        await until(lambda: bool(lab.david.starts), 200)
        assert 99 < anyio.current_time() - began < 110
        assert [each.again for each in told(lab.harness, run, PauseBegan)] == [False, True]


@pytest.mark.parametrize("phase", [0.05, 0.25, 0.45, 0.65, 0.85])
def test_a_clock_that_jumps_past_the_time_holds_the_run(
    phase: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    shift = [0]
    real = harness.clock_us
    monkeypatch.setattr(harness, "clock_us", lambda: real() + shift[0])

    @virtual
    async def lived() -> None:
        lab = Lab({"*": [{"after_s": 1}]})
        async with lab.runner() as control:
            then = harness.clock_us() + 3_600_000_000
            asked = asked_of(line(asking("AaUntil", time=time(then).isoformat()), "Scout"))
            run = (await control.start(asked, ANN)).run.id
            await until(lambda: bool(now(control, run).pauses))
            await anyio.sleep(30 + phase)
            shift[0] = 7_200_000_000
            await anyio.sleep(60)
            held = now(control, run).held
            assert held is not None
            assert "jumped" in held.why
            assert lab.david.starts == []
            await go_on(control, run)
            assert await ended(control, run) == "finished"

    lived()


@virtual
async def test_a_yes_of_more_than_60_s_ago_lets_nothing_begin() -> None:
    lab = Lab({"*": [{"after_s": 1}]})
    async with lab.runner() as control:
        graph = line(CONFIRM, asking("AaWait", 1, seconds=80.0), "Scout")
        run = (await control.start(asked_of(graph), ANN)).run.id
        asked = await open_question(control, run)
        assert asked.moves == ("David",)
        await control.questions.answer(run, asked.question, _YES, BEN)
        await until(lambda: now(control, run).held is not None, 200)
        held = now(control, run).held
        assert held is not None
        assert "more than 60 s old" in held.why
        assert lab.david.starts == []
        await go_on(control, run)
        assert await ended(control, run) == "finished"
        assert len(lab.david.starts) == 1
