"""Makes and lists drafts of graphs, with their proposals and answers."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, Final, Literal, TypeAlias

import msgspec
from sqlalchemy import Connection, Row, select

from action_assistant.editor.catalogue.catalogue import NAME_LIMIT, Catalogue, GraphView
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.drafts.merge_previews import (
    DraftMoment,
    DraftSides,
    apart_since,
)
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people.people import People
from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import order_in_time
from action_assistant.kit.lru_cache import LruCache
from action_assistant.schema.editor_tables import editor_event
from action_assistant.schema.editor_tables import graph as graph_table
from action_assistant.web.auth import caller
from action_assistant.web.auth.keys import PersonRef

#: `merged`: it holds nothing that its origin has not been given.
DraftState: TypeAlias = Literal["open", "proposed", "merged"]
Remark: TypeAlias = Annotated[str, msgspec.Meta(max_length=2000)]

#: A draft, what both sides are compared with, and the last changes of both.
_Moments: TypeAlias = tuple[Any, ...]
_REMEMBERED: Final = 500

_ABOUT: Final = (h.PROPOSED, h.WITHDRAWN, h.ANSWERED, h.MERGED)


class DraftAnswer(msgspec.Struct, frozen=True):
    """A person's answer to a proposal, given for the draft after its change `seq`."""

    author: PersonRef
    at: datetime
    yes: bool
    note: str
    seq: int


class DraftProposal(msgspec.Struct, frozen=True, omit_defaults=True):
    """A proposal to merge a draft. `answers`: the last answer of each person, in order of time."""

    author: PersonRef
    at: datetime
    note: str
    seq: int
    answers: tuple[DraftAnswer, ...] = ()


