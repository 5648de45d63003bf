"""Commands against a running server: import, export, graphs, runs, run, stop."""

import json
import socket
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Any

import anyio
import httpx
import msgspec
import pytest
from httpx_ws import aconnect_ws
from pycrdt import Doc, Map, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from action_assistant.cli import main
from action_assistant.commands import stop
from action_assistant.commands.client import Server
from action_assistant.commands.presses import press
from action_assistant.commands.remote import verdict
from action_assistant.commands.stop import Run, insisting, stopped_as
from action_assistant.runner.runs.views import RunShown
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from support.product import TOKEN, Product, running
from support.waiting import until, wait_until

QUICK = {"behaviours": {"*": [{"after_s": 0.05}]}}
ENDLESS = {"behaviours": {"*": [{"never": True}]}}
GRAPH = {
    "graph_name": "pair",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "B"}],
    "actions": [
        {"name": "A", "type": "sync", "children": [{"name": "B"}]},
        {"name": "B", "type": "sync", "parents": [{"name": "A"}]},
    ],
}


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("remote") / "data") as found:
        yield found


@pytest.fixture
def files(tmp_path: Path) -> dict[str, str]:
    """Files by what they are."""
    found = {"graph": GRAPH, "quick": QUICK, "endless": ENDLESS}
    for name, value in found.items():
        (tmp_path / name).write_text(json.dumps(value))
    return {name: str(tmp_path / name) for name in found}


def imported(product: Product, file: str) -> str:
    """The id of a graph imported from a file."""
    answer = product.cli("import", file)
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.split()[0]


def test_an_empty_list_of_people_says_how_one_is_invited(product: Product) -> None:
    listed = product.cli("people", "list")
    assert (listed.returncode, listed.stdout) == (0, "")
    assert listed.stderr == "nobody was invited yet: `people invite ROLE` makes a link\n"


