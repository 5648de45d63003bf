"""Engines of registered robots on this computer, by their real command lines."""

import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from action_assistant.commands.doctor.installation import Installation
from action_assistant.commands.doctor.robot_checks import engines_index_once, robots_have_names


@contextmanager
def engine(*flags: str) -> Iterator[int]:
    """A process with the command line of an engine's node."""
    line = ["action_engine_node", "-c", "read -r line", *flags]
    with subprocess.Popen(line, executable="/bin/sh", stdin=subprocess.PIPE) as process:
        try:
            yield process.pid
        finally:
            process.kill()


def told(data: Path) -> list[tuple[str, str]]:
    place = Installation(data=data, port=9)
    return [(each.code, each.where) for each in engines_index_once(place)]


@pytest.mark.parametrize(
    ("flags", "wrong"),
    [
        (("--actor-name", "Ada"), True),
        (("--actor-name=Ada", "--indexing-rate", "2"), True),
        (("--actor-name", "Ada", "--indexing-rate=5"), True),
        (("--actor-name", "Ada", "--indexing-rate", "0"), False),
        (("--indexing-rate=0", "--actor-name=Ada"), False),
        (("--actor-name", "Nobody"), False),
    ],
)
def test_an_engine_of_ours_that_indexes_while_it_runs_is_named(
    data: Path, flags: tuple[str, ...], *, wrong: bool
) -> None:
    with engine(*flags):
        assert told(data) == ([("engine-indexing", "Ada")] if wrong else [])


def test_without_an_engine_nothing_is_told(data: Path) -> None:
    assert told(data) == []


def test_a_robot_with_the_name_of_led_runs_is_named(data: Path) -> None:
    place = Installation(data=data, port=9)
    assert list(robots_have_names(place)) == []
    with sqlite3.connect(data / "runner.db") as database:
        database.execute("update robot set name = 'conducted'")
    assert [(each.code, each.where) for each in robots_have_names(place)] == [
        ("robot-name", "conducted")
    ]
