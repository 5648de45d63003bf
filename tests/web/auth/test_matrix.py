"""The matrix of rights at real processes: each role and scope at each route and socket of both OpenAPI
documents, for each kind of graph, run and robot, before and after each kind of revocation. One model
(`rights_model.py`) says each cell.

`TEST_MATRIX=1` asks every route with every graph, run and robot (`make soak ARGS=matrix`); a larger
number, so many routes of each process. What a client may do before its rights are changed is the same for
each kind of revocation: it is asked whole once for each role and scope, and then at a few routes. With
`TEST_MATRIX_KEPT=FILE` the clients that were asked are kept, and a matrix that was ended goes on behind them.
Otherwise some routes are asked, with one graph each, at six kinds of revocation: others each day.
"""

import contextlib
import json
import os
import random
import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, ClassVar, Final, cast, get_args

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from support.openapi import documents
from support.warm import NEW_INTERPRETERS
from web.auth.rights_lab import (
    EVERY,
    PROGRAMS,
    ROUTES,
    THINGS,
    TLS,
    TODAY,
    Lab,
    Thing,
    open_socket,
    routes_of,
)
from web.auth.rights_model import (
    HIDDEN_RUN,
    NEEDED,
    OF_INSIDES,
    RANKS,
    ROBOTS,
    Client,
    Kind,
    Permission,
    Role,
    State,
    after,
    has,
    may_start,
    refusal,
    sees,
)
from web.auth.test_ending import sharing
from web.auth.test_roles import PROCESSES, url_of

#: A file with a line for each client that was asked: a matrix that was ended goes on from there.
KEPT: Final = os.environ.get("TEST_MATRIX_KEPT")
#: Requests of one client at a time.
AT_ONCE: Final = 12
DELETION: Final = ("delete", "/api/graphs/{graph_id}")
#: How often a request is sent that is not answered in time, beside other work of the computer.
TRIES: Final = 3
#: The kinds of revocation that are tried: others each day.
KINDS: Final = get_args(Kind) if EVERY else random.Random(TODAY).sample(get_args(Kind), 6)


