"""Merges a text that was changed on two sides, line by line. Changes that lie apart are combined;
changes to the same lines are a conflict.

This is our own, since libraries for it are under the GPL or compare by characters, where halves of
two lines would make a third one that nobody wrote.
"""

from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher
from typing import Literal, TypeAlias

import msgspec

_Lines: TypeAlias = tuple[bytes, ...]


class MergeConflict(msgspec.Struct, frozen=True):
    """One place that both sides changed. `line`: its first line in `ours`, from 1. `base`, `ours`,
    `theirs`: the lines of each; empty where they were deleted."""

    line: int
    base: tuple[bytes, ...]
    ours: tuple[bytes, ...]
    theirs: tuple[bytes, ...]


class MergedText(msgspec.Struct, frozen=True):
    """The result of a merge. With conflicts, `content` is `ours` unchanged."""

    content: bytes
    conflicts: tuple[MergeConflict, ...] = ()


class _LineChange(msgspec.Struct, frozen=True):
    """The change of lines `first` to `last` (exclusive) of the base into `lines` on one side.

    An insertion has `first == last`. `start` is the line of that side at which they begin.
    """

    side: Literal["ours", "theirs"]
    first: int
    last: int
    lines: tuple[bytes, ...]

    def touches(self, other: "_LineChange") -> bool:
        """Return whether the order or the joint result of two changes would be a guess. Replaced
        lines may be adjacent; an insertion next to changed lines may belong to either of them."""
        if self.first == self.last or other.first == other.last:
            return self.first <= other.last and other.first <= self.last
        return self.first < other.last and other.first < self.last


def merged(base: bytes, ours: bytes, theirs: bytes) -> MergedText:
    """Return the text `ours` with the changes that lead from `base` to `theirs` (a three-way
    merge). Only a line feed ends a line."""
    if theirs in (base, ours):
        return MergedText(ours)
    if ours == base:
        return MergedText(theirs)
    lines = _split(base)
    changes = [
        *_changes("ours", lines, _split(ours)),
        *_changes("theirs", lines, _split(theirs)),
    ]
    result: list[bytes] = []
    conflicts: list[MergeConflict] = []
    done = shift = 0
    for cluster in _clusters(sorted(changes, key=lambda change: (change.first, change.last))):
        first, last = cluster[0].first, max(change.last for change in cluster)
        mine = _applied(lines, [each for each in cluster if each.side == "ours"], first, last)
        new = _applied(lines, [each for each in cluster if each.side == "theirs"], first, last)
        old = lines[first:last]
        result += lines[done:first]
        if old == mine:
            result += new
        elif old == new or mine == new or _taken_over(old, mine, new):
            result += mine
        else:
            conflicts.append(MergeConflict(first + shift + 1, old, mine, new))
        done, shift = last, shift + len(mine) - len(old)
    if conflicts:
        return MergedText(ours, tuple(conflicts))
    return MergedText(b"".join((*result, *lines[done:])))


def _split(text: bytes) -> _Lines:
    """Return the lines of a text with their line feeds. `splitlines` would also end lines at single
    carriage returns."""
    *lines, rest = text.split(b"\n")
    return (*(line + b"\n" for line in lines), *([rest] if rest else ()))


def _edits(old: _Lines, new: _Lines) -> Iterator[tuple[str, int, int, int, int]]:
    """Yield the changes from `old` to `new` as in `SequenceMatcher.get_opcodes`, without equal
    parts."""
    found = SequenceMatcher(None, old, new, autojunk=False).get_opcodes()
    return (each for each in found if each[0] != "equal")


def _changes(side: Literal["ours", "theirs"], base: _Lines, lines: _Lines) -> Iterator[_LineChange]:
    for _, first, last, start, end in _edits(base, lines):
        yield _LineChange(side, first, last, lines[start:end])


def _clusters(changes: Sequence[_LineChange]) -> Iterator[list[_LineChange]]:
    """Yield groups of changes that have to be judged together."""
    cluster: list[_LineChange] = []
    for change in changes:
        if any(change.touches(each) for each in cluster if each.side != change.side):
            cluster.append(change)
            continue
        if cluster:
            yield cluster
        cluster = [change]
    if cluster:
        yield cluster


def _applied(
    base: _Lines, changes: Sequence[_LineChange], first: int, last: int
) -> tuple[bytes, ...]:
    """Return lines `first` to `last` (exclusive) of the base with these changes made."""
    found: list[bytes] = []
    for change in changes:
        found += (*base[first : change.first], *change.lines)
        first = change.last
    return (*found, *base[first:last])


def _taken_over(base: _Lines, ours: _Lines, theirs: _Lines) -> bool:
    """Return whether `ours` has everything by which `theirs` changed `base`, and differs only
    elsewhere: a person merged it by hand."""
    new = [
        (_text_lines(base[start:end]) > _text_lines(theirs[first:last]), first, last)
        for _, start, end, first, last in _edits(base, theirs)
    ]
    own = [(first, last) for _, first, last, _, _ in _edits(theirs, ours)]
    return not any(
        # A change to fewer lines cannot be recognised in `ours`: own lines next to it may stand for it.
        (start <= last and first <= end) if fewer else (start < last and first < end)
        for fewer, first, last in new
        for start, end in own
    )


def _text_lines(lines: _Lines) -> int:
    """Return how many of the lines are not blank."""
    return sum(1 for line in lines if line.strip())
