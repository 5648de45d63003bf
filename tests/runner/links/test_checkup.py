"""What `doctor` says of the environment, where that is odd."""

import os
from pathlib import Path

import pytest

from action_assistant.runner.links.ros2 import checkup
from action_assistant.runner.links.ros2.checkup import environment

NOBODY = 54_321  # an id that no file of accounts names, as those of containers


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives files to others")
def test_shared_memory_of_a_container_whose_user_has_no_name_here_is_told_by_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkup, "_SHM", tmp_path)
    (tmp_path / "fastrtps_port7411").touch()
    (tmp_path / "fastrtps_ended").symlink_to(tmp_path / "gone")
    os.chown(tmp_path / "fastrtps_port7411", NOBODY, NOBODY)
    told = [each.what for each in environment({}) if each.topic == "shared memory"]
    assert f"User {NOBODY} runs nodes of Fast DDS too." in told[-1]


def test_nobodys_memory_is_nothing_to_tell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkup, "_SHM", tmp_path)
    (tmp_path / "fastrtps_port7411").touch()
    assert not [each for each in environment({}) if "Fast DDS too" in each.what]
