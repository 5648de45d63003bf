"""`package`, as a person or a script runs it."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from action_assistant.cli import main
from action_assistant.umrf.kept_values import KEEPER_PACKAGE
from commands.packages.trees import ONE, everything

GRAPH: dict[str, Any] = {
    "graph_name": "g",
    "graph_entry": [{"name": "Look"}],
    "graph_exit": [{"name": "Grasp"}],
    "actions": [
        {"name": "Look", "type": "sync", "children": [{"name": "Grasp"}]},
        {"name": "Grasp", "type": "sync", "parents": [{"name": "Look"}]},
    ],
}


def test_a_package_is_written_and_every_file_named(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert package(ONE) == 0
    written = everything(tmp_path / "out")
    assert "open_gripper/src/open_gripper.cpp" in written
    assert "open_gripper/open_gripper.umrf.json" in written
    told = capsys.readouterr().out.splitlines()
    assert sorted(told) == sorted(str(tmp_path / "out" / path) for path in written)


def test_existing_files_are_left_and_not_reported(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package(ONE)
    (tmp_path / "out/open_gripper/README.md").unlink()
    (tmp_path / "out/open_gripper/own.cpp").write_text("mine")
    capsys.readouterr()
    assert package(ONE) == 0
    assert capsys.readouterr().out == f"{tmp_path}/out/open_gripper/README.md\n"
    assert (tmp_path / "out/open_gripper/own.cpp").read_text() == "mine"


def test_a_file_that_differs_from_what_nobody_remembers_is_named_and_nothing_is_written(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "out/open_gripper/src/open_gripper.cpp"
    source.parent.mkdir(parents=True)
    source.write_text("// work of a person\n")
    before = everything(tmp_path / "out")
    assert package(ONE) == 1
    assert package(ONE, "--check") == 1
    assert everything(tmp_path / "out") == before
    told = capsys.readouterr()
    assert f"{source}: is there and differs" in told.err
    assert told.out == ""
    assert package(ONE, "--diff") == 1
    assert "-// work of a person\n+#include" in capsys.readouterr().out


def test_diff_shows_what_would_change_and_writes_nothing(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert package(ONE, "--diff") == 0
    assert not (tmp_path / "out").exists()
    assert "--- /dev/null\n+++ b/open_gripper/CMakeLists.txt\n" in capsys.readouterr().out
    package(ONE)
    readme = tmp_path / "out/open_gripper/README.md"
    readme.write_text("words of a person")
    capsys.readouterr()
    assert package(ONE, "--diff") == 0
    assert capsys.readouterr().out == ""
    (tmp_path / "out/open_gripper/package.xml").unlink()
    assert package(ONE, "--diff") == 0
    assert "--- /dev/null\n+++ b/open_gripper/package.xml\n" in capsys.readouterr().out
    assert not (tmp_path / "out/open_gripper/package.xml").exists()


def test_check_says_whether_anything_would_change(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert package(ONE, "--check") == 1
    assert not (tmp_path / "out").exists()
    package(ONE)
    assert package(ONE, "--check") == 0
    readme = tmp_path / "out/open_gripper/README.md"
    readme.unlink()
    capsys.readouterr()
    assert package(ONE, "--check", "--diff") == 1
    told = capsys.readouterr()
    assert told.err == f"{readme}: is not there.\n"
    assert "+# open_gripper" in told.out


def test_a_graph_gives_a_package_for_each_action_or_for_those_named(
    package: Callable[..., int], tmp_path: Path
) -> None:
    assert package(GRAPH, "--name", "Grasp") == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"grasp"}
    assert package(GRAPH) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"grasp", "look"}


@pytest.mark.parametrize(
    ("value", "options", "words"),
    [
        ("{", [], "not JSON"),
        ({"x": 1}, [], "no UMRF graph"),
        ({**ONE, "name": "graph_entry"}, [], "the engine's own name"),
        ({**ONE, "name": "../../etc"}, [], "C++ class"),
        ({**ONE, "input_parameters": {"a:b": {"pvf_type": "bool"}}}, [], "colon"),
        (GRAPH, ["--name", "Missing"], "Missing: The file has no action of this name."),
        ({**GRAPH, "actions": [{"name": "moveArm"}, {"name": "MoveArm"}]}, [], "would both be"),
        ({**GRAPH, "actions": []}, [], "no action"),
    ],
)
def test_an_impossible_package_is_refused_with_place_and_reason_and_nothing_is_written(
    package: Callable[..., int],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    value: object,
    options: list[str],
    words: str,
) -> None:
    assert package(value, *options) == 1
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_file_that_is_not_there_is_wrong_use(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = str(tmp_path / "none.umrf.json")
    assert main(["package", missing, "--output", str(tmp_path)]) == 2
    assert "Cannot read" in capsys.readouterr().err
    with pytest.raises(SystemExit) as ended:
        main(["package", missing])
    assert ended.value.code == 2


@pytest.mark.parametrize("link", ["open_gripper", "open_gripper/src", "open_gripper/README.md"])
def test_no_link_leads_out_of_the_folder(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str], link: str
) -> None:
    outside, place = tmp_path / "outside", tmp_path / "out" / link
    outside.mkdir()
    place.parent.mkdir(parents=True)
    place.symlink_to(outside / "README.md" if place.suffix else outside)
    assert package(ONE) == 1
    assert "link" in capsys.readouterr().err
    assert list(outside.iterdir()) == []
    assert everything(tmp_path / "out") == {}


def test_a_pipe_or_a_file_in_the_wrong_place_is_neither_read_nor_replaced(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out/open_gripper").mkdir(parents=True)
    os.mkfifo(tmp_path / "out/open_gripper/README.md")
    (tmp_path / "out/open_gripper/src").write_text("a file where a folder belongs")
    assert package(ONE) == 1
    told = capsys.readouterr().err
    assert "README.md: it is no file" in told
    assert "is a file or a link" in told


def test_a_folder_that_cannot_be_written_is_told_and_nothing_is_left(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out").write_text("a file")
    assert package(ONE) == 2
    assert str(tmp_path / "out") in capsys.readouterr().err


def test_text_of_a_description_steers_no_terminal(
    package: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert package({**ONE, "name": "A\x1b[2J\nB"}) == 1
    told = capsys.readouterr().err
    assert "\x1b" not in told
    assert len(told.splitlines()) == 1


def test_the_package_that_keeps_values_needs_no_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = ["--output", str(tmp_path / "out")]
    assert main(["package", "--values", *output]) == 0
    assert f"{KEEPER_PACKAGE}/src/{KEEPER_PACKAGE}.cpp" in everything(tmp_path / "out")
    capsys.readouterr()
    for more in (["--name", "Look"], ["--together", "both"], [str(tmp_path / "graph.json")]):
        assert main(["package", "--values", *more, *output]) == 2
        assert "a package of its own" in capsys.readouterr().err
