"""The live socket: everybody sees the same, and a Stop goes before everything."""

import json
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from socket import SHUT_RDWR
from typing import Any

import anyio
import pytest
from litestar import WebSocket
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from action_assistant.runner.api.live import Hub, Outbox, attend
from action_assistant.runner.api.view import EncodedStates
from action_assistant.runner.execution.start_checks import StartSources
from action_assistant.runner.runs.sight import HIDDEN_NAME, RunSight, names_seen
from action_assistant.web.auth.graph_rules import Rule
from action_assistant.web.auth.graph_seals import GraphSeals, RulesFile, Statement
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Person
from runner.harness import ANN, Harness, carousel, clock_us, order, sequence, virtual
from runner.process import RunnerProcess, over, started

ENDLESS = {"*": [{"never": True}]}
BUSY = {"*": [{"after_s": 0.0}]}


def messages(socket: ClientConnection) -> Iterator[dict[str, Any]]:
    for text in socket:
        yield json.loads(text)


def test_a_page_is_greeted_with_what_goes_on(process: RunnerProcess) -> None:
    with process.client() as client:
        run = started(client, order(sequence(), script=ENDLESS))
        with process.live() as socket:
            hello = next(messages(socket))
        assert hello["type"] == "hello"
        assert hello["engines"][0]["name"] == "simulator"
        assert run["id"] in [each["id"] for each in hello["runs"]]


def test_a_page_sees_each_action_light_up_and_the_end(process: RunnerProcess) -> None:
    with process.client() as client, process.live() as socket:
        run = started(client, order(sequence(actions=2), script={"*": [{"after_s": 0.3}]}))
        seen = []
        for message in messages(socket):
            if message["type"] == "run" and message["run"]["id"] == run["id"]:
                seen.append([each["state"] for each in message["run"]["actions"].values()])
                if message["run"]["ended_at"] is not None:
                    break
        assert ["RUNNING", "UNINITIALIZED"] in seen
        assert ["FINISHED", "RUNNING"] in seen
        assert seen[-1] == ["FINISHED", "FINISHED"]
        whole = client.get(f"/api/runs/{run['id']}").json()
        assert message["run"] == {key: whole[key] for key in message["run"]}


def test_the_link_beats(process: RunnerProcess) -> None:
    with process.live() as socket:
        assert any(each["type"] == "beat" for each in (next(messages(socket)) for _ in range(50)))


def test_stop_by_the_socket_is_answered_and_done(process: RunnerProcess) -> None:
    with process.client() as client, process.live() as socket:
        run = started(client, order(sequence(), script=ENDLESS))
        socket.send(json.dumps({"type": "stop", "run": run["id"], "stop_id": "s1"}))
        answer = next(each for each in messages(socket) if each["type"] == "stopping")
        assert answer == {
            "type": "stopping",
            "stop_id": "s1",
            "runs": [run["id"]],
            "graphs": {},
            "unknown": {},
        }
        assert over(client, run["id"])["state"] == "stopped"


def test_stop_all_by_the_socket(process: RunnerProcess) -> None:
    with process.client() as client, process.live() as socket:
        run = started(client, order(sequence(), script=ENDLESS))
        socket.send(json.dumps({"type": "stop", "run": "all", "stop_id": "s2"}))
        answer = next(each for each in messages(socket) if each["type"] == "stopping")
        assert run["id"] in answer["runs"]


def test_nonsense_is_answered_and_does_no_harm(process: RunnerProcess) -> None:
    with process.live() as socket:
        for text in ["", "{", "[]", '{"type":"start"}', '{"type":"stop"}', "x" * 20_000]:
            socket.send(text)
            assert next(each for each in messages(socket) if each["type"] == "refused")
        socket.send(json.dumps({"type": "stop", "run": "nothing", "stop_id": "s3"}))
        answer = next(each for each in messages(socket) if each["type"] == "refused")
        assert answer == {
            "type": "refused",
            "stop_id": "s3",
            "detail": "There is no such run.",
        }


@contextmanager
def ten_tabs(process: RunnerProcess) -> Iterator[None]:
    """Five that read and five that do not."""

    def read(socket: ClientConnection) -> None:
        try:
            for _ in socket:
                pass
        except ConnectionClosed:
            pass

    with ExitStack() as tabs:
        sockets = [tabs.enter_context(process.live()) for _ in range(10)]
        threads = [threading.Thread(target=read, args=(each,)) for each in sockets[:5]]
        for thread in threads:
            thread.start()
        yield
        for socket in sockets:
            socket.socket.shutdown(SHUT_RDWR)
        for thread in threads:
            thread.join()


