"""Whether two databases hold the same: every row of every table, whatever order they come in."""

from collections.abc import Iterator
from hashlib import blake2b
from struct import pack
from typing import Any, Final, NamedTuple

from sqlalchemy import Connection, Table, select

from action_assistant.commands.backups.progress import Progress
from action_assistant.journal.databases import ask_once
from action_assistant.schema.branches import BRANCHES

#: What is no part of what was copied: who wrote, and what is derived again from the events.
_APART: Final = frozenset({"written_by", "key_change", "key_change_head"})
_ROWS: Final = 500  # in memory
_WIDE: Final = 1 << 256


class TableSum(NamedTuple):
    """How many rows a table has, and the sum of their digests."""

    rows: int
    digest: int


def differences(one: str, other: str, progress: Progress) -> list[str]:
    """Which tables of the editor are not the same, in words. Raises CannotStart."""
    found = [ask_once(url, lambda c: dict(_sums(c, progress))) for url in (one, other)]
    return [
        f"{name}: {found[0][name].rows} rows and {found[1][name].rows}"
        for name in found[0]
        if found[0][name] != found[1][name]
    ]


def _sums(connection: Connection, progress: Progress) -> Iterator[tuple[str, TableSum]]:
    for table in BRANCHES["editor"].sorted_tables:
        if table.name not in _APART:
            yield table.name, _sum(connection, table, progress)


def _sum(connection: Connection, table: Table, progress: Progress) -> TableSum:
    rows = digest = 0
    chosen = select(table).execution_options(yield_per=_ROWS)
    with connection.execute(chosen) as found:
        for some in found.partitions():
            for row in some:
                digest = (digest + int.from_bytes(_digest(tuple(row)), "big")) % _WIDE
            rows += len(some)
            progress.tell(f"{table.name}: {rows} rows compared")
    return TableSum(rows, digest)


def _digest(values: tuple[Any, ...]) -> bytes:
    """Of what each value is and how long, so that no two rows look alike."""
    digest = blake2b(digest_size=32)
    for value in values:
        if isinstance(value, bytes | memoryview):
            kind, data = b"b", bytes(value)
        else:
            kind, data = type(value).__name__[:1].encode(), str(value).encode()
        digest.update(kind + pack(">I", len(data)) + data)
    return digest.digest()
