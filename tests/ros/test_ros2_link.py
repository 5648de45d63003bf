"""The link to robots over real rclpy, with an engine that does what each test says."""

import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import anyio
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from temoto_msgs.msg import UmrfGraphFeedback, UmrfGraphStart
from temoto_msgs.srv import UmrfGraphGet

from action_assistant.runner.emulator.messages import NODE
from action_assistant.runner.links.port import (
    EngineChanged,
    EngineLog,
    Feedback,
    ForeignCommand,
    Link,
    NoAnswer,
    NotSent,
    Order,
    Registration,
    Report,
)
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.runner.links.ros2.reach import Ros2
from action_assistant.runner.links.unreachable import UnreachableLink
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from ros.echo_engine import EchoEngine, graph_text
from runner.harness import sequence
from support.waiting import wait_until


def clock_us() -> int:
    return time.time_ns() // 1000


@contextmanager
def engine(domain: int, **options: Any) -> Iterator[EchoEngine]:
    made = EchoEngine(domain, **options)
    try:
        yield made
    finally:
        made.end()


@contextmanager
def listener(domain: int, name: str) -> Iterator[Node]:
    """A node that hears starts and does nothing else."""
    context = Context()
    context.init(domain_id=domain)
    node = rclpy.create_node(name, context=context)
    node.create_subscription(UmrfGraphStart, "/umrf_graph_start", lambda _: None, 1)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


@asynccontextmanager
async def reach() -> AsyncIterator[Ros2]:
    found = ros2_reach(clock_us)
    assert isinstance(found, Ros2), found
    try:
        yield found
    finally:
        await found.aclose()


@asynccontextmanager
async def robot(domain: int, name: str = "robot", **more: Any) -> AsyncIterator[Link]:
    """A link that is kept going."""
    async with reach() as ros2, anyio.create_task_group() as tasks:
        link = ros2.link(Registration(name=name, domain=domain, **more), PINNED)
        tasks.start_soon(link.run)
        yield link
        tasks.cancel_scope.cancel()


async def answering(link: Link) -> None:
    await wait_until(lambda: link.standing.state == "answering")


def placed(name: str = "patrol", run: str = "r1") -> Order:
    graph = sequence(name)
    return Order(run=run, graph=graph, umrf=codec.write(graph, codec.Stamp("g", "v", run)))


async def test_a_start_reaches_the_engine_once_whole_and_addressed(domain: int) -> None:
    with engine(domain) as node:
        async with robot(domain) as link:
            await answering(link)
            order = placed()
            await link.start(order)
            await wait_until(lambda: node.heard)
            await anyio.sleep(0.3)
            (message,) = node.commands("start")
            assert message.umrf_graph_json == order.umrf
            assert (message.umrf_graph_name, list(message.targets)) == ("patrol", ["robot"])


async def test_every_command_arrives_on_the_topic_of_this_engine(domain: int) -> None:
    with engine(domain) as node:
        async with robot(domain) as link:
            await answering(link)
            await link.pause("patrol")
            await link.resume("patrol")
            await link.modify(placed(), continue_from="Work_0")
            await link.stop("patrol")
            await wait_until(lambda: len(node.heard) == 4)
            (modify,) = node.commands("modify")
            assert modify.continue_from == "Work_0"
            assert {kind for _, kind, _ in node.heard} == {"pause", "resume", "modify", "stop"}
            assert all(list(each.targets) == ["robot"] for _, _, each in node.heard)


async def test_an_answer_holds_what_the_engine_holds_under_our_identity(domain: int) -> None:
    with engine(domain) as node:
        node.running = [graph_text(), graph_text("other", "FINISHED", None, Work="FINISHED")]
        async with robot(domain) as link:
            await answering(link)
            before = clock_us()
            answer = await link.get()
            assert before <= answer.asked_at <= answer.at <= clock_us()
            ours, other = answer.graphs
            assert (ours.graph, ours.run, ours.source, ours.active) == ("patrol", "r1", "get", True)
            assert ours.nodes == {"Work_0": "RUNNING"}
            assert (other.run, other.active) == (None, False)
            assert answer.texts["patrol"] == node.running[0]
            assert answer.known_actions == ('{"name": "Work"}',)


async def test_stops_of_many_graphs_leave_one_by_one_and_those_of_one_graph_together(
    domain: int,
) -> None:
    with engine(domain) as node:
        async with reach() as ros2, anyio.create_task_group() as tasks:
            links = [ros2.link(Registration(name=name, domain=domain), PINNED) for name in "ab"]
            for link in links:
                tasks.start_soon(link.run)
            for link in links:
                await answering(link)
            async with anyio.create_task_group() as stops:
                for graph in ("one", "two", "three"):
                    for link in links:
                        stops.start_soon(link.stop, graph)
            await wait_until(lambda: len(node.heard) == 3)
            tasks.cancel_scope.cancel()
        got = {each.umrf_graph_name: list(each.targets) for each in node.commands("stop")}
        assert got == {"one": ["a", "b"], "two": ["a", "b"], "three": ["a", "b"]}


