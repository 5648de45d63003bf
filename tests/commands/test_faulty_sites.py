"""Commands with several runners, of which one hangs or answers nonsense: it keeps nothing from the others."""

import argparse
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from queue import SimpleQueue
from typing import Any

import httpx
import pytest

from action_assistant.commands import stop
from action_assistant.commands.client import Known, Server
from action_assistant.settings import Site

RUN = {"id": "r", "number": 7, "graph_name": "patrol", "state": "running", "detail": ""}
RUN |= {"at_rest": None, "unconfirmed": "no answer"}
NONE = (404, {"type": "not_found", "title": "Not found", "status": 404, "detail": ""})
LONG_S = 10.0

#: What a site answers: a status, and JSON or a text. It is asked with method and path.
Answer = Callable[[str, str], tuple[int, Any]]


@contextmanager
def site(name: str, answer: Answer) -> Iterator[Site]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            status, body = answer(self.command, self.path)
            text = (body if isinstance(body, str) else json.dumps(body)).encode()
            self.send_response(status)
            self.send_header("content-length", str(len(text)))
            self.end_headers()
            self.wfile.write(text)

        def do_POST(self) -> None:
            self.do_GET()

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.02,)).start()
        try:
            yield Site(name, f"http://127.0.0.1:{server.server_port}")
        finally:
            server.shutdown()


@contextmanager
def client_of(**answers: Answer) -> Iterator[Server]:
    """A client of these sites; the first one stands for the editor as well."""
    with ExitStack() as stack:
        sites = tuple(stack.enter_context(site(*each)) for each in answers.items())
        url = sites[0].url
        client = stack.enter_context(httpx.Client(base_url=url, trust_env=False, timeout=30))
        yield Server(client, url, known=Known(sites))


def healthy(method: str, path: str) -> tuple[int, Any]:
    if path == "/api/robots":
        return 200, [{"name": "Dora"}]
    return (202, {"runs": ["r"]}) if method == "POST" else (200, RUN)


@pytest.mark.parametrize("nonsense", ["<html>welcome</html>", "[]", "{}", '{"runs": 5}'])
def test_a_stop_of_all_tells_what_each_runner_says_beside_one_that_answers_nonsense(
    nonsense: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stop, "_INSIST_S", 0.0)
    options = argparse.Namespace(all=True, run=None, wait=0.0)
    with client_of(a=healthy, b=lambda *_: (200, nonsense), c=healthy) as server:
        assert stop._stop_at_sites(server, options) == 1
    said = sorted(line[:19] for line in capsys.readouterr().err.splitlines())
    assert said == ["a: STOP UNCONFIRMED", "b: NO ANSWER TO THE", "c: STOP UNCONFIRMED"]


@pytest.mark.parametrize("first", ["a", "b"])
@pytest.mark.parametrize(
    ("path", "sent"), [("/api/runs/r/go_on", None), ("/api/runs", {"engine": "Dora"})]
)
def test_a_press_for_one_runner_arrives_while_another_one_hangs(
    first: str, path: str, sent: dict[str, str] | None
) -> None:
    pressed, in_time = threading.Event(), SimpleQueue[bool]()

    def hanging(*_: str) -> tuple[int, Any]:
        in_time.put(pressed.wait(LONG_S))
        return NONE

    def pressing(method: str, path: str) -> tuple[int, Any]:
        if method == "POST":
            pressed.set()
        return healthy(method, path)

    order = (first, "b" if first == "a" else "a")
    answers: dict[str, Answer] = dict(zip(order, (pressing, hanging), strict=True))
    with client_of(**answers) as server:
        server.runner("POST", path, json=sent)
    # The one that hangs may not have been asked yet when the press was sent.
    assert all(in_time.get() for _ in range(in_time.qsize()))
    assert pressed.is_set()


def test_a_robot_that_two_runners_have_is_found_also_where_one_is_slower() -> None:
    asked = threading.Event()

    def slow(method: str, path: str) -> tuple[int, Any]:
        asked.wait(0.2)
        return healthy(method, path)

    with (
        client_of(a=slow, b=healthy) as server,
        pytest.raises(stop.RequestRefused, match="registered at a and at b"),
    ):
        server.runner("POST", "/api/runs", json={"engine": "Dora"})


@pytest.mark.parametrize("nonsense", ["<html>welcome</html>", "[]", "{}", "[1]"])
def test_a_runner_that_answers_nonsense_has_no_run_and_no_robot(nonsense: str) -> None:
    def foolish(*_: str) -> tuple[int, Any]:
        return 200, nonsense

    with client_of(a=foolish, b=healthy) as server:
        for path, sent in (("/api/runs/r/go_on", None), ("/api/runs", {"engine": "Dora"})):
            assert server.runner("POST", path, json=sent).json() == {"runs": ["r"]}
