"""The threads of an engine's process prove that no code of a run goes on or can begin, or prove nothing."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import anyio
import msgspec
import pytest

from action_assistant.runner.emulator.messages import EngineTraits
from action_assistant.runner.execution import monitor
from action_assistant.runner.execution.run_changes import RunChanges
from action_assistant.runner.links import engine_process
from action_assistant.runner.links.engine_process import EngineProcess, Thread, process, threads
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import Answer, Standing
from action_assistant.runner.runs.events import Published, Requested
from action_assistant.runner.runs.fold import begin, follow
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.runner.stop.engine_threads import EngineThreads
from action_assistant.runner.stop.loading import LoadingTimes
from runner.fake_link import FakeLink
from runner.harness import ANN, BEN, clock_us, order, sequence, until, virtual
from runner.robots_in_network import OTHER, STUBBORN, RobotsInNetwork, asked, shown

ENGINE = EngineProcess("boot", "pid:[1]", 42, 1)
BEFORE = frozenset({Thread(1, 10), Thread(2, 10)})
ACTION = Thread(3, 20)
#: One thread that waits for the graph, and one that runs an action.
OF_THE_RUN = frozenset({Thread(4, 20), ACTION})
_HERE = process(os.getpid())
#: Begins a thread for each line that says so, and ends one for each other line.
PROGRAM = """
import sys, threading
ends = []
for line in sys.stdin:
    if line.startswith("begin"):
        ends.append(threading.Event())
        threading.Thread(target=ends[-1].wait, daemon=True).start()
    else:
        ends.pop().set()
    print("done", flush=True)
