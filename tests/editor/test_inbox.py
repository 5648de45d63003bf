"""Who is mentioned in a comment finds it in their inbox, by what is committed, once."""

import json
from collections.abc import AsyncIterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import anyio
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pycrdt import Array, Doc, Map, Text
from sqlalchemy import Insert, insert, select

from action_assistant.editor import inbox
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.inbox import Inbox, Inboxes
from action_assistant.editor.log import graph_events as h
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.schema.editor_tables import mention, mention_due, outbox
from support.doses import examples
from web.notifications.receiving import webhook

CHAT = webhook("https://chat.example/", "chat")


class Page:
    """A page of a person on a graph: its edits are stored as they came."""

    def __init__(self, journal: Journal, graph: str, author: str) -> None:
        self._journal, self._graph, self._author = journal, graph, author
        self.doc: Doc[Any] = Doc()
        self.sent = 0

    async def say(self, key: str, text: str, *people: str, **fields: object) -> None:
        """Write a comment that mentions people, in a name that the page claims."""
        author = {"id": "somebody-else", "name": "Mallory"}
        body = {"author": author, "at": 1, "text": text, "mentions": list(people)} | fields
        await self.put(key, json.dumps(body, ensure_ascii=False))

    async def put(self, key: str, value: object) -> None:
        """Set a key of the comments, or take it away."""
        before = self.doc.get_state()
        comments = self.doc.get("comments", type=Map)
        with self.doc.transaction():
            if value is None:
                del comments[key]
            else:
                comments[key] = value
        await self.send(self.doc.get_update(before))

    async def send(self, update: bytes) -> None:
        """Have an update stored."""
        self.sent = await self._journal.append(
            h.graph_stream(self._graph), [Draft(h.UPDATED, self._author, update)]
        )


def _marked(graph: str, seq: int) -> Insert:
    """Return the statement that has a change looked at, as if it held the mark."""
    values = {"graph": graph, "seq": seq, "at": 0}
    return insert(mention_due).prefix_with("OR IGNORE").values(values)


async def _opened(folder: Path, url: str = "") -> Journal:
    url = url or f"sqlite:///{folder / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    for graph in ("g1", "g2"):
        made = h.draft(h.CREATED, "ann", h.GraphCreated(f"Fetch {graph}", ""))
        await journal.append(h.about_stream(graph), [made])
    for person, name in (("ann", "Ann"), ("ben", "Ben"), ("mari", "Mari")):
        await journal.append(h.PEOPLE, [h.draft(h.NAMED, person, h.PersonNamed(name))])
    return journal


@pytest.fixture
async def journal(tmp_path: Path) -> AsyncIterator[Journal]:
    """A journal with two graphs, and three people who have acted."""
    journal = await _opened(tmp_path)
    yield journal
    await journal.close()


@pytest.fixture
def inboxes(journal: Journal) -> Inboxes:
    """The inboxes, with one receiver of messages."""
    return Inboxes(journal, ChangeIndex(journal), [CHAT])


async def _of(inboxes: Inboxes, person: str) -> Inbox:
    await inboxes.find()
    return await inboxes.of(person, lambda _: True)


async def _messages(journal: Journal) -> list[tuple[str, dict[str, Any]]]:
    rows = await journal.query(select(outbox).order_by(outbox.c.id))
    return [(each.id, json.loads(each.facts)) for each in rows]


async def test_a_mention_is_found_with_the_author_that_the_log_knows(
    journal: Journal, inboxes: Inboxes
) -> None:
    page = Page(journal, "g1", "ann")
    await page.put("t/0", json.dumps({"about": "a", "author": {}, "at": 1, "text": "no one"}))
    await page.say("t/1", "Look at this, @Ben", "ben", "ann", about="a")
    found = await _of(inboxes, "ben")
    assert found.unread == 1
    (mention,) = found.mentions
    assert (mention.key, mention.graph, mention.graph_name) == ("t/1", "g1", "Fetch g1")
    assert (mention.author.name, mention.text) == ("Ann", "Look at this, @Ben")
    assert (await _of(inboxes, "ann")).mentions == []  # nobody hears of themselves
    assert await _messages(journal) == [
        (
            "graph/g1:2:chat",
            {"person": "Ann", "people": "Ben", "graph": "Fetch g1", "id": "g1", "key": "t/1"},
        )
    ]
    assert await journal.query(select(mention_due)) == []