class Asking:
    """Requests of one client in one state, compared with the model."""

    def __init__(self, lab: Lab, client: Client, state: State) -> None:
        self._lab = lab
        self._client = client
        self._state = state
        self._lock = threading.Lock()
        self.cells = 0
        self.wrong: list[Any] = []

    def _check(self, is_right: bool, *what: Any) -> None:
        with self._lock:
            self.cells += 1
        if not is_right:
            self.wrong.append(what)

    def route(self, http: httpx.Client, method: str, path: str, needed: Permission | None) -> None:
        """Ask a route with a thing that is not there, and with each kind of thing that it can name."""
        wanted = refusal(self._client, self._state, needed, f"{method} {path}")
        things = self._lab.things_of(path)
        unknown = None
        if EVERY or not things:
            unknown = _answer(http, method, path, {})
            fits = unknown[0] == wanted if wanted else unknown[0] not in {0, 401, 403}
            self._check(fits, method, path, needed, wanted, *unknown)
        for thing in things:
            edits = needed != "see"
            # A graph leaves a folder; the folder stays where it is.
            name = "edited" if "{folder_id}" in path else thing.name
            if wanted:
                status, text = _answer(http, method, path, thing.ids | {"run": thing.run})
                self._check(status == wanted, method, path, thing.name, wanted, status, text)
            elif "{run}" in path:
                self._run(http, method, path, thing)
            elif not sees(self._state, name):
                unknown = unknown or _answer(http, method, path, {})
                status, text = _answer(http, method, path, thing.ids)
                same = (status, _without_ids(path, text, thing)) == unknown
                self._check(status == 404 and same, method, path, thing.name, unknown, status, text)
            elif method == "delete" and path.endswith("{folder_id}") and sees(self._state, name):
                continue  # an owner's would be done; others change no rule of what is in it
            else:
                may = sees(self._state, name, edits=edits)
                words = "not change it"
                if method == "get" and OF_INSIDES.search(path):
                    may = sees(self._state, name, run=True)
                    words = "stands for a graph that you may not see"
                status, text = _answer(http, method, path, thing.ids)
                if (method, path) == DELETION and status < 300:
                    self._lab.recover(thing)
                right = status not in {0, 401, 403} if may else status == 403 and words in text
                self._check(
                    right, method, path, thing.name, "edits" if edits else "sees", may, text
                )

    def _run(self, http: httpx.Client, method: str, path: str, thing: Thing) -> None:
        """Ask a route of a run that the client has the permission for."""
        is_hidden = not sees(self._state, thing.name, run=True)
        status, text = _answer(http, method, path, {"run": thing.run})
        if path.endswith("/stop"):
            right = status not in {0, 401, 403}
        elif (method, path) == ("get", "/api/runs/{run}"):
            right = status == 200 and json.loads(text).get("hidden", False) == is_hidden
        elif is_hidden:
            right = status == 403 and HIDDEN_RUN in text
        else:
            right = status not in {0, 401, 403} and HIDDEN_RUN not in text
        self._check(right, method, path, "run of", thing.name, is_hidden, status, text)

    def lists(self, http: httpx.Client, path: str) -> None:
        """Compare a list of graphs or runs with those that the client may see."""
        answer = in_time(lambda: http.get(path))
        wanted = refusal(self._client, self._state, "see", f"get {path}")
        self._check(answer.status_code == (wanted or 200), path, wanted, answer.status_code)
        if wanted or not answer.is_success:
            return
        listed = {each["id"] for each in answer.json() if not each.get("hidden")}
        for thing in self._lab.things.values():
            if thing.name != "draft":
                is_run = path == "/api/runs"
                meant = sees(self._state, thing.name, run=is_run)
                id_ = thing.run if is_run else thing.ids["graph_id"]
                self._check((id_ in listed) == meant, path, thing.name, meant)

    def rights_of_robots(self, http: httpx.Client) -> None:
        """Compare where the client is told that they may start."""
        if refusal(self._client, self._state, "see"):
            return
        told = {
            each["robot"]: each["why"] == "" for each in http.get("/api/rights").json()["robots"]
        }
        for robot in ROBOTS:
            meant = may_start(self._client, self._state, robot)
            self._check(told[robot] == meant, "may start", robot, meant, told[robot])

    def start(self, http: httpx.Client, robot: str, thing: Thing) -> None:
        """Start a graph on a robot. Nothing begins: no engine is there."""
        self._lab.number += 1
        body = {key: value for key, value in thing.start.items() if key != "script"}
        body |= {"engine": robot, "request_id": f"start {self._lab.number}"}
        answer = in_time(lambda: http.post("/api/runs", json=body))
        wanted = refusal(self._client, self._state, "simulate", "post /api/runs")
        seen = sees(self._state, thing.name, run=True)
        if wanted is None and not (seen and may_start(self._client, self._state, robot)):
            unlocked = self._state._replace(is_locked=False)
            wanted = 409 if seen and may_start(self._client, unlocked, robot) else 403
        right = answer.status_code == (wanted or 503)
        self._check(right, "start", robot, thing.name, wanted, answer.status_code, answer.text)

    def elsewhere(self, http: httpx.Client, process: str, thing: Thing) -> None:
        """Ask routes that name a graph or a run in their query or body."""
        named = {"graph": thing.ids["graph_id"], "run": thing.run}
        is_hidden = not sees(self._state, thing.name, run=process == "runner")
        if process == "editor":
            drawn = {"of": f"{named['graph']}.{self._lab.digests[named['graph']]}"}
            self._named(http, "get", "/api/graphs/thumbnails", thing, is_hidden, params=drawn)
            copy = {"copy_of": named["graph"]}
            self._named(http, "post", "/api/graphs", thing, is_hidden, params=copy, content="[]")
            return
        both = {"a": named["run"], "b": named["run"]}
        self._named(http, "get", "/api/comparison", thing, is_hidden, params=both)
        listed = {"graph": named["graph"]}
        self._named(http, "get", "/api/runs", thing, is_hidden, params=listed)
        self._named(http, "get", f"/api/starts/first {thing.name}", thing, is_hidden)
        self._lab.number += 1
        body = self._lab.things["open"].start | {"request_id": f"from {self._lab.number}"}
        body["from"] = {"run": named["run"]}
        self._named(http, "post", "/api/runs", thing, is_hidden, json=body)

    def _named(
        self,
        http: httpx.Client,
        method: str,
        path: str,
        thing: Thing,
        is_hidden: bool,
        **more: Any,
    ) -> None:
        needed = {"get": "see", "/api/graphs": "edit", "/api/runs": "simulate"}
        permission = cast(Permission, needed.get(method) or needed[path])
        answer = in_time(lambda: http.request(method, path, **more))
        status, text = answer.status_code, answer.text
        wanted = refusal(self._client, self._state, permission, f"{method} {path}")
        if wanted:
            right = status == wanted
        elif path == "/api/graphs/thumbnails":
            right = status == 200 and (thing.ids["graph_id"] in text) != is_hidden
        elif path == "/api/comparison":
            right = status == 403 and HIDDEN_RUN in text if is_hidden else status == 200
        elif (method, path) == ("get", "/api/runs"):
            right = status == 200 and (thing.run in text) != is_hidden
        elif path.startswith("/api/starts/"):
            runs = answer.json()["runs"] if status == 200 else [{}]
            right = runs[0].get("id") == thing.run and runs[0].get("hidden", False) == is_hidden
        elif path == "/api/runs":
            right = status == (404 if is_hidden else 409)
        else:
            right = status == (404 if is_hidden else 422)
        self._check(right, method, path, "elsewhere", thing.name, wanted, is_hidden, status, text)

    def rooms(self, things: list[Thing]) -> None:
        """Open the rooms of graphs."""
        for thing in things:
            refused = refusal(self._client, self._state, "see")
            wanted = refused or (101 if sees(self._state, thing.name) else 404)
            status = _upgraded(self._lab.room(thing), self._client.headers)
            self._check(status == wanted, "room", thing.name, wanted, status)

    def live(self) -> None:
        """Open the live socket."""
        wanted = refusal(self._client, self._state, "see") or 101
        status = _upgraded(self._lab.sockets()["live"], self._client.headers)
        self._check(status == wanted, "live", wanted, status)


