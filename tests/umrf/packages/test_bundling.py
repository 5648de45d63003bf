"""One package of several actions: each is built and installed as if it were alone."""

import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given, settings

from action_assistant.umrf.packages.bases import GenerationBase
from action_assistant.umrf.packages.bundling import bundle_files, is_of_bundle
from action_assistant.umrf.packages.generating import ImpossiblePackage, package_files
from action_assistant.umrf.packages.regenerating import regenerated
from support.doses import examples
from umrf.packages.sources import compile_errors, described, hostile_texts, laid_out, layout_faults
from umrf.packages.test_cmake import FOUND, cmake

DRIVE = described(name="Drive", input_parameters={"speed": {"pvf_type": "number"}})
LOOK = described(name="LookAt", output_parameters={"seen": {"pvf_type": "bool"}})
TURN = described(name="Turn")


def test_each_action_has_the_files_that_it_would_have_alone() -> None:
    files = bundle_files("kitchen", (LOOK, DRIVE))
    for action in (DRIVE, LOOK):
        alone = package_files(action)
        own = {path for path in alone if "/" in path or path.endswith(".umrf.json")}
        assert {path: files[path] for path in own} == {path: alone[path] for path in own}
    assert all(map(is_of_bundle, files))
    assert bundle_files("kitchen", (DRIVE, LOOK)) == files


@pytest.mark.long
def test_the_sources_of_all_compile_side_by_side_and_are_laid_out(tmp_path: Path) -> None:
    package = laid_out(bundle_files("kitchen", (DRIVE, LOOK)), tmp_path)
    assert compile_errors(package) == ""
    assert layout_faults([str(path) for path in package.rglob("*.[ch]pp")]) == ""


@pytest.mark.long
def test_cmake_builds_and_installs_all_libraries_and_descriptions(tmp_path: Path) -> None:
    """The build has stubs for ROS 2 and the engine, which CI does not have."""
    if shutil.which("g++") is None:
        pytest.skip("g++ is not here")
    package = laid_out(bundle_files("kitchen", (DRIVE, LOOK)), tmp_path / "package")
    modules = laid_out({name: each.encode() for name, each in FOUND.items()}, tmp_path / "found")
    install = tmp_path / "install"
    options = [f"-DCMAKE_MODULE_PATH={modules}", f"-DCMAKE_INSTALL_PREFIX={install}"]
    cmake("-S", str(package), "-B", "build", *options, folder=tmp_path)
    cmake("--build", "build", folder=tmp_path)
    cmake("--install", "build", folder=tmp_path)
    assert {path.relative_to(install).as_posix() for path in install.rglob("*.*")} == {
        "lib/libdrive.so",
        "lib/liblook_at.so",
        "share/kitchen/drive.umrf.json",
        "share/kitchen/look_at.umrf.json",
    }


@pytest.mark.parametrize(
    ("package", "reason"),
    [
        ("drive", "is what the package of “Drive” alone is called"),
        ("Kitchen", "ROS takes small letters"),
        ("../up", "ROS takes small letters"),
        ("", "ROS takes small letters"),
        ("test", "have for themselves"),
        ("x" * 101, "it may be 100"),
    ],
)
def test_a_name_that_no_package_can_have_is_refused(package: str, reason: str) -> None:
    with pytest.raises(ImpossiblePackage, match=reason):
        bundle_files(package, (DRIVE,))


def test_a_refusal_of_one_action_refuses_the_package() -> None:
    with pytest.raises(ImpossiblePackage) as refused:
        bundle_files("kitchen", (DRIVE, described(name="class"), described(name="drive")))
    assert {each.place for each in refused.value.refusals} == {"class", "drive"}
    with pytest.raises(ImpossiblePackage, match="ament"):
        bundle_files("kitchen", (described(name="KitchenUninstall"),))


def settled(files: Mapping[str, bytes]) -> GenerationBase:
    return GenerationBase(dict(files))


def test_an_action_that_comes_or_goes_leaves_the_edits_of_the_others() -> None:
    before = bundle_files("kitchen", (DRIVE, LOOK))
    edited = before["CMakeLists.txt"].replace(b"ament_package()", b"own()\nament_package()")
    there = {**before, "CMakeLists.txt": edited, "src/drive.cpp": b"// mine\n"}

    more = regenerated(
        "kitchen", bundle_files("kitchen", (DRIVE, LOOK, TURN)), there, settled(before)
    )
    assert (more.conflicts, more.removals, more.kept) == ({}, (), ())
    assert "src/turn.cpp" in more.writes
    assert b"  turn\n" in more.writes["CMakeLists.txt"]
    assert b"own()" in more.writes["CMakeLists.txt"]

    fewer = regenerated("kitchen", bundle_files("kitchen", (TURN,)), there, settled(before))
    assert fewer.kept == ("src/drive.cpp",)
    assert "src/look_at.cpp" in fewer.removals
    assert "include/drive/temoto_action.hpp" in fewer.removals


def test_a_base_names_nothing_that_no_generation_makes() -> None:
    now = bundle_files("kitchen", (DRIVE,))
    paths = ("../up.umrf.json", "notes.txt", "src/sub/x.cpp", "include/x/other.hpp")
    mine = dict.fromkeys(paths, b"mine")
    found = regenerated("kitchen", now, {**now, **mine}, settled({**now, **mine}))
    assert found.removals == ()


@given(text=hostile_texts)
@settings(max_examples=examples(100), deadline=None)
def test_no_description_of_an_action_changes_the_commands_of_the_package(text: str) -> None:
    odd = bundle_files("kitchen", (described(name="Drive", description=f"x{text}"), LOOK))
    plain = bundle_files("kitchen", (described(name="Drive", description="x"), LOOK))
    assert odd["CMakeLists.txt"] == plain["CMakeLists.txt"]
    assert odd["package.xml"] == plain["package.xml"]
