"""A search by the index of words finds what reading through all runs would."""

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import anyio
import pytest
from alembic import command
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import Connection, Row, Select, create_engine, insert, select, text

from action_assistant.journal.databases import database_of
from action_assistant.journal.journal import Journal
from action_assistant.journal.migrate import alembic_config
from action_assistant.runner.analysis import annotations, statistics
from action_assistant.runner.review.background_loops import index_words
from action_assistant.runner.review.stored_runs import numbers_with
from action_assistant.runner.runs import queries, word_index
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.sight import Unseen
from action_assistant.schema.runner_tables import RUNNER, review, run, unindexed_run
from runner.review.old_runs import DAY_US, LENGTHS, add_run, opened, retention
from support.doses import examples

ANN = Author("ann", "Ann")
texts = st.text(st.sampled_from("aBcÄé1_ -/%.\0\n\U0010ffff"), max_size=12)


@contextmanager
def empty() -> Iterator[Connection]:
    """The tables of a runner, in memory, without runs."""
    engine = create_engine("sqlite://")
    try:
        with engine.begin() as connection:
            RUNNER.create_all(connection)
            yield connection
    finally:
        engine.dispose()


def added(
    connection: Connection, number: int, told: Sequence[str], *, indexed: bool = True
) -> None:
    """A run that holds these texts: of graph, robot and person, what was said, a note."""
    name, engine, author, words, note = told
    row = {column.name: 0 for column in run.columns if not column.nullable}
    fields = {"id": f"r{number}", "number": number, "request_id": f"q{number}", "summary": {}}
    names = {"graph_name": name, "engine": engine, "author_name": author}
    connection.execute(insert(run).values({**row, "state": "finished", **fields, **names}))
    noted = {"run": f"r{number}", "pinned": False, "summed": True, "words": words, "note": note}
    connection.execute(insert(review).values(noted))
    if indexed:
        for each in ((name, engine, author), (words,), (note,)):
            for statement in word_index.holds(f"r{number}", *each):
                connection.execute(statement)
    else:
        connection.execute(insert(unindexed_run).values(number=number))


def asked(connection: Connection, wanted: str) -> tuple[list[Any], list[Any], bool]:
    """Return what a search finds by the index and by reading all runs, and whether the index was
    used."""

    async def rows(statement: Select[Any]) -> list[Row[Any]]:
        return list(connection.execute(statement).all())

    among = anyio.run(numbers_with, wanted, rows)
    every = queries.Filter(text=wanted)
    by_index, by_reading = (
        [row.number for row in connection.execute(queries.listed(every, 99, each))]
        for each in (among, None)
    )
    return by_index, by_reading, among is not None


@settings(max_examples=examples(80), deadline=None)
@given(st.lists(st.tuples(texts, texts, texts, texts, texts), max_size=5), texts, st.integers(0, 3))
def test_every_text_is_found_where_it_is(
    told: list[tuple[str, ...]], wanted: str, late: int
) -> None:
    with empty() as connection:
        for number, each in enumerate(told, 1):
            added(connection, number, each, indexed=number > late)
        parts = [each[n][i : i + 3] for each in told for n in range(5) for i in range(len(each[n]))]
        for one in {wanted, *parts[:20]} - {""}:
            by_index, by_reading, _ = asked(connection, one)
            assert by_index == by_reading, repr(one)
        while word_index.index_some(connection, 2):
            pass
        for one in {wanted, *parts[:20]} - {""}:
            by_index, by_reading, _ = asked(connection, one)
            assert by_index == by_reading, repr(one)


def test_the_index_is_of_use_but_for_what_very_many_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(word_index, "MOST", 5)
    with empty() as connection:
        for number in range(1, 21):
            told = (f"Graph_{number % 4}", "David", "Ann", f"Needle {number} of many", "")
            added(connection, number, told)
        assert asked(connection, "nowhere") == ([], [], True)
        assert asked(connection, "eedle 7") == ([7], [7], True)
        assert asked(connection, "NEEDLE 7 o") == ([7], [7], True)
        assert asked(connection, "raph_3") == ([19, 15, 11, 7, 3],) * 2 + (True,)
        assert asked(connection, "dle 2") == ([20, 2], [20, 2], False)
        assert asked(connection, "needle")[2] is False
        assert asked(connection, "--")[2] is False
        added(connection, 21, ("", "", "", "needle", ""), indexed=False)
        assert asked(connection, "nowhere") == ([], [], True)


async def found(journal: Journal, wanted: str) -> list[str]:
    among = await numbers_with(wanted, journal.query)
    assert among is not None
    rows = await journal.query(queries.listed(queries.Filter(text=wanted), 99, among))
    return [row.id for row in rows]


async def words_of(journal: Journal) -> set[tuple[str, int]]:
    held = text("SELECT word.text, number FROM run_word JOIN word ON word.id = run_word.word")
    return {(row[0], row[1]) for row in await journal.query(held)}  # type: ignore[arg-type]


