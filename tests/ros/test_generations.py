"""Engines of another generation of temoto_msgs are recognised, on both sides of the wire."""

import os
import select
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.runner.links.port import NotSent
from ros.test_doctor import doctor, registered
from ros.test_ros2_link import answering, placed, robot

ROOT = Path(__file__).parents[2]
#: The generation before March 2025, as far as it differs or is needed.
OLDER = {
    "msg/UmrfGraphStart.msg": "string umrf_graph_name\nbool name_match_required\n"
    "string[] targets\nstring umrf_graph_json\ntemoto_msgs/UmrfGraphDiff[] umrf_graph_diffs\n",
    "msg/UmrfGraphDiff.msg": 'string ADD="add"\nstring SUBTRACT="subtract"\n'
    "string operation\nstring umrf_json\n",
    "srv/UmrfGraphGet.srv": "---\nstring[] umrf_jsons\nstring[] graph_jsons_indexed\n"
    "string[] graph_jsons_running\n",
}

pytestmark = [
    pytest.mark.skipif(
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE" not in os.environ,
        reason="messages are built with the wheels of `make ros`",
    ),
    pytest.mark.long,
    pytest.mark.timeout(300),  # a compiler shares two cores with other tests
]


@pytest.fixture(scope="module")
def older(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install the older generation of the messages, built as ours is, and return its prefix."""
    source, prefix = tmp_path_factory.mktemp("temoto_msgs"), tmp_path_factory.mktemp("older")
    package = ROOT / "ros" / "temoto_msgs"
    (source / "package.xml").write_bytes((package / "package.xml").read_bytes())
    rules = (package / "CMakeLists.txt").read_text()
    start, end = rules.index("  msg/"), rules.index(")\n\nament_export")
    names = "".join(f"  {name}\n" for name in OLDER)
    (source / "CMakeLists.txt").write_text(rules[:start] + names + rules[end:])
    for name, text in OLDER.items():
        (source / name).parent.mkdir(exist_ok=True)
        (source / name).write_text(text)
    subprocess.run(
        [ROOT / "scripts" / "build-messages", sys.prefix, source, prefix], check=True, timeout=280
    )
    return prefix


@pytest.fixture
def with_older(older: Path) -> dict[str, str]:
    """An environment in which the older generation comes first, as in a sourced workspace."""
    packages = Path(sysconfig.get_path("purelib")).relative_to(sys.prefix)
    return {
        **os.environ,
        "PYTHONPATH": str(older / packages),
        "LD_LIBRARY_PATH": f"{older / 'lib'}:{os.environ.get('LD_LIBRARY_PATH', '')}",
    }


@pytest.fixture
def older_engine(domain: int, with_older: dict[str, str]) -> "Iterator[subprocess.Popen[bytes]]":
    """An engine in a process of its own, up."""
    command = [sys.executable, Path(__file__).with_name("older_engine.py"), str(domain)]
    with subprocess.Popen(command, env=with_older, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            assert b"umrf_graph_diffs" in process.stdout.readline()
            yield process
        finally:
            process.kill()


async def test_an_engine_of_the_older_generation_gets_no_start_and_the_reason_is_told(
    domain: int, older_engine: "subprocess.Popen[bytes]"
) -> None:
    async with robot(domain) as link:
        await answering(link)
        assert link.standing.generation == "older"
        with pytest.raises(NotSent, match="another generation"):
            await link.start(placed())
        await anyio.sleep(0.3)
        assert older_engine.stdout is not None
        assert not select.select([older_engine.stdout], [], [], 0)[0]


@pytest.mark.usefixtures("older_engine")
def test_doctor_names_the_generation_of_a_registered_robot(domain: int, tmp_path: Path) -> None:
    code, found = doctor(registered(tmp_path, [{"name": "David", "domain": domain}]), domain)
    assert (code, found["David"]["code"]) == (1, "robot-older")
    assert "March 2025" in found["David"]["remedy"]


def test_a_workspace_of_the_older_generation_is_refused_with_a_sentence(
    with_older: dict[str, str],
) -> None:
    question = (
        "from action_assistant.runner.links.ros2.availability import why_not; print(why_not())"
    )
    answer = subprocess.run(
        [sys.executable, "-c", question], env=with_older, capture_output=True, text=True, check=True
    )
    assert "are of another generation" in answer.stdout
    assert "umrf_graph_diffs" in answer.stdout
    assert len(answer.stdout.splitlines()) == 1
