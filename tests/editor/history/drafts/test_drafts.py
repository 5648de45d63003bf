"""Drafts on a real journal: merged either way, blamed on those who did it, and taken back."""

import random
from collections import defaultdict
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from action_assistant.editor.catalogue.catalogue import Catalogue
from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.documents.document import Maps, maps_of
from action_assistant.editor.history.blame import Blame, FieldBlame, keys_of
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.drafts.draft_merges import (
    AskedMerge,
    DraftMerges,
    MergedDraft,
    MergePreview,
    WantedMerge,
)
from action_assistant.editor.history.drafts.drafts import Drafts, DraftView, NewDraft
from action_assistant.editor.history.drafts.merge_previews import DraftSide
from action_assistant.editor.history.graph_history import GraphHistory, HistoryEntry
from action_assistant.editor.history.key_changes import exist, owner_of
from action_assistant.editor.history.restoring import EditsOfOne, Restoring
from action_assistant.editor.interchange.document_edits import difference
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people.people import People
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.journal.journal import Journal
from editor.history.drafts.random_sides import loose
from editor.history.random_edits import Person, plain
from support.doses import examples

DOCK, CHARGE = "Dock" * 3, "Char" * 3


class Editor:
    """All services that drafts need, and one graph."""

    def __init__(self, journal: Journal, rooms: Rooms, people: People) -> None:
        self.journal = journal
        self.rooms = rooms
        reader = GraphReader(journal, rooms)
        index = ChangeIndex(journal)
        checks = GraphChecks(journal, rooms, reader)
        self.catalogue = Catalogue(journal, rooms, reader, checks)
        self.drafts = Drafts(journal, reader, self.catalogue, people, index)
        self.merges = DraftMerges(journal, rooms, self.drafts, index, people, checks)
        self.blame = Blame(index)
        self.restoring = Restoring(journal, rooms, reader, index)
        self.history = GraphHistory(index)
        self.origin = ""
        self.wrote: dict[tuple[str, str, bytes], set[str]] = defaultdict(set)

    async def now(self, graph: str) -> Maps:
        async with self.rooms.enter(h.graph_stream(graph)) as room:
            return maps_of((await room.quiet()).doc)

    async def edit(self, graph: str, who: str, dice: random.Random, edits: int = 1) -> None:
        """Edit at random as one person, and remember which values they gave to which keys."""
        for _ in range(edits):
            before = await self.now(graph)
            async with self.rooms.enter(h.graph_stream(graph)) as room:
                me = Person(who, dice)
                me.hear((await room.now()).state)
                for update in me.edit():
                    await room.submit(update, who)
            self._remember(who, before, await self.now(graph))

    async def set(self, graph: str, who: str, root: str, **values: object) -> int:
        """Give keys these values as one person; None removes a key."""

        def edit(doc: Any) -> None:
            me = Person(who, random.Random(0))
            me.doc = doc
            for name, value in values.items():
                key = name.replace("__", "|")
                if value is None:
                    del me.map(root)[key]
                else:
                    me.map(root)[key] = value

        async with self.rooms.enter(h.graph_stream(graph)) as room:
            state = (await room.now()).state
            return await room.submit(difference(state, edit), who)

    async def preview(self, draft: str, asked: AskedMerge) -> MergePreview:
        """Return the preview of a merge, as a caller over HTTP reads it."""
        found = await self.merges.preview(draft, asked)
        return msgspec.json.decode(msgspec.json.encode(found), type=MergePreview)

    async def who_set(self, graph: str, owner: str, seq: int | None) -> list[FieldBlame]:
        found = await self.blame.of(graph, owner, seq)
        return msgspec.json.decode(found, type=list[FieldBlame])

    async def past(self) -> list[HistoryEntry]:
        found = await self.history.of(self.origin, limit=5, before=None)
        return msgspec.json.decode(found, type=list[HistoryEntry])

    async def merge(
        self, draft: str, who: str, dice: random.Random, into: DraftSide = "origin"
    ) -> MergedDraft:
        """Merge with random choices."""
        asked = AskedMerge(into)
        found = await self.preview(draft, asked)
        sides: tuple[DraftSide, ...] = ("origin", "draft")
        choices = {conflict.place: dice.choice(sides) for conflict in found.conflicts}
        wanted = WantedMerge(found.seq, found.draft_seq, into, choices)
        return await self.merges.merge(draft, who, wanted)

    async def log(self, graph: str) -> list[str]:
        """The kinds of everything that is stored of a graph."""
        found = [await self.journal.read(stream(graph)) for stream in _STREAMS]
        return [event.kind for events in found for event in events]

    def _remember(self, who: str, before: Maps, after: Maps) -> None:
        for root, fields in after.items():
            for key, value in fields.items():
                if before[root].get(key) != value:
                    self.wrote[root, key, msgspec.msgpack.encode(value)].add(who)


