"""Room on disks, looked at again and again: what goes wrong there is told, and ends nothing."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import anyio
import pytest

from action_assistant.web.monitoring import storage
from action_assistant.web.monitoring.storage import StorageWatch
from support.waiting import wait_until


async def test_a_failed_check_is_repeated_and_shows_no_old_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(storage, "_LOOK_S", 0.01)
    monkeypatch.setattr(storage, "_FOLDERS_S", 0.01)
    fails = False
    looked = 0

    async def database() -> Mapping[str, int]:
        nonlocal looked
        looked += 1
        if fails:
            raise LookupError("nobody thought of this")
        return {"database": 7}

    async def counted(*_: Any) -> Any:
        raise LookupError("nor of this")

    watch = StorageWatch(tmp_path, database, {"archive": tmp_path}, counted, backups=False)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(watch.run)
        await wait_until(lambda: watch.found is not None)
        fails, before = True, looked
        await wait_until(lambda: looked >= before + 3)
        assert watch.found is None
        assert list(watch.families()) == []
        fails = False
        await wait_until(lambda: watch.found is not None)
        tasks.cancel_scope.cancel()
    assert "nobody thought of this" in caplog.text
    assert "folders were not counted" in caplog.text
