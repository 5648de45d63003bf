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
from action_assistant.journal.removal import removed_by, taken_out
from action_assistant.journal.slots import before_first, ends_of_slots, pages_in_order, slot_of
from action_assistant.schema import editor_tables
from action_assistant.schema.branches import BRANCHES
from action_assistant.schema.editor_tables import editor_event, editor_head, editor_snapshot

_COMPARED: Final = 1_000  # events at once
_AT_ONCE: Final = 64  # rows in memory: an event has up to a MiB, a snapshot several

# The tables of the log are the same for both branches, and in every version there was.
_ROWS: Final = select(*(editor_event.c[name] for name in (*Event.__struct_fields__, "chain")))
#: Without their epochs: in a copy no stream has an owner.
_ENDS: Final = select(*(editor_head.c[name] for name in ("stream", "seq", "chain")))


def copy(
    source: Database,
    target: Database,
    *,
    branch: Branch,
    fold: Fold,
    tell: Callable[[int], None] = lambda _: None,
    over_older: bool = False,
    then: Callable[[], None] = lambda: None,
) -> int:
    """Copy a consistent state of the journal of a branch from one database to another, while others
    may write; return the number of events. The tables are folded again in the same transaction, so
    that all or nothing is copied. `tell` is called with the number of events copied so far. With
    `over_older`, the target may have an earlier state of the very same log, which is replaced.
    `then` is called before others may write to the target.

    The call blocks: use it where no event loop runs, and not from one server to another. Raise
    CannotStart if the source is damaged, a database is not reached, or the target has other data.
    """

    def pour(here: Connection) -> int:
        recognize(here)
        return target.migrate(lambda there: _copy(here, there, branch, fold, tell, over_older))

    try:
        session = target.open(branch)
    except BaseException:
        target.disown()
        raise
    try:
        copied = asyncio.run(_read(source, pour))
        then()
        return copied
    except source.faults as error:
        raise CannotStart(f"{source.name} cannot be read: {cause_of(error)}.") from error
    finally:
        session.close()
        target.disown()


def sentence(damage: Damage) -> str:
    """Return the clause that describes a damage of a journal."""
    return f"{damage.stream or 'the file'}, event {damage.seq}: {damage.why}"


async def _read(source: Database, question: Callable[[Connection], int]) -> int:
    try:
        return await source.at_one_moment(question)
    finally:
        await source.close()


def _copy(
    here: Connection,
    there: Connection,
    branch: Branch,
    fold: Fold,
    tell: Callable[[int], None],
    over_older: bool,
) -> int:
    if there.execute(select(editor_event.c.position).limit(1)).first() is None:
        pass
    elif over_older and _is_older(there, here):
        for table in BRANCHES[branch].sorted_tables:
            if table.name != editor_tables.written_by.name:
                there.execute(table.delete())
    else:
        raise CannotStart(
            f"The database {there.engine.url.database} holds events already; "
            "what is copied goes into an empty one."
        )
    inspector = Inspector(taken_out)
    for rows in pages_in_order(here, _ROWS, editor_event.c.position, _AT_ONCE, removed_by):
        for row in rows:
            inspector.see(tuple(row))
            if inspector.damage is not None:
                raise _damaged(inspector.damage)
        _insert(there, editor_event, rows)
        for row in rows:
            for statement in fold(Event(*row[:7])):
                there.execute(statement)
        tell(inspector.seen)
    for damage in inspector.findings(tuple(row) for row in here.execute(_ENDS)):
        raise _damaged(damage)
    streamed = here.execution_options(yield_per=_AT_ONCE)
    for table, chosen in ((editor_head, _ENDS), (editor_snapshot, select(editor_snapshot))):
        for some in streamed.execute(chosen).partitions():
            _insert(there, table, some)
    return inspector.seen


def _is_older(old: Connection, new: Connection) -> bool:
    """Return whether the log in `old` has exactly the first events of the log in `new`. The links
    of the hash chains are compared, which stand for all fields of an event."""
    event = editor_event.c
    chosen = select(event.position, event.stream, event.seq, event.chain).order_by(event.position)
    for end in ends_of_slots(old, event.position):
        after = before_first(slot_of(end))
        while after < end:
            some = event.position > after, event.position <= end
            rows = old.execute(chosen.where(*some).limit(_COMPARED)).all()
            last = rows[-1].position
            same = new.execute(chosen.where(event.position > after, event.position <= last)).all()
            if [tuple(row) for row in rows] != [tuple(row) for row in same]:
                return False
            after = last
    return True


def _insert(there: Connection, table: Table, rows: Sequence[Any]) -> None:
    there.execute(insert(table), [row._asdict() for row in rows])


def _damaged(damage: Damage) -> CannotStart:
    return CannotStart(f"The journal is damaged: {sentence(damage)}. `verify` tells more.")
