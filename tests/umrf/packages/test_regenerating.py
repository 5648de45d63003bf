"""Changes of a package by a new generation, without any disk, and its base file."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.umrf.packages.bases import (
    GenerationBase,
    UnfinishedFile,
    UnreadableBase,
    digest,
    read_base,
    write_base,
)
from action_assistant.umrf.packages.generating import (
    is_source,
    package_files,
    possible_files,
)
from action_assistant.umrf.packages.regenerating import readable_paths, regenerated
from support.doses import examples
from umrf.packages.sources import described, hostile_texts, odd_actions

files = st.dictionaries(st.text(max_size=5), hostile_texts.map(str.encode), max_size=3)
bases = st.builds(
    GenerationBase,
    files,
    st.dictionaries(st.text(max_size=5), st.builds(UnfinishedFile, st.text(), files.map(repr).map(str.encode)), max_size=2),
)  # fmt: skip


@settings(max_examples=examples(50))
@given(bases)
def test_a_base_is_read_as_it_was_written(base: GenerationBase) -> None:
    assert read_base(write_base(base)) == base


def test_a_base_shows_texts_by_lines() -> None:
    assert b'   "two",\n' in write_base(GenerationBase({"README.md": b"one\ntwo\n"}))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff",
        b"{}",
        b'{"about": "", "format": 1, "files": {"a": "text"}}',
        b'{"about": "", "format": 1, "files": {}, "more": 1}',
        b'<<<<<<< HEAD\n{"about": "", "format": 1, "files": {}}',
    ],
)
def test_a_file_that_is_no_base_is_refused(content: bytes) -> None:
    with pytest.raises(UnreadableBase):
        read_base(content)


@settings(max_examples=examples(20))
@given(odd_actions())
def test_a_package_that_was_just_generated_stays_as_it_is(action: object) -> None:
    now = package_files(action)  # type: ignore[arg-type]
    assert now.keys() <= possible_files("ta_try")
    first = regenerated("ta_try", now, {}, None)
    assert first.writes == now
    assert first.base is not None
    again = regenerated("ta_try", now, now, read_base(first.base))
    assert again == type(again)(announced=again.announced)


def test_sources_are_those_below_src_and_test() -> None:
    sources = {path for path in possible_files("p") if is_source(path)}
    assert sources == {"src/p.cpp", "test/p_test.cpp"}


def test_lines_that_are_good_each_for_itself_may_make_no_file_together() -> None:
    old = b"<a>\n<x/>\n\n<y/>\n\n<z/>\n</a>\n"
    own = b"<a>\n<own>\n<x/>\n\n<y/>\n</own>\n\n<z/>\n</a>\n"
    new = b"<a>\n<x/>\n<new>\n\n<y/>\n\n<z/>\n</new>\n</a>\n"
    path = "package.xml"
    found = regenerated("p", {path: new}, {path: own}, GenerationBase({path: old}))
    assert "mismatched tag" in found.broken[path]
    assert found.writes == {}
    # who has left a file that cannot be read keeps it so
    found = regenerated("p", {path: new}, {path: own + b"<"}, GenerationBase({path: old}))
    assert found.broken == {}
    assert found.writes[path].endswith(b"</a>\n<")


def test_files_that_a_killed_call_wrote_are_recognised_by_their_contents() -> None:
    base = GenerationBase(
        {"README.md": b"old\n", "package.xml": b"<old/>\n"},
        {
            "README.md": UnfinishedFile(digest(b"merged\n"), b"new\n"),
            "package.xml": UnfinishedFile(digest(b"<merged/>\n"), b"<new/>\n"),
            "CMakeLists.txt": UnfinishedFile(digest(b"made()\n"), b"made()\n"),
            "src/p.cpp": UnfinishedFile(digest(b"made\n"), b"made\n"),
        },
    )
    there = {"README.md": b"merged\n", "package.xml": b"<own/>\n", "CMakeLists.txt": b"edited()\n"}
    assert base.settled(there) == {
        "README.md": b"new\n",
        "package.xml": b"<old/>\n",
        "CMakeLists.txt": b"made()\n",
    }


def test_files_to_read_are_those_generated_now_or_before() -> None:
    now = package_files(described())
    header = "include/ta_try/input_parameters.hpp"
    base = GenerationBase({header: b"", "../own": b"", "own": b""})
    assert header not in readable_paths("ta_try", now, None)
    assert set(readable_paths("ta_try", now, base)) == {*now, header}
