"""Variables that a sourced ROS 2 gives to the runner, and to nobody else.

A workspace is found by AMENT_PREFIX_PATH, not by PYTHONPATH: that would put whatever lies beside
rclpy before our own packages, in the editor, too. Only what stands in a prefix's package index comes
in, after everything of ours; and numpy, which messages need, of the distribution that they were built
with. Imports nothing but the standard library, since it runs before anything else does.
"""

import importlib.machinery
import os
import re
import site
import sys
from collections.abc import Mapping, Sequence
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Final

_INDEX: Final = Path("share", "ament_index", "resource_index", "packages")
_PYTHON: Final = f"python{sys.version_info.major}.{sys.version_info.minor}"
#: The folders with the packages of one Python below a prefix, in distributions and by colcon.
_PACKAGES: Final = (
    f"lib/{_PYTHON}/site-packages",
    f"local/lib/{_PYTHON}/dist-packages",
    f"lib/{_PYTHON}/dist-packages",
    "lib/python3/dist-packages",
)
#: Modules outside of ROS that rclpy and messages import, and files that only one Python version reads.
_BESIDE: Final[Mapping[str, tuple[str, ...]]] = {
    "numpy": ("core/_multiarray_umath", "_core/_multiarray_umath"),
    "yaml": (),
}
_SOURCE: Final = re.compile(r"^CMAKE_HOME_DIRECTORY:INTERNAL=(.+)$", re.MULTILINE)
_CACHE: Final = 4_000_000  # bytes of CMake's cache that are read
_EXTENSION: Final = "_rclpy_pybind11"


def hide() -> None:
    """Remove from this process, and all that it starts, the folders that PYTHONPATH put before this
    program's packages. Folders that Python searches anyway stay, after the others; so does the
    folder of this program."""
    named = os.environ.pop("PYTHONPATH", "")
    listed = {_real(each) for each in named.split(os.pathsep) if named}  # "" is where we are
    program = Path(__file__).resolve().parents[1]
    if program in listed:
        listed.remove(program)
        os.environ["PYTHONPATH"] = str(program)
    anyway = [each for each in site.getsitepackages() if _real(each) in listed]
    sys.path[:] = [*(each for each in sys.path if _real(each) not in listed), *anyway]


def offer(environ: Mapping[str, str] = os.environ) -> None:
    """Let this process import rclpy and messages of the ROS workspace that `environ` names, if
    there is one."""
    workspace = Workspace.of(environ)
    if workspace.prefixes and workspace not in sys.meta_path:
        sys.meta_path.append(workspace)


class Workspace:
    """The install folders (prefixes) of a sourced ROS 2, nearest first; empty if none is sourced.
    It finds modules by duck typing, since importing `importlib.abc` takes longer than all else in
    this module."""

    def __init__(self, prefixes: tuple[Path, ...], system: tuple[Path, ...]) -> None:
        self.prefixes = prefixes
        self._system = system

    @classmethod
    def of(
        cls,
        environ: Mapping[str, str],
        system: tuple[Path, ...] = (Path("/usr"), Path(sys.base_prefix)),
    ) -> "Workspace":
        """Return the workspace that an environment names. `system` lists folders where numpy of the
        distribution may be; it is preferred to other copies, since the messages were compiled
        against it."""
        named = environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        prefixes = tuple(each for each in map(Path, named) if each.is_absolute())
        return cls(prefixes, system)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Workspace) and other.prefixes == self.prefixes

    def __hash__(self) -> int:
        return hash(self.prefixes)

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of the module `fullname` in the workspace, or None if it is not there or
        has a dot in its name, which is left to the finder of its package. The other parameters are
        those of import finders and are not used."""
        if "." in fullname or not self.prefixes:
            return None
        prefixes = [each for each in self.prefixes if (each / _INDEX / fullname).exists()]
        if not prefixes and fullname in _BESIDE:
            prefixes = [*self.prefixes, *self._system]
        for folder in (str(each / below) for each in prefixes for below in _PACKAGES):
            found = PathFinder.find_spec(fullname, [folder])
            if found is not None and found.origin is not None and _fits(found):
                return found
        return None

    def rclpy(self) -> ModuleSpec | None:
        """Return the spec of the workspace's rclpy if it was built for this Python; else None."""
        found = self.find_spec("rclpy")
        return found if found is not None and rclpy_fits(found) else None

    def other_python(self) -> str:
        """Return a sentence that says why the workspace's rclpy does not fit this Python; "" if it
        fits or the workspace has no rclpy."""
        if self.rclpy() is not None:
            return ""
        for prefix in self.prefixes:
            homes = (
                each for base in ("lib", "local/lib") for each in (prefix / base).glob("python3.*")
            )
            for home in homes:
                if any(home.glob("*-packages/rclpy")):
                    return _for_another(prefix, home.name.removeprefix("python"))
        return ""


def rclpy_fits(rclpy: ModuleSpec) -> bool:
    """Return whether a found rclpy was built for this Python."""
    return any(
        Path(folder, f"{_EXTENSION}{suffix}").exists()
        for folder in rclpy.submodule_search_locations or ()
        for suffix in importlib.machinery.EXTENSION_SUFFIXES
    )


def prefix_of(file: str) -> str:
    """Return, for messages to people, the prefix of the workspace that holds the file of a module;
    the folder of the file if no prefix does."""
    for each in Path(file).parents:
        if (each / _INDEX).is_dir():
            return str(each)
    return str(Path(file).parent)


def source_of(build: Path) -> Path | None:
    """Return the source folder of the package whose build folder (`build/PACKAGE` of a colcon
    workspace) is `build`, read from the cache of CMake there; None if the cache cannot be read or
    does not name the source folder."""
    try:
        with (build / "CMakeCache.txt").open("rb") as file:
            cache = file.read(_CACHE).decode(errors="replace")
    except OSError:
        return None
    found = _SOURCE.search(cache)
    return None if found is None else Path(found[1])


def _for_another(prefix: Path, version: str) -> str:
    return (
        f"ROS 2 in {prefix} is for Python {version}, and this one is {_PYTHON.removeprefix('python')} "
        f"({sys.executable}): install this program with python{version}, as `rm -rf .venv; make setup "
        f"PYTHON=python{version}` does in a checkout."
    )


def _fits(found: ModuleSpec) -> bool:
    """Return whether the compiled parts of a found package that is not of ROS itself, such as
    numpy, fit this Python. A package without such parts fits."""
    built = _BESIDE.get(found.name, ())
    return not built or any(
        Path(folder, f"{name}{suffix}").exists()
        for folder in found.submodule_search_locations or ()
        for name in built
        for suffix in importlib.machinery.EXTENSION_SUFFIXES
    )


def _real(folder: str) -> Path:
    return Path(folder).resolve()
