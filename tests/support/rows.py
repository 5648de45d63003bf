"""Rows for tables of any revision, and what tables hold."""

import json
from typing import Any, Final

from sqlalchemy import JSON, Column, Connection, MetaData, Table, delete, insert, select

from action_assistant.journal.chain import NOTHING, Head, link
from action_assistant.journal.events import Event
from action_assistant.schema.editor_tables import editor_event, editor_head

#: What the program says of itself.
_OWN: Final = frozenset({"alembic_version", "written_by"})


def fill(
    connection: Connection, but: frozenset[str] = frozenset()
) -> dict[str, list[dict[str, Any]]]:
    """Put two rows into each table as it is at this revision, `but` some; what they are."""
    metadata = MetaData()
    metadata.reflect(connection)
    tables = [table for table in metadata.sorted_tables if table.name not in _OWN | but]
    for table in tables:
        for n in (1, 2):
            connection.execute(insert(table).values({c.name: value(c, n) for c in table.columns}))
    return _contents(connection, tables)


def filled_anew(connection: Connection) -> tuple[dict[str, list[dict[str, Any]]], ...]:
    """Return the rows of all tables, and those that were put there in their place."""
    metadata = MetaData()
    metadata.reflect(connection)
    tables = [table for table in metadata.sorted_tables if table.name not in _OWN]
    before = _contents(connection, tables)
    for table in reversed(tables):
        connection.execute(delete(table))
    for table in tables:
        rows = [{c.name: value(c, n) for c in table.columns} for n in (1, 2)]
        connection.execute(insert(table), rows)
    return before, _contents(connection, tables)


def value(column: Column[Any], n: int) -> Any:
    """Return a value that fits a column, and that no other row has."""
    kind = column.type.as_generic().python_type
    values = {int: n, str: f"{column.name} {n}", bytes: bytes([n, 0, 255]), bool: n == 1}
    return {"n": n} if isinstance(column.type.as_generic(), JSON) else values.get(kind, float(n))


def contents(connection: Connection, names: list[str]) -> dict[str, list[dict[str, Any]]]:
    """The rows of some tables."""
    metadata = MetaData()
    metadata.reflect(connection, only=names)
    return _contents(connection, [metadata.tables[name] for name in names])


def _contents(connection: Connection, tables: list[Table]) -> dict[str, list[dict[str, Any]]]:
    return {
        table.name: sorted(
            (dict(row) for row in connection.execute(select(table)).mappings()), key=repr
        )
        for table in tables
    }


def write_events(connection: Connection, streams: int = 3, each: int = 4) -> list[Event]:
    """Events with their chain, as a writer would store them; at whatever revision the tables are."""
    event, head = editor_event, editor_head
    heads, written = dict.fromkeys((f"stream/{n}" for n in range(streams)), NOTHING), []
    for position in range(1, streams * each + 1):
        stream = f"stream/{position % streams}"
        before = heads[stream]
        body = json.dumps({"n": position, "text": "ä🤖"}).encode()
        one = Event(stream, before.seq + 1, "it.happened.v1", "ann", 7 * position, body, position)
        heads[stream] = Head(one.seq, link(before.chain, one))
        row = {name: getattr(one, name) for name in Event.__struct_fields__}
        connection.execute(insert(event).values(**row, chain=heads[stream].chain))
        written.append(one)
    for stream, end in heads.items():
        connection.execute(insert(head).values(stream=stream, seq=end.seq, chain=end.chain))
    return written
