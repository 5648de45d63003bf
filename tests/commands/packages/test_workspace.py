"""`package --into`: the source folder of a colcon workspace."""

from collections.abc import Callable
from pathlib import Path

import pytest

from action_assistant.cli import main
from commands.packages.trees import ONE, everything


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """The source folder of an empty workspace."""
    folder = tmp_path / "ws/src"
    folder.mkdir(parents=True)
    return folder


def manifest(folder: Path, name: str) -> Path:
    """A package of this name in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "package.xml"
    path.write_text(f"<package><name> {name} </name></package>")
    return path


def test_packages_are_written_into_a_workspace_and_anew(
    package: Callable[..., int], source: Path
) -> None:
    manifest(source / "others/look", "look")
    assert package(ONE, "--into", str(source)) == 0
    assert (source / "open_gripper/package.xml").exists()
    assert package({**ONE, "description": "New."}, "--into", str(source)) == 0
    assert package({**ONE, "description": "New."}, "--into", str(source), "--check") == 0


def test_a_package_of_the_same_name_elsewhere_is_named_and_nothing_is_written(
    package: Callable[..., int], source: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest(source / "others/gripper", "open_gripper")
    before = everything(source)
    for options in ((), ("--check",), ("--diff",)):
        assert package(ONE, "--into", str(source), *options) == 1
        told = capsys.readouterr()
        assert f"{source}/others/gripper: is a package “open_gripper” already" in told.err
        assert told.out == ""
    assert everything(source) == before


def test_a_package_behind_a_link_counts_as_colcon_finds_it(
    package: Callable[..., int], source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest(tmp_path / "elsewhere/gripper", "open_gripper")
    (source / "linked").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere/round").symlink_to(source)
    assert package(ONE, "--into", str(source)) == 1
    assert f"{source}/linked/gripper" in capsys.readouterr().err


@pytest.mark.parametrize("marker", ["COLCON_IGNORE", "AMENT_IGNORE"])
def test_packages_where_colcon_does_not_look_do_not_count(
    package: Callable[..., int], source: Path, marker: str
) -> None:
    manifest(source / "old/gripper", "open_gripper")
    (source / "old" / marker).touch()
    manifest(source / ".hidden", "open_gripper")
    manifest(source / "whole/example", "open_gripper")
    manifest(source / "whole", "whole")
    manifest(source / "broken", "x").write_text("<package><name>open_gripper")
    assert package(ONE, "--into", str(source)) == 0


@pytest.mark.parametrize("there", ["", "file", "package.xml", "COLCON_IGNORE"])
def test_a_folder_that_is_no_source_folder_is_wrong_use(
    package: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str], there: str
) -> None:
    place = tmp_path / "ws"
    if there == "file":
        place.touch()
    elif there:
        place.mkdir()
        (place / there).touch()
    before = everything(tmp_path)
    assert package(ONE, "--into", str(place)) == 2
    told = capsys.readouterr().err
    assert str(place) in told
    assert ("is no folder" if there in {"", "file"} else there) in told
    assert {**before, "given.json": b""}.keys() == everything(tmp_path).keys()


def test_exactly_one_of_output_and_into_is_required(tmp_path: Path) -> None:
    for options in ([], ["--output", str(tmp_path), "--into", str(tmp_path)]):
        with pytest.raises(SystemExit) as ended:
            main(["package", "x.json", *options])
        assert ended.value.code == 2
