"""The real CMake reads a package with any description as text, and runs no command of it."""

import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings

from action_assistant.umrf.packages.escapes import visible
from action_assistant.umrf.packages.generating import package_files
from support.doses import examples
from umrf.packages.sources import HOSTILE, NATIVE, STUBS, described, hostile_texts, laid_out

#: Commands that act, each of which tells how many arguments it got instead.
TOLD = (
    "project", "find_package", "add_library", "target_compile_features", "target_include_directories",
    "target_link_libraries", "install", "ament_add_gtest", "ament_package", "execute_process",
)  # fmt: skip
RECORDING = "".join(
    f'function({command})\n  file(APPEND calls "{command} ${{ARGC}}\\n")\n'
    + ('  file(WRITE description "${ARGV2}")\n' if command == "project" else "")
    + "endfunction()\n"
    for command in TOLD
)
#: Files that `find_package` finds in place of ROS 2 and the engine.
FOUND = {
    "Findament_cmake.cmake": """
        function(ament_package)
          file(WRITE "${CMAKE_BINARY_DIR}/description" "${PROJECT_DESCRIPTION}")
        endfunction()
    """,
    "FindBoost.cmake": "",
    "Findtemoto_action_engine.cmake": f"""
        add_library(temoto_action_engine INTERFACE IMPORTED)
        target_include_directories(temoto_action_engine INTERFACE "{STUBS}")
    """,
    "Findtemoto_action_engine_ros2.cmake": "",
}


def cmake(*arguments: str, folder: Path) -> str:
    """Return the output of CMake; raises AssertionError if it fails."""
    if shutil.which("cmake") is None:
        pytest.skip("cmake is not here")
    clean = {name: value for name, value in os.environ.items() if not name.startswith("CMAKE")}
    done = subprocess.run(
        ["cmake", *arguments],
        cwd=folder,
        env=clean | {"HOME": "/home of somebody"},
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def seen(text: str) -> tuple[str, str]:
    """The calls that a package's CMakeLists.txt makes, and the description that CMake sees, where a
    description says this."""
    files = package_files(described(description=f"x{text}"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "script").write_bytes(
            RECORDING.encode() + b"set(BUILD_TESTING ON)\n" + files["CMakeLists.txt"]
        )
        assert cmake("-P", "script", folder=folder) == ""
        assert {each.name for each in folder.iterdir()} == {"script", "calls", "description"}
        return (folder / "calls").read_text(), (folder / "description").read_bytes().decode()


@cache
def harmless_calls() -> str:
    """The calls without anything odd in the description."""
    calls, description = seen(" and harmless")
    assert description == "x and harmless"
    assert "execute_process" not in calls
    assert set(TOLD) - {"execute_process"} == {line.split()[0] for line in calls.splitlines()}
    return calls


@pytest.mark.parametrize("text", [*HOSTILE, "".join(HOSTILE), "${HOME}", "$ENV{HOME}", "@HOME@"])
def test_cmake_reads_a_known_way_out_of_an_argument_as_text(text: str) -> None:
    assert seen(text) == (harmless_calls(), visible(f"x{text}".strip()))


@given(text=hostile_texts)
@settings(max_examples=examples(100), deadline=None)
def test_cmake_reads_any_description_as_text(text: str) -> None:
    assert seen(text) == (harmless_calls(), visible(f"x{text}".strip()))


@given(text=hostile_texts)
@settings(max_examples=examples(100), deadline=None)
def test_package_xml_has_the_description_as_text(text: str) -> None:
    action = described(description=f"x{text}")
    xml = ElementTree.fromstring(package_files(action)["package.xml"])
    assert xml.findtext("description") == visible(f"x{text}".strip())
    assert xml.findtext("name") == "ta_try"


@pytest.mark.turns
def test_cmake_builds_and_installs_the_library_and_the_description(tmp_path: Path) -> None:
    """The build has stubs for ROS 2 and the engine, which CI does not have."""
    if shutil.which("g++") is None:
        pytest.skip("g++ is not here")
    text = "".join(HOSTILE)
    parameters = {kind: {"pvf_type": kind} for kind in (*NATIVE, "any")}
    action = described(description=text, input_parameters=parameters, output_parameters=parameters)
    package = laid_out(package_files(action), tmp_path / "package")
    modules = laid_out({name: each.encode() for name, each in FOUND.items()}, tmp_path / "found")
    install = tmp_path / "install"
    options = [f"-DCMAKE_MODULE_PATH={modules}", f"-DCMAKE_INSTALL_PREFIX={install}"]
    cmake("-S", str(package), "-B", "build", *options, folder=tmp_path)
    cmake("--build", "build", folder=tmp_path)
    cmake("--install", "build", folder=tmp_path)
    assert (tmp_path / "build/description").read_text() == visible(text.strip())
    assert {path.relative_to(install).as_posix() for path in install.rglob("*.*")} == {
        "lib/libta_try.so",
        "share/ta_try/ta_try.umrf.json",
    }
    assert {each.name for each in tmp_path.iterdir()} == {"package", "found", "build", "install"}