async def test_words_follow_from_the_events_and_are_found_again(tmp_path: Path) -> None:
    journal = await opened(tmp_path)
    for number, name in enumerate(LENGTHS, 1):
        await add_run(journal, name, number, 12, ended_at=3 * DAY_US)
    marked = annotations.Marked(1, ANN, annotations.Marks(note="Bumped a chair"))
    await journal.append(annotations.stream_about("r2"), [annotations.draft(marked)])
    assert await found(journal, "a CHAIR") == ["r2"]
    assert await found(journal, "David") == ["r3", "r2", "r1"]
    before = await words_of(journal)
    await journal.rebuild()
    assert await words_of(journal) == before
    assert (await retention(journal, tmp_path).sweep(30, None)).runs == 3
    assert await found(journal, "chair") == ["r2"]
    assert not await journal.query(select(unindexed_run))
    await journal.rebuild()  # without the events of the runs themselves
    assert await found(journal, "chair") == ["r2"]
    await index_words(journal)
    assert await words_of(journal) == before
    assert await found(journal, "chair") == ["r2"]
    await journal.close()


async def test_runs_of_earlier_versions_are_found_before_and_after_their_words_are(
    tmp_path: Path,
) -> None:
    journal = await opened(tmp_path)
    for number in range(1, 25):
        await add_run(journal, f"r{number}", number, 12, ended_at=3 * DAY_US)
    marked = annotations.Marked(1, ANN, annotations.Marks(note="Bumped a chair"))
    await journal.append(annotations.stream_about("r2"), [annotations.draft(marked)])
    before = await words_of(journal)
    await journal.close()
    database_of(f"sqlite:///{tmp_path / 'runner.db'}").migrate(
        lambda connection: command.downgrade(alembic_config(connection, "runner"), "runner_0005")
    )
    journal = await opened(tmp_path)
    assert await words_of(journal) == set()
    assert len(await journal.query(select(unindexed_run))) == 24
    assert await found(journal, "chair") == ["r2"]
    await index_words(journal)
    assert not await journal.query(select(unindexed_run))
    assert await words_of(journal) == before
    assert await found(journal, "chair") == ["r2"]
    await journal.close()


async def test_a_damaged_row_ends_the_looking_for_words_and_nothing_else(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    journal = await opened(tmp_path)
    await add_run(journal, "r1", 1, 12, ended_at=3 * DAY_US)
    await journal.close()
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    database_of(url).migrate(
        lambda connection: command.downgrade(alembic_config(connection, "runner"), "runner_0005")
    )
    with closing(sqlite3.connect(tmp_path / "runner.db")) as database, database:
        database.execute("UPDATE run SET graph_name = x'00'")
    journal = await opened(tmp_path)
    await index_words(journal)
    assert "until the next start" in caplog.text
    assert len(await journal.query(select(unindexed_run))) == 1
    assert await journal.health() is None
    await journal.close()


class OfGraph(NamedTuple):
    """A run for the lists: of which graph, under which name, with which graph inside, by whom."""

    graph: str
    name: str
    inside: str
    author: str


runs = st.builds(
    OfGraph,
    st.sampled_from(["open", "secret"]),
    st.sampled_from(["Go", "Look"]),
    st.sampled_from(["", "open", "secret"]),
    st.sampled_from(["ann", "vic"]),
)


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(runs, max_size=8), st.integers(1, 4), st.sampled_from(["open", "secret", "Go"]))
def test_a_run_out_of_sight_takes_the_place_of_no_other_one(
    told: list[OfGraph], limit: int, wanted: str
) -> None:
    unseen = Unseen("vic", frozenset({"secret"}))
    with empty() as connection:
        for number, each in enumerate(told, 1):
            fields = {
                **{column.name: 0 for column in run.columns if not column.nullable},
                "id": f"r{number}",
                "number": number,
                "request_id": f"q{number}",
                "graph": each.graph,
                "graph_name": each.name,
                "engine": "David",
                "author_id": each.author,
                "author_name": each.author,
                "ended_at": number,
                "summary": {"inside": [each.inside] if each.inside else []},
            }
            connection.execute(insert(run).values({**fields, "state": "finished"}))
        seen = [
            number
            for number, each in enumerate(told, 1)
            if wanted in (each.graph, each.name)
            and (each.author == "vic" or "secret" not in (each.graph, each.inside))
        ][: -limit - 1 : -1]
        for query in (
            queries.listed(queries.Filter(graph=wanted), limit, unseen=unseen),
            queries.listed(queries.Filter(graph=wanted, engine="David"), limit, unseen=unseen),
            statistics.runs_of(wanted, None, limit, unseen),
        ):
            assert [row.number for row in connection.execute(query)] == seen
