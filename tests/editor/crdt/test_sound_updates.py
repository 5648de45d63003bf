"""A partial reading of sound updates makes the same document as a complete one."""

import random
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycrdt import Array, Doc, Map, Text, merge_updates

from action_assistant.editor.crdt import loading
from action_assistant.editor.crdt.loading import Folded, Stored, fold, fold_sound, stored
from action_assistant.editor.crdt.replica import EventColumns, Replica, ReplicaState, UpdateEffect
from action_assistant.editor.crdt.sound_updates import lies_deep
from action_assistant.editor.log.graph_events import DEFERRED, UPDATED
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.web.workers.lanes import Crashed
from editor import forged_updates
from support.doses import examples

PEOPLE = ("ada", "bob", "cem")


class History:
    """People who edit the same document, each on a copy that hears of the others now and then."""

    def __init__(self, chance: random.Random, *, nested: bool, late: bool) -> None:
        self.chance, self.nested, self.late = chance, nested, late
        self.rows: list[tuple[str, str, bytes]] = []
        self.room = Replica()
        self.docs = [
            Doc[Any](client_id=chance.choice([n + 1, 2**31 + n, 2**52 + n])) for n in range(3)
        ]
        self.made: list[bytes] = []
        self.heard = [0, 0, 0]  # how much of the log each has
        self.held: list[tuple[str, bytes]] = []
        for doc in self.docs:
            doc.observe(lambda event: self.made.append(event.update))

    def step(self) -> None:
        """Edit as a random person, who has received the others' updates or has not."""
        who = self.chance.randrange(3)
        if self.chance.random() < 0.5:
            for kind, _, body in self.rows[self.heard[who] :]:
                if kind in {UPDATED, DEFERRED}:
                    self.docs[who].apply_update(body)
            self.heard[who] = len(self.rows)
        self.made.clear()
        with self.docs[who].transaction():
            for _ in range(self.chance.randint(1, 3)):
                self.edit(self.docs[who])
        made = [each for each in self.made if each != b"\0\0"]
        for update in made:
            self.log(PEOPLE[who], update)

    def edit(self, doc: "Doc[Any]") -> None:
        things = doc.get("actions", type=Map)
        key = f"a{self.chance.randrange(6)}" + self.chance.choice(["", "|x", "|y"])
        match self.chance.randrange(8):
            case 0 if key in things.keys():  # noqa: SIM118
                del things[key]
            case 1 if self.nested:
                things[key] = Map({"list": Array([1.0, Map({"deep": "x"})]), "text": Text("é")})
            case 2 if self.nested:
                for value in list(things.values()):
                    if isinstance(value, Map):
                        value["more"] = Map({"n": self.chance.random()})
            case _:
                things[key] = self.chance.choice([0, 1.5, 120.0, "a\x00b", b"\x01\x00", [1, {"k": None}], True])  # fmt: skip

    def log(self, author: str, update: bytes) -> None:
        """Some are late, in any order."""
        if self.late and self.chance.random() < 0.1:
            self.held.append((author, update))
            return
        self.take(author, update)
        if self.held and self.chance.random() < 0.1:
            self.chance.shuffle(self.held)
            while self.held:
                self.take(*self.held.pop())
        if self.chance.random() < 0.05:
            self.rows.append(("graph.other.v1", author, b"not an update"))
        if (
            len(self.rows) > 3 and self.chance.random() < 0.05
        ):  # an echo, of several clients at once
            bodies = [body for kind, _, body in self.rows[-3:] if kind == UPDATED]
            if bodies:
                self.take(author, merge_updates(*bodies))

    def take(self, author: str, update: bytes) -> None:
        """Store an update as rooms do: one that lacks an earlier one is stored as deferred."""
        waits = self.room.take(update, author) is UpdateEffect.WAITS
        self.rows.append((DEFERRED if waits else UPDATED, author, update))


def columns(rows: list[tuple[str, str, bytes]], first: int = 1) -> EventColumns:
    kinds, authors, bodies = (list(each) for each in zip(*rows, strict=True))
    return EventColumns(first, kinds, authors, bodies)


def known(folded: Folded | None) -> Any:
    """Return all that a folded document knows, in comparable form."""
    if folded is None:
        return None
    if not folded.document:
        return folded.seq, folded.damaged
    kept = msgspec.msgpack.decode(folded.document, type=ReplicaState)
    replica = ReplicaState.replica(folded.document)
    assert replica is not None
    doc = replica.doc
    roots = {name: doc.get(name, type=Map).to_py() for name in ("actions", "things")}
    return (
        folded.seq,
        folded.damaged,
        kept.owners,
        kept.spans,
        kept.waiting,
        roots,
        doc.get_update(),
    )


