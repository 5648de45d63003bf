"""`people` on a data folder without a server: it says yes only to what the disk has."""

import time
from pathlib import Path

import pytest

from action_assistant.cli import main
from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.keys import Keys, Person, Session
from action_assistant.web.auth.people_files import PeopleFiles, PersonFile
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.session_files import SessionFiles


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data folder in which Mari is signed in on two devices."""
    Keys.of(tmp_path)
    PeopleFiles(tmp_path).write(PersonFile("mari", "Mari", "operator"))
    sessions = SessionFiles(tmp_path, Revocations(tmp_path))
    for id_ in ("tablet", "phone"):
        person = Person("mari", "Mari", "operator")
        now = time.time()
        sessions.note(Session(id_, person, now + 3600, personal=True, begun=now))
    return tmp_path


def confirmed(data: Path) -> list[str]:
    """Return the devices that a process with this folder calls confirmed."""
    confirmations = Confirmations(data, Keys.known(data))
    return [each for each in ("tablet", "phone") if confirmations.confirmed_at(each) is not None]


def test_a_confirmation_that_the_disk_does_not_take_is_no_success(
    data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = ["people", "confirm", "mari", "--data", str(data)]
    (data / "confirmed").mkdir(mode=0o700)
    (data / "confirmed" / "tablet.json").mkdir()  # cannot be replaced by a file
    assert main(call) == 1
    said = capsys.readouterr()
    assert "not confirmed on 1 of 2 devices" in said.err
    assert confirmed(data) == ["phone"]  # the other one was tried
    (data / "confirmed" / "tablet.json").rmdir()
    assert main(call) == 0
    assert confirmed(data) == ["tablet", "phone"]


def test_a_person_whose_end_the_disk_does_not_take_is_not_called_ended(
    data: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    call = ["people", "end", "mari", "--data", str(data)]
    monkeypatch.setenv("ACTION_ASSISTANT_PORT", "1")  # where nobody answers
    (data / "revoked").rmdir()
    (data / "revoked").write_text("no folder")
    assert main(call) == 2
    said = capsys.readouterr()
    assert ("ended" in said.out, "could not be written" in said.err) == (False, True)
    (data / "revoked").unlink()
    assert main(call) == 0
    assert "has not been told" in capsys.readouterr().out
    assert Revocations(data).person_ended("mari")