async def test_a_newest_first_batch_is_told_oldest_first(domain: int) -> None:
    heard: list[Report] = []
    with engine(domain) as node:
        async with robot(domain) as link:
            with link.listen(heard.append):
                await answering(link)
                node.say(
                    graph_text(Work="FINISHED"),
                    "no graph at all",
                    graph_text(Work="RUNNING"),
                    graph_text(Work="UNINITIALIZED"),
                )
                await wait_until(lambda: any(isinstance(each, Feedback) for each in heard))
            (told,) = [each for each in heard if isinstance(each, Feedback)]
            assert [each.nodes["Work_0"] for each in told.snapshots] == [
                "UNINITIALIZED",
                "RUNNING",
                "FINISHED",
            ]
            assert told.actor == "robot"


async def test_commands_of_others_are_told_and_our_own_are_not(domain: int) -> None:
    heard: list[Report] = []
    with engine(domain, depth=10) as node, engine(domain, namespace="laptop") as other:
        async with robot(domain, get_service="/umrf_graph_get") as link:
            with link.listen(heard.append):
                await answering(link)
                await link.stop("patrol")
                order = placed()
                await link.start(order)
                await wait_until(lambda: len(node.heard) == 2)
                other.speak()
                await wait_until(lambda: link.standing.others == 1)
                other.publish("stop", umrf_graph_name="patrol", targets=["robot"])
                other.publish("start", umrf_graph_json=order.umrf, targets=["robot", "x"])
                other.publish("stop", umrf_graph_name="patrol", targets=["somebody-else"])
                foreign = lambda: [each for each in heard if isinstance(each, ForeignCommand)]  # noqa: E731
                await wait_until(lambda: len(foreign()) >= 2 and len(node.heard) == 5)
                await anyio.sleep(0.2)
            told = {each.command: each for each in foreign()}
            assert len(foreign()) == 2
            assert told["stop"].graph == "patrol"
            assert (told["start"].graph, told["start"].umrf) == ("patrol", order.umrf)
            assert told["start"].targets == ("robot", "x")


async def test_lines_of_the_engines_log_come_with_the_graph_they_name(domain: int) -> None:
    heard: list[Report] = []
    with engine(domain) as node:
        async with robot(domain) as link:
            with link.listen(heard.append):
                await answering(link)
                node.log("Received request to start UMRF graph: patrol")
                node.log("Graph 'patrol' finished.")
                node.log("The Action Engine is initialized.")
                lines = lambda: [each for each in heard if isinstance(each, EngineLog)]  # noqa: E731
                await wait_until(lambda: len(lines()) == 3)
            assert [each.graph for each in lines()] == ["patrol", "patrol", None]


async def test_nobody_there_is_said_at_once_and_without_waiting(domain: int) -> None:
    async with robot(domain) as link:
        await wait_until(lambda: "Nobody answers" in link.standing.why)
        assert link.standing.state == "gone"
        with pytest.raises(NoAnswer, match=f"Nobody answers on umrf_graph_get on domain {domain}"):
            await link.get()
        with pytest.raises(NotSent, match="nobody listens"):
            await link.start(placed())
        with pytest.raises(NotSent, match="nobody listens"):
            await link.stop("patrol")


async def test_two_engines_on_one_path_prove_nothing(domain: int) -> None:
    with engine(domain) as node:
        async with robot(domain) as link:
            await answering(link)
            with engine(domain):
                await wait_until(lambda: link.standing.servers == 2)
                asked = node.asked
                with pytest.raises(NoAnswer, match="2 engines answer"):
                    await link.get()
                assert node.asked == asked
                assert link.standing.state == "busy"
            await wait_until(lambda: link.standing.servers == 1)
            await link.get()


async def test_a_node_that_hears_starts_and_does_not_serve_may_be_a_second_engine(
    domain: int,
) -> None:
    """One by one: what listens as an engine, what only watches, and what serves in the end."""
    with engine(domain), engine(domain, namespace="r2"):
        async with robot(domain) as link:
            await answering(link)
            await wait_until(lambda: link.standing.newcomers == ())
            with listener(domain, NODE) as rising:
                await wait_until(lambda: link.standing.newcomers == (NODE,))
                assert (link.standing.servers, (await link.get()).graphs) == (1, ())
                assert f"{NODE} hears starts and does not answer gets" in link.standing.doubt
                rising.create_service(UmrfGraphGet, "umrf_graph_get", lambda _, it: it)
                await wait_until(lambda: link.standing.servers == 2)
            await wait_until(lambda: link.standing.doubt == "")
            with listener(domain, "recorder") as recorder:
                await wait_until(lambda: link.standing.newcomers == ("recorder",))
                recorder.create_subscription(
                    UmrfGraphFeedback, "/umrf_graph_feedback", lambda _: None, 1
                )
                await wait_until(lambda: link.standing.doubt == "")