def wrong_cells(
    lab: Lab, client: Client, state: State, *, few: bool = False
) -> tuple[int, list[Any]]:
    """Ask in the name of a client, only a few routes if so wanted; return how many cells were
    looked at, and those that are not as the model says."""
    asking = Asking(lab, client, state)
    things = [each for each in lab.some(lab.things.values(), THINGS) if each.name != "draft"]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for process in PROCESSES:
            url, given = url_of(lab.product, process), client.headers
            with httpx.Client(
                base_url=url, headers=given, trust_env=False, timeout=90, verify=TLS
            ) as http:
                routes = lab.some(lab.routes[process], 4 if few else ROUTES)
                alone = [each for each in routes if each[:2] == DELETION]
                for _ in pool.map(
                    lambda each, http=http: asking.route(http, *each),
                    [each for each in routes if each not in alone],
                ):
                    pass
                for each in alone:  # for what is deleted meanwhile all other answers are different
                    asking.route(http, *each)
                for thing in things:
                    asking.elsewhere(http, process, thing)
                asking.lists(http, "/api/graphs" if process == "editor" else "/api/runs")
                if process == "runner":
                    asking.rights_of_robots(http)
                    for robot in lab.some(ROBOTS, THINGS):
                        for thing in lab.some(lab.things.values(), THINGS):
                            asking.start(http, robot, thing)
    asking.rooms(lab.some(lab.things.values(), THINGS))
    asking.live()
    return asking.cells, asking.wrong


def in_time(ask: Callable[[], httpx.Response]) -> httpx.Response:
    """Return the answer to a request, which is sent again if it is not answered in time."""
    for _ in range(TRIES - 1):
        with contextlib.suppress(httpx.ReadTimeout):
            return ask()
    return ask()


def _answer(http: httpx.Client, method: str, path: str, ids: dict[str, str]) -> tuple[int, str]:
    """Return status and text of the answer to a request without a meaning."""
    url = re.sub(r"\{(\w+)\}", lambda name: ids.get(name[1], "nothing"), path.replace("{seq}", "1"))
    content = b"" if method in {"get", "delete"} else b"[]"
    for _ in range(TRIES):
        with (
            contextlib.suppress(httpx.ReadTimeout),
            http.stream(method, url, content=content) as answer,
        ):
            if "event-stream" in answer.headers.get("content-type", ""):
                return answer.status_code, ""
            answer.read()
            break
    else:
        return 0, "no answer"
    return answer.status_code, re.sub(r'"request_id": ?"[^"]*"', "", answer.text)


def _without_ids(path: str, text: str, thing: Thing) -> str:
    for name in re.findall(r"\{(\w+)\}", path):
        text = text.replace(thing.ids.get(name, "nothing"), "nothing")
    return text


def _upgraded(url: str, headers: dict[str, str]) -> int:
    try:
        with open_socket(url, headers):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


def _is_closed(socket: ClientConnection, deadline: float) -> bool:
    try:
        while time.monotonic() < deadline:
            try:
                socket.recv(timeout=0.05)
            except TimeoutError:
                continue
    except ConnectionClosed:
        return True
    return False