def test_a_file_comes_back_with_the_same_meaning(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    assert graph in product.cli("graphs").stdout
    exported = product.cli("export", graph)
    assert digest(codec.read(exported.stdout).graph) == digest(codec.read(json.dumps(GRAPH)).graph)


def test_a_run_is_waited_for_and_listed(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    answer = product.cli("run", graph, "--script", files["quick"])
    assert answer.returncode == 0, answer.stderr + answer.stdout
    run = answer.stdout.split()[0]
    assert answer.stdout.splitlines()[-1] == "finished (on_true)"
    (listed,) = json.loads(product.cli("runs", "--graph", graph, "--json").stdout)
    assert (listed["id"], listed["state"], listed["result"]) == (run, "finished", "on_true")


def test_a_repeat_is_followed_listed_and_written_as_a_table(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    answer = product.cli("run", graph, "--script", files["quick"], "--times", "3")
    assert answer.returncode == 0, answer.stderr + answer.stdout
    repeat, *lines, closed = answer.stdout.splitlines()
    assert [line.split()[0] for line in lines] == ["1", "2", "3"]
    assert closed.startswith("closed: Every run was carried out")
    assert repeat in product.cli("runs", "repeats").stdout
    table = product.cli("runs", "repeats", repeat, "--csv").stdout.splitlines()
    assert len(table) == 4
    assert "name it" in product.cli("runs", "repeats", "--parquet").stderr
    refused = product.cli("runs", "next", repeat)
    assert refused.returncode != 0
    assert "was started" in refused.stderr
    wrong = product.cli("run", graph, "--grid", "place=a,b")
    assert "is not asked for" in wrong.stderr


def test_a_start_waits_in_the_queue_and_is_listed_started_and_removed(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    waits = product.cli("run", graph, "--script", files["endless"], "--queue")
    assert waits.returncode == 0, waits.stderr
    assert "its turn" in waits.stdout
    behind = product.cli("run", graph, "--script", files["quick"], "--queue")
    entry = behind.stdout.split()[0]
    listed = product.cli("queue").stdout
    assert entry in listed
    refused = product.cli("queue", "start", entry)
    assert refused.returncode != 0
    assert "The simulator is not free." in refused.stderr
    closed = product.cli("queue", "close", "simulator").stdout
    assert "closed: simulator" in closed
    opened = product.cli("queue", "open", "simulator").stdout
    assert "closed" not in opened
    assert entry in product.cli("queue", "move", entry).stdout
    assert product.cli("queue", "remove", entry).stdout == "removed\n"
    assert product.cli("queue").stdout == ""
    assert "not in the queue" in product.cli("queue", "start", entry).stderr
    product.cli("stop", "--all")


def test_sub_graphs_run_with_their_graph(product: Product, files: dict[str, str]) -> None:
    imported(product, files["graph"])
    end = {"graph_entry": [{"name": "pair"}], "graph_exit": [{"name": "pair"}]}
    outer = {"graph_name": "around", **end, "actions": [{"name": "pair", "type": "sync"}]}
    Path(files["graph"]).write_text(json.dumps(outer))
    graph = imported(product, files["graph"])
    answer = product.cli("run", graph, "--script", files["quick"])
    assert answer.returncode == 0, answer.stderr + answer.stdout
    told = answer.stdout.splitlines()
    assert {"around__pair__0/A_0: FINISHED", "around__pair__0/B_0: FINISHED"} <= set(told)


@pytest.mark.long
def test_expected_courses_are_simulated_again_and_a_changed_graph_is_told(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    run = product.cli("run", graph, "--script", files["quick"]).stdout.split()[0]
    with product.runner() as runner:
        saved = runner.post("/api/expectations", json={"run": run, "name": "the pair"})
        assert saved.status_code == 201, saved.text
    answer = product.cli("runs", "verify", "--graph", graph)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert answer.stdout.splitlines() == ["same     the pair (then)", "same     the pair (now)"]
    anyio.run(cut, product, graph)
    answer = product.cli("runs", "verify", "--graph", graph, "--json")
    assert answer.returncode == 1
    then, now = json.loads(answer.stdout)
    assert (then["same"], now["same"]) == (True, False)
    assert "B_0 is told to run" in now["why"]


@pytest.mark.parametrize(
    ("how", "apart"),
    [
        ((), "B_0 is told to run"),
        (("--robots", "=simulator", "--into"), "cannot be led one by one"),
    ],
)
def test_expected_courses_with_sub_graphs_are_simulated_again_as_they_ran(
    product: Product, files: dict[str, str], how: tuple[str, ...], apart: str
) -> None:
    name = "opened" if how else "whole"
    end = {"graph_entry": [{"name": name}], "graph_exit": [{"name": name}]}
    outer = {"graph_name": f"with {name}", **end, "actions": [{"name": name, "type": "sync"}]}
    with product.editor() as editor:
        inner = editor.post("/api/graphs", json={**GRAPH, "graph_name": name}).json()["id"]
        graph = editor.post("/api/graphs", json=outer).json()["id"]
    answer = product.cli("run", graph, *how, "--script", files["quick"])
    assert answer.returncode == 0, answer.stderr
    with product.runner() as runner:
        wanted = {"run": answer.stdout.split()[0], "name": name}
        saved = runner.post("/api/expectations", json=wanted)
        assert saved.status_code == 201, saved.text
        assert "B_0" in str(saved.json()["course"])
    answer = product.cli("runs", "verify", "--graph", graph)
    assert answer.stdout.splitlines() == [f"same     {name} (then)", f"same     {name} (now)"]
    anyio.run(cut, product, inner)
    answer = product.cli("runs", "verify", "--graph", graph)
    assert answer.returncode == 1
    then, now, why = answer.stdout.splitlines()
    assert (then, now) == (f"same     {name} (then)", f"DIFFERS  {name} (now)")
    assert apart in why


@pytest.mark.long
def test_the_edit_that_made_a_run_go_another_way_is_named(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    assert product.cli("run", graph, "--script", files["quick"]).returncode == 0
    anyio.run(cut, product, graph)
    run = product.cli("run", graph, "--script", files["quick"], "--no-wait").stdout.split()[0]
    with product.runner() as runner:
        until("A_0 did not end", lambda: _ended(runner.get(f"/api/runs/{run}").json(), "A_0"))
    product.cli("stop", run)
    found = product.cli("runs", "since", run)
    assert found.returncode == 1, found.stdout + found.stderr
    first, *more = found.stdout.splitlines()
    assert first.startswith("since change 2 of ")
    assert "    - A_0 -> B_0" in more
    assert "B_0 is told to run before" in found.stdout
    answer = product.cli("runs", "since", run, "--good", "2")
    assert (answer.returncode, answer.stdout.splitlines()[0]) == (
        0,
        "No edit explains it: with what its actions did, the graph goes the same way.",
    )


def _ended(run: dict[str, Any], action: str) -> bool:
    return any(visit["result"] == "true" for visit in run["actions"][action]["visits"])


@asynccontextmanager
async def drawing(product: Product, graph: str) -> AsyncIterator[Doc[Any]]:
    """The document of a graph, as another client has it."""
    doc: Doc[Any] = Doc()
    relations = doc.get("relations", type=Map)
    address = f"{product.url}/api/graphs/{graph}/room"
    headers = {"authorization": f"Bearer {TOKEN}"}
    async with (
        httpx.AsyncClient(trust_env=False) as client,
        aconnect_ws(address, client, headers=headers) as socket,
        Provider(doc, HttpxWebsocket(socket, address)),
    ):
        await wait_until(lambda: any("entry>" in key for key in relations))
        yield doc


async def cut(product: Product, graph: str) -> None:
    """Delete the arrow from A to B, as another client."""
    async with drawing(product, graph) as doc:
        relations = doc.get("relations", type=Map)
        with doc.transaction():
            for key in list(relations):
                if not key.startswith("entry>") and ">exit|" not in key:
                    del relations[key]
        with product.editor() as editor:
            umrf = f"/api/graphs/{graph}/umrf"
            await wait_until(lambda: not editor.get(umrf).json()["actions"][0].get("children"))


async def wait_at(product: Product, graph: str, name: str, mark: str) -> None:
    """Set a breakpoint at an action, as another client."""
    async with drawing(product, graph) as doc:
        actions = doc.get("actions", type=Map)
        (key,) = (each for each, value in actions.items() if value == name)
        actions[f"{key}|breakpoint"] = mark
        with product.editor() as editor:
            path = f"/api/graphs/{graph}/breakpoints"
            await wait_until(lambda: editor.get(path).json() != [])


def test_a_led_run_takes_the_breakpoints_of_its_graph_where_the_command_says_so(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    anyio.run(wait_at, product, graph, "B", '{"visit": 1, "by": "a later page"}')
    started: tuple[str, ...] = ("run", graph, "--robots", "=simulator", "--no-wait")
    for more, waits in (
        ((), None),
        (("--breakpoints",), [{"action": "B_0", "visit": 1}]),
        (
            ("--breakpoints", "--break", "A_0"),
            [{"action": "A_0"}, {"action": "B_0", "visit": 1}],
        ),
        (("--breakpoints", "--break", "B_0:7"), [{"action": "B_0", "visit": 7}]),
    ):
        answer = product.cli(*started, *more)
        assert answer.returncode == 0, answer.stderr
        run = answer.stdout.split()[0]
        with product.runner() as runner:
            assert runner.get(f"/api/runs/{run}").json().get("breakpoints") == waits
        product.cli("stop", run)


def test_an_opened_run_takes_the_breakpoints_inside_and_so_does_one_that_continues_it(
    product: Product,
) -> None:
    outer = {
        "graph_name": "around",
        "graph_entry": [{"name": "marked"}],
        "graph_exit": [{"name": "marked"}],
        "actions": [{"name": "marked", "type": "sync"}],
    }
    with product.editor() as editor:
        inner = editor.post("/api/graphs", json={**GRAPH, "graph_name": "marked"}).json()["id"]
        graph = editor.post("/api/graphs", json=outer).json()["id"]
        # The version is older than the breakpoint, which is no part of it.
        editor.post(f"/api/graphs/{graph}/versions", json={})
    anyio.run(wait_at, product, inner, "B", '{"visit": 7, "by": "ada"}')
    started = ("run", graph, "--robots", "=simulator", "--no-wait")
    led = partial(_started, product)
    assert not led(*started, "--into").get("breakpoints")
    assert not led(*started, "--breakpoints").get("breakpoints")
    first = led(*started, "--into", "--breakpoints")
    (mark,) = first["breakpoints"]
    assert first["actions"][mark["action"]]["levels"] == ["marked_0"]
    assert set(mark) == {"action"}, "visits of a sub-graph are none of the whole graph"
    with product.runner() as runner:
        until("the run was not held", lambda: shown(runner, first["id"])["held"] is not None)
        held = shown(runner, first["id"])["held"]
        assert held["how"] == "breakpoint"
        product.cli("stop", first["id"])
    waiting = led(*started, "--from", first["id"], "--breakpoints")
    assert waiting["breakpoints"] == [mark]
    product.cli("stop", waiting["id"])


def _started(product: Product, *command: str) -> dict[str, Any]:
    """Start a run by this command, and return it."""
    answer = product.cli(*command)
    assert answer.returncode == 0, answer.stderr
    with product.runner() as runner:
        return shown(runner, answer.stdout.split()[0])


def shown(runner: httpx.Client, run: str) -> dict[str, Any]:
    found: dict[str, Any] = runner.get(f"/api/runs/{run}").json()
    return found


def test_a_stop_insists_where_connections_break() -> None:
    """The first two are closed without an answer, and a proxy answers the third."""
    proxy = b"HTTP/1.1 504 Gateway Timeout\r\ncontent-length: 0\r\nconnection: close\r\n\r\n"
    answer = b'HTTP/1.1 200 OK\r\ncontent-length: 11\r\n\r\n{"runs":[]}'

    def serve() -> None:
        for said in (b"", b"", proxy, answer):
            connection, _ = listener.accept()
            with connection:
                connection.recv(65_536)
                connection.sendall(said)

    with socket.create_server(("127.0.0.1", 0)) as listener, ThreadPoolExecutor(1) as runner:
        serving = runner.submit(serve)
        with httpx.Client(trust_env=False) as client:
            url = f"http://127.0.0.1:{listener.getsockname()[1]}"
            kind = dict[str, list[str]]
            assert insisting(Server(client, url), "POST", "/api/stop", kind) == {"runs": []}
        serving.result(5)


def test_a_stop_without_an_answer_leads_to_the_hardware_stop(
    product: Product, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The runner is frozen, as one whose computer hangs."""
    monkeypatch.setattr(stop, "_STOP_ANSWER_S", 0.5)
    monkeypatch.setattr(stop, "_INSIST_S", 0.5)
    runner = product.process("runner")
    runner.suspend()
    try:
        answer = product.cli("stop", "--all", "--data", str(product.data))
    finally:
        runner.resume()
    assert answer.returncode == 2
    assert "NO ANSWER TO THE STOP" in answer.stderr
    assert "use its hardware stop" in answer.stderr


def test_a_run_is_stopped_and_that_is_proven(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    run = product.cli("run", graph, "--script", files["endless"], "--no-wait").stdout.strip()
    answer = product.cli("stop", run)
    assert (answer.returncode, answer.stdout) == (0, "stopped\n")
    with product.runner() as runner:
        assert runner.get(f"/api/runs/{run}").json()["state"] == "stopped"


def test_a_stopped_run_is_continued_by_command_and_another_one_begins_in_the_middle(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    led = ("--robots", "=simulator")
    answer = product.cli("run", graph, *led, "--script", files["endless"], "--no-wait")
    run = answer.stdout.strip()
    assert run, answer.stderr
    assert product.cli("stop", run).returncode == 0
    quick = ("--script", files["quick"])
    refused = product.cli("run", graph, "--from", run, *quick)
    assert refused.returncode == 1
    assert "A_0 had begun and had no outcome" in refused.stderr
    done = ("--done", "A_0=true", "--reason", "I saw it.")
    continued = product.cli("run", graph, "--from", run, *done, *quick)
    assert continued.returncode == 0, continued.stderr
    assert "B_0: FINISHED" in continued.stdout
    assert "A_0: FINISHED" not in continued.stdout
    part = product.cli("run", graph, *led, "--at", "B_0", *quick)
    assert part.returncode == 0, part.stderr
    assert "A_0" not in part.stdout
    with product.runner() as runner:
        newest, before = runner.get("/api/runs", params={"graph": graph}).json()[:2]
        assert newest["from"] == {"at": ["B_0"]}
        assert (before["from"]["run"], before["state"]) == (run, "finished")
        whole = runner.get(f"/api/runs/{before['id']}").json()
        assert whole["earlier"]["choices"] == {"A_0": "true"}
        assert whole["earlier"]["reason"] == "I saw it."


def test_a_run_is_stopped_while_no_editor_answers(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    run = product.cli("run", graph, "--script", files["endless"], "--no-wait").stdout.strip()
    editor = product.process("editor")
    editor.suspend()
    try:
        answer = product.cli("stop", run)
    finally:
        editor.resume()
    assert (answer.returncode, answer.stdout) == (0, "stopped\n"), answer.stderr


def rested(state: str, by: str | None = None, how: str = "", detail: str = "") -> Run:
    """Return a run that is over, as the runner shows it. `by`: who saw it at rest."""
    return {
        "number": 7,
        "graph_name": "patrol",
        "unconfirmed": None,
        "state": state,
        "detail": detail,
        "at_rest": {"by": {"name": by} if by else None, "how": how} if how else None,
    }


@pytest.mark.parametrize(
    ("run", "was_over", "said"),
    [
        (rested("stopped"), False, "stopped"),
        (rested("finished"), False, "run 7 of patrol is at rest: it ended as finished, not by the"),
        (
            rested("halted"),
            False,
            "run 7 of patrol is at rest: it ended as halted, not by the Stop",
        ),
        (
            rested("error", detail="It failed."),
            False,
            "it ended as error, not by the Stop: It failed",
        ),
        (rested("refused", detail="No turn."), False, "at rest: nothing of it began: No turn"),
        (rested("error", "Ben", "I stand there."), False, "Ben saw it at rest (I stand there); no"),
        (rested("lost", None, "its process ended"), False, "lost. the runner saw it at rest (its"),
        (
            rested("stopped", "Ben", "I look."),
            False,
            "stopped. Ben saw it at rest (I look); no answer",
        ),
        (rested("finished"), True, "run 7 of patrol was over already: finished"),
        (rested("stopped"), True, "run 7 of patrol was over already: stopped"),
    ],
)
def test_a_stop_says_how_the_run_came_to_rest(run: Run, was_over: bool, said: str) -> None:
    words = stopped_as(run, was_over=was_over)
    assert said in words
    assert (words == "stopped") == (said == "stopped")


def test_a_stop_of_a_run_that_is_over_says_how_it_ended(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    run = product.cli("run", graph, "--script", files["endless"], "--no-wait").stdout.strip()
    product.cli("stop", run)
    answer = product.cli("stop", run)
    assert answer.returncode == 0
    assert answer.stdout.endswith("was over already: stopped\n")


def test_an_id_that_begins_with_a_dash_is_no_option(product: Product) -> None:
    """Earlier versions made such ids, one in 64."""
    for words in (["stop", "-8kdhW2_-qNv"], ["stop", "-8kdhW2_-qNv", "--wait", "1"]):
        answer = product.cli(*words)
        assert answer.returncode == 1, answer.stderr
        assert "There is no such run." in answer.stderr


def test_the_answer_no_is_exit_code_1_and_one_sentence(
    product: Product, files: dict[str, str], tmp_path: Path
) -> None:
    for arguments in (
        ["export", "nothing"],
        ["run", "nothing"],
        ["stop", "nothing"],
        ["import", files["quick"]],
        ["run", imported(product, files["graph"]), "--engine", "nobody"],
    ):
        answer = product.cli(*arguments)
        assert answer.returncode == 1, arguments
        assert len(answer.stderr.splitlines()) == 1, answer.stderr


@pytest.mark.parametrize("robots", ["David", "Scout=", "Scout=David,", "Scout=David,Scout=Carol"])
def test_robots_of_a_led_run_that_cannot_be_meant_are_refused_with_the_form(
    robots: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["run", "patrol", "--robots", robots])
    told = capsys.readouterr().err
    assert f"{robots!r} is not of the form ACTOR=ROBOT,…, each actor once" in told


def test_without_a_server_it_says_how_to_start_one(tmp_path: Path) -> None:
    answer = Product(tmp_path).cli("graphs")
    assert answer.returncode == 2
    assert "action-assistant serve" in answer.stderr


def run_shown(state: str, result: str | None, visits: list[str | None]) -> RunShown:
    """Return a run of one action as the runner shows it, with the results of its visits."""
    at = "2026-11-27T20:00:00Z"
    unknown = {"not_before": at, "not_after": None, "until": None, "how": "observed"}
    shown = [{"from": at, "result": each, **unknown} for each in visits]
    required = (each.name for each in msgspec.structs.fields(RunShown) if each.required)
    known: dict[str, Any] = dict.fromkeys(required)
    known |= {"id": "R", "number": 1, "graph_name": "pair", "digest": "", "engine": "David"}
    known |= {"author": {"id": "A", "name": "Ada"}, "desired": "running", "requested_at": at}
    known |= {"state": state, "result": result, "detail": "", "alarms": [], "log": [], "rests": []}
    known |= dict.fromkeys(("simulated", "recorded", "behaviours"), False)
    action = {"aid": None, "state": "", "visits": shown, "older": 0, "messages": []}
    return msgspec.convert(known | {"actions": {"Work_0": action}}, RunShown)


@pytest.mark.parametrize(
    ("state", "result", "visits", "code"),
    [
        ("finished", "on_true", ["true"], 0),
        ("finished", "on_false", ["false"], 1),
        ("finished", "on_error", ["error"], 1),
        ("finished", None, [None, None], 0),
        ("finished", None, ["error", None], 1),
        ("stopped", "on_stopped", ["stopped"], 1),
        ("stopped", None, [None], 1),
        ("error", None, [None], 1),
        ("halted", "on_halted", [None], 1),
        ("lost", None, [None], 1),
        ("refused", None, [], 1),
    ],
)
def test_a_run_fails_the_command_only_if_it_did_not_finish_or_is_known_to_have_failed(
    state: str, result: str | None, visits: list[str | None], code: int
) -> None:
    found, words = verdict(run_shown(state, result, visits))
    assert found == code
    assert words.startswith(state)
    assert ("does not tell" in words) == (state == "finished" and result is None and code == 0)


def test_a_draft_is_made_looked_at_and_merged(product: Product, files: dict[str, str]) -> None:
    graph = imported(product, files["graph"])
    draft = product.cli("drafts", "new", graph, "--name", "gentler grip").stdout.strip()
    assert f"{draft}  open  0 ahead, 0 behind  gentler grip" in (
        product.cli("drafts", "list", graph).stdout
    )
    assert "pair" in product.cli("export", draft).stdout
    for each, name in ((draft, "one"), (graph, "other")):
        with product.editor() as http:
            http.patch(f"/api/graphs/{each}", json={"name": name})
    looked = product.cli("drafts", "merge", draft)
    assert looked.returncode == 1
    assert "? both changed name of the graph: --choose 'meta/name=origin|draft'" in looked.stdout
    assert 'draft: name: "pair" -> "one"' in looked.stdout
    merged = product.cli("drafts", "merge", draft, "--choose", "meta/name=draft")
    assert (merged.returncode, merged.stdout.splitlines()[-1]) == (0, "merged: change 3")
    assert product.cli("drafts", "merge", draft, "--choose", "nowhere").returncode == 2
    assert product.cli("export", "AbCdEfGhIjKl").returncode == 1


def test_folders_are_made_by_path_and_graphs_are_put_into_them(
    product: Product, files: dict[str, str]
) -> None:
    graph = imported(product, files["graph"])
    night = product.cli("folders", "new", "Lab/Night").stdout.strip()
    assert product.cli("folders", "new", "Lab/Night").stdout.strip() == night
    assert product.cli("folders", "put", graph, "--into", "Lab/Night").returncode == 0
    lines = product.cli("folders", "list").stdout.splitlines()
    assert [line.split("  ", 1)[1] for line in lines] == ["Lab  0 graphs", "Lab/Night  1 graph"]
    assert product.cli("graphs", "--folder", "Lab/Night").stdout.startswith(f"{graph}  ")
    assert json.loads(product.cli("graphs", "--folder", "Lab", "--json").stdout) == []
    assert product.cli("folders", "rename", "Lab/Night", "Day").returncode == 0
    assert product.cli("folders", "move", "Lab/Day", "--into", "/").returncode == 0
    assert graph in product.cli("graphs", "--folder", "Day").stdout
    assert product.cli("folders", "remove", night).returncode == 0
    assert graph in product.cli("graphs", "--folder", "/").stdout
    for words, why in (
        (("remove", "Lab/Day"), "There is no folder 'Lab/Day'."),
        (("remove", "/"), "Name a folder"),
        (("new", "/"), "A path names at least one folder."),
        (("move", "Lab", "--into", "Lab"), "A folder cannot lie in itself."),
    ):
        refused = product.cli("folders", *words)
        assert (refused.returncode, why in refused.stderr) == (1, True), refused.stderr
    product.cli("folders", "remove", "Lab")


def test_an_order_without_an_answer_is_sent_once_more_with_the_same_request_id() -> None:
    heard: list[dict[str, str]] = []

    def answer(request: httpx.Request) -> httpx.Response:
        heard.append(json.loads(request.content))
        if len(heard) == 1:
            raise httpx.ReadTimeout("no answer", request=request)
        return httpx.Response(202, json={})

    with httpx.Client(transport=httpx.MockTransport(answer), base_url="http://editor") as client:
        server = Server(client, "http://runner")
        press(server, "/api/runs/12/go_on", {"since": "2026-01-01T00:00:00Z"})
        press(server, "/api/runs/12/go_on", {"since": "2026-01-01T00:00:00Z"})
    first, again, other = heard
    assert first == again
    assert first["since"] == other["since"]
    assert first["request_id"] != other["request_id"]
