"""A runner process that the tests of this folder share, and one for those who kill it."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from runner.process import RunnerProcess


@pytest.fixture(scope="session")
def shared_process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunnerProcess]:
    """A runner that lives as long as the tests."""
    process = RunnerProcess(tmp_path_factory.mktemp("runner") / "data").start()
    yield process
    process.end()


@pytest.fixture
def process(shared_process: RunnerProcess) -> Iterator[RunnerProcess]:
    """The shared runner; whatever a test leaves running is stopped."""
    yield shared_process
    with shared_process.client() as client:
        client.post("/api/stop")


@pytest.fixture
def own_process(tmp_path: Path) -> Iterator[RunnerProcess]:
    """A runner of one's own."""
    process = RunnerProcess(tmp_path / "data").start()
    yield process
    process.end()
