"""Graphs are written into an index whole, beside what others have there, and nowhere else."""

import json
import os
import resource
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.index_folders.comparison import Present, file_state
from action_assistant.runner.index_folders.scan import scanned, shown_path
from action_assistant.runner.index_folders.writing import NewFile, WritingOutcome, sha, write
from action_assistant.runner.robots.engine import EngineIndex
from action_assistant.runner.start.index_writer import planned, read_index_write
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.writing import graph_file_name
from action_assistant.umrf.model import Graph, Signature
from runner.harness import sequence
from runner.index_folders.folders import add, held, put, sent, wish
from support.doses import examples


def is_there(folder: Path, graph: Graph) -> bool:
    files = scanned(folder, {graph.name})
    return file_state(graph, files, PINNED, actions=(), graphs={}) == Present()


def test_lacking_graphs_are_written_and_present_ones_not_touched(tmp_path: Path) -> None:
    kept = add(tmp_path, "package/mine.graph.json", sequence("leg", 2))
    before = kept.stat()
    outcome = put(tmp_path, sequence("leg", 2), sequence("round"))
    assert [(each.graph, each.path, each.kept) for each in outcome.written] == [
        ("round", "round.umrf.graph.json", "")
    ]
    assert outcome.failed == ""
    assert kept.stat() == before
    assert sorted(held(tmp_path)) == ["package/mine.graph.json", "round.umrf.graph.json"]
    assert is_there(tmp_path, sequence("round"))
    first = (tmp_path / "round.umrf.graph.json").stat()
    assert put(tmp_path, sequence("leg", 2), sequence("round")).written == ()
    assert (tmp_path / "round.umrf.graph.json").stat() == first


def test_another_file_of_that_name_is_replaced_only_where_that_is_said(tmp_path: Path) -> None:
    mine = add(tmp_path, "package/deep/leg.umrf.json.graph.json", sequence("leg", 3))
    mine.chmod(0o640)
    before = held(tmp_path)
    with pytest.raises(Conflict, match="package/deep/leg") as refused:
        put(tmp_path, sequence("leg", 2), sequence("round"))
    assert (refused.value.where or {})["files"] == {"leg": str(mine.relative_to(tmp_path))}
    assert held(tmp_path) == before
    (round_, leg) = put(tmp_path, sequence("round"), sequence("leg", 2), replace=["leg"]).written
    assert (round_.kept, leg.path) == ("", str(mine.relative_to(tmp_path)))
    assert held(tmp_path)[leg.kept] == before[leg.path]
    assert Path(leg.kept).parent == Path(leg.path).parent
    assert not any(mark in leg.kept.rpartition("/")[2] for mark in ("graph.json", "umrf.json"))
    assert mine.stat().st_mode & 0o777 == 0o640
    assert is_there(tmp_path, sequence("leg", 2))


@pytest.mark.parametrize(("folder", "file"), [(0o755, 0o644), (0o700, 0o600), (0o775, 0o664)])
def test_readers_of_the_folder_can_read_the_file(tmp_path: Path, folder: int, file: int) -> None:
    tmp_path.chmod(folder)
    before = os.umask(0o077)  # as a service of systemd has it
    try:
        put(tmp_path, sequence("leg"))
    finally:
        os.umask(before)
    assert (tmp_path / "leg.umrf.graph.json").stat().st_mode & 0o777 == file


def test_a_file_of_an_older_form_is_none_that_an_engine_reads(tmp_path: Path) -> None:
    text = json.loads(codec.write(sequence("leg", 2)))
    text["graph_entry"] = {"actions": text["graph_entry"]}
    (tmp_path / "old.graph.json").write_text(json.dumps(text))
    with pytest.raises(Conflict, match=r"old\.graph\.json"):
        put(tmp_path, sequence("leg", 2))
    (leg,) = put(tmp_path, sequence("leg", 2), replace=["leg"]).written
    assert leg.path == "old.graph.json"