def test_ten_tabs_and_busy_runs_do_not_delay_a_stop(own_process: RunnerProcess) -> None:
    """Measured in beats of the runner itself: a machine that is slow is slow for both."""
    process = own_process
    with process.client() as client:
        for i in range(6):
            started(client, order(carousel(f"busy{i}"), script=BUSY))
        started(client, order(sequence("long", 300), script={"*": [{"after_s": 0.01}]}))
        victim = started(client, order(sequence("victim"), script=ENDLESS))
        with ten_tabs(process), process.live() as socket:
            time.sleep(1)
            socket.send(json.dumps({"type": "stop", "run": victim["id"], "stop_id": "now"}))
            kinds = []
            for message in messages(socket):
                run = message.get("run", {})
                kinds.append(message["type"])
                if run.get("id") == victim["id"] and run["state"] == "stopped":
                    break
        assert "stopping" in kinds
        assert kinds[: kinds.index("stopping")].count("beat") <= 1
        assert kinds.count("beat") <= 3
        client.post("/api/stop")


@virtual
async def test_a_page_that_does_not_read_is_owed_one_state_of_each_run() -> None:
    harness = Harness()
    async with harness.runner() as control:
        hub = Hub(control, clock_us)
        box = Outbox(hub, lambda: True, Identity(Person(ANN.id, ANN.name)))
        hub.boxes.add(box)
        run = (await control.start(order(carousel(), script=BUSY), ANN)).run
        await anyio.sleep(10)
        assert control.open[run.id].revision > 300
        sent: list[dict[str, Any]] = []

        async def send(text: str) -> None:
            sent.append(json.loads(text))

        with anyio.move_on_after(0.04):
            await box.deliver(send)
        states = [each for each in sent if each["type"] == "run"]
        assert len(states) == 1
        assert states[0]["run"]["actions"]["Work_0"]["older"] > 30


@virtual
async def test_states_of_one_run_come_at_most_twenty_times_a_second() -> None:
    harness = Harness()
    async with harness.runner() as control:
        hub = Hub(control, clock_us)
        box = Outbox(hub, lambda: True, Identity(Person(ANN.id, ANN.name)))
        hub.boxes.add(box)
        await control.start(order(carousel(), script=BUSY), ANN)
        sent: list[str] = []

        async def send(text: str) -> None:
            sent.append(text)

        with anyio.move_on_after(10):
            await box.deliver(send)
        states = [each for each in sent if each.startswith('{"type":"run"')]
        assert 150 <= len(states) <= 201


@virtual
async def test_the_answer_to_a_stop_goes_before_everything_that_waits() -> None:
    harness = Harness()
    async with harness.runner() as control:
        hub = Hub(control, clock_us)
        box = Outbox(hub, lambda: True, Identity(Person(ANN.id, ANN.name)))
        hub.boxes.add(box)
        for i in range(5):
            await control.start(order(carousel(f"busy{i}"), script=BUSY), ANN)
        await anyio.sleep(1)
        box.post(await hub.follow('{"type":"stop","run":"all","stop_id":"s"}', ANN))
        first: list[str] = []

        async def send(text: str) -> None:
            first.append(text)
            await anyio.sleep(0.1)

        with anyio.move_on_after(0.05):
            await box.deliver(send)
        assert json.loads(first[0])["type"] == "stopping"


@virtual
async def test_an_expired_session_is_shown_nothing_more_but_its_stop_is_followed() -> None:
    harness = Harness()
    async with harness.runner() as control:
        hub = Hub(control, clock_us)
        box = Outbox(hub, lambda: False, Identity(Person(ANN.id, ANN.name)))
        hub.boxes.add(box)
        run = (await control.start(order(sequence(), script=ENDLESS), ANN)).run
        box.post(await hub.follow(f'{{"type":"stop","run":"{run.id}","stop_id":"s"}}', ANN))
        sent: list[str] = []

        async def send(text: str) -> None:
            sent.append(json.loads(text)["type"])

        with anyio.move_on_after(3.5):
            await box.deliver(send)
        assert sent[0] == "stopping"
        assert set(sent) == {"stopping", "beat"}
        assert run.id not in control.open


@virtual
async def test_a_stop_of_everything_passes_by_what_fails_in_one_run() -> None:
    async with Harness().runner() as control:
        runs = [
            (await control.start(order(sequence(f"s{i}"), script=ENDLESS), ANN)).run.id
            for i in range(3)
        ]

        def fail(*_: object) -> None:
            raise RuntimeError("a fault of the runner")

        first = control.open[runs[0]]
        first.stop = fail  # type: ignore[method-assign]  # the fault
        with pytest.raises(ExceptionGroup):
            control.stop_all(ANN, "s")
        assert [control.open[each].run.desired for each in runs] == [
            "running",
            "stopped",
            "stopped",
        ]


@virtual
async def test_a_stop_is_taken_before_it_is_asked_what_its_sender_may_see() -> None:
    """If that fails, the Stop is answered without the names of others' graphs."""
    async with Harness().runner() as control:
        run = (await control.start(order(sequence(), script=ENDLESS), ANN)).run.id
        desired: list[str] = []

        def unseen() -> None:
            desired.append(control.open[run].run.desired)
            raise OSError("the disk is gone")

        message = '{"type":"stop","run":"all","stop_id":"s"}'
        answer = json.loads(await Hub(control, clock_us).follow(message, ANN, unseen=unseen))
        assert (answer["type"], answer["runs"], desired) == ("stopping", [run], ["stopped"])
        assert names_seen({"r1": ["others"]}, unseen) == {"r1": [HIDDEN_NAME]}


