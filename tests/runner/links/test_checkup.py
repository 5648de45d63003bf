"""`doctor` reports memory that nodes cannot share, and absent robots."""

import os
import subprocess
import sys
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.runner.links.hardware_stop import StopSignal
from action_assistant.runner.links.health import HealthSignal
from action_assistant.runner.links.port import Candidate, Registration, Sighting, Standing
from action_assistant.runner.links.ros2 import checkup
from action_assistant.runner.links.ros2.checkup import shared_memory
from action_assistant.system.diagnostics import Diagnostic
from action_assistant.umrf.facts import EngineFacts

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
        """Return the finding where engines of containers have mounted memory from this source."""
        mount = f'mount -t tmpfs -o size=64m {source} /dev/shm && exec "$0" -c "$1"'
        command = ["unshare", "--mount", "sh", "-c", mount, sys.executable, look]
        answer = subprocess.run(command, capture_output=True, text=True, check=False)
        if answer.returncode:
            pytest.skip("mounting a small file system needs root")
        return answer.stdout.strip()

    assert inside("shm") == "['shared-memory-apart']"
    assert inside("tmpfs") == "[]"


NOBODY_THERE = Standing(state="gone", why="Nobody answers.")


class Seen:
    """A reach that shows engines, none of which answers as a robot that is registered."""

    rmw = "rmw_fastrtps_cpp"

    def __init__(self, *candidates: Candidate, standing: Standing = NOBODY_THERE) -> None:
        self._candidates = candidates
        self._standing = standing

    def link(self, registration: Registration, facts: EngineFacts) -> Any:
        """A link to a robot of which no engine is seen, unless something else is said."""
        return Gone(self._standing)

    async def stop_signal(self, *_: object) -> StopSignal:
        """Return a signal that nobody writes."""
        return StopSignal()

    async def health_signal(self, *_: object) -> HealthSignal:
        """Return a signal that nobody writes."""
        return HealthSignal()

    async def sighting(self) -> Sighting:
        """The engines in sight, and that no other will come."""
        return Sighting(self._candidates, 0.0)

    async def candidates(self) -> tuple[Candidate, ...]:
        """The engines in sight."""
        return self._candidates

    async def aclose(self) -> None:
        """Let go."""


class Gone:
    """A link to a robot that is not there."""

    def __init__(self, standing: Standing) -> None:
        self.standing = standing

    async def run(self) -> None:
        """Run without any message."""

    def listen(self, hear: object) -> AbstractContextManager[None]:
        """Listen without hearing anything."""
        return nullcontext()


def looked(
    monkeypatch: pytest.MonkeyPatch,
    robots: int,
    *seen: Candidate,
    standing: Standing = NOBODY_THERE,
) -> list[Diagnostic]:
    """Return the findings about `robots` robots that are absent, or of another standing."""
    registered = [Registration(name=f"R{n}", domain=10 + n) for n in range(robots)]
    monkeypatch.setattr(checkup, "ros2_reach", lambda *_: Seen(*seen, standing=standing))
    monkeypatch.setattr(checkup, "_origin", lambda _: "here")
    monkeypatch.setattr(checkup, "_PATIENCE_S", 0.01)
    return anyio.run(checkup.look, registered, lambda: 0, {})


def engine(domain: int, actor: str = "") -> Candidate:
    path = "/umrf_graph_get"
    return Candidate(domain=domain, rmw="rmw_fastrtps_cpp", get_service=path, actor=actor)


def test_an_engine_without_a_name_is_told_once_however_many_robots_are_absent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = looked(monkeypatch, 33, engine(0))
    naming = [each for each in found if "domain 0" in each.where or "domain 0" in each.message]
    naming = [each for each in naming if each.severity != "fine"]
    assert [each.code for each in naming] == ["engine-unregistered"]
    assert naming[0].message.endswith("not seen: R0, R1, R2, R3, R4 and 28 more.")
    assert "--actor-name" in naming[0].remedy
    assert [each.code for each in found].count("robot-silent") == 33


def test_an_engine_that_says_its_name_is_told_with_that_robot_and_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = {each.where: each for each in looked(monkeypatch, 3, engine(0, "R1"), engine(1, "Eve"))}
    assert [found[f"R{n}"].code for n in range(3)] == [
        *("robot-silent", "robot-elsewhere"),
        "robot-silent",
    ]
    assert "one answers on domain 0 (/umrf_graph_get)" in found["R1"].message
    assert "says no name" not in "".join(each.message for each in found.values())


def test_a_single_absent_robot_is_named_with_an_engine_without_a_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = {each.where: each for each in looked(monkeypatch, 1, engine(0))}
    assert found["R0"].code == "robot-elsewhere"
    assert "says no name" not in found["/umrf_graph_get, domain 0"].message


def test_two_engines_of_one_robot_are_told_once_and_those_of_nobody_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    why = "2 engines answer on /umrf_graph_get."
    twins, strangers = (
        msgspec.structs.replace(engine(domain), servers=2, problem=why) for domain in (10, 11)
    )
    standing = Standing(state="silent", why=why, servers=2)
    found = looked(monkeypatch, 1, twins, strangers, standing=standing)
    told = [(each.code, each.where) for each in found if each.message == why]
    assert told == [("robot-silent", "R0"), ("engine-odd", "/umrf_graph_get, domain 11")]
