"""The runner takes from a sourced ROS 2 only the packages that it asks for and that fit its
Python."""

import importlib.machinery
import os
import subprocess
import sys
from pathlib import Path

import pytest

from action_assistant import interpreter
from action_assistant.interpreter import for_runner, rclpy_fits
from action_assistant.ros_workspace import Workspace

HERE = f"python{sys.version_info.major}.{sys.version_info.minor}"
ENDING = importlib.machinery.EXTENSION_SUFFIXES[0]
OURS = ("litestar", "msgspec", "uvicorn")


def prefix(folder: Path, *packages: str, python: str = HERE, site: str = "site-packages") -> Path:
    """An install prefix in whose index these packages are, with an extension for that Python."""
    for name in packages:
        home = folder / "lib" / python / site / name
        home.mkdir(parents=True)
        (home / "__init__.py").write_text(f"PLACE = {str(folder)!r}\n")
        index = folder / "share" / "ament_index" / "resource_index" / "packages"
        index.mkdir(parents=True, exist_ok=True)
        (index / name).touch()
    rclpy = folder / "lib" / python / site / "rclpy"
    if rclpy.is_dir():
        tag = python.replace("python", "").replace(".", "")
        ending = ENDING if python == HERE else f".cpython-{tag}-x86_64-linux-gnu.so"
        (rclpy / f"_rclpy_pybind11{ending}").touch()
    return folder


def environ(*prefixes: Path, python: str = HERE) -> dict[str, str]:
    return {
        "AMENT_PREFIX_PATH": os.pathsep.join(map(str, prefixes)),
        "PYTHONPATH": os.pathsep.join(f"{each}/lib/{python}/site-packages" for each in prefixes),
        "ROS_DISTRO": "jazzy",
    }


def run(code: str, added: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Return the output of one of our processes, started in this environment."""
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **added},
        capture_output=True,
        text=True,
        check=False,
    )


def test_packages_of_a_sourced_environment_never_stand_before_ours(tmp_path: Path) -> None:
    harmful = tmp_path / "lib" / HERE / "site-packages"
    harmful.mkdir(parents=True)
    for name in OURS:
        (harmful / f"{name}.py").write_text("raise ImportError('of the workspace')")
    shown = subprocess.run(
        [sys.executable, "-m", "action_assistant", "--version"],
        env={**os.environ, **environ(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (shown.returncode, shown.stderr) == (0, "")


def test_child_processes_do_not_see_pythonpath_either(tmp_path: Path) -> None:
    shown = run(
        "import os, sys; from action_assistant import ros_workspace; ros_workspace.hide();"
        "print(os.environ.get('PYTHONPATH'), any('hostile' in each for each in sys.path))",
        {"PYTHONPATH": str(tmp_path / "hostile")},
    )
    assert shown.stdout == "None False\n"


def test_the_program_itself_may_come_by_pythonpath(tmp_path: Path) -> None:
    server = str(Path(interpreter.__file__).parents[1])
    shown = run(
        "import os, sys; from action_assistant import ros_workspace; ros_workspace.hide();"
        f"print(os.environ.get('PYTHONPATH') == {server!r}, {server!r} in sys.path)",
        {"PYTHONPATH": os.pathsep.join([server, str(tmp_path)])},
    )
    assert shown.stdout == "True True\n"


def test_the_overlay_comes_before_what_it_lies_over(tmp_path: Path) -> None:
    under = prefix(tmp_path / "under", "temoto_msgs", "builtin_interfaces")
    over = prefix(tmp_path / "over", "temoto_msgs")
    workspace = Workspace.of(environ(over, under))
    found = workspace.find_spec("temoto_msgs")
    below = workspace.find_spec("builtin_interfaces")
    assert found is not None
    assert below is not None
    assert str(found.origin).startswith(str(over))
    assert str(below.origin).startswith(str(under))


def test_only_packages_of_ros_come_in(tmp_path: Path) -> None:
    sourced = prefix(tmp_path, "temoto_msgs")
    (tmp_path / "lib" / HERE / "site-packages" / "pydantic.py").touch()
    workspace = Workspace.of(environ(sourced))
    assert workspace.find_spec("pydantic") is None, "litestar would take it, whatever its version"
    assert workspace.find_spec("temoto_msgs.msg") is None, "parts of a package find themselves"
    assert Workspace.of({}).find_spec("temoto_msgs") is None


@pytest.mark.parametrize("site", ["site-packages", "dist-packages"])
def test_packages_lie_where_distributions_put_them(tmp_path: Path, site: str) -> None:
    assert Workspace.of(environ(prefix(tmp_path, "rclpy", site=site))).find_spec("rclpy")


def test_numpy_is_the_distributions_if_it_was_built_for_this_python(tmp_path: Path) -> None:
    packages = tmp_path / "usr" / "lib" / "python3" / "dist-packages"
    (packages / "numpy" / "core").mkdir(parents=True)
    (packages / "numpy" / "__init__.py").touch()
    workspace = Workspace.of(environ(prefix(tmp_path / "ros", "rclpy")), system=(tmp_path / "usr",))
    assert workspace.find_spec("numpy") is None, "its extension is for another Python"
    (packages / "numpy" / "core" / f"_multiarray_umath{ENDING}").touch()
    found = workspace.find_spec("numpy")
    assert found is not None
    assert str(found.origin).startswith(str(packages))
    assert Workspace.of({}, system=(tmp_path / "usr",)).find_spec("numpy") is None


@pytest.mark.skipif(rclpy_fits({}), reason="this Python speaks ROS 2 by itself")
def test_a_workspace_comes_before_the_environment_of_make_ros(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from test_interpreter import wheels_of

    wheels = wheels_of(tmp_path, b"rclpy==1\n")
    monkeypatch.setattr(interpreter.paths, "wheels", lambda: wheels)
    asked = environ(prefix(tmp_path / "ros", "rclpy"))
    assert for_runner(asked).origin == "this"
    assert for_runner({}).origin == "wheels"


@pytest.mark.skipif(rclpy_fits({}), reason="this Python speaks ROS 2 by itself")
def test_a_workspace_for_another_python_is_named_with_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(interpreter.paths, "wheels", lambda: None)
    asked = environ(prefix(tmp_path / "ros", "rclpy", python="python3.99"), python="python3.99")
    found = for_runner(asked)
    assert found.origin == "this"
    assert f"{tmp_path / 'ros'} is for Python 3.99" in found.remark
    assert "python3.99" in found.remark
