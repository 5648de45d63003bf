"""`package` where people have worked: their edits stay, or nothing is written."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from commands.packages.trees import ONE, everything

BASE = ".generated.json"
WIDER: dict[str, Any] = {
    **ONE,
    "description": "Opens it wide.",
    "input_parameters": {"opening": {"pvf_type": "numbers"}, "fast": {"pvf_type": "bool"}},
}


@pytest.fixture
def made(package: Callable[..., int], tmp_path: Path) -> Path:
    """The folder of the package of `ONE`."""
    package(ONE)
    return tmp_path / "out/open_gripper"


def edit(path: Path, old: str, new: str) -> None:
    """A hand edit."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_without_edits_what_is_ours_becomes_as_if_it_were_new(
    package: Callable[..., int], made: Path, tmp_path: Path
) -> None:
    assert package(WIDER) == 0
    again = everything(made)
    fresh = tmp_path / "fresh"
    assert package(WIDER, "--into", str(fresh)) == 2
    fresh.mkdir()
    assert package(WIDER, "--into", str(fresh)) == 0
    expected = everything(fresh / "open_gripper")
    assert again.keys() == expected.keys()
    differing = {path for path in again if again[path] != expected[path]}
    assert differing == {"src/open_gripper.cpp"}
    assert package(WIDER, "--check") == 0


def test_edits_of_every_merged_file_stay_beside_what_is_new(
    package: Callable[..., int], made: Path
) -> None:
    manifest, readme = made / "package.xml", made / "README.md"
    edit(manifest, "TODO: who looks after it", "Jane")
    edit(manifest, "TODO: license", "BSD-3-Clause")
    edit(manifest, "<depend>libboost-dev</depend>", "<depend>libboost-dev</depend>\n<own/>")
    edit(made / "CMakeLists.txt", "ament_package()", "own()\nament_package()")
    edit(readme, "The work belongs", "Own words.\n\nThe work belongs")
    edit(made / "include/open_gripper/input_parameters.hpp", "#include <string>", "#include <own>")
    edit(made / "open_gripper.umrf.json", '  "name"', '  "effect": "own",\n  "name"')
    assert package(WIDER) == 0
    assert "<description>Opens it wide.</description>" in manifest.read_text()
    assert all(word in manifest.read_text() for word in ("Jane", "BSD-3-Clause", "<own/>"))
    assert 'DESCRIPTION "Opens it wide."' in (made / "CMakeLists.txt").read_text()
    assert "own()\nament_package()" in (made / "CMakeLists.txt").read_text()
    assert "Own words." in readme.read_text()
    assert "| opening | numbers |" in readme.read_text()
    header = (made / "include/open_gripper/input_parameters.hpp").read_text()
    assert "#include <own>" in header
    assert "std::vector<double> opening{};" in header
    assert '"effect": "own"' in (made / "open_gripper.umrf.json").read_text()
    assert package(WIDER, "--check") == 0


