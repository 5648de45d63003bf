"""A runner that has a folder of behaviours, which all tests of a file share."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from runner.links.behaviours.written import (
    processes,
    until,
    write,
)
from runner.process import RunnerProcess


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunnerProcess]:
    """A runner that has a folder of them, for all tests."""
    place = tmp_path_factory.mktemp("runner")
    process = RunnerProcess(
        place / "data", "--behaviours", str(write(place / "behaviours"))
    ).start()
    yield process
    process.end()
    until(lambda: not processes())


@pytest.fixture
def folder(shared: RunnerProcess) -> Iterator[Path]:
    """The folder of the behaviours, empty at first."""
    found = shared.data.parent / "behaviours"
    yield found
    shutil.rmtree(found)
    found.mkdir()


@pytest.fixture
def runner(shared: RunnerProcess) -> Iterator[RunnerProcess]:
    """The runner; whatever a test leaves running is stopped."""
    yield shared
    with shared.client() as client:
        client.post("/api/stop")
    until(lambda: not processes())


@pytest.fixture
def client(runner: RunnerProcess) -> Iterator[httpx.Client]:
    with runner.client() as opened:
        yield opened
