"""A colcon workspace with one package of an action, built some time ago."""

import os
from pathlib import Path
from typing import Final

BUILT: Final = 1_000_000_000


def workspace(folder: Path, *, merged: bool = False, package: str = "lift_box") -> Path:
    """A workspace as colcon leaves it, with one package; its prefix."""
    source, build = folder / "src" / package, folder / "build" / package
    prefix = folder / "install" if merged else folder / "install" / package
    for path in (source / "src", source / "test", build, prefix / "lib"):
        path.mkdir(parents=True)
    (build / "CMakeCache.txt").write_text(f"CMAKE_HOME_DIRECTORY:INTERNAL={source}\n")
    for path in (
        build / f"lib{package}.so",
        prefix / "lib" / f"lib{package}.so",
        source / "src" / f"{package}.cpp",
        source / "test" / f"{package}_test.cpp",
        source / f"{package}.umrf.json",
        source / "CMakeLists.txt",
    ):
        path.write_text("")
        os.utime(path, (BUILT, BUILT))
    return prefix


def changed(folder: Path, file: str, package: str = "lift_box") -> None:
    """Touch a file of the source, as after a change."""
    os.utime(folder / "src" / package / file, (BUILT + 1, BUILT + 1))