@pytest.mark.parametrize("replace", [(), ("leg",)])
def test_two_definitions_of_one_name_prevent_the_write(
    tmp_path: Path, replace: tuple[str, ...]
) -> None:
    add(tmp_path, "a/leg.graph.json", sequence("leg", 2))
    add(tmp_path, "b/leg.graph.json", sequence("leg", 3))
    before = held(tmp_path)
    with pytest.raises(Conflict, match=r"2 files define leg.*a/leg.*b/leg|b/leg.*a/leg"):
        put(tmp_path, sequence("round"), sequence("leg", 2), replace=replace)
    assert held(tmp_path) == before
    add(tmp_path, "b/leg.graph.json", sequence("leg", 2))
    assert put(tmp_path, sequence("leg", 2)).written == ()


def test_an_action_of_that_name_comes_first_so_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "leg.umrf.json").write_text('{"name": "leg", "type": "sync"}')
    with pytest.raises(Conflict, match=r"leg\.umrf\.json defines an action leg"):
        put(tmp_path, sequence("leg"))
    known = EngineIndex(actions={"round": Signature(inputs={}, outputs={})})
    with pytest.raises(Conflict, match="has an action round"):
        put(tmp_path, sequence("round"), index=known)
    assert sorted(held(tmp_path)) == ["leg.umrf.json"]


def test_an_engine_that_looks_elsewhere_is_not_written_for_in_vain(tmp_path: Path) -> None:
    known = EngineIndex(graphs={"leg": sequence("leg", 3)})
    with pytest.raises(Conflict, match="looks elsewhere"):
        put(tmp_path, sequence("leg", 2), replace=["leg"], index=known)
    assert put(tmp_path, sequence("leg", 3), index=known).written == ()


def test_an_unreadable_file_prevents_the_write(tmp_path: Path) -> None:
    with (tmp_path / "large.graph.json").open("wb") as large:
        large.truncate(9 << 20)
    with pytest.raises(Conflict, match=r"is not known: large\.graph\.json"):
        put(tmp_path, sequence("leg"))


