"""Epochs of the log. A new one begins when the log goes back, as after a restore.

Pages name the epoch they know, so that nobody's edits are merged into a history that they were not
made on. `action-assistant restore` begins an epoch itself. Files that somebody copied back by hand
are noticed at the next start: a mark beside the log says which event was its last.
"""

import asyncio
import logging
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Final, Literal, TypeAlias

import msgspec
from sqlalchemy import select

from action_assistant.editor.log import graph_events as h
from action_assistant.errors import Conflict, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.private_files import DamagedFile, read_json, replace_file
from action_assistant.schema import editor_tables

log: Final = logging.getLogger(__name__)

MARK: Final = "editor.mark"
_EVERY: Final = 60.0  # seconds between marks
_STREAM: Final = "epochs"
_event: Final = editor_tables.editor_event.c


Why: TypeAlias = Literal["the first", "a backup was restored", "the log had gone back"]


class EpochBegun(msgspec.Struct, frozen=True):
    """A new epoch begins with this event. `why`: for people who read the log."""

    id: str
    why: Why


class EpochMark(msgspec.Struct, frozen=True, omit_defaults=True):
    """The last event that this data folder has seen, and the chain up to it as hex. `others`: the same of
    the slots after slot 0, where several editors have written."""

    position: int
    chain: str
    others: tuple[tuple[int, str], ...] = ()


async def begin(journal: Journal, why: Why, *, after: int | None = None) -> str:
    """Begin an epoch (a new history of all graphs, as after a restored backup) and return its id.
    `why`: the reason, for the log; `after`: how many there were (None: any number). Raise Conflict if
    there are more by now, Unavailable if the journal cannot be written."""
    begun = EpochBegun(secrets.token_hex(8), why)
    await journal.append(_STREAM, [h.draft(h.EPOCH, h.SERVER, begun)], expected=after)
    return begun.id


@asynccontextmanager
async def living_in(journal: Journal, data: Path) -> AsyncIterator[str]:
    """Return a context with the id of the epoch of this log, which is begun if there is none;
    during it the file with the last event seen (mark) is kept up to date. `data`: the data folder.
    """
    mark = data / MARK
    try:
        epoch = await _epoch(journal, mark)
    except Unavailable as error:  # reading goes on; pages get another epoch next time
        log.error("no epoch could be begun: %s", error.detail)
        epoch = secrets.token_hex(8)
    await _remember(journal, mark)
    task = asyncio.create_task(_keep_up(journal, mark), name="mark")
    try:
        yield epoch
    finally:
        task.cancel()
        await asyncio.wait([task])
        await _remember(journal, mark)


async def _epoch(journal: Journal, mark: Path) -> str:
    while True:
        newest = await journal.newest(_STREAM)
        try:
            if newest == 0:
                return await begin(journal, "the first", after=0)
            (event,) = await journal.read(_STREAM, after=newest - 1)
            epoch = msgspec.json.decode(event.body, type=EpochBegun).id
            if await _follows(journal, marked(mark)):
                return epoch
            log.warning("the log lacks what was in it before: open pages are told, and begin anew")
            return await begin(journal, "the log had gone back", after=newest)
        except Conflict:  # another editor has begun one meanwhile
            continue


async def _follows(journal: Journal, mark: EpochMark | None) -> bool:
    """Return whether the log still has the events of `mark`, with the same hash chain, and so
    continues it; True if `mark` is None."""
    ends = () if mark is None else ((mark.position, mark.chain), *mark.others)
    for position, chain in ends:
        if await _chain(journal, position) != chain:
            return False
    return True


async def _chain(journal: Journal, position: int) -> str:
    rows = await journal.query(select(_event.chain).where(_event.position == position))
    return "".join(bytes(row.chain).hex() for row in rows)


def marked(mark: Path) -> EpochMark | None:
    """Read the file `mark` of a data folder: the last event that this program stored while it used
    the folder. Return None if the file is missing, unreadable or damaged."""
    try:
        return read_json(mark, EpochMark)
    except (OSError, DamagedFile):  # a new folder, or one of an older version
        return None


async def _keep_up(journal: Journal, mark: Path) -> None:
    while True:
        await asyncio.sleep(_EVERY)
        await _remember(journal, mark)


async def _remember(journal: Journal, mark: Path) -> None:
    """Write the position and chain of the log's newest event into the file `mark`, by which the
    next start notices that the log went back.

    A failure is only logged: without a new mark, the next start notices less and nothing else
    breaks.
    """
    try:
        now = await journal.cursor()
        ends = [
            now.end_in(slot)
            for slot in range(max(1, len(now.numbers)))
            if slot == 0 or now.numbers[slot]
        ]
        chains = [(end, await _chain(journal, end)) for end in ends]
        text = msgspec.json.encode(EpochMark(*chains[0], tuple(chains[1:])))
        await asyncio.to_thread(partial(replace_file, mark, text, is_durable=False))
    except (OSError, Unavailable) as error:
        log.warning("cannot write %s: %s", mark, error)
