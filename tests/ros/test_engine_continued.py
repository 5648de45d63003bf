"""A led run on real engines that ended early is continued, or a part of it is played: the code of the actions
writes down what has begun, and how often.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
`TEST_LED_DOMAIN` is the first domain.
"""

import os
from collections import Counter
from pathlib import Path
from typing import Any

import anyio
import httpx
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Conflict, Refused
from action_assistant.runner.execution.interventions import RestRequest, confirm_rest
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.runs.earlier import Choice, StartFrom
from action_assistant.runner.start.admission import StartRequest
from action_assistant.runner.start.kept_starts import text_of
from ros.led_engines import Engines, as_led, over, register, relay
from ros.led_runner import is_over
from runner import process
from runner.harness import ANN, BEN, until
from support import waiting
from support.real_engine import needs_engine

DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "170"))

pytestmark = [needs_engine, pytest.mark.timeout(0)]


@pytest.fixture
def engines(tmp_path: Path) -> Engines:
    return Engines(tmp_path, DOMAIN)


def task() -> StartRequest:
    """Return the start of four actions on Ann and Bob in turn, of which the third takes 3 s."""
    works = [(delay, "on_true") for delay in (0.1, 0.1, 3.0, 0.1)]
    return msgspec.structs.replace(as_led(relay("continued", works)), graph="g1")


def begun(engines: Engines) -> Counter[str]:
    """Return how often the code of each action has begun."""
    return Counter(line.action for line in engines.lines() if line.what == "begin")


def on(start: StartRequest, run: str, press: str, **choices: Choice) -> StartRequest:
    """Return the start once more, to continue a run. `press`: its request id."""
    since = StartFrom(run=run, choices=choices, reason="I stand beside it.")
    return msgspec.structs.replace(start, start_from=since, request_id=press)


async def stopped_in_third(
    control: ExecutionService, engines: Engines, start: StartRequest, times: int = 1
) -> str:
    """Start a run, and stop it when the code of its third action has begun so many times in all; return
    its id."""
    run = (await control.start(start, ANN)).run.id
    await until(lambda: begun(engines)["OxWork_2"] == times, 20)
    await anyio.sleep(0.3)
    await control.stop(run, BEN)
    assert await over(control, run, 20) == "stopped"
    return run


@pytest.mark.parametrize(("choice", "times"), [("again", 2), ("true", 1)])
def test_what_was_under_way_begins_again_only_if_a_person_chose_that(
    choice: Choice, times: int, engines: Engines
) -> None:
    async def main() -> None:
        async with engines.led() as (control, _):
            start = task()
            first = await stopped_in_third(control, engines, start)
            request = on(start, first, "again", OxWork_2=choice)
            run = (await control.start(request, ANN)).run.id
            assert await over(control, run, 30) == "finished"
            assert begun(engines) == {
                "OxWork_0": 1,
                "OxWork_1": 1,
                "OxWork_2": times,
                "OxWork_3": 1,
            }

    anyio.run(main)


def test_a_continued_run_is_stopped_and_continued_once_more(engines: Engines) -> None:
    async def main() -> None:
        async with engines.led() as (control, _):
            start = task()
            first = await stopped_in_third(control, engines, start)
            request = on(start, first, "second", OxWork_2="again")
            second = await stopped_in_third(control, engines, request, 2)
            request = on(start, second, "third", OxWork_2="again")
            third = (await control.start(request, ANN)).run.id
            assert await over(control, third, 30) == "finished"
            assert begun(engines) == {"OxWork_0": 1, "OxWork_1": 1, "OxWork_2": 3, "OxWork_3": 1}

    anyio.run(main)


