"""Merging by lines: separate changes are combined, overlapping ones are conflicts, and no line is
lost."""

import re

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from action_assistant.umrf.packages.merging import MergeConflict, merged
from support.doses import examples

BASE = b"one\ntwo\nthree\nfour\nfive\n"
#: Few different lines, so that many stand twice; the last may have no end.
texts = st.tuples(
    st.lists(st.sampled_from([b"a\n", b"b\n", b"c\n", b"\n", b"}\n"]), max_size=8).map(b"".join),
    st.sampled_from([b"", b"", b"a", b"\r", b"\0"]),
).map(b"".join)


@pytest.mark.parametrize(
    ("ours", "theirs", "both"),
    [
        (BASE, b"new\n", b"new\n"),
        (b"own\n", BASE, b"own\n"),
        (b"own\n" + BASE, BASE + b"new\n", b"own\n" + BASE + b"new\n"),
        (b"one\nown\nthree\nfour\nfive\n", b"one\ntwo\nthree\nfour\n", b"one\nown\nthree\nfour\n"),
        # replaced lines may lie next to each other, as <description> and <maintainer> do
        (
            b"one\nown\nthree\nfour\nfive\n",
            b"one\ntwo\nnew\nfour\nfive\n",
            b"one\nown\nnew\nfour\nfive\n",
        ),
        (b"own\n", b"own\n", b"own\n"),
        (b"one\r\ntwo\nthree\nfour\nfive\n", BASE + b"new\n", b"one\r\n" + BASE[4:] + b"new\n"),
        (b"\0" + BASE, BASE + b"new\n", b"\0" + BASE + b"new\n"),
    ],
)
def test_changes_that_lie_apart_are_taken_together(ours: bytes, theirs: bytes, both: bytes) -> None:
    assert merged(BASE, ours, theirs).content == both
    assert merged(BASE, ours, theirs).conflicts == ()


@pytest.mark.parametrize(
    ("ours", "theirs", "line"),
    [
        (b"one\nown\nthree\nfour\nfive\n", b"one\nnew\nthree\nfour\nfive\n", 2),
        (b"own\none\ntwo\n3\nfour\nfive\n", b"one\ntwo\nnew\nfour\nfive\n", 4),
        (b"one\nthree\nfour\nfive\n", b"one\nnew\nthree\nfour\nfive\n", 2),
        (b"one\nown\nthree\nfour\nfive\n", b"one\nthree\nfour\nfive\n", 2),
        # nobody knows which of them comes first, or which line an insertion belongs to
        (BASE + b"own\n", BASE + b"new\n", 6),
        (b"one\ntwo\nown\nthree\nfour\nfive\n", b"one\ntwo\nnew\nfour\nfive\n", 3),
        (b"one\ntwo\nown\nthree\nfour\nfive\n", b"one\ntwo\nfour\nfive\n", 3),
        (BASE.rstrip(), BASE + b"new\n", 5),
    ],
)
def test_overlapping_changes_are_a_conflict_with_its_line(
    ours: bytes, theirs: bytes, line: int
) -> None:
    found = merged(BASE, ours, theirs)
    assert [each.line for each in found.conflicts] == [line]
    assert found.content == ours


def test_a_conflict_tells_what_each_side_has() -> None:
    (conflict,) = merged(b"a\nb\nc\n", b"a\nown\nc\n", b"a\nnew\nc\n").conflicts
    assert conflict == MergeConflict(2, (b"b\n",), (b"own\n",), (b"new\n",))


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (b"one\nnew\nown\nthree\nfour\nfive\n", b"one\nnew\nthree\nfour\nfive\n"),
        (b"one\nnew\nown\nfour\nfive\n", b"one\nnew\nthree\nfour\nfive\n"),
        (BASE + b"new\nown\n", BASE + b"new\n"),
    ],
)
def test_a_conflict_ends_when_the_new_lines_are_taken_over_by_hand(
    ours: bytes, theirs: bytes
) -> None:
    assert merged(BASE, ours, theirs).content == ours
    assert merged(BASE, ours, theirs).conflicts == ()


def test_an_edited_line_does_not_stand_for_the_deletion_of_what_it_was() -> None:
    assert merged(b"a\nb\nc\n", b"a\nown\nc\n", b"a\nc\n").conflicts
    assert merged(b"a\nb\nc\n", b"a\nown\n\nc\n", b"a\n\nc\n").conflicts


def lines(text: bytes) -> set[bytes]:
    """Return the lines of a text, each with its end."""
    return {line for line in re.split(rb"(?<=\n)", text) if line}


@settings(max_examples=examples(200))
@given(texts, texts, texts)
@example(b"a\nb\n", b"a\nc\n", b"d\nb\n")
def test_a_merge_loses_no_line_of_either_side(base: bytes, ours: bytes, theirs: bytes) -> None:
    found = merged(base, ours, theirs)
    if found.conflicts:
        assert found.content == ours
        return
    for side in (ours, theirs):
        assert lines(side) - lines(base) <= lines(found.content)


@settings(max_examples=examples(100))
@given(st.lists(st.tuples(*[st.sampled_from(["", "keep", "own", "add"])] * 2), max_size=8))
def test_a_merge_of_different_lines_may_be_done_twice(kept: list[tuple[str, str]]) -> None:
    def side(index: int) -> bytes:
        made = {"": "", "keep": "{}\n", "own": "{} {}\n", "add": "{}\n{} {}\n"}
        each = [made[row[index]] for row in kept]
        return "".join(
            text.format(line, f"{index}{line}")
            if "add" not in row
            else text.format(line, line, index)
            for line, (text, row) in enumerate(zip(each, kept, strict=True))
        ).encode()

    base = "".join(f"{line}\n" for line in range(len(kept))).encode()
    found = merged(base, side(0), side(1))
    if not found.conflicts:
        assert merged(base, found.content, side(1)).content == found.content


@settings(max_examples=examples(100))
@given(texts, texts)
def test_a_change_of_one_side_alone_is_taken(base: bytes, changed: bytes) -> None:
    assert merged(base, base, changed).content == changed
    assert merged(base, changed, base).content == changed
    assert merged(base, changed, changed).content == changed
