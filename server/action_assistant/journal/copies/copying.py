"""Copies the log of one journal into another one that is empty: event for event, of either database."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, Final

from sqlalchemy import Connection, Table, insert, select

from action_assistant.errors import CannotStart
from action_assistant.journal.chain import Damage, Inspector
from action_assistant.journal.database import Branch, Database, cause_of
from action_assistant.journal.events import Event, Fold
from action_assistant.journal.migrate import recognize
from action_assistant.journal.removal import taken_out
from action_assistant.schema.editor_tables import editor_event, editor_head, editor_snapshot

_AT_ONCE: Final = 64  # rows in memory: an event has up to a MiB, a snapshot several

# The tables of the log are the same for both branches, and in every version there was.
_ROWS: Final = select(*(editor_event.c[name] for name in (*Event.__struct_fields__, "chain")))


def copy(
    source: Database,
    target: Database,
    *,
    branch: Branch,
    fold: Fold,
    tell: Callable[[int], None] = lambda _: None,
) -> int:
    """Copy everything as it is at one moment, while others may write; how many events. The tables are
    folded anew, in the same transaction: whatever ends it, all is there or nothing.

    `tell` hears how many events have been copied so far. To be called where no loop runs; not from
    one server to another. Raises CannotStart: damaged, not to be reached, or the target holds
    something.
    """

    def pour(here: Connection) -> int:
        recognize(here)
        return target.migrate(lambda there: _pour(here, there, fold, tell))

    try:
        session = target.open(branch)
    except BaseException:
        target.disown()
        raise
    try:
        return asyncio.run(_read(source, pour))
    except source.faults as error:
        raise CannotStart(f"{source.name} cannot be read: {cause_of(error)}.") from error
    finally:
        session.close()
        target.disown()


def sentence(damage: Damage) -> str:
    """What is wrong, for people."""
    return f"{damage.stream or 'the file'}, event {damage.seq}: {damage.why}"


async def _read(source: Database, question: Callable[[Connection], int]) -> int:
    try:
        return await source.at_one_moment(question)
    finally:
        await source.close()


def _pour(here: Connection, there: Connection, fold: Fold, tell: Callable[[int], None]) -> int:
    if there.execute(select(editor_event.c.position).limit(1)).first() is not None:
        raise CannotStart(
            f"The database {there.engine.url.database} holds events already; "
            "what is copied goes into an empty one."
        )
    inspector = Inspector(taken_out)
    streamed = here.execution_options(yield_per=_AT_ONCE)
    for rows in streamed.execute(_ROWS.order_by(editor_event.c.position)).partitions():
        for row in rows:
            inspector.see(tuple(row))
            if inspector.damage is not None:
                raise _damaged(inspector.damage)
        _insert(there, editor_event, rows)
        for row in rows:
            for statement in fold(Event(*row[:7])):
                there.execute(statement)
        tell(inspector.seen)
    ends = here.execute(select(editor_head)).all()
    for damage in inspector.findings((row.stream, row.seq, row.chain) for row in ends):
        raise _damaged(damage)
    for table in (editor_head, editor_snapshot):
        for rows in streamed.execute(select(table)).partitions():
            _insert(there, table, rows)
    return inspector.seen


def _insert(there: Connection, table: Table, rows: Sequence[Any]) -> None:
    there.execute(insert(table), [row._asdict() for row in rows])


def _damaged(damage: Damage) -> CannotStart:
    return CannotStart(f"The journal is damaged: {sentence(damage)}. `verify` tells more.")