def test_a_run_whose_engine_was_killed_is_continued_when_a_person_has_looked(
    engines: Engines,
) -> None:
    async def main() -> None:
        async with engines.led() as (control, _):
            start = task()
            run = (await control.start(start, ANN)).run.id
            await until(lambda: begun(engines)["OxWork_2"] == 1, 20)
            engines.kill("Ann")
            await until(lambda: control.open[run].run.desired == "stopped", 30)
            with pytest.raises(Conflict, match="is not over"):
                await control.start(on(start, run, "early", OxWork_2="again"), ANN)
            await is_over(control, run, 10)
            for opened in [*control.open.values()]:
                if opened.run.piece is not None:
                    confirm_rest(opened, RestRequest("I stand beside it."), BEN)
            await over(control, run, 20)
            engines.start("Ann")
            again = await started_when_it_answers(control, on(start, run, "", OxWork_2="again"))
            assert await over(control, again, 30) == "finished"
            assert begun(engines) == {"OxWork_0": 1, "OxWork_1": 1, "OxWork_2": 2, "OxWork_3": 1}

    anyio.run(main)


async def started_when_it_answers(control: ExecutionService, request: StartRequest) -> str:
    """Start a run once discovery has forgotten the engine that was killed, by one press a second; return
    its id. A refused press has sent nothing."""
    with anyio.fail_after(60):
        for press in range(100):
            each = msgspec.structs.replace(request, request_id=f"press {press}")
            try:
                return (await control.start(each, ANN)).run.id
            except Refused:
                await anyio.sleep(1)
    raise AssertionError("it never answered")


@pytest.mark.parametrize(
    ("only", "played"),
    [(False, {"OxWork_2": 1, "OxWork_3": 1}), (True, {"OxWork_2": 1})],
)
def test_a_run_of_a_part_begins_nothing_that_it_skips(
    only: bool, played: dict[str, int], engines: Engines
) -> None:
    async def main() -> None:
        async with engines.led() as (control, _):
            part = StartFrom(at=("OxWork_2",), only=only)
            start = msgspec.structs.replace(task(), start_from=part)
            run = (await control.start(start, ANN)).run.id
            assert await over(control, run, 30) == "finished"
            assert begun(engines) == played

    anyio.run(main)


def rests(client: httpx.Client, run: str) -> list[dict[str, Any]]:
    """Return how far each robot of a run is known to be at rest."""
    found: list[dict[str, Any]] = client.get(f"/api/runs/{run}").json()["rests"]
    return found


def looked_at(client: httpx.Client, run: str) -> bool:
    """Say of each robot that keeps a run open that somebody has looked; return whether the run is over."""
    for each in rests(client, run):
        if each.get("piece"):
            how = {"how": "I stand beside it."}
            client.post(
                f"/api/runs/{each['piece']}/at_rest", json=how
            )  # refused where it is proven
    return bool(client.get(f"/api/runs/{run}").json()["ended_at"])


def test_after_a_kill_of_everything_a_run_is_continued_and_nothing_begins_twice_unasked(
    engines: Engines, tmp_path: Path
) -> None:
    runner = process.RunnerProcess(tmp_path / "runner").start()
    try:
        for name in engines.names:
            engines.start(name)
        with runner.client() as client:
            register(client, engines.names)
            start = task()
            run = process.started(client, start)["id"]
            waiting.until("the third action has not begun", lambda: begun(engines)["OxWork_2"])
        runner.kill()
        for name in engines.names:
            engines.kill(name)
        for name in engines.names:
            engines.start(name)
        runner.start()
        with runner.client() as client:
            client.post(f"/api/runs/{run}/stop").raise_for_status()
            waiting.until(
                "it is not over", lambda: looked_at(client, run), 60, lambda: rests(client, run)
            )
            assert begun(engines) == {"OxWork_0": 1, "OxWork_1": 1, "OxWork_2": 1}
            unasked = client.post("/api/runs", content=bytes(text_of(on(start, run, "unasked"))))
            assert unasked.status_code in {400, 409}
            assert "OxWork_2" in unasked.text
            asked = bytes(text_of(on(start, run, "again", OxWork_2="again")))
            refused: list[str] = []

            def continued() -> str:
                answer = client.post("/api/runs", content=asked)
                refused.append(answer.text)
                return str(answer.json()["id"]) if answer.is_success else ""

            again = waiting.until("it is not continued", continued, 60, lambda: refused[-1])
            assert process.over(client, again)["state"] == "finished"
            assert client.post("/api/runs", content=asked).json()["id"] == again
        assert begun(engines) == {"OxWork_0": 1, "OxWork_1": 1, "OxWork_2": 2, "OxWork_3": 1}
    finally:
        runner.end()
        engines.end()
