"""Backups are made and restored wherever the clock of the computer stands."""

import json
import time
import zipfile
from datetime import UTC, datetime, tzinfo
from pathlib import Path

import pytest

from action_assistant.commands.backups import backup
from commands.backups.test_restore import filled, here


@pytest.mark.long
@pytest.mark.parametrize("now", [0.0, 315_532_799.0, 4_354_819_200.0, 6_000_000_000.0])
def test_a_backup_is_made_wherever_the_clock_stands(
    tmp_path: Path, now: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    at = time.localtime(now)
    moment = datetime.fromtimestamp(now, UTC)

    class Clock(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> datetime:
            return moment

    given = {"time": lambda: now, "localtime": lambda *when: localtime(*when) if when else at}
    localtime = time.localtime
    data, file = tmp_path / "data", tmp_path / "monday.zip"
    filled(data, "Ada")
    with monkeypatch.context() as there:
        for name, function in given.items():
            there.setattr(time, name, function)
        there.setattr(backup, "datetime", Clock)
        assert here("backup", file, "--data", data) == 0
        assert here("backup", "--into", tmp_path / "into", "--data", data, "--keep", "7d") == 0
        assert here("restore", "--rehearse", file, "--data", data) == 0
        assert here("restore", file, "--data", tmp_path / "new") == 0
    with zipfile.ZipFile(file) as packed:
        assert packed.testzip() is None
        assert json.loads(packed.read("about.json"))["made_at"] == now
    assert here("verify", "--data", tmp_path / "new") == 0
