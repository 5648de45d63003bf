"""A run that cannot be stopped ends with the process of its engine, and with no other."""

import subprocess
from collections.abc import Iterator
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.runner.links.engine_process import (
    EngineProcess,
    command_line,
    has_ended,
    indexes_again,
    indexes_by,
    process,
)
from action_assistant.runner.links.port import EngineLog
from runner.harness import (
    ANN,
    Harness,
    Robot,
    clock_us,
    engine,
    order,
    sequence,
    until,
    virtual,
)
from runner.robots_in_network import STUBBORN
from support import waiting


@pytest.fixture
def child() -> Iterator[subprocess.Popen[bytes]]:
    """A process of this computer."""
    with subprocess.Popen(["sleep", "600"]) as started:
        yield started
        started.kill()


def test_a_process_of_this_computer_is_seen_to_end_and_no_other(
    child: subprocess.Popen[bytes],
) -> None:
    known = process(child.pid)
    assert known is not None
    assert not has_ended(known)
    assert has_ended(msgspec.structs.replace(known, started=known.started - 1))  # number reused
    assert not has_ended(msgspec.structs.replace(known, boot="another"))
    assert not has_ended(msgspec.structs.replace(known, namespace="pid:[1]"))
    child.kill()
    while not has_ended(known):  # also before anybody has waited for it
        pass
    child.wait()
    assert has_ended(known)
    assert process(child.pid) is None


@pytest.mark.parametrize(
    ("line", "again"),
    [
        (["/opt/lib/action_engine_node", "--actor-name", "David"], True),
        (["action_engine_node", "--actor-name", "David", "--indexing-rate", "2"], True),
        (["action_engine_node", "--indexing-rate=0", "--actor-name", "David"], False),
        (["action_engine_node", "--index", "0", "--actor-name", "David"], False),
        (["action_engine_node", "--actor-name", "simulate-robot"], True),
        (["gdb", "/opt/lib/action_engine_node", "--indexing-rate", "00"], False),
        (["python3", "/usr/bin/action-assistant", "simulate-robot", "David"], False),
        (["python3", "-m", "action_assistant", "simulate-robot", "David"], False),
        (["own_engine", "--actor-name", "David", "--indexing-rate", "0"], None),
        (["own_engine", "simulate-robot", "--actor-name", "David"], None),
    ],
)
def test_the_command_line_of_an_engine_shows_whether_it_indexes_while_it_runs(
    line: list[str], again: bool | None
) -> None:
    assert indexes_by(line) is again


def test_only_the_very_process_of_an_engine_shows_how_it_indexes() -> None:
    line = ["action_engine_node", "-c", "read -r line", "--indexing-rate", "2"]
    with subprocess.Popen(line, executable="/bin/sh", stdin=subprocess.PIPE) as node:
        # The kernel shows none yet while the program begins.
        waiting.until("it shows its arguments", lambda: command_line(node.pid)[0])
        known = process(node.pid)
        assert known is not None
        assert indexes_again(known) is True
        assert indexes_again(msgspec.structs.replace(known, started=known.started - 1)) is None
        assert indexes_again(msgspec.structs.replace(known, boot="another")) is None
        node.kill()
        node.wait()
        assert indexes_again(known) is None


@virtual
async def test_a_run_ends_with_the_process_of_its_engine(child: subprocess.Popen[bytes]) -> None:
    robot = WithProcess(engine(STUBBORN), process(child.pid))
    harness = Harness({"David": robot})
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(robot.engine.run)
        async with harness.runner() as control:
            run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
            await control.stop(run, ANN)
            await until(lambda: bool(control.open[run].run.unconfirmed))
            child.kill()
            child.wait()
            await until(lambda: run not in control.open)
            told = await control.find(run)
            assert (told.state, told.proof_at) == ("error", None)
            assert told.at_rest is not None
            assert told.at_rest.by is None
        tasks.cancel_scope.cancel()


@pytest.mark.parametrize(
    ("line", "before_s", "is_named"),
    [
        ("std::bad_alloc", 1, True),
        ("map::at", 1, True),
        ("Graph 'patrol' finished.", 1, False),
        ("std::bad_alloc", 60, False),
    ],
)
@virtual
async def test_an_engine_that_logs_an_exception_and_ends_is_lost_with_these_words(
    child: subprocess.Popen[bytes], line: str, before_s: float, is_named: bool
) -> None:
    robot = WithProcess(engine({"*": [{"never": True}]}), process(child.pid))
    harness = Harness({"David": robot})
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(robot.engine.run)
        async with harness.runner() as control:
            run = (await control.start(order(sequence(), engine="David"), ANN)).run.id
            await anyio.sleep(2)
            robot.subscribers.tell(EngineLog(at=clock_us(), text=line))
            await anyio.sleep(before_s)
            child.kill()
            child.wait()
            await until(lambda: run not in control.open)
            told = await control.find(run)
            assert told.state == "lost"
            assert ("Its log said before" in told.detail) is is_named
            assert (line in told.detail) is is_named
        tasks.cancel_scope.cancel()


class WithProcess(Robot):
    """A robot whose engine is a process of this computer."""

    def __init__(self, inside: Any, known: EngineProcess | None) -> None:
        super().__init__(inside)
        self.known = known

    @property
    def standing(self) -> Any:
        """Return the standing, with the process."""
        return msgspec.structs.replace(super().standing, process=self.known)