"""


class Kernel:
    """Threads as a test says; `seen` is false where they cannot be seen."""

    def __init__(self) -> None:
        self.threads = set(BEFORE)
        self.seen = True

    def __call__(self, _: EngineProcess) -> frozenset[Thread] | None:
        return frozenset(self.threads) if self.seen else None


def started() -> tuple[Kernel, EngineThreads]:
    """A run whose first action moves, in a thread of its own."""
    kernel = Kernel()
    watched = EngineThreads(kernel)
    watched.starts(ENGINE)
    kernel.threads |= OF_THE_RUN
    watched.see_moving()
    return kernel, watched


def test_a_run_is_over_when_no_thread_is_left_that_began_since_its_start() -> None:
    kernel, watched = started()
    assert not watched.have_ended(ENGINE)
    kernel.threads -= OF_THE_RUN
    assert watched.have_ended(ENGINE)
    kernel.threads.add(Thread(3, 30))  # the number is used again: the next action loads
    assert not watched.have_ended(ENGINE)


def test_a_thread_from_before_the_start_may_end_and_its_number_be_used_again() -> None:
    kernel, watched = started()
    kernel.threads -= {*OF_THE_RUN, Thread(2, 10)}
    assert watched.have_ended(ENGINE)
    kernel.threads.add(Thread(2, 30))
    assert not watched.have_ended(ENGINE)


def test_an_engine_that_was_never_seen_to_begin_a_thread_for_an_action_proves_nothing() -> None:
    kernel = Kernel()
    watched = EngineThreads(kernel)
    watched.starts(ENGINE)
    watched.see_moving()
    assert not watched.have_ended(ENGINE)


def test_the_thread_that_waits_for_a_graph_does_not_show_that_actions_have_threads() -> None:
    kernel = Kernel()
    watched = EngineThreads(kernel)
    watched.starts(ENGINE)
    kernel.threads.add(Thread(4, 20))
    watched.see_moving()
    kernel.threads.discard(Thread(4, 20))
    assert not watched.have_ended(ENGINE)


def test_a_process_that_is_not_seen_or_another_one_proves_nothing() -> None:
    kernel, watched = started()
    kernel.threads -= OF_THE_RUN
    assert not watched.have_ended(None)
    assert not watched.have_ended(msgspec.structs.replace(ENGINE, started=2))
    kernel.seen = False
    assert not watched.have_ended(ENGINE)
    unseen = EngineThreads(kernel)
    unseen.starts(ENGINE)
    kernel.seen = True
    unseen.see_moving()
    assert not unseen.have_ended(ENGINE)
    assert not EngineThreads(kernel).have_ended(ENGINE)  # after a restart of the runner


def test_a_thread_that_begins_between_two_looks_at_the_list_is_seen() -> None:
    kernel, watched = started()
    kernel.threads -= OF_THE_RUN
    lists = [set(BEFORE), {*BEFORE, Thread(4, 40)}]
    watched._threads_of = lambda _: frozenset(lists.pop(0))
    assert not watched.have_ended(ENGINE)


@pytest.fixture
def node(request: pytest.FixtureRequest) -> Iterator[subprocess.Popen[str]]:
    """A process that calls itself as an engine's node does, or as the test says."""
    name = getattr(request, "param", "/opt/ros/lib/action_engine_node")
    with subprocess.Popen(
        [name, "-c", PROGRAM],
        executable=sys.executable,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as child:
        yield child
        child.kill()


def _told(child: subprocess.Popen[str], line: str) -> None:
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdin.write(f"{line}\n")
    child.stdin.flush()
    assert child.stdout.readline() == "done\n"


def test_threads_of_a_real_process_are_told_apart(node: subprocess.Popen[str]) -> None:
    known = process(node.pid)
    assert known is not None
    before = threads(known)
    assert before is not None
    assert {each.number for each in before} == {node.pid}
    watched = EngineThreads()
    watched.starts(known)
    _told(node, "begin")
    _told(node, "begin")
    watched.see_moving()
    assert not watched.have_ended(known)
    _told(node, "end")
    assert not watched.have_ended(known)
    _told(node, "end")
    while not watched.have_ended(known):  # the kernel takes a moment to let go of a thread
        pass
    assert threads(msgspec.structs.replace(known, started=known.started - 1)) is None
    assert threads(msgspec.structs.replace(known, boot="another")) is None
    node.kill()
    node.wait()
    assert threads(known) is None


def test_a_list_in_which_a_thread_ends_says_nothing(
    node: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread may have begun the next action's right before, after the kernel's list was read."""
    known = process(node.pid)
    assert known is not None
    _told(node, "begin")
    began = engine_process._began
    looks = 0

    def ends_when_listed(folder: Path) -> int | None:
        nonlocal looks
        looks += 1
        return None if looks in vanishing else began(folder)

    monkeypatch.setattr(engine_process, "_began", ends_when_listed)
    vanishing = range(1, 10_000)
    assert threads(known) is None
    looks, vanishing = 0, range(1, 2)  # in the first list only: the second one counts
    seen = threads(known)
    assert seen is not None
    assert len(seen) > 1


def test_a_list_that_is_shorter_than_the_kernel_counts_says_nothing(
    node: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel ends its list at a thread that ends right then, and lists none of those behind it."""
    known = process(node.pid)
    assert known is not None
    _told(node, "begin")
    monkeypatch.setattr(Path, "iterdir", lambda folder: iter([folder / str(node.pid)]))
    assert threads(known) is None


@pytest.mark.parametrize("node", ["python", "/opt/action_engine_node/python3"], indirect=True)
def test_a_program_that_is_not_the_engines_own_node_tells_nothing(
    node: subprocess.Popen[str],
) -> None:
    known = process(node.pid)
    assert known is not None
    assert threads(known) is None


@virtual
async def test_a_stop_is_proven_by_the_threads_where_an_action_may_still_be_loading(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All feedback is lost, so the answers leave open whether the second action was triggered."""
    kernel = Kernel()
    monkeypatch.setattr(monitor, "EngineThreads", lambda: EngineThreads(kernel))
    here = RobotsInNetwork(5, quirks=EngineTraits(loading_ms=1.0), script={"*": [{"never": True}]})
    here.network.show = lambda *_: None
    monkeypatch.setattr(FakeLink, "standing", property(_with_process(FakeLink.standing)))
    async with here.played() as control:
        started = await control.start(order(sequence("patrol", 2), engine="David"), ANN)
        kernel.threads |= OF_THE_RUN
        run = started.run.id
        await until(lambda: control.open[run].run.active != ())
        await anyio.sleep(1.5)
        await control.stop(run, BEN)
        await anyio.sleep(5)
        assert shown(control, run).proof_at is None
        assert shown(control, run).unconfirmed.startswith("Work_1 may still be loading")
        kernel.threads -= OF_THE_RUN
        await until(lambda: run not in control.open)
        ended = await control.find(run)
        assert (ended.state, ended.loading, ended.at_rest) == ("stopped", "", None)
        assert ended.proof_at is not None


@virtual
async def test_an_action_that_did_not_obey_is_over_when_its_thread_has_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kernel = Kernel()
    monkeypatch.setattr(monitor, "EngineThreads", lambda: EngineThreads(kernel))
    here = RobotsInNetwork(5, quirks=EngineTraits(loading_ms=1.0), script=STUBBORN)
    monkeypatch.setattr(FakeLink, "standing", property(_with_process(FakeLink.standing)))
    async with here.played() as control:
        run = (await control.start(asked(), ANN)).run.id
        kernel.threads |= OF_THE_RUN
        await until(lambda: control.open[run].run.active != ())
        await anyio.sleep(1.5)
        await control.stop(run, BEN)
        await until(lambda: bool(control.open[run].run.unconfirmed))
        await anyio.sleep(30)
        assert run in control.open
        kernel.threads -= OF_THE_RUN
        await until(lambda: run not in control.open)
        ended = await control.find(run)
        assert (ended.state, ended.proof_at) == ("error", None)
        assert ended.at_rest is not None
        assert ended.at_rest.how.startswith("No thread that the engine began for this run is left")
        await control.start(order(OTHER, engine="David"), ANN)  # nothing is in its way any more


def _with_process(plain: Any) -> Any:
    """Let a link say which process of this computer its engine is."""
    return lambda link: msgspec.structs.replace(plain.fget(link), process=_HERE)


class TwoRuns:
    """A run of `patrol` on an engine that still holds, in ERROR, a sub-graph of an earlier run of it.

    The action of that sub-graph has not obeyed a Stop, and its thread goes on. It began before the start
    of this run.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.kernel = Kernel()
        monkeypatch.setattr(monitor, "EngineThreads", lambda: EngineThreads(self.kernel))
        at = clock_us()
        self.run = begin(
            Requested(
                at=at,
                run="second",
                number=2,
                request_id="request",
                author=ANN,
                graph="graph",
                graph_name="patrol",
                version="version",
                digest="digest",
                engine="David",
                simulated=False,
                actions={"Work_0": "aaaaaaaaaaaa", "Sub_0": "bbbbbbbbbbbb"},
                umrf="{}",
                laps=None,
            )
        )
        doubts = DoubtfulErrors(reached=False)
        times = LoadingTimes()
        self.monitor = monitor.Monitor(
            self.run, exact=False, clock_us=clock_us, doubts=doubts, loading_times=times
        )
        self.monitor.starts("{}", ENGINE)
        self.kernel.threads |= OF_THE_RUN
        self.run = follow(self.run, Published(at, "life", ENGINE))

    def look(self, state: str, work: str) -> None:
        """Take in one answer of the engine."""
        asked_at = clock_us()

        def snapshot(graph: str, state: str, nodes: dict[str, str], run: str | None) -> Snapshot:
            return Snapshot(
                at=clock_us(), asked_at=asked_at, graph=graph, state=state, nodes=nodes, run=run
            )

        own = snapshot("patrol", state, {"Work_0": work, "Sub_0": "UNINITIALIZED"}, "second")
        left = snapshot("patrol__Sub__0", "ERROR", {"Reach_0": "ERROR"}, None)
        answer = Answer(
            asked_at=asked_at,
            at=clock_us(),
            incarnation="life",
            graphs=(own, left),
            texts={},
            known_actions=(),
            known_graphs=(),
        )
        standing = Standing(state="answering", incarnation="life", servers=1, process=ENGINE)
        changes = RunChanges(self.run, clock_us)
        self.monitor.answered(changes, standing, answer, self.monitor.begin_query())
        self.run = changes.run


@virtual
async def test_threads_say_nothing_of_a_graph_that_an_earlier_run_has_left_in_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    two = TwoRuns(monkeypatch)
    two.look("RUNNING", "RUNNING")
    assert two.run.unconfirmed
    two.kernel.threads -= OF_THE_RUN
    for _ in range(8):
        two.look("STOPPED", "FINISHED")
        await anyio.sleep(0.5)
    assert two.run.end is None
