"""watch against the real server: changes of others, hostile names, lost connections, refusals."""

import json
import queue
import re
import shutil
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import anyio
import httpx
import pytest
from httpx_ws import aconnect_ws
from pycrdt import Doc, Map, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from action_assistant.commands.watch import QuietSocket, WatchedGraph
from action_assistant.editor.crdt import messages
from support.product import COMMAND, TOKEN, Product, running

KEY = "a" * 12
HOSTILE = "Evil\x1b[2J\u202e\n12:00:00  moment 1  Ann"


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("watch") / "data") as found:
        yield found


def graph_in(product: Product, name: str) -> str:
    """The id of a new graph."""
    with product.editor() as editor:
        found: str = editor.post("/api/graphs", json={"name": name}).json()["id"]
    return found


class Watching:
    """The command while it runs."""

    def __init__(self, product: Product, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [*COMMAND, "watch", *arguments],
            env=product.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # A test run in the background of a shell would otherwise pass on that Ctrl-C is
            # ignored.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        assert self.process.stdout
        assert self.process.stderr
        self._lines, self._news = (
            self._reading(self.process.stdout),
            self._reading(self.process.stderr),
        )

    @staticmethod
    def _reading(stream: IO[bytes]) -> "queue.Queue[str]":
        lines: queue.Queue[str] = queue.Queue()

        def read() -> None:
            with stream:
                for line in stream:
                    lines.put(line.decode().removesuffix("\n"))

        threading.Thread(target=read, daemon=True).start()
        return lines

    def line(self) -> str:
        """The next one on the standard output."""
        return self._lines.get(timeout=30)

    def news(self, wanted: str) -> str:
        """The next one on the standard error that has a text."""
        while wanted not in (line := self._news.get(timeout=30)):
            pass
        return line

    def interrupt(self) -> int:
        """Ctrl-C; the exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(20)


@contextmanager
def watching(product: Product, *arguments: str) -> Iterator[Watching]:
    found = Watching(product, *arguments)
    try:
        yield found
    finally:
        found.process.kill()
        found.process.wait()


def edit(product: Product, graph: str, change: Callable[[Any], None]) -> None:
    """Another client comes, is there by name, changes the actions, and goes when that is stored."""

    async def act() -> None:
        doc: Doc[Any] = Doc()
        address = f"{product.url}/api/graphs/{graph}/room"
        headers = {"authorization": f"Bearer {TOKEN}"}
        async with (
            httpx.AsyncClient(trust_env=False) as client,
            aconnect_ws(address, client, headers=headers) as socket,
            Provider(doc, HttpxWebsocket(socket, address)) as provider,
        ):
            with anyio.fail_after(20):
                await provider.synced.wait()
                entry = messages.PresenceEntry(doc.client_id, 1, b"{}")
                await socket.send_bytes(messages.presence([entry]))
                with product.editor() as editor:
                    before = editor.get(f"/api/graphs/{graph}").json()["seq"]
                    with doc.transaction():
                        change(doc.get("actions", type=Map))
                    # No event of this process: the server answers when it has committed.
                    while editor.get(f"/api/graphs/{graph}").json()["seq"] == before:  # noqa: ASYNC110
                        await anyio.sleep(0.05)

    anyio.run(act)


def named(name: str) -> Callable[[Any], None]:
    return lambda actions: actions.update({KEY: name})


@pytest.mark.long
def test_changes_of_others_are_told_with_moment_and_person(product: Product) -> None:
    graph = graph_in(product, "told")
    with watching(product, "told") as watch:
        watch.news("Watching told at moment")
        for name, words in (
            ("Walk", "action Walk_0 added"),
            ("Run", "action Walk_0 renamed to Run_0"),
        ):
            edit(product, graph, named(name))
            with product.editor() as editor:
                seq = editor.get(f"/api/graphs/{graph}").json()["seq"]
            line = watch.line()
            assert line.endswith(words), line
            assert re.search(rf"  moment {seq}  \w+  action", line), line
        edit(product, graph, lambda actions: actions.pop(KEY))
        assert watch.line().endswith("action Run_0 removed")
        assert watch.interrupt() == 0


def test_a_name_steers_no_terminal_and_makes_no_line_of_its_own(product: Product) -> None:
    graph = graph_in(product, "hostile")
    with watching(product, graph) as text, watching(product, graph, "--json") as values:
        text.news("Watching")
        values.news("Watching")
        edit(product, graph, named(HOSTILE))
        line = text.line()
        assert line.isprintable(), line
        assert "Evil\\u001b[2J\\u202e\\n12:00:00" in line
        found = json.loads(values.line())
        assert found["name"] == f"{HOSTILE}_0"
        assert (found["subject"], found["change"]) == ("action", "added")
        assert {"time", "seq", "who", "words"} <= found.keys()
        edit(product, graph, named("Calm"))
        assert "renamed to Calm_0" in text.line()
        assert json.loads(values.line())["field"] == "name"


@pytest.mark.long
def test_watch_reconnects_when_the_server_is_back_and_prints_missed_changes(tmp_path: Path) -> None:
    product = Product(tmp_path / "data")
    product.start()
    try:
        graph = graph_in(product, "patient")
        with watching(product, graph) as watch:
            watch.news("Watching")
            product.kill()
            watch.news("Connection lost")
            product.start()
            edit(product, graph, named("While"))
            watch.news("Connected again")
            assert watch.line().endswith("action While_0 added")
            shutil.copytree(product.data, tmp_path / "copy")
            edit(product, graph, named("Later"))
            assert watch.line().endswith("renamed to Later_0")
            product.kill()
            shutil.rmtree(product.data)
            shutil.move(tmp_path / "copy", product.data)
            product.start()
            watch.news("replaced")
            watch.news("Watching patient")
            with product.editor() as editor:
                assert editor.delete(f"/api/graphs/{graph}").is_success
            watch.news("deleted")
            assert watch.process.wait(20) == 1
    finally:
        product.end()


def test_an_unknown_graph_and_a_wrong_token_are_refused_in_a_sentence(product: Product) -> None:
    answer = product.cli("watch", "nothing")
    assert (answer.returncode, answer.stdout) == (1, "")
    assert answer.stderr == "action-assistant: No graph is called 'nothing'.\n"
    answer = subprocess.run(
        [*COMMAND, "watch", "nothing"],
        env=product.environment | {"ACTION_ASSISTANT_TOKEN": "another-" + TOKEN},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert answer.returncode == 2
    assert "does not know the token" in answer.stderr
    assert len(answer.stderr.splitlines()) == 1


async def test_watch_sends_no_message_that_could_change_a_graph() -> None:
    sent: list[bytes] = []

    class Socket:
        async def send_bytes(self, message: bytes) -> None:
            sent.append(message)

    ends, ended = anyio.create_memory_object_stream[Exception](1)
    with ends, ended:
        quiet = QuietSocket(Socket(), WatchedGraph(None), ends)  # type: ignore[arg-type]
        for message in (messages.change(b"x"), messages.answer(b"x"), messages.question(b"\0")):
            await quiet.send(message)
    assert sent == [messages.question(b"\0")]
