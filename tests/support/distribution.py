"""ROS 2 as a distribution lays it out, made of the wheels of `make ros`: a prefix with a `setup.bash`,
over it a colcon workspace with its own `temoto_msgs`, and packages on PYTHONPATH that do harm.

    python tests/support/distribution.py .venv-ros /opt/ros/jazzy /root/workspace/install
"""

import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

_INDEX = "share/ament_index/resource_index"
#: Code of other packages on PYTHONPATH that fails on import, as an older version would.
_HARM = 'raise ImportError(f"{__name__} of the sourced workspace was imported")\n'
_HARMFUL = ("litestar", "msgspec", "uvicorn", "httpx", "pytest_of_the_workspace")
_PLUGIN = "[pytest11]\nworkspace = pytest_of_the_workspace\n"


@dataclass(frozen=True)
class Distribution:
    """The folders of a laid-out ROS 2. `workspace` is what colcon calls the install base."""

    prefix: Path
    workspace: Path

    @property
    def setup(self) -> Path:
        """The file that a shell sources."""
        return self.workspace / "setup.bash"

    def sourced(self, environ: dict[str, str]) -> dict[str, str]:
        """An environment after sourcing."""
        shown = subprocess.run(
            ["bash", "-c", f". '{self.setup}' && env -0"],
            env=environ,
            capture_output=True,
            check=True,
        )
        pairs = (line.partition(b"=") for line in shown.stdout.split(b"\0") if line)
        return {name.decode(): value.decode() for name, _, value in pairs}


def lay_out(wheels: Path, prefix: Path, workspace: Path, *, numpy: bool = False) -> Distribution:
    """A prefix and a workspace over it. With `numpy`, the wheels' numpy lies in the prefix, as in an
    environment that brings its own; without, it is the system's (`python3-numpy`), as on Ubuntu."""
    (packages,) = (wheels / "lib").glob("python3.*/site-packages")
    python = packages.parent.name
    names = {each.name for each in (wheels / _INDEX / "packages").iterdir()}
    _copy(wheels, prefix, names - {"temoto_msgs"}, python)
    _copy(wheels, workspace / "temoto_msgs", {"temoto_msgs"}, python)
    bundled = sorted(each.name for each in packages.glob("ros_*.libs"))
    for name in bundled:
        shutil.copytree(packages / name, prefix / "lib" / name, dirs_exist_ok=True)
    theirs = prefix / "lib" / python / "site-packages"
    for name in ("numpy", "numpy.libs") if numpy else ():
        shutil.copytree(packages / name, theirs / name)
    for name in _HARMFUL:
        (theirs / f"{name}.py").write_text(_HARM)
    plugin = theirs / "pytest_of_the_workspace-1.0.dist-info"
    plugin.mkdir()
    (plugin / "METADATA").write_text("Metadata-Version: 2.1\nName: workspace\nVersion: 1.0\n")
    (plugin / "entry_points.txt").write_text(_PLUGIN)
    made = Distribution(prefix=prefix, workspace=workspace)
    (prefix / "setup.bash").write_text(_exports(prefix, python, bundled))
    made.setup.write_text(
        f'. "{prefix}/setup.bash"\n'
        f'export COLCON_PREFIX_PATH="{workspace}"\n'
        + _exports(workspace / "temoto_msgs", python, [])
    )
    return made


def _copy(wheels: Path, prefix: Path, names: set[str], python: str) -> None:
    """These packages: their libraries, modules, share folders and marks in the ament index."""
    modules = Path("lib") / python / "site-packages"
    (prefix / modules).mkdir(parents=True)
    own = "temoto_msgs"
    for library in (wheels / "lib").glob("lib*.so*"):
        if (own in library.name) == (own in names):
            shutil.copy(library, prefix / "lib" / library.name, follow_symlinks=False)
    for name in sorted(names):
        for folder in (modules / name, Path("share") / name):
            if (wheels / folder).is_dir():
                shutil.copytree(wheels / folder, prefix / folder, symlinks=True)
    for mark in (wheels / _INDEX).glob("*/*"):
        if mark.name in names or (mark.name not in _all(wheels) and own not in names):
            (prefix / _INDEX / mark.parent.name).mkdir(parents=True, exist_ok=True)
            shutil.copy(mark, prefix / _INDEX / mark.parent.name)


def _all(wheels: Path) -> set[str]:
    return {each.name for each in (wheels / _INDEX / "packages").iterdir()}


def _exports(prefix: Path, python: str, bundled: list[str]) -> str:
    """Return the lines that sourcing one prefix runs; each puts its part before the present
    value."""
    libraries = ":".join([f"{prefix}/lib", *(f"{prefix}/lib/{name}" for name in bundled)])
    added = {
        "AMENT_PREFIX_PATH": f"{prefix}",
        "CMAKE_PREFIX_PATH": f"{prefix}",
        "LD_LIBRARY_PATH": libraries,
        "PATH": f"{prefix}/bin",
        "PYTHONPATH": f"{prefix}/lib/{python}/site-packages",
    }
    lines = [f'export {name}="{value}${{{name}:+:${name}}}"' for name, value in added.items()]
    return "\n".join([*lines, "export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3", ""])


if __name__ == "__main__":
    wheels_, prefix_, workspace_ = map(Path, sys.argv[1:])
    sys.stdout.write(f"{lay_out(wheels_.resolve(), prefix_, workspace_).setup}\n")