@pytest.mark.parametrize("database", ["sqlite", "postgres"])
async def test_mentions_out_of_sight_or_taken_back_leave_room_for_all_others(
    request: pytest.FixtureRequest, tmp_path: Path, database: str
) -> None:
    server = request.getfixturevalue("postgres") if database == "postgres" else None
    journal = await _opened(tmp_path, "" if server is None else server.new_database())
    index = ChangeIndex(journal)
    inboxes = Inboxes(journal, index, [CHAT])
    page = Page(journal, "g1", "ann")
    await page.say("t/1", "@Ben", "ben")
    for number in range(3):
        await page.say(f"t/more {number}", "@Ben", "ben")
    assert (await _of(inboxes, "ben")).unread == 4
    for number in range(3):
        await page.put(f"t/more {number}", None)
    await index.upto("g1")  # so that it is known that they are gone
    fields = {"person": "ben", "graph": "g2", "seq": 1, "author": "eve", "text": "@Ben"}
    late = [{"key": f"e/{n}", "at": 2**53 + n, **fields} for n in range(1_100)]
    await journal.derive(lambda connection: connection.execute(insert(mention), late))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inbox, "_SHOWN", 2)  # fewer than were taken back
        found = await inboxes.of("ben", {"g1"}.__contains__)
    assert ([each.key for each in found.mentions], found.unread) == (["t/1"], 1)
    await journal.close()


async def test_a_new_name_changes_nothing(journal: Journal, inboxes: Inboxes) -> None:
    await Page(journal, "g1", "ann").say("t/1", "@Ben", "ben")
    await journal.append(h.PEOPLE, [h.draft(h.NAMED, "ben", h.PersonNamed("Benjamin"))])
    await journal.append(h.PEOPLE, [h.draft(h.NAMED, "mari", h.PersonNamed("Ben"))])
    assert (await _of(inboxes, "ben")).unread == 1
    assert (await _of(inboxes, "mari")).unread == 0


async def test_what_is_read_stays_read_also_after_the_tables_are_made_again(
    journal: Journal, inboxes: Inboxes
) -> None:
    page = Page(journal, "g1", "ann")
    await page.say("t/1", "@Ben", "ben")
    await page.say("t/2", "@Ben and @Mari", "ben", "mari")
    await _of(inboxes, "ben")
    await inboxes.read("ben", ["t/1", "t/9"])
    await inboxes.read("mari", ["t/1"])  # it is not hers
    await inboxes.read("ben", ["t/1"])
    before = await _of(inboxes, "ben"), await _of(inboxes, "mari"), await _messages(journal)
    assert [each.is_read for each in before[0].mentions] == [False, True]
    assert (before[0].unread, before[1].unread) == (1, 1)
    await journal.rebuild()
    assert (
        await _of(inboxes, "ben"), await _of(inboxes, "mari"), await _messages(journal),
    ) == before  # fmt: skip


async def test_a_deleted_comment_mentions_nobody_and_one_that_comes_back_is_as_read_as_before(
    journal: Journal, inboxes: Inboxes
) -> None:
    page = Page(journal, "g1", "ann")
    await page.say("t/1", "@Ben", "ben")
    await _of(inboxes, "ben")
    await inboxes.read("ben", ["t/1"])
    await page.put("t/1", None)
    await ChangeIndex(journal).upto("g1")  # as it does by itself after a while
    assert (await _of(inboxes, "ben")).mentions == []
    await page.say("t/1", "@Ben", "ben")
    found = await _of(inboxes, "ben")
    assert [each.is_read for each in found.mentions] == [True]
    assert len(await _messages(journal)) == 1


