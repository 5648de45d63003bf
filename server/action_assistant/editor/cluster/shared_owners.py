"""Owners of graphs in a Postgres database that several editors share (decision 174).

The table `room` says which editor owns a stream, `editor` which editors there are. Neither protects
the log: an editor that takes a stream raises its epoch, and each append names the epoch that it was
made in. So a wrong suspicion that an editor is dead costs its clients a new connection and nothing
else.
"""

import asyncio
import hmac
import logging
import secrets
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final

from sqlalchemy import Connection, text
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine

from action_assistant.editor.cluster.chores import CHORES
from action_assistant.editor.cluster.owners import Elsewhere, Here, Nobody, Owner
from action_assistant.editor.cluster.shared_desk import SIGN_IN
from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal.chain import START
from action_assistant.journal.database import cause_of
from action_assistant.journal.journal import Journal
from action_assistant.journal.postgres import HELD_SLOT, Postgres, beside
from action_assistant.version import VERSION

log: Final = logging.getLogger(__name__)

_FAULTS: Final[tuple[type[Exception], ...]] = (*Postgres.faults, Unavailable)
_BEAT_S: Final = 0.5  # between two beats
_DEAD_S: Final = 2.0  # without a beat, after which others take the streams of an editor
_CUT_OFF_S: Final = 1.5  # without a beat, after which an editor closes its own rooms
_LOOKED_S: Final = 0.1  # between two looks at the time of the last beat
_ANSWER_S: Final = 1.0  # for a beat
_PATIENCE_S: Final = 5.0  # for any other question
_COMPARED_EACH: Final = 4  # beats between two comparisons of the streams owned
_TIES: Final = 20  # how often another editor may be faster
#: Without a beat, after which the token of an editor does not count. An editor that was frozen for
#: more than `_DEAD_S` may go on, and would refuse what is relayed to it; one that died must not keep
#: others from starting with a new token.
_TOKEN_COUNTS_S: Final = 5.0
_CONNECTIONS: Final = 2
_NOW: Final = "(extract(epoch FROM clock_timestamp()) * 1000000)::bigint"
_LIVES: Final = (
    f"e.draining_at IS NULL AND e.beat_at > {_NOW} - {int(_DEAD_S * 1e6)} AND "
    + HELD_SLOT.format("e.slot")
)
#: The owner of a stream and whether it lives, as far as it is known.
_LOOK: Final = text(
    f"SELECT r.life, r.epoch, e.url, coalesce({_LIVES}, false) AS lives"
    " FROM room r LEFT JOIN editor e ON e.life = r.life WHERE r.stream = :stream"
)
#: Nothing is returned for a stream without events: a request for a graph that does not exist leaves
#: no rows.
_RAISE: Final = text("UPDATE head SET epoch = epoch + 1 WHERE stream = :stream RETURNING epoch")
#: Nothing is returned if another editor was faster.
_SHOW: Final = text(
    f"INSERT INTO room AS r (stream, life, epoch, since) VALUES (:stream, :life, :epoch, {_NOW})"
    " ON CONFLICT (stream) DO UPDATE"
    " SET life = excluded.life, epoch = excluded.epoch, since = excluded.since, people = NULL"
    " WHERE (r.life, r.epoch) = (CAST(:old_life AS bytea), CAST(:old_epoch AS bigint))"
    " RETURNING stream"
)
_GIVE_UP: Final = text("DELETE FROM room WHERE stream = :stream AND life = :life")
_MINE: Final = text("SELECT stream, epoch FROM room WHERE life = :life")
_BEAT: Final = text(
    f"UPDATE editor e SET beat_at = {_NOW} WHERE life = :life AND {HELD_SLOT.format('e.slot')}"
    " RETURNING slot"
)
_CLAIM: Final = (
    text("DELETE FROM editor WHERE life = :life AND slot <> :slot"),
    text(
        "INSERT INTO editor (slot, life, url, version, beat_at, proof)"
        f" VALUES (:slot, :life, :url, :version, {_NOW}, :proof) ON CONFLICT (slot) DO UPDATE"
        " SET life = excluded.life, url = excluded.url, version = excluded.version,"
        " beat_at = excluded.beat_at, proof = excluded.proof, draining_at = NULL, mark = NULL, met = NULL"
    ),
    text(
        "INSERT INTO head (stream, seq, chain) VALUES (:chores, 0, :start), (:sign_in, 0, :start)"
        " ON CONFLICT DO NOTHING"
    ),
)
_DRAIN: Final = text(f"UPDATE editor SET draining_at = {_NOW} WHERE life = :life")
_LEAVE: Final = (
    text("DELETE FROM room WHERE life = :life"),
    text("DELETE FROM editor WHERE life = :life"),
)
_SHOW_TOKEN: Final = text("UPDATE editor SET proof = :proof WHERE life = :life")
_OTHER_TOKENS: Final = text(
    f"SELECT url FROM editor WHERE proof <> :proof AND beat_at > {_NOW} - {int(_TOKEN_COUNTS_S * 1e6)}"
    f" AND {HELD_SLOT.format('slot')} ORDER BY slot"
)
_UNKNOWN: Final = "It cannot be found out which editor has this graph: {}."
_DRAINING: Final = "This editor is ending; try again."
_TIED: Final = "Other editors take this graph again and again; try again."


