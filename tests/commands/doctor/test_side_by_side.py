"""`doctor` looks at everything at once: what waits for the network does not come after what waits for disks."""

import threading
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path

import pytest

from action_assistant.commands.doctor import doctor
from action_assistant.commands.doctor.doctor import Check, examine
from action_assistant.commands.doctor.installation import Installation
from action_assistant.system.diagnostics import Diagnostic, fine


def test_robots_are_asked_while_disks_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each waits for the other here, so that neither could come first."""
    disk, robot = threading.Event(), threading.Event()

    def meets(mine: threading.Event, other: threading.Event, place: str) -> list[Diagnostic]:
        mine.set()
        return [fine(place, "met" if other.wait(5) else "alone")]

    monkeypatch.setattr(doctor, "engines_index_once", lambda _: ())
    monkeypatch.setattr(doctor, "robots_answer", lambda _: meets(robot, disk, "robots"))
    monkeypatch.setattr(
        doctor, "examine", partial(_with_checks, [lambda _: meets(disk, robot, "disks")])
    )
    seen = list(doctor.looked_at(Installation(data=tmp_path), None))
    assert [(each.where, each.message) for each in seen] == [("disks", "met"), ("robots", "met")]


def _with_checks(
    checks: list[Check], place: Installation, others: Iterable[Check] = (), seconds: float = 10.0
) -> Iterator[Diagnostic]:
    """Run `examine` with these checks instead of those of a machine."""
    return examine(place, others or checks, seconds)
