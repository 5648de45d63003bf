"""Versions: what a graph was at one seq, published as UMRF that never changes again."""

from datetime import datetime
from typing import Any, Final

import msgspec
from sqlalchemy import Row, select

from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.documents import contents
from action_assistant.editor.log import graph_events as h
from action_assistant.errors import BadInput, NotFound
from action_assistant.journal.journal import Journal
from action_assistant.random_ids import random_id
from action_assistant.schema import editor_tables
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.embedded import UmrfGraph
from action_assistant.web.auth.keys import PersonRef

LABEL_LIMIT: Final = 200  # characters
NOTE_LIMIT: Final = 4_000  # characters


class VersionView(msgspec.Struct, frozen=True, omit_defaults=True):
    """A version. `umrf` is the graph as text to be kept as it is; lists leave it out."""

    id: str
    graph: str
    label: str
    digest: str
    seq: int
    author: PersonRef
    at: datetime
    umrf: UmrfGraph | None = None
    note: str = ""


class Versions:
    """All versions of all graphs."""

    def __init__(self, journal: Journal, graph_reader: GraphReader) -> None:
        self._journal = journal
        self._graph_reader = graph_reader

    async def publish(
        self,
        graph: str,
        author: PersonRef,
        *,
        label: str = "",
        note: str = "",
        seq: int | None = None,
    ) -> tuple[VersionView, bool]:
        """The version of a graph at `seq`, or as it is, and whether it is new.

        Without label and note it is the one that was published at that seq before, if there is one.
        Raises NotFound, Conflict, BadInput.
        """
        label, note = _within_limits(label, note)
        sight = await self._graph_reader.moment(graph, seq)
        if not label and not note:
            for row in await self._rows(graph, sight.seq):
                return await self.get(row.id), False
        made = random_id()
        stamp = codec.Stamp(graph=graph, version=made, run=None)
        digest, text = await self._graph_reader.ask(contents.released, sight, stamp)
        published = h.VersionPublished(
            id=made,
            label=label,
            digest=digest,
            seq=sight.seq,
            author_name=author.name,
            umrf=msgspec.Raw(text),
            note=note,
        )
        await self._journal.append(
            h.about_stream(graph), [h.draft(h.PUBLISHED, author.id, published)]
        )
        return await self.get(made), True

    async def get(self, version: str) -> VersionView:
        """One version, with its UMRF. Raises NotFound."""
        chosen = select(editor_tables.version).where(editor_tables.version.c.id == version)
        rows = await self._journal.query(chosen)
        if not rows:
            raise NotFound(f"There is no version {version!r}.")
        row = rows[0]
        (event,) = await self._journal.read(row.stream, after=row.event_seq - 1, upto=row.event_seq)
        published = msgspec.json.decode(event.body, type=h.VersionPublished)
        return msgspec.structs.replace(_view(row), umrf=published.umrf)

    async def of(self, graph: str) -> list[VersionView]:
        """The versions of a graph, newest first, without their UMRF."""
        return [_view(row) for row in await self._rows(graph)]

    async def by_event(self, graph: str) -> dict[int, VersionView]:
        """The versions of a graph, by the seq of the event that published them."""
        return {row.event_seq: _view(row) for row in await self._rows(graph)}

    async def _rows(self, graph: str, seq: int | None = None) -> list[Row[Any]]:
        version = editor_tables.version.c
        chosen = select(editor_tables.version).where(version.graph == graph)
        if seq is not None:
            chosen = chosen.where(version.seq == seq)
        return await self._journal.query(chosen.order_by(version.event_seq.desc()))


def _within_limits(label: str, note: str) -> tuple[str, str]:
    """Both without spaces around them. Raises BadInput."""
    label, note = " ".join(label.split()), note.strip()
    if len(label) > LABEL_LIMIT:
        raise BadInput(f"A label has up to {LABEL_LIMIT} characters.", where={"path": "/label"})
    if len(note) > NOTE_LIMIT:
        raise BadInput(f"A note has up to {NOTE_LIMIT} characters.", where={"path": "/note"})
    return label, note


def _view(row: Row[Any]) -> VersionView:
    return VersionView(
        id=row.id,
        graph=row.graph,
        label=row.label,
        digest=row.digest,
        seq=row.seq,
        author=PersonRef(row.author_id, row.author_name),
        at=h.when(row.at),
        note=row.note,
    )