@settings(max_examples=examples(150), deadline=None)
@given(st.integers(0, 2**32), st.booleans(), st.booleans(), st.booleans())
def test_a_document_knows_the_same(seed: int, nested: bool, late: bool, spoilt: bool) -> None:
    chance = random.Random(seed)
    history = History(chance, nested=nested, late=late)
    for _ in range(chance.randint(1, 60)):
        history.step()
    rows = history.rows or [(UPDATED, "ada", b"\0\0")]
    if spoilt:
        place = chance.randrange(len(rows))
        kind, author, body = rows[place]
        bad = chance.choice(
            [b"", b"nonsense", body[: len(body) // 2], b"\x01" + body, b"\x03" + body]
        )
        rows[place] = kind, author, bad
    cut = chance.randrange(len(rows) + 1)
    whole = fold(b"", columns(rows), learn=True)
    assert known(fold_sound(b"", columns(rows))) == known(whole)
    if 0 < cut < len(rows):
        begun = fold_sound(b"", columns(rows[:cut]))
        assert begun is not None
        if begun.damaged is None:
            later = columns(rows[cut:], cut + 1)
            assert known(fold_sound(begun.document, later)) == known(whole)


def test_an_update_that_lacks_an_earlier_one_is_read_as_a_whole() -> None:
    updates = [forged_updates.entry(1, clock, f"a{clock}", "b") for clock in range(3)]
    rows = [(UPDATED, "ada", updates[0]), (UPDATED, "ada", updates[2])]  # as no room tells it
    found = known(fold_sound(b"", columns(rows)))
    assert found == known(fold(b"", columns(rows), learn=True))
    assert found[4] == [(updates[2], "ada")]


@pytest.mark.parametrize(
    ("deep", "update"),
    [
        (False, forged_updates.entry(5, 0, "a", "b")),
        (False, forged_updates.entry(1, 0, "a", "\x01\x00\x21\x00")),
        (True, forged_updates.nested_types(2)),
        (True, forged_updates.nested_types(1, below=3, start=4)),
        (True, forged_updates.nested_types(2).replace(b"\x27\x00\x07\x00", b"\x27\x80\x80\x00\x07\x00")),
    ],
)  # fmt: skip
def test_nested_values_are_noticed_however_they_are_written(deep: bool, update: bytes) -> None:
    assert lies_deep([b"\0\0", update]) == deep


@pytest.fixture(params=["SQLite", "Postgres"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "SQLite":
        return f"sqlite:///{tmp_path / 'editor.db'}"
    found: str = request.getfixturevalue("postgres").new_database()
    return found


async def aside(work: Callable[..., Any], /, *args: Any) -> Any:
    """Run the work here, in place of a worker."""
    return work(*args)


async def dying(work: Callable[..., Any], /, *args: Any) -> Any:
    """A worker that what no room took would end."""
    if work is fold_sound:
        raise Crashed("The process that worked on this has died.")
    return work(*args)


@pytest.fixture
def all_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    """However short a log is, it is put together by a worker."""
    monkeypatch.setattr(loading, "_SMALL", -1)


async def written(url: str, *, steps: int = 300) -> Journal:
    journal = await Journal.open(url, branch="editor", fold=nothing)
    history = History(random.Random(7), nested=False, late=True)
    for _ in range(steps):
        history.step()
    drafts = [Draft(*row) for row in history.rows]
    await journal.append("graph/g", drafts)
    assert len(drafts) > 300
    return journal


def told(found: Stored) -> Any:
    return known(Folded(found.document, found.seq, found.damaged))


@pytest.mark.usefixtures("all_aside")
async def test_a_long_log_reads_the_same_in_one_piece_or_in_many(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = await written(url)
    whole = told(await stored(journal, "graph/g", learn=True))
    assert told(await stored(journal, "graph/g", learn=True, run_in_worker=aside)) == whole
    assert told(await stored(journal, "graph/g", learn=True, run_in_worker=dying)) == whole
    middle = told(await stored(journal, "graph/g", 99, learn=True))
    monkeypatch.setattr(loading, "SLICES", (7, 3))
    for name, value in (("TOGETHER", 40), ("TOGETHER_BYTES", 999)):
        with monkeypatch.context() as patch:
            patch.setattr(loading, name, value)
            many = await stored(journal, "graph/g", learn=True, run_in_worker=aside)
            assert told(many) == whole
            part = await stored(journal, "graph/g", 99, learn=True, run_in_worker=aside)
            assert told(part) == middle
    await journal.close()


@pytest.mark.usefixtures("all_aside")
@pytest.mark.parametrize("seq", [1, 2, 233, 234])
@pytest.mark.parametrize(
    "change", ["at = at + 1", "at = 'then'", "author = x'616461'", "body = 'text'"]
)
async def test_a_long_log_ends_at_the_first_changed_event(
    tmp_path: Path, seq: int, change: str
) -> None:
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    await (await written(url)).close()
    with closing(sqlite3.connect(tmp_path / "editor.db")) as database, database:
        database.execute(f"UPDATE event SET {change} WHERE seq = ?", (seq,))
    journal = await Journal.open(url, branch="editor", fold=nothing)
    whole = await stored(journal, "graph/g", learn=True)
    found = await stored(journal, "graph/g", learn=True, run_in_worker=aside)
    assert told(found) == told(whole)
    assert found.damaged is not None
    assert (found.seq, found.damaged.seq) == (seq - 1, seq)
    await journal.close()
