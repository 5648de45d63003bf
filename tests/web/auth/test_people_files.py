"""The files of persons: what holds when they cannot be read, and when several write at once."""

import errno
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from action_assistant.errors import Unavailable
from action_assistant.kit import retrying_thread
from action_assistant.web.auth import people_files
from action_assistant.web.auth.people_files import PeopleFiles, PersonFile
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role
from support.used_server import eventually


def person(role: Role, name: str = "Mari") -> PersonFile:
    return PersonFile("mari", name, role)


def test_a_failed_read_gives_nobody_an_earlier_role_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    editor, runner = PeopleFiles(tmp_path), PeopleFiles(tmp_path)
    editor.write(person("viewer"))
    assert runner.get("mari") == person("viewer")
    editor.write(person("viewer", "Mari K."))

    def fails(*_: object) -> Any:
        raise OSError(errno.EMFILE, "Too many open files")

    with monkeypatch.context() as patch:
        patch.setattr(people_files, "read_json", fails)
        assert runner.get("mari") == person("viewer")  # as known; a cookie may say owner
    assert runner.get("mari") == person("viewer", "Mari K.")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "stat", fails)
        assert runner.get("mari") == person("viewer", "Mari K.")
    (tmp_path / "people" / "mari.json").write_bytes(b"{")
    assert runner.get("mari") == person("viewer", "Mari K.")


def test_several_that_write_a_person_at_once_all_succeed(tmp_path: Path) -> None:
    processes = [PeopleFiles(tmp_path) for _ in range(2)]
    last = PeopleFiles(tmp_path)

    def write(n: int) -> None:
        processes[n % 2].write(person("viewer", f"Mari {'x' * (n % 40)}"))
        assert last.get("mari") is not None

    with ThreadPoolExecutor(8) as threads:
        list(threads.map(write, range(400)))
    assert {path.name for path in (tmp_path / "people").iterdir()} == {"mari.json"}
    assert processes[0].get("mari") == processes[1].get("mari")


def test_what_a_disk_does_not_take_reaches_the_other_process_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(retrying_thread, "AGAIN_S", 0.02)
    editor, runner = PeopleFiles(tmp_path), PeopleFiles(tmp_path)
    marks, others = Revocations(tmp_path), Revocations(tmp_path)
    (tmp_path / "revoked").rmdir()
    for name in ("people", "revoked"):
        (tmp_path / name).write_text("no folder")
    with pytest.raises(Unavailable):
        editor.write(person("viewer"))
    with pytest.raises(Unavailable):
        marks.end_token("t1")
    assert (editor.get("mari"), runner.get("mari")) == (person("viewer"), None)
    assert (marks.token_ended("t1"), others.token_ended("t1")) == (True, False)
    for name in ("people", "revoked"):
        (tmp_path / name).unlink()
    eventually(lambda: runner.get("mari") == person("viewer") and others.token_ended("t1"))
