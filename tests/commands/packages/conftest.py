"""The command `package`, for its tests."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from action_assistant.cli import main


@pytest.fixture
def package(tmp_path: Path) -> Callable[..., int]:
    """Runs the command on a description; packages go into `out`, if no option says where."""

    def run(value: object, *options: str) -> int:
        path = tmp_path / "given.json"
        path.write_text(value if isinstance(value, str) else json.dumps(value))
        place = () if "--into" in options else ("--output", str(tmp_path / "out"))
        return main(["package", str(path), *place, *options])

    return run
