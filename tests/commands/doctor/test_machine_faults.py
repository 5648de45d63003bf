"""`doctor` on computers that are short of something, for real; and on a page that is not whole."""

import os
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from action_assistant import paths
from action_assistant.interpreter import VARIABLE, rclpy_fits
from support.doctor import asked, fault, faults

SHORT = ("sh", "-c", 'ulimit -n 256; exec "$0" "$@"')


def in_memory(mount: str) -> tuple[str, ...]:
    """Before a command: it sees another /dev/shm than everybody else."""
    return ("unshare", "--mount", "sh", "-c", f'{mount} && exec "$0" "$@"')


@pytest.fixture
def may_mount(small_disk: Callable[[str], Path]) -> None:
    """Skips where nothing can be mounted."""
    small_disk("1m")


def machine(data: Path, *before: str) -> list[str]:
    """The codes of what is wrong."""
    _, found = asked(data, "--only", "machine", "--port", "9", before=before)
    return [each["code"] for each in found]


def test_too_few_descriptors_are_named_with_their_number(data: Path) -> None:
    code, found = asked(data, "--only", "machine", "--port", "9", before=SHORT)
    assert (code, [each["code"] for each in found]) == (1, ["descriptors-few"])
    assert "256 files" in found[0]["message"]
    assert "LimitNOFILE" in found[0]["remedy"]


def test_missing_and_small_shared_memory_are_told_apart(data: Path, may_mount: None) -> None:
    nothing = in_memory("mount -t tmpfs -o ro tmpfs /dev/shm")
    assert machine(data, *nothing) == ["shared-memory-missing"]
    small = in_memory("mount -t tmpfs -o size=1m tmpfs /dev/shm")
    assert machine(data, *small) == ["shared-memory-small"]


def test_a_page_that_is_not_built_not_whole_or_of_other_sources_is_named(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page, sources = tmp_path / "dist", tmp_path / "src"
    monkeypatch.setattr(paths, "page", lambda: page)
    assert fault(data).code == "page-missing"
    shutil.copytree(Path(paths.__file__).parents[2] / "frontend" / "dist", page)
    sources.mkdir()
    (sources / "main.tsx").touch()
    monkeypatch.setattr(paths, "page_sources", lambda: sources)
    os.utime(page / "index.html", (time.time() + 60, time.time() + 60))
    assert faults(data) == []
    os.utime(sources / "main.tsx", (time.time() + 120, time.time() + 120))
    found = fault(data)
    assert found.code == "page-stale"
    assert "src/main.tsx" in found.message
    shutil.rmtree(page / "assets")
    assert fault(data).code == "page-missing"
    assert "assets/" in fault(data).message


@pytest.mark.long
@pytest.mark.skipif(rclpy_fits(), reason="this Python speaks ROS 2 by itself")
def test_a_missing_rclpy_matters_only_where_there_are_robots(data: Path, tmp_path: Path) -> None:
    without = {VARIABLE: sys.executable}
    assert asked(tmp_path / "none", "--only", "ros", **without) == (0, [])
    code, found = asked(data, "--only", "ros", **without)
    assert (code, found[0]["code"]) == (1, "rclpy-missing")
    assert found[0]["message"].startswith("Ada cannot be reached: rclpy is not there")


def test_a_python_of_the_runner_that_cannot_run_this_program_is_named(
    data: Path, tmp_path: Path
) -> None:
    program = tmp_path / "python"
    program.write_text("#!/bin/sh\necho No module named action_assistant >&2; exit 1\n")
    program.chmod(0o755)
    code, found = asked(data, "--only", "ros", **{VARIABLE: str(program)})
    assert (code, found[0]["code"]) == (1, "python-unusable")
    assert "No module named action_assistant" in found[0]["message"]
