"""Errors that colcon printed are shown at the actions of the library. The logs are colcon's own
words (colcon-core 0.20, g++ 12.2, CMake 3.25), recorded."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from action_assistant.commands.builds import errors_of, last_builds, of_actions
from action_assistant.errors import CannotStart
from support.product import Product, running

EVENTS = """\
[0.000000] (-) TimerEvent: {}
[0.000114] (kitchen) JobQueued: {'identifier': 'kitchen', 'dependencies': OrderedDict()}
[0.000124] (kitchen) JobStarted: {'identifier': 'kitchen'}
[0.495790] (broken) JobEnded: {'identifier': 'broken', 'rc': 1}
[1.116251] (kitchen) JobEnded: {'identifier': 'kitchen', 'rc': 2}
[1.219480] (wave) JobEnded: {'identifier': 'wave', 'rc': 0}
[1.319480] (halted) JobEnded: {'identifier': 'halted', 'rc': 'SIGINT'}
[1.523777] (-) EventReactorShutdown: {}
"""
COMPILER = """\
WS/src/kitchen/src/drive.cpp: In member function ‘virtual bool drive_action::Drive::onRun()’:
WS/src/kitchen/src/drive.cpp:25:5: error: ‘nonsense_here’ was not declared in this scope
   25 |     nonsense_here("Running", getName());
      |     ^~~~~~~~~~~~~
gmake[2]: *** [CMakeFiles/drive.dir/build.make:76: CMakeFiles/drive.dir/src/drive.cpp.o] Error 1
gmake[1]: *** [CMakeFiles/Makefile2:83: CMakeFiles/drive.dir/all] Error 2
gmake: *** [Makefile:91: all] Error 2
"""
CMAKE = """\
CMake Error at CMakeLists.txt:3 (find_package):
  By not providing "Findnothing_like_it.cmake" in CMAKE_MODULE_PATH this
  project has asked CMake to find a package configuration file provided by
  "nothing_like_it", but CMake did not find one.

  Add the installation prefix of "nothing_like_it" to CMAKE_PREFIX_PATH.


"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace after a build of four packages."""
    files = {
        "log/latest_build/events.log": EVENTS,
        "log/latest_build/kitchen/stderr.log": COMPILER,
        "log/latest_build/broken/stderr.log": CMAKE,
    }
    described = {"kitchen": ("Drive", "LookAt"), "broken": ("Lift",), "wave": ("Wave",)}
    for package, actions in described.items():
        cache = f"CMAKE_HOME_DIRECTORY:INTERNAL=WS/src/{package}\n"
        files[f"build/{package}/CMakeCache.txt"] = cache
        for name in actions:
            text = f'{{"name": "{name}", "type": "sync"}}'
            files[f"src/{package}/{name.lower()}.umrf.json"] = text
    for path, text in files.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text.replace("WS", str(tmp_path)))
    return tmp_path


def test_each_package_of_the_last_build_is_told_with_its_end_and_its_errors(
    workspace: Path,
) -> None:
    builds = {each.package: each for each in last_builds(workspace)}
    assert {name: each.ended_well for name, each in builds.items()} == {
        "broken": False,
        "kitchen": False,
        "wave": True,
        "halted": False,
    }
    (error,) = builds["kitchen"].errors
    assert (error.file, error.line, error.column) == ("src/drive.cpp", 25, 5)
    assert error.message == "‘nonsense_here’ was not declared in this scope"
    (error,) = builds["broken"].errors
    assert (error.file, error.line, error.column) == ("CMakeLists.txt", 3, None)
    assert error.message.endswith('"nothing_like_it" to CMAKE_PREFIX_PATH.')
    assert builds["halted"].errors[0].message == "colcon wrote nothing about it."


def test_an_error_in_a_file_of_one_action_is_that_actions_and_any_other_every_ones(
    workspace: Path,
) -> None:
    found = {each.action: each for build in last_builds(workspace) for each in of_actions(build)}
    assert {name: len(each.errors) for name, each in found.items()} == {
        "Drive": 1,
        "LookAt": 0,
        "Lift": 1,
        "Wave": 0,
    }


def test_words_that_are_no_known_error_are_told_as_they_end() -> None:
    (error,) = errors_of("one\n\n  ld: cannot find -lthing\ncollect2: 1\n", None)
    assert error.message == "one ld: cannot find -lthing collect2: 1"
    assert error.file == ""


def test_a_folder_without_a_build_is_told_how_to_get_one(tmp_path: Path) -> None:
    with pytest.raises(CannotStart, match="colcon build"):
        last_builds(tmp_path)


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("builds") / "data") as found:
        yield found


def test_the_library_keeps_what_was_told_last(product: Product, workspace: Path) -> None:
    answer = product.cli("import", str(workspace / "src"))
    assert answer.returncode == 0, answer.stderr
    answer = product.cli("builds", str(workspace))
    assert answer.returncode == 1
    assert "Drive: src/drive.cpp:25:5: ‘nonsense_here’ was not declared" in answer.stdout
    assert "LookAt: not built, for errors of others" in answer.stdout
    assert "Wave: built." in answer.stdout
    drive = told(product, "Drive")
    assert (drive["package"], drive["ended_well"]) == ("kitchen", False)
    assert drive["errors"][0]["line"] == 25
    assert told(product, "Wave")["ended_well"] is True

    log = workspace / "log/latest_build/events.log"
    log.write_text(log.read_text().replace("'rc': 2", "'rc': 0"))
    product.cli("builds", str(workspace))
    assert told(product, "Drive")["ended_well"] is True


def told(product: Product, name: str) -> dict[str, Any]:
    with product.editor() as editor:
        listed = editor.get("/api/actions").json()
        (document,) = [each["document"] for each in listed if each["name"] == name]
        return dict(editor.get(f"/api/actions/{document}/build").json()["build"])