def test_a_link_is_read_and_never_written_through(tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "index", tmp_path / "elsewhere"
    folder.mkdir()
    add(elsewhere, "leg.graph.json", sequence("leg", 3))
    (folder / "package").symlink_to(elsewhere)
    before = held(tmp_path)
    with pytest.raises(Conflict, match=r"package/leg\.graph\.json .* is a link"):
        put(folder, sequence("leg", 2), replace=["leg"])
    assert put(folder, sequence("leg", 3)).written == ()
    old = sha((elsewhere / "leg.graph.json").read_bytes())
    forged = NewFile("leg", b"{}", "package/leg.graph.json", old)
    assert "cannot be written" in write(folder, [forged]).failed
    for path in ("../elsewhere/leg.graph.json", "./x.graph.json", "//etc/x.graph.json"):
        assert write(folder, [NewFile("leg", b"{}", path, old)]).failed
    assert held(tmp_path) == before


def test_a_file_that_somebody_has_changed_since_is_left(tmp_path: Path) -> None:
    mine = add(tmp_path, "leg.graph.json", sequence("leg", 3))
    plan = planned(wish(sequence("leg", 2), replace=["leg"]), tmp_path, EngineIndex(), PINNED)
    mine.write_text("{}")
    outcome = write(tmp_path, plan.files)
    assert outcome == WritingOutcome((), "leg.graph.json was changed meanwhile; look again.")
    mine.unlink()
    assert "changed meanwhile" in write(tmp_path, plan.files).failed
    assert held(tmp_path) == {}


def test_a_file_written_at_the_same_time_is_never_lost(tmp_path: Path) -> None:
    mine, ends = tmp_path / "leg.graph.json", threading.Event()
    saved: list[bytes] = []

    def save_again() -> None:
        for number in range(100_000):
            text = codec.write(sequence("leg", 1 + number % 5)) + "\n" * number
            fresh = tmp_path / "editor.tmp"
            fresh.write_text(text)
            fresh.rename(mine)
            saved.append(text.encode())
            if ends.wait(0.001):
                return

    other = threading.Thread(target=save_again)
    other.start()
    for number in range(examples(60)):
        if mine.exists():
            text = mine.read_bytes()
            write(tmp_path, [NewFile("leg", b'{"n": %d}' % number, mine.name, sha(text))])
    ends.set()
    other.join()
    # The last saved text is under its name or put aside: no file of a person was overwritten.
    kept = [each.read_bytes() for each in tmp_path.iterdir() if each.name.endswith(".replaced")]
    assert saved[-1] in (mine.read_bytes(), *kept)
    assert not any(each.name.endswith(".new") for each in tmp_path.iterdir())


@contextmanager
def little_space() -> Iterator[None]:
    """Limit this process's files to 1,000 bytes, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_without_space_nothing_is_written_and_the_path_is_reported(tmp_path: Path) -> None:
    add(tmp_path, "leg.graph.json", sequence("leg", 3))
    before = held(tmp_path)
    files = (
        NewFile("small", b"{}"),
        NewFile("leg", b" " * 2000, "leg.graph.json", sha(before["leg.graph.json"])),  # type: ignore[arg-type]
    )
    with little_space():
        outcome = write(tmp_path, files)
    assert outcome.written == ()
    assert outcome.failed == f"{tmp_path}/leg.graph.json cannot be written: File too large."
    assert held(tmp_path) == before


@pytest.mark.parametrize("folder", ["/proc", "/sys/kernel", "/nonexistent", "/dev/null"])
def test_a_folder_that_takes_nothing_is_named(folder: str) -> None:
    outcome = write(Path(folder), [NewFile("leg", b"{}")])
    assert outcome.written == ()
    assert outcome.failed.startswith(folder)
    assert "cannot be written: " in outcome.failed


@pytest.mark.parametrize("name", ["x%n", "l" * 201, "a\nb"])
def test_a_name_that_no_engine_may_read_gets_into_no_index(tmp_path: Path, name: str) -> None:
    with pytest.raises(Conflict, match="cannot be written: The name of the graph"):
        put(tmp_path, sequence(name))
    assert held(tmp_path) == {}


@pytest.mark.parametrize("name", ["a b", "../up", "läuft", "l" * 65, "9"])
def test_a_name_that_an_engine_takes_gets_into_its_index_under_a_safe_file_name(
    tmp_path: Path, name: str
) -> None:
    put(tmp_path, sequence(name))
    (written,) = held(tmp_path)
    assert Path(written).name == written
    assert len(written) < 120
    assert codec.read((tmp_path / written).read_bytes()).graph.name == name


def test_a_graph_that_no_engine_reads_gets_into_no_index(tmp_path: Path) -> None:
    graph = sequence("leg", 2)
    twice = msgspec.structs.replace(graph.actions[1], instance_id=graph.actions[0].instance_id)
    with pytest.raises(Conflict, match="leg cannot be written") as refused:
        put(tmp_path, msgspec.structs.replace(graph, actions=(graph.actions[0], twice)))
    assert str((refused.value.where or {})["path"]).startswith("/subgraphs/0/umrf")


def test_a_wish_is_what_was_approved_and_names_what_it_sends(tmp_path: Path) -> None:
    other = wish(sequence("leg", 2))
    altered = msgspec.structs.replace(other, subgraphs=(sent(sequence("leg"), digest="0" * 64),))
    with pytest.raises(Conflict, match="not the one that was approved"):
        planned(altered, tmp_path, EngineIndex(), PINNED)
    with pytest.raises(Conflict) as refused:
        planned(
            msgspec.structs.replace(other, tree_digest="1" * 64), tmp_path, EngineIndex(), PINNED
        )
    assert refused.value.where == {"path": "/tree_digest"}
    with pytest.raises(BadInput, match="not among the graphs") as unknown:
        read_index_write(msgspec.json.encode(msgspec.structs.replace(other, replace=("tower",))))
    assert unknown.value.where == {"path": "/replace/0"}


# --- whatever stands there --------------------------------------------------------------------------

NAMES = ("leg", "round", "a_b")
#: Names that people and strangers give to files and graphs; a file system takes each.
hostile = st.one_of(
    st.sampled_from(
        ["graph.json", "umrf.json", "leg.umrf.graph.json", "LEG.umrf.graph.json", ".graph.json"]
    ),
    st.text(min_size=1, max_size=40)
    .filter(lambda t: "/" not in t and "\0" not in t and t not in {".", ".."})
    .map(lambda t: t.encode("utf-8", "replace").decode()[:60] + ".graph.json"),
)
contents = st.one_of(
    st.builds(
        lambda name, n: codec.write(sequence(name, n)).encode(),
        st.sampled_from(NAMES),
        st.integers(1, 3),
    ),
    st.builds(lambda name: json.dumps({"name": name}).encode(), st.sampled_from(NAMES)),
    st.binary(max_size=30),
)
paths = st.builds(
    lambda above, name: "/".join((*above, name)),
    st.lists(st.sampled_from(["a", "b", "graph.json.d"]), max_size=3),
    hostile,
)


def shown(folder: Path) -> dict[str, bytes | str]:
    """Return the files by the paths that people are told."""
    return {shown_path(path): text for path, text in held(folder).items()}


@pytest.mark.long
@given(
    files=st.dictionaries(paths, contents, max_size=6), link=st.booleans(), replaces=st.booleans()
)
@settings(max_examples=examples(60), deadline=None)
def test_foreign_files_in_the_folder_keep_every_byte(
    files: dict[str, bytes], link: bool, replaces: bool
) -> None:
    above = Path(tempfile.mkdtemp())
    try:
        folder = above / "index"
        folder.mkdir()
        for path, text in files.items():
            try:
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_bytes(text)
            except OSError:  # of two that cannot both be there
                continue
        if link:
            add(above / "outside", "leg.graph.json", sequence("leg", 3))
            (folder / "linked").symlink_to(above / "outside")
        before = shown(above)
        graphs = [sequence(name, 2) for name in NAMES]
        try:
            outcome = put(folder, *graphs, replace=NAMES if replaces else ())
        except Conflict:
            assert shown(above) == before
            return
        after = shown(above)
        fresh = {f"index/{each.path}" for each in outcome.written}
        assert outcome.failed == ""
        for path, text in before.items():
            if path not in fresh:
                assert after[path] == text
        for each in outcome.written:
            assert each.kept == "" or after[f"index/{each.kept}"] == before[f"index/{each.path}"]
        kept = {f"index/{each.kept}" for each in outcome.written if each.kept}
        assert set(after) == set(before) | fresh | kept
        assert all(is_there(folder, graph) for graph in graphs)
    finally:
        shutil.rmtree(above)


@given(st.text(max_size=300), st.integers(1, 50))
@settings(max_examples=examples(300), deadline=None)
def test_any_graph_name_gives_a_plain_file_name_of_a_graph(name: str, number: int) -> None:
    file = graph_file_name(name, number)
    assert file.isascii()
    assert not set(file) & set("/\\\0%:\n ")
    assert not file.startswith(".")
    assert len(file) < 120
    assert file.count("graph.json") == 1
    assert "umrf.json" not in file
    assert file.endswith(".umrf.graph.json")


def test_names_that_are_made_alike_get_numbers(tmp_path: Path) -> None:
    names = ("../x", "x/..", "..x", "x", "x.umrf.json")
    outcome = write(tmp_path, [NewFile(name, name.encode()) for name in names])
    assert outcome.failed == ""
    assert sorted(held(tmp_path).values()) == sorted(name.encode() for name in names)
    assert all(
        (tmp_path / each.path).read_bytes() == each.graph.encode() for each in outcome.written
    )