async def test_engines_with_paths_of_their_own_are_told_apart(domain: int) -> None:
    with engine(domain, namespace="r1") as one, engine(domain, namespace="r2") as two:
        one.running, two.running = [graph_text("first")], [graph_text("second")]
        async with robot(domain, "one", get_service="/r1/umrf_graph_get") as link:
            heard: list[Report] = []
            with link.listen(heard.append):
                await answering(link)
                await wait_until(lambda: len(link.standing.listeners) and link._domain)
                for _ in range(20):
                    assert [each.graph for each in (await link.get()).graphs] == ["first"]
                one.log("Graph 'first' finished.")
                two.log("Graph 'second' finished.")
                two.say(graph_text("second", run="r9"), actor="two")
                one.say(graph_text("first", run="r1"), actor="one")
                await wait_until(
                    lambda: (
                        any(isinstance(each, Feedback) for each in heard)
                        and any(isinstance(each, EngineLog) for each in heard)
                    )
                )
            graphs = {
                shown.graph
                for each in heard
                if isinstance(each, Feedback)
                for shown in each.snapshots
            }
            assert graphs == {"first"}
            assert {each.graph for each in heard if isinstance(each, EngineLog)} == {"first"}


async def test_an_engine_that_was_replaced_is_told_as_restarted(domain: int) -> None:
    heard: list[Report] = []
    async with robot(domain) as link:
        with link.listen(heard.append):
            with engine(domain):
                await answering(link)
                first = (await link.get()).incarnation
            await wait_until(lambda: link.standing.state == "gone")
            with engine(domain):
                await answering(link)
                assert (await link.get()).incarnation != first
        states = [each.state for each in heard if isinstance(each, EngineChanged)]
        assert "restarted" in states
        assert states.index("gone") < states.index("restarted") < len(states) - 1
        assert states[-1] == "answering"


async def test_a_frozen_engine_is_busy_and_late_answers_go_nowhere(domain: int) -> None:
    with engine(domain) as node:
        async with robot(domain) as link:
            await answering(link)
            node.holding.set()
            with anyio.move_on_after(1.2) as asked:
                await link.get()
            assert asked.cancelled_caught
            await wait_until(lambda: link.standing.state == "busy")
            node.running = [graph_text()]
            node.holding.clear()
            assert [each.graph for each in (await link.get()).graphs] == ["patrol"]
            assert link.standing.state == "answering"


@pytest.fixture
def process(domain: int) -> Iterator[subprocess.Popen[bytes]]:
    """An engine in a process of its own, up."""
    program = Path(__file__).with_name("echo_engine.py")
    command = [sys.executable, program, str(domain)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as started:
        try:
            assert started.stdout is not None
            assert started.stdout.readline() == b"up\n"
            yield started
        finally:
            started.kill()


async def test_a_killed_engine_is_never_said_to_answer(
    domain: int, process: "subprocess.Popen[bytes]"
) -> None:
    async with robot(domain) as link:
        await answering(link)
        process.kill()
        with pytest.raises(TimeoutError):
            with anyio.fail_after(1.2):
                await link.get()
        await wait_until(lambda: link.standing.state == "busy")


async def test_another_middleware_is_refused_with_what_to_do(domain: int) -> None:
    async with reach() as ros2:
        link = ros2.link(
            Registration(name="robot", domain=domain, rmw="rmw_cyclonedds_cpp"), PINNED
        )
        assert isinstance(link, UnreachableLink)
        with pytest.raises(NotSent, match="RMW_IMPLEMENTATION"):
            await link.start(placed())


async def test_candidates_are_what_answers_as_engines_do(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    with engine(domain, namespace="r1") as node:
        async with reach() as ros2:
            (found,) = await ros2.candidates()
            assert (found.get_service, found.domain, found.actor) == (
                "/r1/umrf_graph_get",
                domain,
                "",
            )
            assert (found.generation, found.problem, found.rmw) == ("current", "", ros2.rmw)
            node.say(graph_text(), actor="David")
            with anyio.fail_after(10):
                while (await ros2.candidates())[0].actor != "David":  # noqa: ASYNC110 as above
                    await anyio.sleep(0.05)


async def test_stop_does_not_wait_for_megabytes_of_feedback(domain: int) -> None:
    """A feedback message of a large graph is read on the domain's thread."""
    nodes = {f"Work{number}": "RUNNING" for number in range(200)}
    large = graph_text("large", **nodes)
    with engine(domain) as node:
        async with robot(domain) as link:
            await answering(link)
            seen: list[Report] = []
            with link.listen(seen.append):
                node.say(*[large] * 20)
                node.say(*[large] * 20)
                await link.stop("large")
                await wait_until(lambda: node.commands("stop"))
                await wait_until(lambda: sum(isinstance(each, Feedback) for each in seen) == 2)
            assert all(len(each.snapshots) == 20 for each in seen if isinstance(each, Feedback))


async def test_closing_leaves_no_thread_behind(domain: int) -> None:
    with engine(domain):
        async with robot(domain) as link:
            await answering(link)
            assert any(each.name == f"ros2-{domain}" for each in threading.enumerate())
        assert not any(each.name == f"ros2-{domain}" for each in threading.enumerate())
