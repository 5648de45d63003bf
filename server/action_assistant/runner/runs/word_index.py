"""The words of runs, by which a search finds the few that may hold a text.

A search is for a part of what was said, wherever in a word it begins. What the index names is compared
with the texts themselves, so it may name too many runs, and never one too few. Where words are so
common that it names very many, a list of the newest ones is found sooner without it.
"""

import re
from collections.abc import Sequence
from typing import Any, Final, Literal

import msgspec
from sqlalchemy import Connection, Executable, Select, delete, func, insert, literal, select, text

from action_assistant.schema.runner_tables import review, run, run_word, unindexed_run, word

#: Runs that may be named, before no use is made of them.
MOST: Final = 2_000
#: As `lower` and `like` of SQLite, which know no other letters than those of ASCII.
_WORD: Final = re.compile("[0-9a-z\x80-\U0010ffff]+")
_KNOWN: Final = text("INSERT OR IGNORE INTO word (text) SELECT value FROM json_each(:words)")
_HELD: Final = text(
    "INSERT OR IGNORE INTO run_word (word, number) SELECT word.id, run.number"
    " FROM json_each(:words) CROSS JOIN word ON word.text = value CROSS JOIN run ON run.id = :run"
)


class Piece(msgspec.Struct, frozen=True):
    """A word of what is searched for, and where in a word of a run it has to stand."""

    text: str
    place: Literal["all", "end", "begin", "within"]


def holds(run_id: str, *texts: str) -> Sequence[Executable]:
    """That these texts are a run's: statements for the transaction that stores them."""
    words = sorted({each for told in texts for each in _WORD.findall(_lower(told))})
    if not words:
        return ()
    listed = msgspec.json.encode(words).decode()
    return (_KNOWN.bindparams(words=listed), _HELD.bindparams(words=listed, run=run_id))


def will_be_indexed(run_id: str, number: int) -> Executable:
    """That the words of a run are to be found later, if there is no such run yet."""
    chosen = select(literal(number)).where(~select(run.c.id).where(run.c.id == run_id).exists())
    return insert(unindexed_run).prefix_with("OR IGNORE").from_select(["number"], chosen)


def index_some(connection: Connection, most: int) -> bool:
    """Find the words of some runs that are not in the index yet, the newest first; whether there were
    any."""
    texts = (run.c.graph_name, run.c.engine, run.c.author_name, review.c.words, review.c.note)
    chosen = (
        select(unindexed_run.c.number, run.c.id, *texts)
        .outerjoin_from(unindexed_run, run, run.c.number == unindexed_run.c.number)
        .outerjoin(review, review.c.run == run.c.id)
        .order_by(unindexed_run.c.number.desc())
        .limit(most)
    )
    rows = connection.execute(chosen).all()
    for row in rows:
        for statement in holds(row[1], *(each for each in row[2:] if each)):
            connection.execute(statement)
    done = [row.number for row in rows]
    connection.execute(delete(unindexed_run).where(unindexed_run.c.number.in_(done)))
    return bool(rows)


def pieces(wanted: str) -> list[Piece]:
    """The words of what is searched for, those first that fewer runs hold; none where only reading all
    runs tells."""
    if "\0" in wanted:  # ends a text, to `like`
        return []
    lowered = _lower(wanted)
    found = [
        Piece(each[0], _place(each.start() > 0, each.end() < len(lowered)))
        for each in _WORD.finditer(lowered)
    ]
    return sorted(found, key=lambda piece: (piece.place != "all", -len(piece.text)))


def holding(piece: Piece) -> Select[Any]:
    """Numbers of runs that hold such a word: all of them, or more than `MOST`."""
    match piece.place:
        case "all":
            fits = word.c.text == piece.text
        case "begin":
            fits = func.instr(word.c.text, piece.text) == 1
        case "end":
            fits = func.substr(word.c.text, -len(piece.text)) == piece.text
        case "within":
            fits = func.instr(word.c.text, piece.text) > 0
    words = select(word.c.id).where(fits)  # not joined: all words of all runs would be read
    held = select(run_word.c.number).where(run_word.c.word.in_(words))
    return held.distinct().limit(MOST + 1)


def unindexed() -> Select[Any]:
    """Numbers of runs of which the index knows nothing yet: all of them, or more than `MOST`."""
    return select(unindexed_run.c.number).limit(MOST + 1)


def _place(begins: bool, ends: bool) -> Literal["all", "end", "begin", "within"]:
    """Of a word with something before it, or after it."""
    if begins and ends:
        return "all"
    if begins:
        return "begin"
    return "end" if ends else "within"


def _lower(told: str) -> str:
    return told.encode("utf-8", "replace").lower().decode()
