"""A stream may leave the log when it says so: the rest stays proven, and nothing else may leave."""

import sqlite3
from collections.abc import Awaitable, Callable
from contextlib import closing
from pathlib import Path

import pytest

from action_assistant.errors import Conflict
from action_assistant.journal.events import Addition, Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.removal import StreamRemoved

Open = Callable[..., Awaitable[Journal]]


async def filled(journal: Journal) -> None:
    """Two streams with 2,500 events each, mixed."""
    for n in range(25):
        for name in ("gone", "kept"):
            await journal.append(name, [Draft("it.was.v1", "ada", b"%d" % n)] * 100)


async def removed(journal: Journal, stream: str) -> StreamRemoved:
    end = await journal.end(stream)
    return StreamRemoved(stream, end.seq, end.chain.hex(), "elsewhere", "00")


def note(by: int) -> Addition:
    return Addition("notes", (Draft("noted.v1", "", b"%d" % by),))


async def test_a_log_stays_sound_while_a_stream_leaves_it_and_after(open_journal: Open) -> None:
    journal = await open_journal()
    await filled(journal)
    by = await journal.take_out(await removed(journal, "gone"), note)
    assert await journal.verify() == []
    left = [2_500]
    while await journal.delete_some("gone", by):
        left.append(len(await journal.read("gone")))
        assert await journal.verify() == []
    assert len(left) > 2
    assert await journal.read("gone") == []
    assert await journal.newest("gone") == 2_500
    assert len(await journal.read("kept")) == 2_500
    await journal.append("gone", [Draft("it.goes.on.v1", "ada", b"")])
    assert await journal.verify() == []
    await journal.close()
    again = await open_journal()
    await again.append("kept", [Draft("it.was.v1", "ada", b"")])
    assert await again.verify() == []


async def test_a_stream_that_nobody_keeps_elsewhere_stays(open_journal: Open) -> None:
    journal = await open_journal()
    await filled(journal)
    told = await removed(journal, "gone")
    by = await journal.take_out(told, note)
    with pytest.raises(Conflict):
        await journal.delete_some("kept", by)
    with pytest.raises(Conflict):
        await journal.delete_some("gone", by + 1)
    await journal.append("gone", [Draft("it.goes.on.v1", "ada", b"")])
    with pytest.raises(Conflict):  # it has gone on since somebody looked
        await journal.take_out(told, note)
    assert len(await journal.read("kept")) == 2_500


@pytest.mark.parametrize(
    ("damage", "found"),
    [
        ("DELETE FROM event WHERE stream = 'kept'", ("kept", 1)),
        ("DELETE FROM event WHERE stream = 'kept' AND seq = 7", ("kept", 7)),
        ("DELETE FROM event WHERE stream = 'removed'", ("removed", 1)),
        ("UPDATE event SET body = x'7b7d' WHERE stream = 'removed'", ("removed", 1)),
        ("UPDATE event SET author = 'eve' WHERE stream = 'gone' AND seq = 3", ("gone", 3)),
    ],
)
async def test_damage_is_found_beside_what_was_taken_out(
    tmp_path: Path, damage: str, found: tuple[str, int]
) -> None:
    path = tmp_path / "editor.db"
    journal = await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)
    await filled(journal)
    by = await journal.take_out(await removed(journal, "gone"), note)
    await journal.delete_some("gone", by)
    with closing(sqlite3.connect(path)) as other, other:
        other.execute(damage)
    assert found in [(each.stream, each.seq) for each in await journal.verify()]
    await journal.close()


async def test_a_whole_stream_that_vanished_without_a_word_is_missed(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    journal = await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)
    await filled(journal)
    await journal.take_out(await removed(journal, "gone"), note)
    with closing(sqlite3.connect(path)) as other, other:
        other.execute("DELETE FROM event WHERE stream IN ('kept', 'gone')")
        other.execute("DELETE FROM head WHERE stream = 'kept'")
    (damage,) = await journal.verify()
    assert "are missing" in damage.why
    await journal.close()