class DraftView(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A draft. `seq`, `origin_seq`: the last changes of draft and origin. `ahead`, `behind`: how
    many things the draft and the origin changed since they were equal; None if that is unknown."""

    id: str
    name: str
    origin: str
    origin_name: str
    made_by: PersonRef
    made_at: datetime
    updated_at: datetime
    drafted_seq: int
    base: DraftMoment
    seq: int
    origin_seq: int
    state: DraftState
    ahead: int | None
    behind: int | None
    proposal: DraftProposal | None = None


class NewDraft(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for a draft: its name, and the change of the graph that it begins with (missing:
    the last one)."""

    name: str = ""
    seq: int | None = None


class DraftPair(msgspec.Struct, frozen=True):
    """The row of a draft in the catalogue, and its two sides."""

    row: Any
    sides: DraftSides


class Drafts:
    """Makes, lists, proposes and answers drafts. Its methods raise NotFound for an id that is no
    draft or is deleted, Unavailable while the journal cannot be used. `author`: the id of the person for whom it acts."""

    def __init__(
        self,
        journal: Journal,
        graph_reader: GraphReader,
        catalogue: Catalogue,
        people: People,
        index: ChangeIndex,
    ) -> None:
        self._journal = journal
        self._graph_reader = graph_reader
        self._catalogue = catalogue
        self._people = people
        self._index = index
        self._distances: LruCache[_Moments, tuple[int, int]] = LruCache(_REMEMBERED)

    async def make(self, origin: str, author: str, new: NewDraft) -> DraftView:
        """Make a draft of the graph `origin`, and return it. `new`: its name and the change to
        begin with. Raise BadInput for a bad name, NotFound for an unknown graph, Conflict for a
        change that it does not have, Unavailable if the journal cannot be written."""
        await self._catalogue.require(origin, "graph")
        name = " ".join(new.name.split())
        if len(name) > NAME_LIMIT:
            raise BadInput(
                f"A draft's name has up to {NAME_LIMIT} characters.", where={"path": "/name"}
            )
        seq = (await self._graph_reader.now(origin)).seq if new.seq is None else new.seq
        name = name or f"Draft {len(await self._rows(graph_table.c.draft_of == origin)) + 1}"
        made = await self._catalogue.add_draft(origin, seq, name, author)
        return await self.get(made.id)

    async def of(self, origin: str) -> list[DraftView]:
        """Return the drafts of the graph `origin` that are not deleted, the last changed first."""
        await self._catalogue.require(origin)
        there = graph_table.c.deleted_at.is_(None)
        rows = await self._rows(graph_table.c.draft_of == origin, there)
        views = [await self._view(row) for row in rows]
        return sorted(views, key=lambda view: view.updated_at, reverse=True)

    async def get(self, draft: str) -> DraftView:
        """Return one draft. Raise NotFound if no draft has this id."""
        return await self._view(await self._row(draft))

    async def pair(self, draft: str) -> DraftPair:
        """Return both sides of a draft, and the last state in which they were equal. Raise NotFound
        if a side does not exist, Unavailable if the journal cannot be read."""
        row = await self._row(draft)
        await self._catalogue.require(row.draft_of, "graph")
        await self._index.upto(row.base_graph, row.base_seq)
        base = DraftMoment(row.base_graph, row.base_seq)
        origin = await self._graph_reader.now(row.draft_of)
        return DraftPair(row, DraftSides(base, origin, await self._graph_reader.now(draft)))

    # --- proposals --------------------------------------------------------------------------------

    async def propose(self, draft: str, author: str, note: str) -> DraftView:
        """Propose that a draft, in its present state, be merged, with a note for others. Return the
        draft."""
        await self._row(draft)
        seq = (await self._graph_reader.now(draft)).seq
        body = h.DraftProposed(note.strip(), seq, caller.device())
        proposed = h.draft(h.PROPOSED, author, body)
        await self._journal.append(h.about_stream(draft), [proposed])
        return await self.get(draft)

    async def withdraw(self, draft: str, author: str) -> DraftView:
        """Withdraw the proposal of a draft, and return the draft. Raise Conflict if it is not
        proposed."""
        if (await self._proposal(await self._row(draft)))[0] is None:
            raise Conflict("This draft is not proposed.")
        await self._journal.append(h.about_stream(draft), [h.draft(h.WITHDRAWN, author)])
        return await self.get(draft)

    async def answer(self, draft: str, author: str, body: h.DraftAnswered) -> DraftView:
        """Answer another person's proposal with yes or no (`body`), about the draft's change that
        `author` has seen; return the draft. Raise BadInput for a malformed answer; Conflict if it
        is not proposed, has changed, or the proposal is their own."""
        row = await self._row(draft)
        proposal, device = await self._proposal(row)
        if proposal is None:
            raise Conflict("This draft is not proposed.")
        here = caller.device()
        if proposal.author.id == author or (here and device == here):
            who = "You have" if proposal.author.id == author else "Somebody has, in your browser,"
            raise Conflict(
                f"{who} proposed this draft: a second person has to answer. The proposal can be "
                "withdrawn.",
                where={"path": "/yes"},
            )
        newest = await self._journal.newest(h.graph_stream(draft))
        if not 1 <= body.seq <= newest:
            raise BadInput(
                f"The draft has no change {body.seq}; its last one is {newest}.",
                where={"path": "/seq"},
            )
        if body.seq < newest:
            raise Conflict(
                f"The draft was changed since change {body.seq}; its last one is {newest}. Look at it "
                "again before you answer.",
                where={"path": "/seq", "seq": newest},
            )
        await self._journal.append(h.about_stream(draft), [h.draft(h.ANSWERED, author, body)])
        return await self.get(draft)

    async def _proposal(self, row: Row[Any]) -> tuple[DraftProposal | None, str]:
        """Return the open proposal of a draft (None if there is none), and the id of the browser it
        came from. Answers that earlier versions stored to one's own proposal or to unknown changes
        do not count. `row`: the row of the draft."""
        found: DraftProposal | None = None
        device = ""
        answers: dict[str, DraftAnswer] = {}
        newest = await self._journal.newest(h.graph_stream(row.id))
        for event in await self._about(row):
            author, at = self._people.person(event.author), h.when(event.at)
            match event.kind:
                case h.PROPOSED:
                    proposed = msgspec.json.decode(event.body, type=h.DraftProposed)
                    found = DraftProposal(author, at, proposed.note, proposed.seq)
                    device, answers = proposed.device, {}
                case h.ANSWERED if found is not None and event.author != found.author.id:
                    said = msgspec.json.decode(event.body, type=h.DraftAnswered)
                    answers.pop(event.author, None)
                    if 1 <= said.seq <= newest:
                        answers[event.author] = DraftAnswer(
                            author, at, said.yes, said.note, said.seq
                        )
                case h.MERGED if _ends_proposal(event, row):
                    found = None
                case h.WITHDRAWN:
                    found = None
        if found is None:
            return None, ""
        return msgspec.structs.replace(found, answers=tuple(answers.values())), device

    async def _about(self, row: Row[Any]) -> Sequence[Row[Any]]:
        """Return the stored events about a draft (`row`) and its merges, in order of time."""
        event = editor_event.c
        streams = [h.about_stream(row.id), h.about_stream(row.draft_of)]
        chosen = (
            select(event.kind, event.author, event.at, event.body)
            .where(event.stream.in_(streams), event.kind.in_(_ABOUT))
            .where((event.stream == streams[0]) | (event.kind == h.MERGED))
        )

        def find(connection: Connection) -> list[Row[Any]]:
            order = order_in_time(connection, event.position, event.at, event.seq)
            return list(connection.execute(chosen.order_by(*order)))

        return await self._journal.ask(find)

    # --- reading ----------------------------------------------------------------------------------

    async def _view(self, row: Row[Any]) -> DraftView:
        draft: GraphView = await self._catalogue.get(row.id)
        (origin,) = await self._rows(graph_table.c.id == row.draft_of)
        ahead, behind, origin_seq = await self._distance(row, origin)
        proposal, _ = await self._proposal(row)
        merged = row.merged_seq == draft.seq
        return DraftView(
            id=row.id,
            name=row.draft_name,
            origin=row.draft_of,
            origin_name=origin.name,
            made_by=self._people.person(row.made_by),
            made_at=draft.made_at,
            updated_at=draft.updated_at,
            drafted_seq=row.drafted_seq,
            base=DraftMoment(row.base_graph, row.base_seq),
            seq=draft.seq,
            origin_seq=origin_seq,
            state="merged" if merged else "open" if proposal is None else "proposed",
            ahead=ahead,
            behind=behind,
            proposal=None if merged else proposal,
        )

    async def _distance(
        self, row: Row[Any], origin: Row[Any]
    ) -> tuple[int | None, int | None, int]:
        """Return how many things the draft and the origin changed since they were equal (None if
        the origin is deleted), and the number of the last change of the origin. `row`, `origin`:
        their rows."""
        newest = [await self._journal.newest(h.graph_stream(g)) for g in (origin.id, row.id)]
        if origin.deleted_at is not None:
            return None, None, newest[0]
        moments = row.id, row.base_graph, row.base_seq, *newest
        known = self._distances.get(moments)
        if known is None:
            pair = await self.pair(row.id)
            behind, ahead = await self._index.value(apart_since, pair.sides)
            known = self._distances.put(moments, (ahead, behind))
        return *known, newest[0]

    async def _row(self, draft: str) -> Row[Any]:
        await self._catalogue.require(draft, "graph")
        (row,) = await self._rows(graph_table.c.id == draft)
        if row.draft_of is None:
            raise NotFound(f"{draft!r} is no draft.")
        return row

    async def _rows(self, *chosen: Any) -> Sequence[Row[Any]]:
        return await self._journal.query(select(graph_table).where(*chosen))


def _ends_proposal(event: Row[Any], row: Row[Any]) -> bool:
    """Return whether an event is the merge of the draft (`row`) into its origin."""
    merged = msgspec.json.decode(event.body, type=h.GraphMerged)
    return merged.draft == merged.source == str(row.id)