async def test_a_copy_of_a_graph_mentions_nobody_anew(journal: Journal, inboxes: Inboxes) -> None:
    page = Page(journal, "g1", "ann")
    await page.say("t/1", "@Ben", "ben")
    await _of(inboxes, "ben")
    copy = Page(journal, "g2", "mari")
    await copy.send(page.doc.get_update())
    assert [each.graph for each in (await _of(inboxes, "ben")).mentions] == ["g1"]
    assert len(await _messages(journal)) == 1


@pytest.mark.parametrize(
    "value",
    [
        "no JSON \"mentions\"",
        '["mentions"]',
        '{"mentions": "ben", "text": "x"}',
        '{"mentions": [1, null, {"a": 1}, "", "nobody-knows"], "text": "x"}',
        '{"mentions": ["ben"], "text": 7}',
        '{"mentions": ["ben"], "text": ""}',
        '{"mentions": ["ben"]}',
        '{"mentions": ["b\\u0000n"], "text": "x"}',
        '{"mentions": [' + '"x",' * 30 + '"ben"], "text": "x"}',
        '"mentions"',
        '{"mentions": ' + "[" * 100_000,
        '{"mentions": ["ben"], "text": "' + "x" * 100_000 + '"}',
        7,
        {"mentions": ["ben"]},
    ],
)  # fmt: skip
async def test_what_is_no_mention_is_passed_over_and_the_next_one_is_found(
    journal: Journal, inboxes: Inboxes, value: Any
) -> None:
    page = Page(journal, "g1", "ann")
    await page.put("t/0", value)
    many = '"x",' * 30
    expected = 1 if isinstance(value, str) and many in value else 0  # one name, thirty times
    assert (await _of(inboxes, "ben")).unread == expected
    await page.say("t/1", "@Ben", "ben")
    assert (await _of(inboxes, "ben")).unread == expected + 1


#: Values of a comment, as an edit can bring them: also of kinds that no page writes.
_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats() | st.text()
    | st.binary(max_size=20),
    lambda each: st.lists(each, max_size=4) | st.dictionaries(st.text(), each, max_size=4),
    max_leaves=20,
)  # fmt: skip
_PEOPLE = st.sampled_from(["ben", "ann", "", "\0", "nobody", "b" * 200])
_BODIES = st.fixed_dictionaries(
    {"mentions": st.lists(_PEOPLE | _VALUES, max_size=30) | _VALUES, "text": st.text() | _VALUES}
)


def _as_json(value: object) -> str:
    return json.dumps(value, default=repr, ensure_ascii=False)


_COMMENTS = (
    _VALUES.filter(lambda each: each is not None)
    | st.one_of(_BODIES, _VALUES).map(_as_json)
    | st.sampled_from([1, 900, 100_000]).map(lambda n: '{"mentions": ' + "[" * n)
    | st.text().map(lambda text: Text(text))
    | _VALUES.map(lambda each: Array([each] * 3))
    | _VALUES.map(lambda each: Map({"mentions": each}))
)


@settings(deadline=None, max_examples=examples(20))
@given(values=st.lists(st.tuples(st.text(max_size=50), _COMMENTS), min_size=3, max_size=8))
@example(values=[("deep", '{"mentions": ' + "[" * 100_000)])  # it once ended the editor
async def test_whatever_stands_among_the_comments_the_next_mention_is_found(
    values: list[tuple[str, Any]],
) -> None:
    with TemporaryDirectory() as folder:
        journal = await _opened(Path(folder))
        try:
            inboxes = Inboxes(journal, ChangeIndex(journal), [CHAT])
            page = Page(journal, "g1", "ann")
            for key, value in values:
                await page.put(f"t/{key}", value)
                await journal.derive(lambda c, n=page.sent: c.execute(_marked("g1", n)))
            await page.say("t", "@Mari", "mari")
            assert [each.key for each in (await _of(inboxes, "mari")).mentions] == ["t"]
            assert (await _of(inboxes, "ben")).mentions is not None
            assert await journal.query(select(mention_due)) == []
        finally:
            await journal.close()