def closed_wrongly(
    sockets: dict[str, ClientConnection], client: Client, before: State, now: State
) -> list[Any]:
    """Wait, and return which open sockets are closed, or open, against the model."""
    begun, wrong = time.monotonic(), []
    ends = now.is_ended or (now.role, now.in_group) != (before.role, before.in_group)
    gone = {name: ends or (now.is_expired and name != "live") for name in sockets}
    if "edited" in gone and not gone["edited"]:
        could, can = (sees(each, "edited", edits=True) for each in (before, now))
        lost = could and not can and has(client, now, "edit")
        gone["edited"] = lost or not sees(now, "edited")
    for name in sorted(gone, key=lambda each: not gone[each]):
        if _is_closed(sockets[name], begun + (5.0 if gone[name] else 1.2)) != gone[name]:
            wrong.append(("open socket", name, gone[name]))
    return wrong


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_each_route_of_both_documents_has_a_row_and_each_row_a_route(tmp_path: Path) -> None:
    found = [routes_of(process, document) for process, document in documents(tmp_path).items()]
    assert {route: needed for each in found for route, needed in each.items()} == NEEDED


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A server of its own, with a robot."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("ACTION_ASSISTANT_LIMITS", "off")
        environment.setenv(NEW_INTERPRETERS, "1")  # forks have no rclpy, so they start no robot
        with sharing(tmp_path_factory.mktemp("matrix") / "data") as product:
            found = Lab(product)
            with contextlib.closing(found.owner), contextlib.closing(found.robots):
                yield found


def clients(lab: Lab, kind: Kind) -> Iterator[tuple[Role, str | None]]:
    """Yield the roles of the people, and the programs, to which a revocation applies."""
    for role in RANKS:
        if kind == "link_revoked" and role == "owner":
            continue  # no group link makes owners
        if kind != "token_revoked":
            yield role, None
        if kind in {"session_ended", "device_ended"} or RANKS.index(role) < 2:
            continue  # no token ends with a session; who may not operate gives no such token
        yield from ((role, program) for program in PROGRAMS)


def _lines() -> list[str]:
    is_there = KEPT is not None and Path(KEPT).exists()
    return Path(KEPT or "").read_text("utf-8").splitlines() if is_there else []


class Kept:
    """The cells of one client, which may have been asked before this process began."""

    _whole: ClassVar[set[tuple[Any, ...]]] = set()  # clients whose rights were asked as they came

    def __init__(self, kind: Kind, role: Role, program: str | None) -> None:
        self._what = [kind, role, program]
        self.cells = 0
        self.wrong: list[Any] = []
        for line in _lines():
            what, in_group, cells, wrong = json.loads(line)
            if not wrong:
                self._whole.add((*what[1:], in_group))
            if what == self._what and not wrong:
                self.cells = cells

    def was_before(self, client: Client) -> bool:
        """Return whether every route was asked by such a client before its rights were changed."""
        self._in_group = client.in_group
        return EVERY and (*self._what[1:], client.in_group) in self._whole

    def add(self, when: str, cells: int, wrong: list[Any]) -> None:
        """Count cells."""
        self.cells += cells
        self.wrong += [(*self._what, when, each) for each in wrong]

    def keep(self) -> None:
        """Write down that this client was asked."""
        if not self.wrong:
            self._whole.add((*self._what[1:], self._in_group))
        if KEPT:
            line = json.dumps([self._what, self._in_group, self.cells, self.wrong])
            with Path(KEPT).open("a", encoding="utf-8") as file:
                file.write(line + "\n")


@pytest.mark.timeout(0 if EVERY else 120)
@pytest.mark.parametrize("kind", KINDS)
def test_every_cell_is_as_the_model_says_before_and_after_each_revocation(
    lab: Lab, kind: Kind
) -> None:
    cells, wrong = 0, []
    every = list(clients(lab, kind))
    for role, program in every if EVERY else lab.random.sample(every, min(2, len(every))):
        kept = Kept(kind, role, program)
        if not kept.cells:
            client = lab.came(kind, role, program)
            state = State(role, client.in_group)
            kept.add("before", *wrong_cells(lab, client, state, few=kept.was_before(client)))
            with contextlib.ExitStack() as stack:
                sockets = lab.opened(client, state, stack) if program is None else {}
                lab.revoke(kind, client)
                now = after(kind, state)
                if kind == "role_raised" and program is not None:
                    now = state  # a token has at most the role that it was made with
                open_ = closed_wrongly(sockets, client, state, now)
            kept.add("after", len(sockets), open_)
            kept.add("after", *wrong_cells(lab, client, now))
            lab.reset(new_group=kind == "group_ended")
            kept.keep()
        cells += kept.cells
        wrong += kept.wrong
    assert cells > 50
    print(f"{kind}: {cells} cells, {len(wrong)} wrong")  # noqa: T201 - the figure that is asked for
    assert wrong[:10] == []
