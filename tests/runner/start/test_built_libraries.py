"""A library that is older than its source is named before a start, as far as this computer can tell."""

from pathlib import Path

import pytest

from action_assistant.runner.start.built_libraries import older_libraries
from action_assistant.umrf.model import Action, Graph
from runner.colcon_workspace import changed, workspace

GRAPH = Graph(name="g", actions=(Action(key="a", name="LiftBox"), Action(key="b", name="Wave")))


@pytest.mark.parametrize("merged", [False, True])
def test_a_source_that_was_changed_after_the_build_is_named(tmp_path: Path, merged: bool) -> None:
    prefix = workspace(tmp_path, merged=merged)
    assert older_libraries(GRAPH, [prefix]) == []
    changed(tmp_path, "src/lift_box.cpp")
    (found,) = older_libraries(GRAPH, [prefix])
    assert (found.action, found.library.name, found.source.name) == (
        "LiftBox",
        "liblift_box.so",
        "lift_box.cpp",
    )


@pytest.mark.parametrize("file", ["test/lift_box_test.cpp", "lift_box.umrf.json", "CMakeLists.txt"])
def test_files_that_no_library_is_compiled_from_do_not_count(tmp_path: Path, file: str) -> None:
    prefix = workspace(tmp_path)
    changed(tmp_path, file)
    assert older_libraries(GRAPH, [prefix]) == []


def test_the_library_that_a_loader_finds_first_counts(tmp_path: Path) -> None:
    over, under = workspace(tmp_path / "over"), workspace(tmp_path / "under")
    changed(tmp_path / "under", "src/lift_box.cpp")
    assert older_libraries(GRAPH, [over, under]) == []
    assert len(older_libraries(GRAPH, [under, over])) == 1


def test_without_build_information_no_library_is_reported(tmp_path: Path) -> None:
    prefix = workspace(tmp_path)
    changed(tmp_path, "src/lift_box.cpp")
    (tmp_path / "build" / "lift_box" / "CMakeCache.txt").unlink()
    assert older_libraries(GRAPH, [prefix, tmp_path / "nowhere"]) == []
    assert older_libraries(GRAPH, []) == []