async def test_a_graph_that_cannot_be_read_keeps_no_mention_of_another_back(
    journal: Journal, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    class Failing(ChangeIndex):
        """An index that fails at one graph, in a way that nobody has foreseen."""

        async def upto(self, graph: str, seq: int | None = None) -> int:
            if graph == "g1":
                raise KeyError(graph)
            return await super().upto(graph, seq)

    monkeypatch.setattr(inbox, "_GRAPHS", 1)
    monkeypatch.setattr(inbox, "_LOOK_S", 0.01)
    inboxes = Inboxes(journal, Failing(journal))
    await Page(journal, "g1", "ann").say("t/1", "@Ben", "ben")
    await Page(journal, "g2", "ann").say("t/2", "@Ben", "ben")
    async with inboxes.kept_up():
        while not (await inboxes.of("ben", lambda _: True)).mentions:  # noqa: ASYNC110 - nobody tells
            await anyio.sleep(0.01)
    found = await inboxes.of("ben", lambda _: True)
    assert [each.key for each in found.mentions] == ["t/2"]
    assert caplog.text.count("g1: mentions from change 1 on cannot be looked for") == 1


async def test_one_change_with_many_comments_is_read_in_parts(
    journal: Journal, inboxes: Inboxes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inbox, "_ROWS", 5)
    page = Page(journal, "g1", "ann")
    for n in range(12):
        await page.say(f"t/{n:02}", "@Ben", "ben")
    comments = page.doc.get("comments", type=Map)
    before = page.doc.get_state()
    with page.doc.transaction():
        for n in range(12):
            comments[f"u/{n:02}"] = '{"text": "x", "mentions": ["mari"]}'
    await page.send(page.doc.get_update(before))
    await page.say("v", "@Mari", "mari")
    for _ in range(5):  # 4 and 4 and 4, the large change, and the last one
        assert await journal.query(select(mention_due)) != []
        await inboxes.find()
    assert await journal.query(select(mention_due)) == []
    assert (await _of(inboxes, "ben")).unread == 12
    mine = [each.key for each in (await _of(inboxes, "mari")).mentions]
    assert sorted(mine) == [*(f"u/{n:02}" for n in range(5)), "v"]


async def test_a_comment_mentions_few_people(journal: Journal, inboxes: Inboxes) -> None:
    await Page(journal, "g1", "ann").say("t/1", "all", *(f"p{n}" for n in range(30)), "ben")
    assert (await _of(inboxes, "ben")).unread == 0


async def test_a_graph_out_of_sight_and_a_deleted_one_are_not_shown(
    journal: Journal, inboxes: Inboxes
) -> None:
    await Page(journal, "g1", "ann").say("t/1", "@Ben", "ben")
    await Page(journal, "g2", "ann").say("t/2", "@Ben", "ben")
    await inboxes.find()
    found = await inboxes.of("ben", lambda graph: graph == "g2")
    assert (found.unread, [each.graph for each in found.mentions]) == (1, ["g2"])
    await journal.append(h.about_stream("g2"), [h.draft(h.DELETED, "ann")])
    assert (await inboxes.of("ben", lambda graph: graph == "g2")).mentions == []


async def test_comments_flood_nobody_with_messages(
    journal: Journal, inboxes: Inboxes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inbox, "_HOURLY", 3)
    page = Page(journal, "g1", "ann")
    for n in range(5):
        await page.say(f"t/{n}", "@Ben", "ben")
    assert (await _of(inboxes, "ben")).unread == 5
    rows = await journal.query(select(outbox).order_by(outbox.c.at))
    assert [each.due is None for each in rows] == [False] * 3 + [True] * 2
    assert rows[-1].error.startswith("Not sent: there were")


async def test_no_message_speaks_of_who_may_not_see_the_graph(journal: Journal) -> None:
    async def may_see(graph: str, person: str) -> bool:
        return (graph, person) == ("g1", "ben")

    inboxes = Inboxes(journal, ChangeIndex(journal), [CHAT], may_see=may_see)
    await Page(journal, "g1", "ann").say("t/1", "@Ben and @Mari", "ben", "mari")
    await Page(journal, "g2", "ann").say("t/2", "@Ben", "ben")
    await inboxes.find()
    assert [(id_, facts["people"]) for id_, facts in await _messages(journal)] == [
        ("graph/g1:1:chat", "Ben")
    ]
