"""The line of `verify --head`: whoever alters a log and makes its chain anew is found by it."""

import asyncio
import contextlib
import io
import shutil
import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.cli import main
from action_assistant.journal.chain import START, link
from action_assistant.journal.events import Addition, Draft, Event
from action_assistant.journal.journal import Journal
from action_assistant.journal.removal import StreamRemoved
from action_assistant.runner.archives.archive_file import ArchiveFile
from action_assistant.runner.projection import fold
from support.doses import examples


def stored(data: Path, events: list[tuple[str, bytes]]) -> None:
    """Append events to a runner's journal."""

    async def append() -> None:
        journal = await Journal.open(f"sqlite:///{data / 'runner.db'}", branch="runner", fold=fold)
        for stream, body in events:
            await journal.append(stream, [Draft("x.y.v1", "ada", body)])
        await journal.close()

    asyncio.run(append())


def archived(data: Path, stream: str) -> None:
    """Take a stream out of the journal, into an archive."""

    async def take_out() -> None:
        journal = await Journal.open(f"sqlite:///{data / 'runner.db'}", branch="runner", fold=fold)
        end = await journal.end(stream)
        place = f"runs/{stream}.jsonl.gz"
        file = ArchiveFile(data / "archive" / place, stream, place, end)
        file.add(await journal.read(stream))
        removed = StreamRemoved(stream, end.seq, end.chain.hex(), place, file.close())
        by = await journal.take_out(removed, lambda _: _addition())
        while await journal.delete_some(stream, by):
            pass
        await journal.close()

    asyncio.run(take_out())


def _addition() -> Addition:
    return Addition("about", (Draft("x.y.v1", "ada", b"{}"),))


def forge(data: Path, position: int, body: bytes) -> None:
    """Alter an event, and make the chain of its stream anew from there."""
    with closing(sqlite3.connect(data / "runner.db")) as db, db:
        columns = "stream, seq, kind, author, at, body, position"
        (stream,) = db.execute("SELECT stream FROM event WHERE position = ?", [position]).fetchone()
        db.execute("UPDATE event SET body = ? WHERE position = ?", [body, position])
        chain, seq = START, 0
        rows = db.execute(f"SELECT {columns} FROM event WHERE stream = ? ORDER BY seq", [stream])
        for row in rows.fetchall():
            chain, seq = link(chain, Event(*row)), row[1]
            db.execute("UPDATE event SET chain = ? WHERE position = ?", [chain, row[6]])
        db.execute("UPDATE head SET seq = ?, chain = ? WHERE stream = ?", [seq, chain, stream])


def line_of(data: Path, capfd: pytest.CaptureFixture[str], *more: str) -> str:
    """The line, which is all of the output."""
    capfd.readouterr()
    assert main(["verify", "--data", str(data), "--head", *more]) == 0
    (line,) = capfd.readouterr().out.splitlines()
    return line


def against(data: Path, line: str, *more: str) -> int:
    return main(["verify", "--data", str(data), "--against", line, *more])


@pytest.fixture
def data(tmp_path: Path) -> Path:
    (tmp_path / "data").mkdir()
    stored(tmp_path / "data", [("a", b"1"), ("b", b"2"), ("a", b"3"), ("c", b"4"), ("a", b"5")])
    return tmp_path / "data"


