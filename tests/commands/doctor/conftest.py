"""A sound data folder: one for all tests, and a copy for each."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from action_assistant import paths
from support.doctor import served_once


@pytest.fixture(scope="session")
def served(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that was served, and that no test alters."""
    return served_once(tmp_path_factory.mktemp("served"))


@pytest.fixture(autouse=True)
def page_of_these_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever works on the page has sources that are newer than what was built; a test says so itself."""
    monkeypatch.setattr(paths, "page_sources", lambda: None)


@pytest.fixture
def data(served: Path, tmp_path: Path) -> Iterator[Path]:
    """A copy of it."""
    place = tmp_path / "data"
    shutil.copytree(served, place)
    yield place
    place.chmod(0o700)
