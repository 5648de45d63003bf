"""`package`, as a person or a script runs it."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from action_assistant.cli import main

ONE: dict[str, Any] = {
    "name": "OpenGripper",
    "type": "sync",
    "input_parameters": {"width": {"pvf_type": "number"}},
}
GRAPH: dict[str, Any] = {
    "graph_name": "g",
    "graph_entry": [{"name": "Look"}],
    "graph_exit": [{"name": "Grasp"}],
    "actions": [
        {"name": "Look", "type": "sync", "children": [{"name": "Grasp"}]},
        {"name": "Grasp", "type": "sync", "parents": [{"name": "Look"}]},
    ],
}


@pytest.fixture
def package(tmp_path: Path) -> Callable[..., int]:
    """Runs the command on a description; packages go into `out`."""

    def run(value: object, *options: str) -> int:
        path = tmp_path / "given.json"
        path.write_text(value if isinstance(value, str) else json.dumps(value))
        return main(["package", str(path), "--output", str(tmp_path / "out"), *options])

    return run


def everything(folder: Path) -> dict[str, bytes]:
    """Contents of all files below, by path."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and not path.is_symlink()
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


def test_what_is_there_already_is_left_and_not_told(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package(ONE)
    (tmp_path / "out/open_gripper/README.md").unlink()
    (tmp_path / "out/open_gripper/own.cpp").write_text("mine")
    capsys.readouterr()
    assert package(ONE) == 0
    assert capsys.readouterr().out == f"{tmp_path}/out/open_gripper/README.md\n"
    assert (tmp_path / "out/open_gripper/own.cpp").read_text() == "mine"


def test_a_file_that_differs_is_named_and_nothing_is_written(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package(ONE)
    source = tmp_path / "out/open_gripper/src/open_gripper.cpp"
    source.write_text("// work of a person\n")
    (tmp_path / "out/open_gripper/README.md").unlink()
    before = everything(tmp_path / "out")
    capsys.readouterr()
    assert package(ONE) == 1
    assert everything(tmp_path / "out") == before
    told = capsys.readouterr()
    assert f"{source}: is there and differs" in told.err
    assert told.out == ""


def test_diff_shows_what_would_change_and_writes_nothing(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert package(ONE, "--diff") == 0
    assert not (tmp_path / "out").exists()
    assert "--- /dev/null\n+++ b/open_gripper/CMakeLists.txt\n" in capsys.readouterr().out
    package(ONE)
    source = tmp_path / "out/open_gripper/src/open_gripper.cpp"
    source.write_text("// work of a person")
    capsys.readouterr()
    assert package(ONE, "--diff") == 0
    shown = capsys.readouterr().out
    assert "-// work of a person\n\\ No newline at end of file\n+#include" in shown
    assert "CMakeLists" not in shown
    assert source.read_text() == "// work of a person"


def test_check_says_whether_anything_would_change(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert package(ONE, "--check") == 1
    assert not (tmp_path / "out").exists()
    package(ONE)
    assert package(ONE, "--check") == 0
    source = tmp_path / "out/open_gripper/src/open_gripper.cpp"
    source.write_text("// work of a person\n")
    capsys.readouterr()
    assert package(ONE, "--check", "--diff") == 1
    told = capsys.readouterr()
    assert f"{source}: differs." in told.err
    assert "-// work of a person" in told.out


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
def test_what_cannot_be_is_refused_with_place_and_reason_and_nothing_is_written(
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


def test_what_is_no_file_is_neither_waited_for_nor_replaced(
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


def test_what_a_description_says_steers_no_terminal(
    package: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert package({**ONE, "name": "A\x1b[2J\nB"}) == 1
    told = capsys.readouterr().err
    assert "\x1b" not in told
    assert len(told.splitlines()) == 1
