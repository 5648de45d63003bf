"""The inbox of each person: the comments in which others have mentioned them.

Found in the committed events, not by what a page says: the author is the one that the log knows.
"""

import logging
from collections import Counter, defaultdict
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from collections.abc import Set as AbstractSet
from contextlib import asynccontextmanager
from datetime import datetime
from functools import partial
from itertools import islice
from typing import Any, Final, TypeAlias

import anyio
import msgspec
from sqlalchemy import Connection, and_, delete, func, insert, select

from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.log.graph_events import draft, graph_stream
from action_assistant.editor.log.inbox_events import READ, InboxRead, inbox_stream
from action_assistant.editor.people.people import stored_people
from action_assistant.errors import Refused
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.kit.clock import ClockUs, utc_us
from action_assistant.kit.moments import moment
from action_assistant.schema.editor_tables import (
    graph,
    key_change,
    member,
    mention,
    mention_due,
    mention_read,
    outbox,
    person,
)
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.notifications.messages import LATE_US
from action_assistant.web.notifications.outbox import id_of, row
from action_assistant.web.notifications.receivers import Receiver

log: Final = logging.getLogger(__name__)

#: Returns whether a person (the second id) may see a graph (the first one).
MaySee: TypeAlias = Callable[[str, str], Awaitable[bool]]

#: The kinds of messages that the editor sends.
KINDS: Final = ("mention", "server.fault")
#: Persons that one comment can mention; others in it are ignored.
MOST: Final = 20
_LOOK_S: Final = 2.0
_GRAPHS: Final = 20  # in one look
_EXCERPT: Final = 300  # characters
_LONGEST_ID: Final = 100
_LARGEST: Final = 100_000  # bytes of a comment; a larger one mentions nobody
_ROWS: Final = 1_000  # changes of comments that are read at once
_OF_ONE_CHANGE: Final = 50  # comments with mentions; a page brings one
_AGAIN_S: Final = 60.0  # after which a graph that could not be read is tried again
_SHOWN: Final = 100  # mentions in one answer
_ROOT: Final = "comments"
#: Messages about mentions to one receiver in an hour: nobody can flood it by comments.
_HOURLY: Final = 30
_HOUR_US: Final = 3_600_000_000


class Mention(msgspec.Struct, frozen=True, kw_only=True):
    """A comment in which the person is mentioned. `key`: of the comment in its document; `author`:
    by the log; `text`: its beginning."""

    key: str
    graph: str
    graph_name: str
    author: PersonRef
    at: datetime
    text: str
    is_read: bool


class Inbox(msgspec.Struct, frozen=True):
    """The newest mentions of a person, and how many of them are unread."""

    unread: int
    mentions: list[Mention]


class FoundMentions(msgspec.Struct, frozen=True):
    """The persons whom one event of a graph mentions in the comment `key`. `at`: microseconds UTC."""

    seq: int
    author: str
    at: int
    key: str
    text: str
    people: tuple[str, ...]


class ReadMentions(msgspec.Struct, frozen=True):
    """The mentions in the changes of a graph up to `upto`."""

    upto: int
    found: list[FoundMentions]