_STREAMS = (h.graph_stream, h.about_stream)


@pytest.fixture(params=["SQLite", pytest.param("Postgres", marks=pytest.mark.long)])
async def editor(request: pytest.FixtureRequest, tmp_path: Path) -> AsyncIterator[Editor]:
    """An editor on each kind of database."""
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    if request.param == "Postgres":
        url = request.getfixturevalue("postgres").new_database()
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    rooms = Rooms(journal, linger=60, window=0)
    editor = Editor(journal, rooms, await People.known(journal))
    made, _ = await editor.catalogue.create(b'{"name": "valve"}', "ada")
    editor.origin = made.id
    yield editor
    await rooms.close()
    await journal.close()


async def _draft(editor: Editor, name: str = "gentler grip") -> DraftView:
    return await editor.drafts.make(editor.origin, "ben", NewDraft(name))


def _silent(maps: Maps) -> bytes:
    return plain({root: fields for root, fields in maps.items() if root != "comments"})


def _loose(maps: Maps) -> set[str]:
    return loose({(root, k): v for root, fields in maps.items() for k, v in fields.items()})  # type: ignore[misc]


async def test_a_draft_begins_as_its_origin_was_and_is_listed_under_it(editor: Editor) -> None:
    dice = random.Random(1)
    await editor.edit(editor.origin, "ada", dice, 12)
    then = await editor.now(editor.origin)
    made = await _draft(editor)
    assert _silent(await editor.now(made.id)) == _silent(then)
    assert (made.name, made.origin, made.ahead, made.behind) == (
        "gentler grip",
        editor.origin,
        0,
        0,
    )
    assert [view.id for view in await editor.catalogue.all()] == [editor.origin]
    assert [view.id for view in await editor.drafts.of(editor.origin)] == [made.id]
    assert (await editor.catalogue.get(editor.origin)).drafts == 1
    await editor.catalogue.delete(made.id, "ben")
    assert await editor.drafts.of(editor.origin) == []
    assert (await editor.catalogue.get(editor.origin)).drafts == 0
    assert [view.id for view in await editor.catalogue.all(deleted=True)] == [made.id]


async def test_drafts_are_rebuilt_from_the_log(editor: Editor) -> None:
    dice = random.Random(2)
    await editor.edit(editor.origin, "ada", dice, 6)
    made = await _draft(editor)
    await editor.edit(made.id, "ben", dice, 6)
    await editor.merge(made.id, "ada", dice)
    before = await editor.drafts.get(made.id)
    await editor.journal.rebuild()
    assert await editor.drafts.get(made.id) == before


@pytest.mark.turns
@pytest.mark.parametrize("seed", range(examples(10)))
async def test_blame_names_who_did_it_however_often_and_whichever_way_it_was_merged(
    editor: Editor, seed: int
) -> None:
    dice = random.Random(seed)
    await editor.edit(editor.origin, "ada", dice, 8)
    drafts = [(await _draft(editor)).id, (await _draft(editor)).id]
    for _ in range(6):
        draft = dice.choice(drafts)
        await editor.edit(dice.choice([draft, draft, editor.origin]), dice.choice(_PEOPLE), dice, 2)
        if dice.random() < 0.6:
            before = await editor.now(editor.origin)
            await editor.merge(draft, "zoe", dice, dice.choice(("origin", "draft")))
            assert _loose(await editor.now(editor.origin)) <= _loose(before)
    for graph in [*drafts, editor.origin]:
        await _blamed(editor, graph)


_PEOPLE = ("ada", "ben", "mari")


async def _blamed(editor: Editor, graph: str) -> None:
    maps = await editor.now(graph)
    owners = {owner_of(root, k) for root, fields in maps.items() for k in fields}  # type: ignore[arg-type]
    for owner in owners - {"entry", "exit"}:
        for each in await editor.who_set(graph, owner, None):
            value = msgspec.msgpack.encode(each.value)
            keys = keys_of(owner, each.field)
            authors = {who for place in keys for who in editor.wrote.get((*place, value), ())}
            if authors:  # else it is what the graph began with
                assert each.author.id in authors, (owner, each)
                assert each.merged is None or each.merged.by.id == "zoe"


