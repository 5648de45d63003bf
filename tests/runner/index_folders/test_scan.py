"""The files that an engine would read are found, and those that cannot be read are named."""

import os
from pathlib import Path

from action_assistant.runner.index_folders.scan import scanned
from runner.harness import sequence
from runner.index_folders.folders import add


def test_files_are_found_as_deep_as_an_engine_looks_whatever_they_are_called(
    tmp_path: Path,
) -> None:
    for path in ("a.graph.json", "one/x-graph.json.bak", "one/two/.graph.json", "t/t/t/graph.json"):
        add(tmp_path, path, sequence("leg"))
    add(tmp_path, "one/leg.json", sequence("leg"))
    (tmp_path / "one/leg.umrf.json").write_text('{"name": "leg"}')
    (tmp_path / "other.umrf.json").write_text('\ufeff{"name": "other"}')
    found = scanned(tmp_path, {"leg", "other"})
    assert sorted(each.path for each in found.graphs["leg"]) == [
        "a.graph.json",
        "one/two/.graph.json",
        "one/x-graph.json.bak",
    ]
    assert [each.path for each in found.actions["leg"]] == ["one/leg.umrf.json"]
    assert [each.path for each in found.actions["other"]] == ["other.umrf.json"]
    assert found.unread == ()


def test_links_are_followed_and_told_and_what_leads_nowhere_defines_nothing(
    tmp_path: Path,
) -> None:
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "index"
    add(elsewhere, "leg.graph.json", sequence("leg"))
    folder.mkdir()
    (folder / "package").symlink_to(elsewhere)
    (folder / "round").symlink_to(folder)
    (folder / "nothing.graph.json").symlink_to(tmp_path / "nothing")
    (folder / "itself.graph.json").symlink_to(folder / "itself.graph.json")
    os.mkfifo(folder / "pipe.graph.json")
    (folder / "bad.graph.json").write_bytes(b"\xff[" + b"[" * 100_000)
    found = scanned(folder, {"leg"})
    assert {(each.path, each.linked) for each in found.graphs["leg"]} == {
        ("package/leg.graph.json", True),
        ("round/package/leg.graph.json", True),
    }
    assert found.unread == ()


def test_files_that_are_too_large_or_missing_are_reported(tmp_path: Path) -> None:
    with (tmp_path / "large.graph.json").open("wb") as large:
        large.truncate(9 << 20)
    assert scanned(tmp_path, {"leg"}).unread == ("large.graph.json (larger than 8 MB)",)
    assert scanned(tmp_path / "none", {"leg"}).unread == ("the folder (No such file or directory)",)
