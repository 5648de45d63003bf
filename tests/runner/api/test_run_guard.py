"""Rules of graphs in the runner: each person at each route and each kind of run, and what they read."""

import contextlib
import json
import re
import sqlite3
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import httpx
import msgspec
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from action_assistant.runner.api.run_guard import ANSWERING_ALL, FILTERED, WITHOUT_RUNS
from action_assistant.runner.runs.sight import HIDDEN_NAME, HIDDEN_RUN
from action_assistant.runner.start.admission import StartRequest
from action_assistant.umrf.model import Graph, Parameter
from action_assistant.web.auth.graph_rules import OPEN, Rule
from action_assistant.web.auth.graph_seals import GraphSeals, RulesFile, Sight, Statement
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.people_files import PeopleFiles, PersonFile
from runner.harness import order, sequence
from runner.process import TOKEN, RunnerProcess, body, over, started

KEYS = Keys(TOKEN)
SEALS = GraphSeals(KEYS)
ORIGIN = "http://127.0.0.1:8000"
FAST = {"*": [{"after_s": 0.01}]}
ENDLESS = {"*": [{"never": True}]}
#: Stands in each name and value of what is hidden.
CANARY = "Canary"


class Who(NamedTuple):
    """A person with a browser."""

    id: str
    headers: dict[str, str]

    def client(self, process: RunnerProcess) -> httpx.Client:
        url = f"http://127.0.0.1:{process.port}"
        return httpx.Client(base_url=url, headers=self.headers, trust_env=False, timeout=60)

    def live(self, process: RunnerProcess) -> ClientConnection:
        headers = {"cookie": self.headers["cookie"]}
        url = f"ws://127.0.0.1:{process.port}/api/live"
        origin = Origin(ORIGIN)
        return connect(url, additional_headers=headers, origin=origin, proxy=None, max_size=None)


def who(name: str, role: Any, *, personal: bool = False) -> Who:
    session = KEYS.new_session(name, role=role, personal=personal)
    cookie = f"aa_8000={KEYS.sealed(session)}"
    return Who(session.person.id, {"cookie": cookie, "origin": ORIGIN})


PEOPLE = {
    "viewer": who("Vic", "viewer"),
    "editor": who("Edo", "editor"),
    "operator": who("Opa", "operator"),
    "reader": who("Rea", "viewer"),
    "operating reader": who("Rob", "operator"),
    "starter": who("Sam", "operator"),
    "owner": who("Olga", "owner"),
}
READERS = {"reader", "operating reader"}
RULE = Rule(tuple(PEOPLE[name].id for name in READERS), ())


def secret(name: str = f"{CANARY}Graph") -> Graph:
    """A graph whose names and values all say so."""
    plain = sequence(name, 2)
    value = Parameter("speed", json.dumps({"pvf_type": "string", "pvf_value": f"{CANARY}Value"}))
    renamed = tuple(
        msgspec.structs.replace(each, name=f"{CANARY}Act", inputs=(value,))
        for each in plain.actions
    )
    named: Graph = msgspec.structs.replace(plain, actions=renamed)
    return named


def with_sight(asked: StartRequest, rules: dict[str, Rule], **changes: Any) -> StartRequest:
    """The start with the sealed rules of its graphs."""
    at = time.time_ns() // 1000
    sight = Sight(asked.version, asked.digest, tuple(rules), tuple(rules.values()), at)
    sealed = SEALS.sealed(msgspec.structs.replace(sight, **changes))
    return msgspec.structs.replace(asked, sight=sealed)