@pytest.mark.turns
@pytest.mark.parametrize("seed", range(examples(10)))
async def test_a_merge_that_is_taken_back_leaves_the_origin_as_it_was(
    editor: Editor, seed: int
) -> None:
    dice = random.Random(seed)
    await editor.edit(editor.origin, "ada", dice, 10)
    made = await _draft(editor)
    await editor.edit(made.id, "ben", dice, 8)
    await editor.edit(editor.origin, "mari", dice, 4)
    before = await editor.now(editor.origin)
    merged = await editor.merge(made.id, "zoe", dice)
    if merged.changed:
        gone = await editor.restoring.revert(
            editor.origin, "ada", EditsOfOne("zoe", merged.seq, merged.seq)
        )
        assert gone.left == ()
    assert plain(await editor.now(editor.origin)) == plain(before)


@pytest.mark.turns
@pytest.mark.parametrize("seed", range(examples(10)))
async def test_both_sides_are_equal_after_merges_in_both_directions(
    editor: Editor, seed: int
) -> None:
    dice = random.Random(seed)
    await editor.edit(editor.origin, "ada", dice, 10)
    made = await _draft(editor)
    await editor.edit(made.id, "ben", dice, 5)
    await editor.edit(editor.origin, "mari", dice, 5)
    await editor.merge(made.id, "zoe", dice)
    assert (await editor.drafts.get(made.id)).ahead == 0
    await editor.merge(made.id, "zoe", dice, "draft")
    assert _things(await editor.now(made.id)) == _things(await editor.now(editor.origin))
    view = await editor.drafts.get(made.id)
    found = await editor.preview(made.id, AskedMerge())
    assert (view.behind, found.conflicts) == (0, ())


def _things(maps: Maps) -> set[str]:
    places = {(root, key): v for root, fields in maps.items() for key, v in fields.items()}
    return exist(places) - loose(places)  # type: ignore[arg-type]


async def test_a_merge_of_an_unchanged_draft_stores_nothing(editor: Editor) -> None:
    dice = random.Random(3)
    await editor.edit(editor.origin, "ada", dice, 5)
    made = await _draft(editor)
    await editor.edit(editor.origin, "ada", dice, 5)
    before = await editor.log(editor.origin), await editor.log(made.id)
    assert (await editor.merge(made.id, "zoe", dice)).changed is False
    assert (await editor.log(editor.origin), await editor.log(made.id)) == before


async def _conflicting(editor: Editor) -> DraftView:
    await editor.set(editor.origin, "ada", "actions", **{DOCK: "Dock", f"{DOCK}__in/speed": "1"})
    made = await _draft(editor)
    await editor.set(made.id, "ben", "actions", **{f"{DOCK}__in/speed": "2", CHARGE: "Charge"})
    await editor.set(editor.origin, "ada", "actions", **{f"{DOCK}__in/speed": "3"})
    return made


async def test_a_conflict_is_refused_until_it_has_a_choice(editor: Editor) -> None:
    made = await _conflicting(editor)
    found = await editor.preview(made.id, AskedMerge())
    (conflict,) = found.conflicts
    assert (conflict.place, conflict.what) == (
        f"actions/{DOCK}|in/speed",
        "input speed of Dock_0",
    )
    (theirs,) = conflict.draft.actions
    assert [(f.field, f.before, f.after) for f in theirs.fields] == [("in/speed", "1", "2")]
    wanted = WantedMerge(found.seq, found.draft_seq)
    with pytest.raises(Conflict, match=r"input speed of Dock_0") as refused:
        await editor.merges.merge(made.id, "zoe", wanted)
    assert refused.value.where == {"places": [conflict.place]}
    choices: dict[str, DraftSide] = {conflict.place: "draft"}
    chosen = msgspec.structs.replace(wanted, choices=choices)
    merged = await editor.merges.merge(made.id, "zoe", chosen)
    actions = (await editor.now(editor.origin))["actions"]
    assert (actions[f"{DOCK}|in/speed"], actions[CHARGE]) == ("2", "Charge")
    speed = next(
        each for each in await editor.who_set(editor.origin, DOCK, None) if each.field == "in/speed"
    )
    assert (speed.author.id, speed.seq) == ("ben", merged.seq)
    assert speed.merged is not None
    assert (speed.merged.graph, speed.merged.by.id, speed.merged.seq) == (made.id, "zoe", 2)
    entry = (await editor.past())[0]
    assert entry.kind == "merged"
    assert entry.merged is not None
    assert [each.id for each in entry.merged.authors] == ["ben"]