class Inboxes:
    """Finds mentions, and reads and marks the inboxes of all persons. `receivers`: to which mentions
    are sent as messages; `may_see`: whether a person may see a graph, by their ids (None: all may)."""

    def __init__(
        self,
        journal: Journal,
        changes: ChangeIndex,
        receivers: Sequence[Receiver] = (),
        clock_us: ClockUs = utc_us,
        may_see: MaySee | None = None,
    ) -> None:
        self._journal = journal
        self._changes = changes
        self._receivers = [each for each in receivers if "mention" in each.kinds]
        self._clock_us = clock_us
        self._may_see = may_see
        self._put_off: dict[str, float] = {}  # until when, of graphs that could not be read

    @asynccontextmanager
    async def kept_up(self) -> AsyncIterator[None]:
        """Return a context during which mentions are found, some seconds after they are stored."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._keep_up)
            yield
            tasks.cancel_scope.cancel()

    async def _keep_up(self) -> None:
        said = ""
        while True:
            try:
                await self.find()
                said = ""
            except Refused as error:
                if said != (said := error.detail):  # once, until it works again
                    log.warning("mentions are not looked for: %s", error.detail)
            except Exception:  # whatever the log holds, the editor is not ended by it
                log.exception("mentions cannot be looked for")
            await anyio.sleep(_LOOK_S)

    async def find(self) -> None:
        """Find the mentions in the edits that are marked. A graph that cannot be read is logged, and
        tried again later. Raise Unavailable if the journal cannot be read."""
        now = anyio.current_time()
        self._put_off = {each: until for each, until in self._put_off.items() if until > now}
        due = mention_due.c
        marked = select(due.graph, func.min(due.seq).label("first")).group_by(due.graph)
        marked = marked.where(due.graph.not_in(self._put_off)).order_by("first", due.graph)
        for each in await self._journal.query(marked.limit(_GRAPHS)):
            try:
                await self._find_in(each.graph, each.first)
            except Refused as error:
                text = "%s: mentions from change %d on are not looked for: %s"
                log.warning(text, each.graph, each.first, error.detail)
            except Exception:  # the graphs after it have mentions too
                text = "%s: mentions from change %d on cannot be looked for"
                log.exception(text, each.graph, each.first)
            else:
                continue
            self._put_off[each.graph] = now + _AGAIN_S

    async def _find_in(self, graph_: str, first: int) -> None:
        """Find the mentions in the changes of a graph from `first` on; the remainder of many stays
        marked. Raise the errors of the index."""
        newest = await self._journal.newest(graph_stream(graph_))
        await self._changes.upto(graph_, newest)  # less is there only where the log is damaged
        read = await self._changes.value(mentions_in, graph_, first, newest)
        people = dict.fromkeys(one for mention_ in read.found for one in mention_.people)
        sees = self._may_see
        blind = {p for p in people if sees is not None and not await sees(graph_, p)}
        await self._journal.derive(partial(self._keep, graph_, read.upto, read.found, blind))

    async def of(self, reader: str, sees: Callable[[str], bool]) -> Inbox:
        """Return the inbox of a person. `sees`: whether they may see the graph with an id. Raise
        Unavailable if the journal cannot be read."""
        return await self._journal.ask(partial(_inbox_of, reader=reader, sees=sees))

    async def read(self, reader: str, keys: Sequence[str]) -> None:
        """Mark mentions as read by a person. Raise Unavailable if the journal cannot be written."""
        c = mention.c
        mine = select(c.key).where(c.person == reader, c.key.in_(keys))
        known = tuple([each.key for each in await self._journal.query(mine)])
        if known:
            await self._journal.append(
                inbox_stream(reader), [draft(READ, reader, InboxRead(known))]
            )

    def _keep(
        self,
        graph_: str,
        upto: int,
        found: Sequence[FoundMentions],
        blind: AbstractSet[str],
        connection: Connection,
    ) -> None:
        """Store what was found up to a change of a graph, with the messages about it, and take the
        marks away. `blind`: the persons who may not see the graph now, of whom no message speaks."""
        fresh: dict[int, list[tuple[FoundMentions, tuple[str, ...]]]] = defaultdict(list)
        for each in found:
            people = _fresh(connection, each)
            if people:
                fresh[each.seq].append((each, tuple(one for one in people if one not in blind)))
                rows = [
                    {
                        "key": each.key,
                        "person": one,
                        "graph": graph_,
                        "seq": each.seq,
                        "author": each.author,
                        "at": each.at,
                        "text": each.text,
                    }
                    for one in people
                ]
                connection.execute(insert(mention), rows)
        for seq, mentions in fresh.items():
            self._put_messages(connection, graph_, seq, mentions)
        done = mention_due.c.graph == graph_, mention_due.c.seq <= upto
        connection.execute(delete(mention_due).where(*done))

    def _put_messages(
        self,
        connection: Connection,
        graph_: str,
        seq: int,
        mentions: Sequence[tuple[FoundMentions, tuple[str, ...]]],
    ) -> None:
        first = mentions[0][0]
        people = dict.fromkeys(one for _, named in mentions for one in named)
        if not people or not self._receivers or self._clock_us() - first.at > LATE_US:
            return  # as when the tables were made again
        known = stored_people(connection)
        name = connection.scalar(select(graph.c.name).where(graph.c.id == graph_))
        facts = {
            "person": known(first.author).name or "Somebody",
            "people": ", ".join(known(each).name or "somebody" for each in people),
            "graph": name or "a graph",
            "id": graph_,
            "key": first.key,
        }
        event = Event(graph_stream(graph_), seq, "", first.author, first.at, b"", 0)
        for receiver in self._receivers:
            id_, c = id_of(event, receiver.name), outbox.c
            recent = c.receiver == receiver.name, c.kind == "mention", c.at > first.at - _HOUR_US
            count = connection.scalar(select(func.count()).where(*recent)) or 0
            if connection.scalar(select(c.id).where(c.id == id_)) is None:
                values = row(id_, receiver.name, "mention", event.stream, first.at, facts)
                if count >= _HOURLY:
                    why = f"Not sent: there were {_HOURLY} mentions within an hour."
                    values |= {"due": None, "error": why}
                connection.execute(insert(outbox).values(values))


def mentions_in(connection: Connection, graph_: str, first: int, upto: int) -> ReadMentions:
    """Return the persons whom the changes of a graph from `first` on mention, in the order of the
    changes, by what the index of key changes says; up to `upto`, or less if there are many. A comment
    that cannot be read is logged and mentions nobody. For workers."""
    c = key_change.c
    chosen = (
        select(c.seq, c.author, c.at, c.key, c.after)
        .where(c.graph == graph_, c.root == _ROOT, c.seq >= first, c.seq <= upto)
        .where(func.length(c.after) <= _LARGEST)
        .order_by(c.seq, c.key)
        .limit(_ROWS)
    )
    rows = connection.execute(chosen).all()
    if len(rows) == _ROWS:  # the last change may have more; if it is the only one, these count
        upto = rows[-1].seq if rows[0].seq == rows[-1].seq else rows[-1].seq - 1
    found: list[FoundMentions] = []
    counts: Counter[int] = Counter()
    for each in rows:
        if each.seq > upto:
            break
        try:
            text, people = _mentioned(each.after)
        except (ValueError, RecursionError) as error:  # pages write comments, and so may others
            log.warning("%s: a comment of change %d cannot be read: %s", graph_, each.seq, error)
            continue
        others = tuple(one for one in people if one != each.author)
        if others and counts[each.seq] < _OF_ONE_CHANGE:
            found.append(FoundMentions(each.seq, each.author, each.at, each.key, text, others))
            counts[each.seq] += 1
    return ReadMentions(upto, found)


def _mentioned(packed: bytes) -> tuple[str, tuple[str, ...]]:
    """Return the beginning of a comment, and the persons that it mentions: none if it is no object
    with both. Raise ValueError or RecursionError if it is no JSON."""
    body: Any = msgspec.json.decode(msgspec.msgpack.decode(packed, type=str))
    if not isinstance(body, dict) or not isinstance(body.get("mentions"), list):
        return "", ()
    text = body.get("text")
    people = [each for each in body["mentions"] if isinstance(each, str)]
    fit = dict.fromkeys(
        each for each in people if 0 < len(each) <= _LONGEST_ID and "\0" not in each
    )
    if not isinstance(text, str) or not text or "\0" in text:
        return "", ()
    return text[:_EXCERPT], tuple(fit)[:MOST]


def _fresh(connection: Connection, found: FoundMentions) -> tuple[str, ...]:
    """Return the persons of a comment who are known here, and whom it did not mention before: a copy
    of a comment, as in a draft, mentions nobody anew."""
    before = select(mention.c.person).where(mention.c.key == found.key)
    old = set(connection.scalars(before))
    known: set[str] = set()
    for table in (person, member):
        known |= set(connection.scalars(select(table.c.id).where(table.c.id.in_(found.people))))
    return tuple(each for each in found.people if each in known and each not in old)


def _inbox_of(connection: Connection, reader: str, sees: Callable[[str], bool]) -> Inbox:
    c = mention.c
    graphs = connection.scalars(select(c.graph).where(c.person == reader).distinct())
    hidden = [each for each in graphs if not sees(each)]  # not in the way of what is seen
    chosen = (
        select(
            c.key, c.graph, graph.c.name, c.author, c.at, c.text, mention_read.c.key.label("read")
        )
        .join(graph, and_(graph.c.id == c.graph, graph.c.deleted_at.is_(None)))
        .outerjoin(
            mention_read, and_(mention_read.c.person == c.person, mention_read.c.key == c.key)
        )
        .where(c.person == reader, c.graph.not_in(hidden))
        .order_by(c.at.desc(), c.key)
        .limit(10 * _SHOWN)
    )
    known = stored_people(connection)
    rows = list(
        islice(
            (
                each
                for each in connection.execute(chosen).all()
                if _stands(connection, each.graph, each.key, reader)
            ),
            _SHOWN,
        )
    )
    found = [
        Mention(
            key=each.key,
            graph=each.graph,
            graph_name=each.name,
            author=known(each.author),
            at=moment(each.at),
            text=each.text,
            is_read=each.read is not None,
        )
        for each in rows
    ]
    return Inbox(sum(not each.is_read for each in found), found)


def _stands(connection: Connection, graph_: str, key: str, reader: str) -> bool:
    """Return whether a comment still mentions a person, as far as the index of key changes knows."""
    c = key_change.c
    newest = (
        select(c.after)
        .where(c.graph == graph_, c.root == _ROOT, c.key == key)
        .order_by(c.seq.desc())
        .limit(1)
    )
    found = connection.execute(newest).first()
    if found is None:
        return True
    try:
        return found.after is not None and reader in _mentioned(found.after)[1]
    except (ValueError, RecursionError):  # it was replaced by something else
        return False
