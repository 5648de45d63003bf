"""The editor ends at once, whoever is connected."""

import contextlib
import threading
import time
from pathlib import Path

import pytest

from action_assistant.editor.crdt import messages
from editor.process import Editor, running

SOON = 1.5  # seconds


@pytest.fixture
def own(tmp_path: Path) -> "contextlib.AbstractContextManager[Editor]":
    return running(tmp_path / "data")


async def test_listeners_and_sockets_do_not_delay_the_end(
    own: "contextlib.AbstractContextManager[Editor]",
) -> None:
    with own as editor:
        with editor.client() as http:
            graph = http.post("/api/graphs", json={"name": "task"}).json()["id"]
        listening = threading.Semaphore(0)  # one for each that hears something
        heard: list[str] = []

        def listen() -> None:
            with editor.client() as http, http.stream("GET", "/api/events?after=0") as events:
                for number, line in enumerate(events.iter_lines()):
                    heard.append(line)
                    if number == 0:
                        listening.release()

        listeners = [threading.Thread(target=listen) for _ in range(3)]
        for each in listeners:
            each.start()
        async with editor.socket(graph, "?acks=1") as session:
            await session.send_bytes(messages.question(b"\x00"))
            while (await session.receive_bytes(timeout=5))[0] != messages.ACKS:
                pass
            assert all(listening.acquire(timeout=5) for _ in listeners)
            begun = time.monotonic()
            assert editor.end() in {0, -15}
            taken = time.monotonic() - begun
        for each in listeners:
            each.join(5)  # the stream has ended in good order: iter_lines would have raised
        assert taken < SOON
        assert "ERROR" not in editor.log.read_text()