@pytest.fixture
def key(tmp_path: Path) -> Path:
    """Make a signing key with the command of the documents."""
    path = tmp_path / "heads.pem"
    command = ["openssl", "genpkey", "-algorithm", "ed25519", "-out", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    return path


@given(
    later=st.lists(st.tuples(st.sampled_from("abcd"), st.binary(max_size=3)), max_size=4),
    position=st.integers(1, 5),
    body=st.binary(max_size=3),
)
@settings(max_examples=examples(10))
def test_a_forgery_that_makes_the_chain_anew_is_sound_in_itself_and_found_by_the_line(
    tmp_path_factory: pytest.TempPathFactory,
    later: list[tuple[str, bytes]],
    position: int,
    body: bytes,
) -> None:
    data = tmp_path_factory.mktemp("forged")
    first = [("a", b"1000"), ("b", b"2000"), ("a", b"3000"), ("c", b"4000"), ("a", b"5000")]
    stored(data, first)
    command = ["verify", "--data", str(data), "--head"]
    line = output_of(command)
    stored(data, later)
    assert output_of(["verify", "--data", str(data), "--against", line], code=0).endswith(
        "\nrunner: its first 5 events are those of " + line.split()[2]
    )
    forge(data, position, body)
    assert "all of them sound" in output_of(["verify", "--data", str(data)], code=0)
    assert "is NOT what it was" in output_of(
        ["verify", "--data", str(data), "--against", line], code=1
    )


def output_of(words: list[str], code: int = 0) -> str:
    """Return the output of a command, without its last line feed."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main(words) == code
    return out.getvalue().rstrip("\n")


def test_events_that_are_missing_at_the_end_are_told(
    data: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(data, tmp_path / "before")
    stored(data, [("a", b"6")])
    line = line_of(data, capfd)
    assert against(tmp_path / "before", line) == 1
    assert "it had 6 events" in capfd.readouterr().out


@pytest.mark.parametrize("made", ["before", "between", "after"])
def test_streams_that_were_archived_since_are_read_in_their_archives(
    data: Path, capfd: pytest.CaptureFixture[str], made: str
) -> None:
    lines = {"before": line_of(data, capfd)}
    stored(data, [("a", b"6"), ("b", b"7")])
    lines["between"] = line_of(data, capfd)
    archived(data, "a")
    lines["after"] = line_of(data, capfd)
    stored(data, [("d", b"8")])
    assert against(data, lines[made]) == 0
    (data / "archive" / "runs" / "a.jsonl.gz").rename(data / "gone")
    assert against(data, lines[made]) == (0 if made == "after" else 1)
    if made != "after":
        assert "cannot be compared" in capfd.readouterr().out


def test_a_log_that_is_gone_is_told(data: Path, capfd: pytest.CaptureFixture[str]) -> None:
    line = line_of(data, capfd)
    other = line.replace("runner", "editor")
    assert against(data, other) == 1
    told = capfd.readouterr().out
    assert "editor: the line of" in told
    assert "runner: the line of" in told


def test_nothing_is_printed_for_a_log_that_is_not_sound(
    data: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with closing(sqlite3.connect(data / "runner.db")) as db, db:
        db.execute("UPDATE event SET body = 'x' WHERE position = 1")
    capfd.readouterr()
    assert main(["verify", "--data", str(data), "--head"]) == 1
    assert capfd.readouterr().out == ""


def test_a_signed_line_is_proven_by_either_half_of_its_key(
    data: Path, key: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    line = line_of(data, capfd, "--sign", str(key))
    public = tmp_path / "public.pem"
    command = ["openssl", "pkey", "-in", str(key), "-pubout", "-out", str(public)]
    subprocess.run(command, check=True, capture_output=True)
    assert against(data, line) == 0
    assert against(data, line, "--key", str(key)) == 0
    assert against(data, line, "--key", str(public)) == 0
    lines = tmp_path / "lines.txt"
    lines.write_text(f"{line}\n\n{line_of(data, capfd, '--sign', str(key))}\n")
    assert against(data, str(lines), "--key", str(public)) == 0


def test_a_line_that_is_not_the_owners_is_refused(
    data: Path, key: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    line, plain = line_of(data, capfd, "--sign", str(key)), line_of(data, capfd)
    other = tmp_path / "other.pem"
    command = ["openssl", "genpkey", "-algorithm", "ed25519", "-out", str(other)]
    subprocess.run(command, check=True, capture_output=True)
    for text, named, why in (
        (line, other, "signed by another key"),
        (plain, key, "not signed"),
        (line.replace("runner 5", "runner 4"), key, "it was altered"),
        (line[:-1], key, "no line"),
        (line.replace("20", "19", 1), None, "it was altered"),
        ("action-assistant-heads", None, "no line"),
        (str(tmp_path / "nowhere"), None, "neither a line"),
    ):
        assert against(data, text, *(["--key", str(named)] if named else [])) == 2
        assert why in capfd.readouterr().err


def test_a_key_in_the_data_folder_or_of_another_kind_is_refused(
    data: Path, key: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(key, data / "key.pem")
    (tmp_path / "link.pem").symlink_to(data / "key.pem")
    (tmp_path / "text").write_text("no key")
    rsa = tmp_path / "rsa.pem"
    command = ["openssl", "genpkey", "-algorithm", "rsa", "-out", str(rsa)]
    subprocess.run(command, check=True, capture_output=True)
    for path, why in (
        (data / "key.pem", "is in the data folder"),
        (tmp_path / "link.pem", "is in the data folder"),
        (tmp_path / "nowhere.pem", "openssl genpkey"),
        (tmp_path / "text", "no private key"),
        (rsa, "of another kind"),
    ):
        assert main(["verify", "--data", str(data), "--sign", str(path)]) == 2
        assert why in capfd.readouterr().err
