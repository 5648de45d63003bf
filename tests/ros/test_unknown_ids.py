"""Over a middleware whose ids do not tell processes apart nothing is proven, and everything says so."""

import hashlib

import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.links.port import NotSent
from action_assistant.runner.links.ros2 import checkup
from action_assistant.runner.links.ros2 import domain as domains
from action_assistant.runner.links.ros2.ros_values import Endpoint
from ros.test_ros2_link import answering, clock_us, engine, placed, robot
from support.waiting import wait_until


@pytest.fixture
def hashed_ids(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give each endpoint an id of its own, of which processes share nothing, as Zenoh does."""
    told = domains._endpoint

    def hashed(info: object) -> Endpoint:
        end = told(info)
        gid = hashlib.sha256(end.gid.encode()).hexdigest()[:32]
        return msgspec.structs.replace(end, gid=gid, process=gid[:24])

    monkeypatch.setattr(domains, "_endpoint", hashed)


async def test_the_ids_of_this_middleware_tell_processes_apart(domain: int) -> None:
    with engine(domain):
        async with robot(domain) as link:
            await answering(link)
            assert link.standing.doubt == ""


@pytest.mark.usefixtures("hashed_ids")
async def test_an_answer_proves_nothing_a_start_is_refused_and_a_stop_leaves(domain: int) -> None:
    with engine(domain) as node:
        async with robot(domain) as link:
            await answering(link)
            assert "which process an answer comes from" in link.standing.doubt
            with pytest.raises(NotSent, match="does not show whether"):
                await link.start(placed())
            with pytest.raises(NotSent, match="does not show whether"):
                await link.stop("patrol")
            await wait_until(lambda: node.commands("stop"))
            assert node.commands("start") == []


@pytest.mark.usefixtures("hashed_ids")
async def test_the_doctor_says_that_nothing_is_proven_there(domain: int) -> None:
    with engine(domain):
        named = checkup.Registration(name="robot", domain=domain)
        found = {each.where: each for each in await checkup.look([named], clock_us)}
        assert found["robot"].code == "robot-unproven"
        assert "no Stop can be proven" in found["robot"].message