def test_sources_are_never_touched_and_what_is_new_for_them_is_told(
    package: Callable[..., int], made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, trial = made / "src/open_gripper.cpp", made / "test/open_gripper_test.cpp"
    source.write_text("// work of a person\n")
    capsys.readouterr()
    assert package(WIDER, "--diff") == 0
    told = capsys.readouterr()
    assert f"{source}: is yours and stays" in told.err
    assert "+    // params_in.opening is a std::vector<double>" in told.out
    assert package(WIDER) == 0
    told = capsys.readouterr()
    assert f"{source}: is yours and stays" in told.err
    assert "+    // params_in.opening is a std::vector<double>" in told.err
    assert str(trial) not in told.err + told.out
    assert source.read_text() == "// work of a person\n"
    assert package(WIDER) == 0
    assert capsys.readouterr().err == ""


def test_deleted_sources_stay_deleted_and_other_files_come_back(
    package: Callable[..., int], made: Path
) -> None:
    for path in ("src/open_gripper.cpp", "test/open_gripper_test.cpp", "CMakeLists.txt"):
        (made / path).unlink()
    assert package(WIDER) == 0
    assert not (made / "src/open_gripper.cpp").exists()
    assert not (made / "test/open_gripper_test.cpp").exists()
    assert "Opens it wide." in (made / "CMakeLists.txt").read_text()


def test_an_overlap_is_told_by_file_and_line_and_nothing_is_written(
    package: Callable[..., int], made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header = made / "include/open_gripper/input_parameters.hpp"
    edit(header, "#include <string>", "#include <string>\n#include <own>")
    edit(header, "double width{};", "double width{0.1};")
    before = everything(made)
    line = 1 + header.read_text().split("\n").index("  double width{0.1};")
    capsys.readouterr()
    for options in ((), ("--check",), ("--diff",)):
        assert package(WIDER, *options) == 1
        told = capsys.readouterr()
        assert f"{header}:{line}: " in told.err
        assert everything(made) == before
    assert "+  std::vector<double> opening{};" in told.out
    edit(header, "double width{0.1};", "std::vector<double> opening{};\n  bool fast{};")
    assert package(WIDER) == 0
    assert "#include <own>" in header.read_text()


def test_a_header_that_is_no_longer_generated_goes_unless_it_was_edited(
    package: Callable[..., int], made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header = made / "include/open_gripper/input_parameters.hpp"
    bare = {**ONE, "input_parameters": {}}
    assert package(bare, "--check") == 1
    assert f"{header}: is no longer generated, and would be removed." in capsys.readouterr().err
    assert package(bare, "--diff") == 0
    assert "+++ /dev/null" in capsys.readouterr().out
    assert header.exists()
    assert package(bare) == 0
    assert not header.exists()
    assert package(ONE) == 0
    edit(header, "#include <string>", "#include <string>\n#include <own>")
    capsys.readouterr()
    assert package(bare) == 0
    assert f"{header}: is no longer generated; it stays" in capsys.readouterr().err
    assert package(bare, "--check") == 0
    assert package(WIDER) == 0
    assert "#include <own>" in header.read_text()
    assert "opening{};" in header.read_text()


def test_a_deleted_header_that_is_no_longer_generated_is_no_trouble(
    package: Callable[..., int], made: Path
) -> None:
    (made / "include/open_gripper/input_parameters.hpp").unlink()
    bare = {**ONE, "input_parameters": {}}
    assert package(bare) == 0
    assert package(bare, "--check") == 0


def test_a_conflict_in_one_package_keeps_all_packages_as_they_were(
    package: Callable[..., int], tmp_path: Path
) -> None:
    def graph(text: str) -> dict[str, Any]:
        actions = [
            {"name": name, "type": "sync", "description": text} for name in ("Look", "Grasp")
        ]
        return {"graph_name": "g", "graph_entry": [], "graph_exit": [], "actions": actions}

    assert package(graph("Old.")) == 0
    edit(tmp_path / "out/look/README.md", "Old", "Own")
    before = everything(tmp_path / "out")
    assert package(graph("New.")) == 1
    assert everything(tmp_path / "out") == before
    assert package(graph("New."), "--name", "Grasp") == 0


@pytest.mark.parametrize("content", ["{", "[]", '{"about": "", "format": 2, "files": {}}'])
def test_a_base_that_cannot_be_read_stops_the_call(
    package: Callable[..., int],
    made: Path,
    capsys: pytest.CaptureFixture[str],
    content: str,
) -> None:
    (made / BASE).write_text(content)
    before = everything(made)
    capsys.readouterr()
    assert package(WIDER) == 1
    assert f"{made / BASE}: it is " in capsys.readouterr().err
    assert everything(made) == before


def test_a_base_cannot_have_files_removed_that_are_not_generated(
    package: Callable[..., int], made: Path, tmp_path: Path
) -> None:
    (made / "own.txt").write_text("mine\n")
    (tmp_path / "own.txt").write_text("mine\n")
    edit(
        made / BASE,
        '"files": {',
        '"files": {"own.txt": ["mine", ""], "../../own.txt": ["mine", ""],',
    )
    assert package(WIDER) == 0
    assert (made / "own.txt").exists()
    assert (tmp_path / "own.txt").exists()


def test_a_package_without_a_base_gets_that_of_its_description(
    package: Callable[..., int], made: Path, tmp_path: Path
) -> None:
    edit(made / "README.md", "The work belongs", "Own words.\n\nThe work belongs")
    (made / BASE).unlink()
    assert package(WIDER) == 1
    aside = tmp_path / "aside"
    aside.mkdir()
    assert package(ONE, "--into", str(aside)) == 0
    (aside / "open_gripper" / BASE).rename(made / BASE)
    assert package(WIDER) == 0
    assert "Own words." in (made / "README.md").read_text()


def test_files_stay_as_open_to_others_as_they_were(package: Callable[..., int], made: Path) -> None:
    (made / "README.md").chmod(0o640)
    assert package(WIDER) == 0
    assert (made / "README.md").stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("name", ["fsync", "replace", "unlink"])
def test_a_disk_that_fails_leaves_everything_as_it_was(
    package: Callable[..., int], made: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    edit(made / "README.md", "The work belongs", "Own words.\n\nThe work belongs")
    before = everything(made)
    real, calls = getattr(os, name), [0]
    bare = {**ONE, "description": "New.", "input_parameters": {}}

    def failing(*values: Any, **more: Any) -> Any:
        calls[0] += 1
        if calls[0] == at:
            raise OSError(28, "No space left on device")
        return real(*values, **more)

    for at in (1, 4, 12):
        calls[0] = 0
        monkeypatch.setattr(os, name, failing)
        code = package(bare, "--output", str(made.parent))
        monkeypatch.setattr(os, name, real)
        if calls[0] < at:
            break
        assert code == 2
        assert everything(made) == before
    assert package(bare) == 0


def test_a_file_that_is_saved_meanwhile_stops_the_call(
    package: Callable[..., int],
    made: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    real = os.fsync

    def saved(file: int) -> None:
        real(file)
        (made / "README.md").write_text("saved just now\n")

    monkeypatch.setattr(os, "fsync", saved)
    before = everything(made)
    assert package(WIDER) == 2
    assert "changed while this was at work" in capsys.readouterr().err
    assert everything(made) == {**before, "README.md": b"saved just now\n"}


KILLED = """
import os, sys
from action_assistant.cli import main
real, left = os.replace, [int(sys.argv[1])]
def replace(*values, **more):
    if left[0] == 0:
        os._exit(9)
    left[0] -= 1
    real(*values, **more)
os.replace = replace
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize("steps", range(0, 8, 2))
def test_a_call_that_was_killed_is_finished_by_the_next(
    package: Callable[..., int], made: Path, tmp_path: Path, steps: int
) -> None:
    edit(made / "README.md", "The work belongs", "Own words.\n\nThe work belongs")
    edit(made / "package.xml", "TODO: license", "BSD-3-Clause")
    assert package(WIDER, "--check") == 1
    command = ["package", str(tmp_path / "given.json"), "--output", str(tmp_path / "out")]
    ended = subprocess.run([sys.executable, "-c", KILLED, str(steps), *command], check=False)
    assert ended.returncode == 9
    edit(made / "README.md", "Own words.", "Own words, edited since.")
    assert package(WIDER) == 0
    assert package(WIDER, "--check") == 0
    assert "Own words, edited since." in (made / "README.md").read_text()
    assert "| opening | numbers |" in (made / "README.md").read_text()
    assert (made / "README.md").read_text().count("| fast |") == 1
    assert "BSD-3-Clause" in (made / "package.xml").read_text()
    assert "Opens it wide." in (made / "package.xml").read_text()
