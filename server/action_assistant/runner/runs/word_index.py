"""The index of words of runs: it finds the few runs that may hold a text.

A search is for a part of what was said, wherever in a word it begins. Runs that the index names are
compared with the text afterwards, so that it may name too many runs but never one too few. Where a
word is so common that it names very many, a list of the newest runs is quicker without the index.
"""

import re
from collections.abc import Sequence
from typing import Any, Final, Literal

import msgspec
from sqlalchemy import Connection, Executable, Select, delete, func, insert, literal, select, text

from action_assistant.schema.runner_tables import review, run, run_word, unindexed_run, word

#: The index is not used for a word that more runs hold.
MOST: Final = 2_000
#: A word, for `lower` and `like` of SQLite, which know only the letters of ASCII.
_WORD: Final = re.compile("[0-9a-z\x80-\U0010ffff]+")
_KNOWN: Final = text("INSERT OR IGNORE INTO word (text) SELECT value FROM json_each(:words)")
_HELD: Final = text(
    "INSERT OR IGNORE INTO run_word (word, number) SELECT word.id, run.number"
    " FROM json_each(:words) CROSS JOIN word ON word.text = value CROSS JOIN run ON run.id = :run"
)


class Piece(msgspec.Struct, frozen=True):
    """A word of the searched text, and where it has to stand in a word of a run: "all" of it, at
    its "begin" or "end", or "within" it."""

    text: str
    place: Literal["all", "end", "begin", "within"]


def holds(run_id: str, *texts: str) -> Sequence[Executable]:
    """Return the statements that put the words of these texts into the index for the run; ()
    without words. They belong into the transaction that stores the texts."""
    words = sorted({each for part in texts for each in _WORD.findall(_lower(part))})
    if not words:
        return ()
    listed = msgspec.json.encode(words).decode()
    return (_KNOWN.bindparams(words=listed), _HELD.bindparams(words=listed, run=run_id))


def will_be_indexed(run_id: str, number: int) -> Executable:
    """Return the statement that marks a new run with this number as not indexed yet; it does
    nothing if the run exists already."""
    chosen = select(literal(number)).where(~select(run.c.id).where(run.c.id == run_id).exists())
    return insert(unindexed_run).prefix_with("OR IGNORE").from_select(["number"], chosen)


def index_some(connection: Connection, most: int) -> bool:
    """Index the words of at most `most` runs that are marked as not indexed, the newest first, in
    the transaction of `connection`. Return whether any run was indexed; False means that none is
    left."""
    said = (review.c.words, review.c.note, review.c.remarks)
    texts = (run.c.graph_name, run.c.engine, run.c.author_name, *said)
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
    """Split a searched text into words, the rarest first as far as can be guessed (whole and long
    words); empty if only reading all runs can answer."""
    if "\0" in wanted:  # `like` takes it for the end of the text
        return []
    lowered = _lower(wanted)
    found = [
        Piece(each[0], _place(each.start() > 0, each.end() < len(lowered)))
        for each in _WORD.finditer(lowered)
    ]
    return sorted(found, key=lambda piece: (piece.place != "all", -len(piece.text)))


def holding(piece: Piece) -> Select[Any]:
    """Select the numbers of the runs with this word: all of them, or `MOST` + 1 if there are more."""
    match piece.place:
        case "all":
            fits = word.c.text == piece.text
        case "begin":
            fits = func.instr(word.c.text, piece.text) == 1
        case "end":
            fits = func.substr(word.c.text, -len(piece.text)) == piece.text
        case "within":
            fits = func.instr(word.c.text, piece.text) > 0
    words = select(word.c.id).where(fits)  # a join would read all words of all runs
    held = select(run_word.c.number).where(run_word.c.word.in_(words))
    return held.distinct().limit(MOST + 1)


def unindexed() -> Select[Any]:
    """Select the numbers of the runs that are not indexed: all of them, or `MOST` + 1 if there are
    more."""
    return select(unindexed_run.c.number).limit(MOST + 1)


def _place(begins: bool, ends: bool) -> Literal["all", "end", "begin", "within"]:
    """Return where in a word of a run a part of the searched text has to be. `begins`, `ends`: the
    searched text has other characters before, or after, this part, so that the word begins, or
    ends, with it."""
    if begins and ends:
        return "all"
    if begins:
        return "begin"
    return "end" if ends else "within"


def _lower(value: str) -> str:
    return value.encode("utf-8", "replace").lower().decode()