@virtual
async def test_a_stop_does_not_wait_for_the_first_message() -> None:
    class Stuck(Hub):
        async def hello(self, unseen: object) -> str:
            await anyio.sleep_forever()

    async with Harness().runner() as control:
        run = (await control.start(order(sequence(), script=ENDLESS), ANN)).run.id
        waiting = [{"type": "websocket.connect"}]
        waiting.append(
            {"type": "websocket.receive", "text": json.dumps({"type": "stop", "run": run})}
        )

        async def receive() -> Any:
            return waiting.pop(0) if waiting else await anyio.sleep_forever()

        async def send(_: Any) -> None: ...

        state = {"identity": Identity(Person(ANN.id, ANN.name))}
        scope: Any = {"type": "websocket", "path": "/api/live", "headers": [], "state": state}
        with anyio.move_on_after(1):
            await attend(WebSocket(scope, receive, send), Stuck(control, clock_us))
        assert run not in control.open or control.open[run].run.desired == "stopped"


KEYS = Keys("t" * 40)
MINE = Rule((ANN.id,), ())


def rule(data: Path, at: int, **rules: Rule) -> None:
    """Store which rules count, as the editor seals them."""
    listed = tuple(dict.fromkeys(rules.values()))
    graphs = {graph: listed.index(each) for graph, each in rules.items()}
    RulesFile(data, KEYS).store(GraphSeals(KEYS).sealed(Statement(at, listed, graphs)))


@virtual
async def test_a_page_that_reads_slowly_is_shown_no_more_than_its_person_may_see(
    tmp_path: Path,
) -> None:
    """There is always something that waits for it: a rule counts before the next message is chosen."""
    harness = Harness()
    harness.sources = StartSources(sight=RunSight(tmp_path, KEYS))
    async with harness.runner() as control:
        hub = Hub(control, clock_us)
        box = Outbox(hub, lambda: True, Identity(Person("bob", "Bob", "viewer")))
        hub.boxes.add(box)
        for i in range(5):
            await control.start(order(carousel(f"busy{i}"), graph=f"g{i}", script=BUSY), ANN)
        sent: list[tuple[float, str]] = []

        async def send(text: str) -> None:
            sent.append((anyio.current_time(), text))
            await anyio.sleep(0.2)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(box.deliver, send)
            await anyio.sleep(3)
            rule(tmp_path, 1, **{f"g{i}": MINE for i in range(5)})
            ruled_at = anyio.current_time()
            await anyio.sleep(5)
            tasks.cancel_scope.cancel()
        named = [at for at, text in sent if "busy" in text]
        assert named
        assert max(named) <= ruled_at + 0.7
        hidden = {json.loads(text)["run"]["id"] for _, text in sent if HIDDEN_NAME in text}
        assert hidden == set(control.shown)


@virtual
async def test_a_change_is_encoded_once_for_all_from_whom_a_run_is_hidden(tmp_path: Path) -> None:
    harness = Harness()
    harness.sources = StartSources(sight=RunSight(tmp_path, KEYS))
    async with harness.runner() as control:
        hub = Hub(control, clock_us)
        run = (await control.start(order(sequence(), graph="g", script=ENDLESS), ANN)).run.id
        rule(tmp_path, 1, g=MINE)
        people = [Identity(Person(f"p{i}", f"P{i}", "viewer")) for i in range(20)]
        opened = control.open[run]
        assert len({id(hub.frame(opened, is_hidden=True)) for _ in people}) == 1
        assert HIDDEN_NAME in hub.frame(opened, is_hidden=True).text
        assert "patrol" in hub.frame(opened).text
        lists = [hub.engines(hub.unseen(each)) for each in people]
        assert {id(each) for each in lists} == {id(lists[0])}


@virtual
async def test_the_state_for_links_is_encoded_once_however_many_look_at_once() -> None:
    async with Harness().runner() as control:
        hub = Hub(control, clock_us)
        states = EncodedStates(lambda: hub)
        run = (await control.start(order(carousel(), script=BUSY), ANN)).run.id
        opened = control.open[run]
        await anyio.sleep(1)

        async def looked() -> set[int]:
            found: set[int] = set()

            async def look() -> None:
                found.add(id(await states.of(opened)))

            async with anyio.create_task_group() as tasks:
                for _ in range(30):
                    tasks.start_soon(look)
            return found

        first = await looked()
        before = opened.revision
        await anyio.sleep(1)
        assert opened.revision > before
        assert (len(first), len(await looked())) == (1, 1)
        assert (await states.of(opened)).revision > before