def rule(process: RunnerProcess, rules: dict[str, Rule]) -> None:
    """Say which rules count, as the editor does, into the data folder of both."""
    file = RulesFile(process.data, KEYS)
    file.newest()
    listed = tuple(dict.fromkeys(rules.values()))
    graphs = {graph: listed.index(each) for graph, each in rules.items()}
    file.store(SEALS.sealed(Statement(time.time_ns() // 1000, listed, graphs)))


class Runs(NamedTuple):
    """The ids of runs, by kind; those in `hidden` are for readers of their graphs only."""

    hidden: dict[str, str]
    unsighted: str
    visible: dict[str, str]


def begin(process: RunnerProcess, asked: StartRequest, by: str = "starter") -> str:
    with PEOPLE[by].client(process) as client:
        return str(started(client, asked)["id"])


@pytest.fixture(scope="module")
def ruled(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunnerProcess]:
    """A runner of its own, whose rules disturb nobody else."""
    process = RunnerProcess(
        tmp_path_factory.mktemp("ruled") / "data", "--page-port", "8000"
    ).start()
    yield process
    process.end()


@pytest.fixture(scope="module")
def runs(ruled: RunnerProcess) -> Runs:
    """Runs of before there were rules and since, of graphs, drafts, and graphs around others."""
    old = begin(ruled, order(secret(), graph="ruled", script=FAST))
    draft = begin(ruled, order(secret(), graph="draft", script=FAST))
    plain = begin(ruled, order(sequence("plain", 2), graph="plain", script=FAST))
    rule(ruled, {"ruled": RULE, "draft": RULE})
    stale = with_sight(order(secret(), graph="ruled", script=FAST), {"ruled": OPEN}, at=1)
    sighted = begin(ruled, stale, "operating reader")
    around = order(secret(f"{CANARY}Around"), graph="around", script=FAST)
    inner = begin(ruled, with_sight(around, {"around": OPEN, "inside": RULE}), "operating reader")
    unknown = begin(ruled, order(secret(f"{CANARY}File"), graph=None, script=FAST))
    seen = order(sequence("seen", 2), graph="seen", script=FAST)
    found = Runs(
        {"old": old, "draft": draft, "sighted": sighted, "inner": inner},
        unknown,
        {"plain": plain, "seen": begin(ruled, with_sight(seen, {"seen": OPEN}))},
    )
    with PEOPLE["owner"].client(ruled) as owner:
        for run in (*found.hidden.values(), unknown, *found.visible.values()):
            over(owner, run)
        marks = {"note": f"{CANARY} note", "labels": [f"{CANARY} label"], "pinned": True}
        for run in (*found.hidden.values(), unknown):
            assert owner.patch(f"/api/runs/{run}/marks", json=marks).status_code == 200
        wanted = {"name": f"{CANARY} course", "run": old}
        assert owner.post("/api/expectations", json=wanted).status_code == 201
    return found


def operations(process: RunnerProcess) -> list[tuple[str, str]]:
    """Method and path of everything that the runner describes."""
    with process.client() as client:
        schema = client.get("/schema/openapi.json").json()
    return [(method, path) for path, item in schema["paths"].items() for method in item]


def url_of(path: str, run: str) -> str:
    path = path.replace("{run}", run).replace("{seq}", "1")
    return re.sub(r"\{(\w+)\}", "simulator", path)


def ask(client: httpx.Client, method: str, url: str, **query: str) -> httpx.Response:
    content = b"" if method in {"get", "delete"} else b"[]"
    return client.request(method, url, content=content, params=query)


def is_hidden(name: str, runs: Runs, run: str) -> bool:
    """Return what the rules say: the starter sees what they started before the rule was made."""
    own = {runs.hidden["old"], runs.hidden["draft"], runs.unsighted, *runs.visible.values()}
    if name == "owner" or (name == "starter" and run in own):
        return False
    return run == runs.unsighted or (run in runs.hidden.values() and name not in READERS)


def test_each_person_gets_of_each_run_what_the_rules_say(ruled: RunnerProcess, runs: Runs) -> None:
    """Method × path × person × run, from the OpenAPI document."""
    of_runs = [each for each in operations(ruled) if "{run}" in each[1]]
    assert len(of_runs) > 15
    wrong, cells = [], 0
    every = [*runs.hidden.values(), runs.unsighted, *runs.visible.values()]
    for name, person in PEOPLE.items():
        with person.client(ruled) as client:
            for run in every if name in {"operator", "operating reader"} else every[::3]:
                for method, path in of_runs:
                    if path.endswith("/export"):
                        answer = ask(client, method, url_of(path, run), format="jsonl")
                    else:
                        answer = ask(client, method, url_of(path, run))
                    hidden, cells = is_hidden(name, runs, run), cells + 1
                    stop, one = path.endswith("/stop"), path == "/api/runs/{run}"
                    if stop or one:
                        fits = answer.status_code == (202 if stop else 200)
                        fits &= not one or answer.json().get("hidden", False) == hidden
                    else:
                        fits = (HIDDEN_RUN in answer.text) == hidden or answer.status_code == 403
                        fits &= not hidden or answer.status_code == 403
                        fits &= hidden or HIDDEN_RUN not in answer.text
                    leaks = hidden and CANARY in answer.text
                    if not fits or leaks or answer.status_code >= 500:
                        wrong.append((name, method, path, run, answer.status_code, answer.text))
    assert (wrong, cells > 500) == ([], True)


def test_nothing_that_a_person_without_sight_can_ask_for_names_it(
    ruled: RunnerProcess, runs: Runs
) -> None:
    """Canaries in every name, value, note, label and course, and every route of the document."""
    queries: list[dict[str, str]] = [
        {"graph": "ruled", "a": runs.hidden["old"], "b": runs.visible["plain"]},
        {"graph": f"{CANARY}Graph", "a": runs.visible["plain"], "b": runs.unsighted},
        {"digest": order(secret(), graph="ruled").digest},
        {},
    ]
    told = {}
    for name in ("viewer", "operator", "owner"):
        with PEOPLE[name].client(ruled) as client:
            texts = [
                (path, answer.text.replace(f"graph={CANARY}Graph", ""))  # refusals quote it
                for method, path in operations(ruled)
                if method == "get" and path not in {"/metrics", "/schema/openapi.json"}
                for query in queries
                for run in (runs.hidden["old"], runs.unsighted)[: 1 + ("{run}" in path)]
                for answer in (ask(client, method, url_of(path, run), **query),)
            ]
        told[name] = {path for path, text in texts if CANARY in text}
    assert told["viewer"] == told["operator"] == set()
    assert len(told["owner"]) > 5


@pytest.mark.parametrize(
    "query",
    [
        *({"text": CANARY}, {"graph": "ruled"}, {"graph": f"{CANARY}Graph"}, {"pinned": "true"}),
        *({"label": f"{CANARY} label"}, {"version": order(secret()).digest}),
    ],
)
def test_no_filter_of_the_list_finds_a_run_by_what_it_hides(
    ruled: RunnerProcess, runs: Runs, query: dict[str, str]
) -> None:
    def found(name: str) -> set[str]:
        with PEOPLE[name].client(ruled) as client:
            return {each["id"] for each in client.get("/api/runs", params=query).json()}

    assert found("viewer").isdisjoint({*runs.hidden.values(), runs.unsighted})
    assert found("owner") & {*runs.hidden.values()} != set()


def test_the_list_shows_of_a_hidden_run_its_robot_its_state_and_who_started_it(
    ruled: RunnerProcess, runs: Runs
) -> None:
    with PEOPLE["viewer"].client(ruled) as client:
        listed = {each["id"]: each for each in client.get("/api/runs").json()}
    assert {id_ for id_, each in listed.items() if each.get("hidden")} == {
        *runs.hidden.values(),
        runs.unsighted,
    }
    run = listed[runs.hidden["old"]]
    assert (run["engine"], run["state"], run["author"]["name"]) == ("simulator", "finished", "Sam")
    assert (run["graph"], run["graph_name"], run["result"], run["labels"]) == (
        *(None, HIDDEN_NAME, None, []),
    )


def test_a_start_is_refused_to_whoever_may_not_see_the_graph(
    ruled: RunnerProcess, runs: Runs
) -> None:
    """By its id, by that of a graph inside, by its sight, and by the id in its text."""
    hidden = with_sight(order(sequence("a"), graph="around"), {"around": OPEN, "inside": RULE})
    by_id = order(sequence("a"), graph="ruled")
    by_text = msgspec.structs.replace(order(sequence("a"), graph=None))
    by_text = msgspec.structs.replace(
        by_text, umrf=msgspec.Raw(bytes(by_text.umrf).replace(b'"g1"', b'"ruled"'))
    )
    with PEOPLE["operator"].client(ruled) as client:
        for asked in (hidden, by_id, by_text):
            answer = client.post("/api/runs", content=body(asked))
            assert (answer.status_code, "may not see this graph" in answer.text) == (403, True)
        look = {"umrf": json.loads(bytes(by_id.umrf)), "engines": ["simulator"], "graph": "ruled"}
        assert client.post("/api/preflight", json=look).status_code == 403
        yes = {"digest": "0" * 64, "graph": "ruled"}
        assert client.post("/api/approvals", json=yes).status_code == 403
        course = {"name": "mine", "graph": "ruled", "umrf": look["umrf"]}
        assert client.post("/api/expectations", json=course).status_code == 403
        check = {"graph": "ruled", "umrf": look["umrf"]}
        assert client.post("/api/expectations/check", json=check).status_code == 403
        replaced = {"name": f"{CANARY} course", "run": runs.visible["plain"]}
        assert client.post("/api/expectations", json=replaced).status_code == 409
        assert client.delete(f"/api/expectations/{CANARY} course").status_code == 404


@pytest.mark.parametrize(
    ("changes", "status"),
    [({"seal": "0" * 64}, 400), ({"version": "other"}, 409), ({"digest": "0" * 64}, 409)],
)
def test_a_sight_counts_only_as_it_was_sealed_and_for_its_version(
    ruled: RunnerProcess, changes: dict[str, str], status: int
) -> None:
    asked = order(sequence("a"), graph="seen")
    sealed = with_sight(asked, {"seen": OPEN}, **{k: v for k, v in changes.items() if k != "seal"})
    if "seal" in changes:
        assert sealed.sight is not None
        forged = msgspec.structs.replace(sealed.sight, rules=(RULE,))
        sealed = msgspec.structs.replace(sealed, sight=forged)
    with PEOPLE["operator"].client(ruled) as client:
        answer = client.post("/api/runs", content=body(sealed))
    assert (answer.status_code, answer.json()["where"]["path"]) == (status, "/sight")


def next_of(socket: ClientConnection, run: str, patience: float = 10) -> dict[str, Any]:
    """Return the next message about a run, or that run in the first message."""
    deadline = time.monotonic() + patience
    while True:
        message = json.loads(socket.recv(timeout=max(0.01, deadline - time.monotonic())))
        listed = message.get("runs", []) if message["type"] == "hello" else [message.get("run")]
        for each in listed:
            if each is not None and each["id"] == run:
                return dict(each)


def test_open_pages_and_streams_follow_a_rule_and_a_group_and_anybody_stops_the_run(
    ruled: RunnerProcess,
) -> None:
    """The rule narrows while a page and an event stream are open, then the person joins a group."""
    watcher = who("Wanda", "viewer", personal=True)
    asked = with_sight(order(secret(), graph="watched", script=ENDLESS), {"watched": OPEN})
    rule(ruled, {"other": RULE})
    run = begin(ruled, asked)
    with watcher.live(ruled) as socket, watcher.client(ruled) as client:
        assert next_of(socket, run)["graph_name"] == f"{CANARY}Graph"
        with client.stream("GET", f"/api/runs/{run}/events") as stream:
            parts = stream.iter_raw()
            text = next(parts)  # some of it has come before the rule narrows
            rule(ruled, {"watched": Rule(("night-shift",), ())})
            text += b"".join(parts)  # it ends, although the run goes on
        assert CANARY.encode() in text
        hidden = next_of(socket, run)
        while not hidden.get("hidden"):
            hidden = next_of(socket, run)
        assert CANARY not in json.dumps(hidden)
        assert (hidden["state"], hidden["engine"], hidden["actions"]) == (
            "running",
            "simulator",
            {},
        )
        refused = client.post(f"/api/runs/{run}/pause")
        assert (refused.status_code, HIDDEN_RUN in refused.text) == (403, False)  # a viewer's role
        file = PersonFile(watcher.id, "Wanda", "viewer", ("night-shift",))
        PeopleFiles(ruled.data).write(file)  # each change of groups closes the socket
        with contextlib.suppress(ConnectionClosed):
            while True:
                socket.recv(timeout=10)
        with watcher.live(ruled) as again:
            assert next_of(again, run)["graph_name"] == f"{CANARY}Graph"
        PeopleFiles(ruled.data).write(msgspec.structs.replace(file, groups=()))
    with watcher.live(ruled) as socket:
        hidden = next_of(socket, run)
        assert hidden.get("hidden")
        socket.send(json.dumps({"type": "stop", "run": run, "stop_id": "w"}))
        while hidden["proof_at"] is None or hidden["ended_at"] is None:
            hidden = next_of(socket, run)
            assert CANARY not in json.dumps(hidden)
        assert (hidden["state"], hidden["stopped_by"]["name"]) == ("stopped", "Wanda")


def test_rules_outlive_the_process_and_a_file_that_cannot_be_read_hides_all(
    ruled: RunnerProcess, runs: Runs
) -> None:
    def hidden() -> set[str]:
        with PEOPLE["viewer"].client(ruled) as client:
            return {each["id"] for each in client.get("/api/runs").json() if each.get("hidden")}

    rule(ruled, {"ruled": RULE, "draft": RULE, "inside": RULE})
    late = order(sequence("late"), graph="late", script=FAST)
    run = begin(ruled, with_sight(late, {"late": RULE}), "owner")  # newer than the statement
    before = hidden()
    assert {run, *runs.hidden.values()} <= before
    ruled.end()
    with sqlite3.connect(ruled.data / "runner.db") as database:  # as earlier versions wrote them
        database.execute("UPDATE run SET summary = json_remove(summary, '$.inside')")
    database.close()
    ruled.start()
    assert hidden() == before
    with PEOPLE["editor"].client(
        ruled
    ) as client:  # nothing of the body is lost while the rules are read
        marks = {"note": "seen later"}
        answer = client.patch(f"/api/runs/{runs.visible['plain']}/marks", json=marks, timeout=20)
        assert answer.status_code == 200
    ruled.end()
    file = ruled.data / "graph-rules.json"
    kept = file.read_bytes()
    file.write_bytes(kept[:-20])
    ruled.start()
    assert {*runs.visible.values()} <= hidden()
    with PEOPLE["owner"].client(ruled) as owner:
        statement = Statement(time.time_ns() // 1000, (), {})
        content = msgspec.json.encode(statement)
        assert owner.put("/api/graph-rules", content=content).status_code == 400
        sealed = msgspec.json.encode(SEALS.sealed(statement))
        assert owner.put("/api/graph-rules", content=sealed).status_code == 204
    assert hidden() == set()  # and what was started without a sight is as visible as without rules


def test_every_route_says_how_it_treats_hidden_runs(ruled: RunnerProcess) -> None:
    described = {re.sub(r"\{(\w+)\}", r"{\1}", path) for _, path in operations(ruled)}
    listed = {re.sub(r":\w+\}", "}", each) for each in ANSWERING_ALL | FILTERED | WITHOUT_RUNS}
    assert listed - described == {"/api/live"}


#: Contents of files for each of which msgspec raises another error.
DAMAGED = [b"{", b'{"id":"\xff","session":"\xff","at":"\xff"}', b'{"x":' + b"[" * 100_000]


@pytest.mark.parametrize("content", DAMAGED, ids=["cut off", "not UTF-8", "nested"])
def test_no_damaged_file_keeps_anybody_from_stopping(ruled: RunnerProcess, content: bytes) -> None:
    """By POST the person whose files are damaged, by the socket another one: rules are for all."""
    session = KEYS.new_session("Dan", role="owner", personal=True)
    cookie = f"aa_8000={KEYS.sealed(session)}"
    dan = Who(session.person.id, {"cookie": cookie, "origin": ORIGIN})
    rules = ruled.data / "graph-rules.json"
    rule(ruled, {"other": RULE})
    kept = rules.read_bytes()
    names = [f"people/{dan.id}", f"passkeys/{dan.id}"]
    names += [f"{folder}/{session.id}" for folder in ("sessions", "confirmed")]
    files = [ruled.data / f"{name}.json" for name in names]
    runs = [begin(ruled, order(sequence("dan"), graph=None, script=ENDLESS)) for _ in range(3)]
    try:
        for file in (*files, rules):
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(content)
        with dan.client(ruled) as client, PEOPLE["viewer"].live(ruled) as socket:
            socket.send(json.dumps({"type": "stop", "run": runs[0], "stop_id": "d"}))
            answers = [client.post(f"/api/runs/{runs[1]}/stop"), client.post("/api/stop")]
            told = json.loads(socket.recv(timeout=10))
            while told["type"] != "stopping":
                told = json.loads(socket.recv(timeout=10))
        assert [each.status_code for each in answers] == [202, 202]
        assert (told["runs"], runs[2] in answers[1].json()["runs"]) == ([runs[0]], True)
    finally:
        rules.write_bytes(kept)
        for file in files:
            file.unlink(missing_ok=True)
    with PEOPLE["owner"].client(ruled) as owner:
        assert [over(owner, run)["state"] for run in runs] == ["stopped"] * 3
