"""A led run in the simulator over HTTP, with the real process of its engine, and who may let it go on."""

from collections.abc import Callable, Iterator
from typing import Any

import httpx
import msgspec
import pytest

from action_assistant.umrf.breakpoints import Breakpoint
from runner.api.test_run_guard import PEOPLE
from runner.harness import order, sequence
from runner.process import RunnerProcess, over, started
from support.waiting import until


@pytest.fixture(scope="module")
def process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunnerProcess]:
    """A runner that pages may talk to."""
    folder = tmp_path_factory.mktemp("led") / "data"
    process = RunnerProcess(folder, "--page-port", "8000").start()
    yield process
    process.end()


def seen(client: httpx.Client, run: str, true: Callable[[dict[str, Any]], object]) -> Any:
    """Return the run once that is true of it."""

    def shown() -> Any:
        return client.get(f"/api/runs/{run}").json()

    def found() -> Any:
        now = shown()
        return now if true(now) else None

    return until("the run is not so", found, 60, shown)


def waiting(client: httpx.Client) -> tuple[str, str]:
    """Start a led run in the simulator; return its id, and since when it waits for its second action."""
    asked = order(
        sequence("task", 4),
        engine="conducted",
        robots={"": "simulator"},
        breakpoints=(Breakpoint(action="Work_1"),),
        script={"*": [{"after_s": 0.05}]},
    )
    run = started(client, msgspec.structs.replace(asked, version="led1"))["id"]
    found = seen(client, run, lambda run: run["held"] and run["held"].get("next"))
    assert found["held"]["why"] == "Breakpoint before Work_1."
    assert found["actions"]["Work_1"]["visits"] == []
    return run, found["held"]["since"]


def test_an_editor_steps_and_lets_a_simulated_run_go_on(process: RunnerProcess) -> None:
    with PEOPLE["editor"].client(process) as client:
        run, since = waiting(client)
        answer = client.post(f"/api/runs/{run}/step", json={"since": since})
        assert answer.status_code == 202, answer.text
        found = seen(
            client,
            run,
            lambda run: run["held"] and run["held"].get("next") and run["held"]["since"] != since,
        )
        assert found["held"]["next"] == [{"action": "Work_2", "robot": "simulator"}]
        answer = client.post(f"/api/runs/{run}/go_on", json={"since": found["held"]["since"]})
        assert answer.status_code == 202, answer.text
        assert over(client, run)["state"] == "finished"


def test_a_viewer_lets_nothing_begin_and_stops_it(process: RunnerProcess) -> None:
    with PEOPLE["editor"].client(process) as client:
        run, since = waiting(client)
    with PEOPLE["viewer"].client(process) as client:
        for command in ("step", "go_on"):
            answer = client.post(f"/api/runs/{run}/{command}", json={"since": since})
            assert answer.status_code == 403
        assert client.post(f"/api/runs/{run}/wait").status_code == 403
        assert client.post(f"/api/runs/{run}/stop").status_code == 202
        done = over(client, run)
    assert done["state"] == "stopped"
    assert [name for name, each in done["actions"].items() if each["visits"]] == ["Work_0"]