class SharedOwners:
    """Finds the owners of streams, and takes streams, as one of several editors. `journal`: opened
    for several writers, on the Postgres database with the URL `database`; `url`: where other
    editors reach this one."""

    def __init__(self, journal: Journal, database: str, url: str) -> None:
        self._journal = journal
        self._database = database
        self._url = url
        self._life = secrets.token_bytes(16)
        self._proof: bytes | None = None  # of the token
        self._loop = asyncio.get_running_loop()
        self._engine = beside(database, "owners", size=_CONNECTIONS, patience=_PATIENCE_S)
        self._mine: dict[str, int] = {}  # the epochs of the streams that this editor owns
        self._asking: dict[str, asyncio.Task[Owner]] = {}
        self._hear: list[Callable[[str], object]] = []
        self._draining = False
        self._beaten = time.monotonic()  # when the last beat began that was stored
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._beat_until_the_end, name="beats", daemon=True)

    @classmethod
    @asynccontextmanager
    async def joined(
        cls, journal: Journal, database: str, url: str
    ) -> AsyncIterator["SharedOwners"]:
        """Return a context in which this editor is one of several; at its end it owns nothing any
        more. The parameters are those of the class. Raise Unavailable if the database cannot be
        written."""
        owners = cls(journal, database, url)
        try:
            await owners._claim()
            owners._thread.start()
            yield owners
        finally:
            await owners._leave()

    async def require_same_token(self, key: bytes) -> None:
        """Show to the other editors of this database which token this one has, without showing the
        token itself, and compare. `key`: the key for what editors relay, which follows from the
        token. Raise CannotStart if a living editor has another token, Unavailable if the database
        does not answer. Of two that start at once with different tokens at least one is refused,
        since each shows its own before it compares."""
        proof = hmac.digest(key, b"an editor of this database", "sha256")
        self._proof = proof  # also for another slot
        values = {"proof": proof, "life": self._life}

        def show(connection: Connection) -> None:
            connection.execute(_SHOW_TOKEN, values)

        def compare(connection: Connection) -> list[str]:
            return [row.url for row in connection.execute(_OTHER_TOKENS, values)]

        await self._journal.derive(show)
        others = await self._journal.derive(compare)
        if others:
            raise CannotStart(
                f"The editor at {others[0]} has another token. All editors of one database need the same "
                "token and the same data folder: start them with the same --data, or give them the same "
                "ACTION_ASSISTANT_TOKEN."
            )

    async def owner(self, stream: str) -> Owner:
        """Return the owner of a stream; take the stream if no living editor owns it. Raise
        Unavailable if the database does not answer, or if this editor is draining and nobody else
        owns the stream."""
        epoch = self._mine.get(stream)
        if epoch is not None:
            return Here(epoch)
        asking = self._asking.get(stream)
        if asking is None:
            asking = self._asking[stream] = asyncio.create_task(self._find(stream))
            asking.add_done_callback(lambda _: self._asking.pop(stream, None))
        return await asyncio.shield(asking)  # others may wait for it too

    async def give_up(self, stream: str) -> None:
        """Own a stream no longer, so that the next editor that needs it takes it."""
        self._mine.pop(stream, None)
        try:
            async with self._engine.begin() as connection:
                await connection.execute(_GIVE_UP, {"stream": stream, "life": self._life})
        except _FAULTS as error:
            log.info("%s is taken from this editor later: %s", stream, cause_of(error))

    def check_again(self, stream: str) -> None:
        """Forget that this editor owns a stream, because an append to it was refused: the next
        `owner` asks the database."""
        self._mine.pop(stream, None)

    def when_lost(self, hear: Callable[[str], object]) -> None:
        """Call `hear` on the event loop with each stream that this editor owns no longer."""
        self._hear.append(hear)

    async def drain(self) -> None:
        """Take no streams any more, and let other editors take those of this one."""
        self._draining = True
        try:
            async with self._engine.begin() as connection:
                await connection.execute(_DRAIN, {"life": self._life})
        except _FAULTS as error:
            log.warning("other editors do not know that this one ends: %s", cause_of(error))

    # --- taking streams ---------------------------------------------------------------------------

    async def _find(self, stream: str) -> Owner:
        try:
            for _ in range(_TIES):
                async with self._engine.connect() as connection:
                    found = await self._look(connection, stream)
                    if found is not None:
                        await connection.commit()
                        if isinstance(found, Here) and found.epoch is not None:
                            self._mine[stream] = found.epoch
                        return found
        except Postgres.faults as error:
            raise Unavailable(_UNKNOWN.format(cause_of(error))) from error
        raise Unavailable(_TIED)

    async def _look(self, connection: AsyncConnection, stream: str) -> Owner | None:
        """Return the owner of a stream, which this editor takes if no living editor owns it. Return
        None if another editor was faster."""
        row = (await connection.execute(_LOOK, {"stream": stream})).first()
        if row is not None and row.life == self._life:
            return Here(row.epoch)
        if row is not None and row.lives:
            return Elsewhere(row.url)
        if self._draining:
            raise Unavailable(_DRAINING)
        epoch = (await connection.execute(_RAISE, {"stream": stream})).scalar()
        if epoch is None:
            return Nobody()
        values: dict[str, Any] = {"stream": stream, "life": self._life, "epoch": epoch}
        values |= {"old_life": None, "old_epoch": None}
        if row is not None:
            values |= {"old_life": row.life, "old_epoch": row.epoch}
        shown = (await connection.execute(_SHOW, values)).first()
        return None if shown is None else Here(epoch)

    def _lose(self, streams: dict[str, int]) -> None:
        """Own these streams no longer, unless they were taken again since: their epochs say so."""
        for stream, epoch in streams.items():
            if self._mine.get(stream) != epoch:
                continue
            del self._mine[stream]
            for hear in self._hear:
                hear(stream)

    def _lose_all(self) -> None:
        log.warning("the database does not hear this editor: its rooms are closed")
        self._lose(dict(self._mine))

    # --- showing that this editor lives -----------------------------------------------------------

    async def _claim(self) -> None:
        """Register this editor under the slot of its writer. The writer's own connection does that,
        so it certainly holds the slot then."""

        def register(connection: Connection) -> None:
            values: dict[str, Any] = {"life": self._life, "slot": self._journal.slot}
            values |= {"url": self._url, "version": VERSION, "start": START, "proof": self._proof}
            values |= {"chores": CHORES, "sign_in": SIGN_IN}
            for statement in _CLAIM:
                connection.execute(statement, values)
            if self._draining:
                connection.execute(_DRAIN, values)

        await self._journal.derive(register)

    def _beat_until_the_end(self) -> None:
        asyncio.run(self._live())

    async def _live(self) -> None:
        """Beat, on the thread for this: the process may live while its event loop is busy."""
        engine = beside(self._database, "beats", size=1, patience=_ANSWER_S)
        watching = asyncio.create_task(self._watch_the_time())
        beats = 0
        try:
            while not self._ended.is_set():
                begun = time.monotonic()
                try:
                    async with engine.begin() as connection:
                        found = (await connection.execute(_BEAT, {"life": self._life})).first()
                    if found is None:  # the slot was lost, perhaps with the writer's connection
                        claiming = asyncio.run_coroutine_threadsafe(self._claim(), self._loop)
                        await asyncio.wrap_future(claiming)
                    self._was_heard(begun)
                    if beats % _COMPARED_EACH == 0:
                        await self._compare(engine)
                except _FAULTS as error:
                    log.info("a beat was not stored: %s", error)
                beats += 1
                # Another thread sets `_ended`.
                while time.monotonic() < begun + _BEAT_S and not self._ended.is_set():  # noqa: ASYNC110
                    await asyncio.sleep(_LOOKED_S)
        finally:
            watching.cancel()
            await engine.dispose()

    def _was_heard(self, begun: float) -> None:
        """Note that a beat was stored, which began at the time `begun`. If the beat before it was
        too long ago, lose all streams first: others may have taken them."""
        if begun - self._beaten > _CUT_OFF_S + _BEAT_S:
            self._on_loop(self._lose_all)
        self._beaten = begun

    async def _watch_the_time(self) -> None:
        is_cut_off = False
        while True:
            await asyncio.sleep(_LOOKED_S)
            was, is_cut_off = is_cut_off, time.monotonic() - self._beaten > _CUT_OFF_S
            if is_cut_off and not was:
                self._on_loop(self._lose_all)

    async def _compare(self, engine: AsyncEngine) -> None:
        """Lose the streams that another editor has taken."""
        owned = dict(self._mine)
        async with engine.connect() as connection:
            rows = (await connection.execute(_MINE, {"life": self._life})).all()
        shown = {row.stream: row.epoch for row in rows}
        lost = {each: epoch for each, epoch in owned.items() if shown.get(each) != epoch}
        if lost:
            self._on_loop(lambda: self._lose(lost))

    def _on_loop(self, call: Callable[[], None]) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call)

    async def _leave(self) -> None:
        self._ended.set()
        if self._thread.is_alive():
            await asyncio.to_thread(self._thread.join)
        self._mine.clear()
        try:
            async with self._engine.begin() as connection:
                for statement in _LEAVE:
                    await connection.execute(statement, {"life": self._life})
        except _FAULTS as error:
            log.info("other editors find out that this one has ended: %s", cause_of(error))
        await self._engine.dispose()
