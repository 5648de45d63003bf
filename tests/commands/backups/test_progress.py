"""Work of more than a second reports its progress; quick work reports nothing."""

import pytest

from action_assistant.commands.backups import progress
from action_assistant.commands.backups.progress import Progress


def test_a_word_a_second_after_the_first_second(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = 100.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    told = Progress()
    for tenth in range(35):
        now = 100 + tenth / 10
        told.tell(f"{tenth} events")
    told.end()
    assert capsys.readouterr().err.splitlines() == ["10 events …", "20 events …", "30 events …"]
