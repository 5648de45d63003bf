"""A run in a file is what was in the journal, or it is refused."""

import gzip
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.events import Event
from action_assistant.runner.archives import archive_file


def chained(bodies: list[bytes]) -> tuple[list[Event], Head]:
    events, end = [], NOTHING
    for seq, body in enumerate(bodies, 1):
        event = Event("run/r1", seq, "it.was.v1", "ann", 5 + seq, body, 10 * seq)
        end = Head(seq, link(end.chain, event))
        events.append(event)
    return events, end


def written(path: Path, bodies: list[bytes]) -> list[Event]:
    events, end = chained(bodies)
    file = archive_file.ArchiveFile(path, "run/r1", "runs/one.jsonl.gz", end)
    file.add(events)
    file.close()
    return events


BODIES = st.one_of(
    st.sampled_from([b"{}", b'{"at":1}', b' {"spaced": 1}', b'{\n"a":1}', b"\xff", b"", b"null"]),
    st.binary(max_size=30),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(BODIES, min_size=1, max_size=12))
def test_an_archive_is_read_byte_for_byte_as_written(tmp_path: Path, bodies: list[bytes]) -> None:
    path = tmp_path / "one.jsonl.gz"
    assert written(path, bodies) == list(archive_file.read(path))


def test_no_byte_of_it_can_be_changed_or_be_missing(tmp_path: Path) -> None:
    path = tmp_path / "one.jsonl.gz"
    written(path, [b'{"at":%d}' % n for n in range(50)])
    whole, chance = path.read_bytes(), random.Random(7)
    for place in [*range(40), *(chance.randrange(len(whole)) for _ in range(100))]:
        if place in {4, 5, 6, 7, 8, 9}:
            continue  # time, level and system, which say nothing of the content
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        with pytest.raises(archive_file.Damaged):
            list(archive_file.read(path))
    for place in range(0, len(whole), 7):
        path.write_bytes(whole[:place])
        with pytest.raises(archive_file.Damaged):
            list(archive_file.read(path))


@pytest.mark.parametrize(
    "change",
    [
        lambda lines: [*lines[:2], *lines[3:]],
        lambda lines: [*lines[:2], lines[3], lines[2], *lines[4:]],
        lambda lines: lines[:-2] + lines[-1:],
        lambda lines: [*lines, lines[-2]],
        lambda lines: [lines[0], lines[1].replace(b"ann", b"eve"), *lines[2:]],
        lambda lines: [lines[0].replace(b"runs/one", b"../../one"), *lines[1:]],
        lambda lines: [lines[0].replace(b'"format":1', b'"format":9'), *lines[1:]],
    ],
)
def test_a_file_that_somebody_put_together_is_refused(tmp_path: Path, change: object) -> None:
    path = tmp_path / "one.jsonl.gz"
    written(path, [b"{}"] * 6)
    lines = gzip.decompress(path.read_bytes()).splitlines(keepends=True)
    assert callable(change)
    path.write_bytes(gzip.compress(b"".join(change(lines))))
    with pytest.raises(archive_file.Damaged):
        list(archive_file.read(path))


def test_a_journal_that_does_not_keep_its_word_is_not_put_away(tmp_path: Path) -> None:
    path = tmp_path / "one.jsonl.gz"
    events, end = chained([b"{}"] * 6)
    file = archive_file.ArchiveFile(path, "run/r1", "runs/one.jsonl.gz", end)
    file.add(events[:5])
    with pytest.raises(archive_file.Damaged):
        file.close()
    assert list(tmp_path.iterdir()) == []
