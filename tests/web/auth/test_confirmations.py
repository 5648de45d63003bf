"""Confirmations: verified in either process alone, sealed, and never older than they say."""

from pathlib import Path

import msgspec
import pytest

from action_assistant.errors import BadInput, Unauthenticated
from action_assistant.web.auth.confirmations import Confirmation, Confirmations
from action_assistant.web.auth.keys import Keys

KEYS = Keys("t" * 40)


class Clock:
    """A clock that tests set."""

    def __init__(self) -> None:
        self.now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


def test_either_process_reads_what_the_other_has_confirmed(tmp_path: Path) -> None:
    clock = Clock()
    editor, runner = (Confirmations(tmp_path, KEYS, clock) for _ in range(2))
    assert runner.confirmed_at("s1") is None
    editor.confirm("s1", "device")
    assert runner.confirmed_at("s1") == 1_000_000
    clock.now += 60
    runner.confirm("s1", "passkey")
    assert editor.last("s1") == runner.last("s1")
    assert editor.confirmed_at("s1") == 1_000_060
    assert editor.confirmed_at("s2") is None
    assert editor.confirmed_at("../token") is None


def test_another_runner_takes_the_sealed_record_and_nothing_else(tmp_path: Path) -> None:
    clock = Clock()
    editor = Confirmations(tmp_path / "editor", KEYS, clock)
    runner = Confirmations(tmp_path / "runner", KEYS, clock)
    made = editor.confirm("s1", "device")
    runner.adopt(made)
    assert runner.confirmed_at("s1") == made.at
    clock.now += 30
    newer = editor.confirm("s1", "device")
    runner.adopt(newer)
    runner.adopt(made)  # sent again by somebody who has kept it
    assert runner.confirmed_at("s1") == newer.at
    forged = [
        msgspec.structs.replace(made, at=made.at + 20),
        msgspec.structs.replace(made, session="s2"),
        msgspec.structs.replace(made, how="oidc"),
        msgspec.structs.replace(made, seal="é"),
        Confirmations(tmp_path / "else", Keys("u" * 40), clock).confirm("s1", "device"),
    ]
    for each in forged:
        with pytest.raises(Unauthenticated):
            runner.adopt(each)
    with pytest.raises(BadInput):
        runner.adopt(msgspec.structs.replace(made, session="../s1"))
    assert runner.confirmed_at("s1") == newer.at
    assert runner.confirmed_at("s2") is None


def test_a_clock_that_is_ahead_confirms_nothing_for_the_future(tmp_path: Path) -> None:
    clock, ahead = Clock(), Clock()
    ahead.now += 600
    made = Confirmations(tmp_path / "editor", KEYS, ahead).confirm("s1", "device")
    runner = Confirmations(tmp_path / "runner", KEYS, clock)
    with pytest.raises(BadInput, match="clocks"):
        runner.adopt(made)
    assert runner.confirmed_at("s1") is None
    assert Confirmations(tmp_path / "editor", KEYS, clock).confirmed_at("s1") is None


def test_a_clock_that_is_set_back_makes_no_confirmation_younger(tmp_path: Path) -> None:
    """Neither where it was made, nor where it was read or adopted; and a new one counts at once."""
    clock, steady = Clock(), Clock()
    made_here, reader, told = (
        Confirmations(tmp_path / name, KEYS, clock, steady) for name in ("a", "a", "b")
    )
    record = made_here.confirm("s1", "device")
    told.adopt(record)
    every = (made_here, reader, told)
    clock.now, steady.now = clock.now + 7200, steady.now + 7200
    assert {each.confirmed_at("s1") for each in every} == {record.at}
    clock.now -= 3600
    assert {round(clock.now - (each.confirmed_at("s1") or 0)) for each in every} == {7200}
    clock.now -= 3600 + 61
    assert {each.confirmed_at("s1") for each in every} == {None}
    again = made_here.confirm("s1", "device")
    told.adopt(again)
    assert {each.confirmed_at("s1") for each in every} == {again.at}


def test_a_full_disk_confirms_in_the_processes_that_are_told(tmp_path: Path) -> None:
    clock = Clock()
    (tmp_path / "confirmed").write_text("no folder")
    editor, runner = (Confirmations(tmp_path, KEYS, clock) for _ in range(2))
    made = editor.confirm("s1", "device")
    assert (editor.confirmed_at("s1"), runner.confirmed_at("s1")) == (made.at, None)
    runner.adopt(made)
    assert runner.confirmed_at("s1") == made.at


@pytest.mark.parametrize(
    "content", [b"", b"{", b'{"session":"s1","at":1e6,"how":"device","seal":"x"}']
)
def test_a_file_that_this_server_did_not_seal_confirms_nothing(
    tmp_path: Path, content: bytes
) -> None:
    (tmp_path / "confirmed").mkdir()
    (tmp_path / "confirmed" / "s1.json").write_bytes(content)
    assert Confirmations(tmp_path, KEYS, Clock()).confirmed_at("s1") is None


def test_the_file_of_another_session_confirms_nothing(tmp_path: Path) -> None:
    confirmations = Confirmations(tmp_path, KEYS, Clock())
    confirmations.confirm("s1", "device")
    folder = tmp_path / "confirmed"
    (folder / "s2.json").write_bytes((folder / "s1.json").read_bytes())
    assert confirmations.confirmed_at("s2") is None
    with pytest.raises(ValueError, match="no id"):
        confirmations.confirm("../s1", "device")
    assert isinstance(confirmations.last("s1"), Confirmation)
