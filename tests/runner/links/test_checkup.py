"""What `doctor` says of memory that nodes cannot share."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from action_assistant.runner.links.ros2 import checkup
from action_assistant.runner.links.ros2.checkup import shared_memory

NOBODY = 54_321  # an id that no file of accounts names, as those of containers


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives files to others")
def test_shared_memory_of_a_container_whose_user_has_no_name_here_is_told_by_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkup, "_SHM", tmp_path)
    (tmp_path / "fastrtps_port7411").touch()
    (tmp_path / "fastrtps_ended").symlink_to(tmp_path / "gone")
    os.chown(tmp_path / "fastrtps_port7411", NOBODY, NOBODY)
    (told,) = shared_memory({})
    assert told.code == "shared-memory-users"
    assert f"user {NOBODY} runs nodes of Fast DDS too." in told.message


def test_nobodys_memory_is_nothing_to_tell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkup, "_SHM", tmp_path)
    (tmp_path / "fastrtps_port7411").touch()
    assert shared_memory({}) == []


def test_a_container_with_memory_of_its_own_is_told_from_one_that_shares_the_hosts() -> None:
    look = (
        "from action_assistant.runner.links.ros2.checkup import shared_memory;"
        "print([each.code for each in shared_memory({})])"
    )

    def inside(source: str) -> str:
        """What is said where engines of containers have mounted memory from this source."""
        mount = f'mount -t tmpfs -o size=64m {source} /dev/shm && exec "$0" -c "$1"'
        command = ["unshare", "--mount", "sh", "-c", mount, sys.executable, look]
        answer = subprocess.run(command, capture_output=True, text=True, check=False)
        if answer.returncode:
            pytest.skip("mounting a small file system needs root")
        return answer.stdout.strip()

    assert inside("shm") == "['shared-memory-apart']"
    assert inside("tmpfs") == "[]"