async def test_a_conflict_in_which_nothing_changes_is_settled_too(editor: Editor) -> None:
    await editor.set(editor.origin, "ada", "actions", **{DOCK: "Dock"})
    made = await _draft(editor)
    await editor.set(made.id, "ben", "actions", **{DOCK: "Berth"})
    seq = await editor.set(editor.origin, "ada", "actions", **{DOCK: "Port"})
    choices: dict[str, DraftSide] = {f"actions/{DOCK}": "origin"}
    wanted = WantedMerge(seq, 2, choices=choices)
    assert await editor.merges.merge(made.id, "zoe", wanted) == MergedDraft(
        editor.origin, seq, changed=False
    )
    assert (await editor.preview(made.id, AskedMerge())).conflicts == ()
    assert (await editor.drafts.get(made.id)).state == "merged"
    entry = (await editor.past())[0]
    assert entry.kind == "edited"
    (name,) = await editor.who_set(editor.origin, DOCK, None)
    assert (name.author.id, name.merged) == ("ada", None)


async def test_a_merge_of_what_nobody_looked_at_is_refused(editor: Editor) -> None:
    made = await _conflicting(editor)
    found = await editor.preview(made.id, AskedMerge())
    choices: dict[str, DraftSide] = {each.place: "draft" for each in found.conflicts}
    wanted = WantedMerge(found.seq, found.draft_seq, choices=choices)
    await editor.set(made.id, "ben", "actions", **{CHARGE: "Load"})
    with pytest.raises(Conflict, match="draft was changed") as refused:
        await editor.merges.merge(made.id, "zoe", wanted)
    assert refused.value.where == {"side": "draft"}
    newer = msgspec.structs.replace(wanted, draft_seq=found.draft_seq + 1)
    await editor.set(editor.origin, "ada", "meta", name="valves")
    with pytest.raises(Conflict, match="graph was changed"):
        await editor.merges.merge(made.id, "zoe", newer)


async def test_problems_that_would_come_with_a_merge_are_told(editor: Editor) -> None:
    await editor.set(editor.origin, "ada", "actions", **{DOCK: "Dock", f"{DOCK}__type": "sync"})
    made = await _draft(editor)
    await editor.set(made.id, "ben", "actions", **{CHARGE: "not a name"})
    found = await editor.preview(made.id, AskedMerge())
    assert any("not a name" in problem.message for problem in found.problems)
    assert not any("Dock" in problem.message for problem in found.problems)


async def test_a_proposal_is_answered_and_ends_with_the_merge(editor: Editor) -> None:
    made = await _conflicting(editor)
    with pytest.raises(Conflict, match="not proposed"):
        await editor.drafts.answer(made.id, "ada", h.DraftAnswered(yes=True, note="", seq=2))
    proposed = await editor.drafts.propose(made.id, "ben", "softer")
    assert proposed.state == "proposed"
    for yes in (False, True):
        answered = await editor.drafts.answer(made.id, "ada", h.DraftAnswered(yes, "", 2))
    assert answered.proposal is not None
    assert [(each.author.id, each.yes) for each in answered.proposal.answers] == [("ada", True)]
    await editor.merge(made.id, "ada", random.Random(0))
    merged = await editor.drafts.get(made.id)
    assert (merged.state, merged.proposal) == ("merged", None)
    await editor.set(made.id, "ben", "actions", **{CHARGE: "Load"})
    again = await editor.drafts.get(made.id)
    assert (again.state, again.ahead) == ("open", 1)
    await editor.drafts.propose(made.id, "ben", "")
    assert (await editor.drafts.withdraw(made.id, "ben")).state == "open"


async def test_a_graph_that_is_no_draft_is_not_found(editor: Editor) -> None:
    with pytest.raises(NotFound, match="no draft"):
        await editor.drafts.get(editor.origin)
    with pytest.raises(BadInput, match="200 characters"):
        await _draft(editor, "x" * 201)
    made = await _draft(editor, "")
    assert made.name == "Draft 1"
    await editor.catalogue.delete(editor.origin, "ada")
    with pytest.raises(NotFound):
        await editor.preview(made.id, AskedMerge())
    assert (await editor.drafts.get(made.id)).ahead is None
