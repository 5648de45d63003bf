"""A server with the graphs, runs, robots and people whose rights the matrix asks for, and each kind of
revocation of them.
"""

import contextlib
import os
import random
import re
import ssl
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime, timedelta
from typing import Any, Final, NamedTuple, cast

import httpx
from websockets.sync.client import ClientConnection, connect

from support.product import Product
from web.auth.rights_model import (
    GRAPHS,
    NEEDED,
    ROBOTS,
    Client,
    Kind,
    Permission,
    Role,
    State,
    sees,
)
from web.auth.test_roles import PROCESSES

DOSE: Final = int(os.environ.get("TEST_MATRIX", "0"))
EVERY: Final = DOSE > 0
ROUTES: Final = None if DOSE == 1 else max(4, DOSE)  # of each process, in each cell
THINGS: Final = None if EVERY else 1  # of those that a path can name
TLS: Final = ssl.create_default_context()  # once: it takes longer than a request
TODAY: Final = datetime.now(UTC).date().toordinal()
#: The scopes that a token has when it was asked for one.
PROGRAMS: Final = {
    "operate": "operate read",
    **({"read": "read", "edit": "edit read", "simulate": "simulate read", "scrape": "scrape"}
       if EVERY else {}),
}  # fmt: skip
#: Routes for links that show one thing; tests/web/auth/test_view_links.py asks them.
OF_LINKS: Final = "/api/view/"
#: Parameters of paths that name something with the rights of a graph.
OF_GRAPHS: Final = frozenset({"graph_id", "draft_id", "version_id", "folder_id"})


class Thing(NamedTuple):
    """A graph: its ids by the name of the parameter in paths, its run, and a start of its version."""

    name: str
    ids: dict[str, str]
    run: str
    start: dict[str, Any]


class Lab:
    """A server with robots, graphs and their runs, and the clients that come to it."""

    def __init__(self, product: Product) -> None:
        self.product = product
        self.owner = product.editor()
        self.robots = product.runner()
        self.owner.timeout = self.robots.timeout = httpx.Timeout(90)
        self.random = random.Random(DOSE if EVERY else TODAY)
        self.number = 0
        for robot in ROBOTS:
            self.robots.post("/api/robots", json={"name": robot}).raise_for_status()
        nobody = self._made("/api/groups", {"name": "nobody"})["id"]
        self._set_operators("Closed", nobody)
        self.folder = self._made("/api/folders", {"name": "Ours"})["id"]
        self.closed = self._made("/api/folders", {"name": "Theirs"})["id"]
        self.things: dict[str, Thing] = {}
        for name in GRAPHS:
            self.things[name] = self._graph(name)
        self.owner.put(f"/api/folders/{self.closed}/rule", json=_rule([], [])).raise_for_status()
        self._rule_graph("hidden", [], [])
        self.group = ""
        self.reset()
        listed = self.owner.get("/api/graphs").json()
        self.digests = {each["id"]: each["thumbnail"] for each in listed}
        self.routes = {process: list(self._declared(process)) for process in PROCESSES}

    def _graph(self, name: str) -> Thing:
        """Make a graph with a draft, a version and, in the runner, a run of it."""
        if name == "draft":
            origin = self.things["edited"]
            draft = origin.ids["draft_id"]
            return origin._replace(name=name, ids=origin.ids | {"graph_id": draft})
        action = "hidden" if name == "around" else "Go"
        path = f"/api/graphs?folder={self.folder}" if name == "filed" else "/api/graphs"
        graph = self._made(path, _file(name, action))["id"]
        ids = {
            "graph_id": graph,
            "draft_id": self._made(f"/api/graphs/{graph}/drafts", {"name": f"of {name}"})["id"],
            "version_id": self._made(f"/api/graphs/{graph}/versions", {})["id"],
            "folder_id": self.folder if name == "filed" else "nothing",
        }
        version = self.owner.get(f"/api/versions/{ids['version_id']}").json()
        start = {
            **{key: version[key] for key in ("digest", "tree_digest", "umrf", "subgraphs")},
            "version": ids["version_id"],
            "graph": graph,
            "engine": "simulator",
            "request_id": f"first {name}",
            "script": {"behaviours": {"*": [{"after_s": 0.01}]}},
            "sight": self.owner.get(f"/api/versions/{ids['version_id']}/sight").json(),
        }
        run = self.robots.post("/api/runs", json=start)
        assert run.is_success, run.text
        return Thing(name, ids, run.json()["id"], start)

    def reset(self, *, new_group: bool = False) -> None:
        """Put back the rights of things that a revocation has changed."""
        if new_group or not self.group:
            self.number += 1
            self.group = self._made("/api/groups", {"name": f"night {self.number}"})["id"]
        self.robots.post("/api/robots/Rover/unlock", json={})
        self._set_operators("Rover", self.group)
        self._file_graph(self.folder)
        self.rules([self.group], [self.group])

    def rules(self, readers: list[str], editors: list[str]) -> None:
        """Set the rules of graphs that the group may see."""
        self._rule_graph("read", readers, [])
        self._rule_graph("edited", readers, editors)
        rule = _rule(readers, editors)
        self.owner.put(f"/api/folders/{self.folder}/rule", json=rule).raise_for_status()

    def _rule_graph(self, name: str, readers: list[str], editors: list[str]) -> None:
        path = f"/api/graphs/{self.things[name].ids['graph_id']}/rule"
        self.owner.put(path, json=_rule(readers, editors)).raise_for_status()

    def _file_graph(self, folder: str) -> None:
        path = f"/api/graphs/{self.things['filed'].ids['graph_id']}/folder"
        self.owner.put(path, json={"folder": folder}).raise_for_status()

    def _set_operators(self, robot: str, *groups: str, until: str | None = None) -> None:
        listed = [{"id": each, "name": "night", "until": until} for each in groups]
        rights = {"operators": listed, "baton": False}
        self.robots.put(f"/api/robots/{robot}/rights", json=rights).raise_for_status()

    def _made(self, path: str, body: dict[str, Any]) -> Any:
        answer = self.owner.post(path, json=body)
        assert answer.is_success, answer.text
        return answer.json()

    def _declared(self, process: str) -> Iterator[tuple[str, str, Permission | None]]:
        """Yield method, path and needed permission of each route that does not answer strangers."""
        client = self.owner if process == "editor" else self.robots
        routes = routes_of(process, client.get("/schema/openapi.json").json())
        for route, needed in routes.items():
            assert NEEDED[route] == needed, route
            if needed not in {"anybody", "link"}:
                method, path = route.split()[1:]
                yield method, path, None if needed == "itself" else cast(Permission, needed)

    def came(self, kind: Kind, role: Role, program: str | None) -> Client:
        """Return a new person in the group, or one by a group link, who is in no group."""
        self.number += 1
        name = f"Person {self.number}"
        if kind == "link_revoked":
            link = self._made("/api/invitations", {"role": role, "label": name})
        else:
            body = {"name": name, "role": role, "groups": [self.group]}
            link = self._made("/api/members", body)["links"][0]
        proof = link["path"].removeprefix("/#i=")
        origin = {"origin": self.product.url}
        answer = httpx.post(
            f"{self.product.url}/api/session",
            json={"invitation": proof, "name": name}
            if kind == "link_revoked"
            else {"invitation": proof},
            headers=origin,
            trust_env=False,
            timeout=90,
            verify=TLS,
        )
        assert answer.is_success, answer.text
        headers = origin | {"cookie": answer.headers["set-cookie"].partition(";")[0]}
        person = answer.json()["person"]["id"]
        devices = self._as(headers, "get", "/api/devices").json()
        session = link["id"] if kind == "link_revoked" else devices["this"]
        in_group = kind != "link_revoked"
        if program is not None:
            wanted = {"name": "program", "scopes": [program]}
            made = self._as(headers, "post", "/api/tokens", json=wanted)
            assert made.is_success, made.text
            headers = {"authorization": f"Bearer {made.json()['token']}"}
            if kind == "token_revoked":
                session = made.json()["record"]["id"]
        scopes = None if program is None else frozenset(PROGRAMS[program].split())
        return Client(headers, person, session, role, scopes, in_group)

    def _device(self, headers: dict[str, str]) -> dict[str, str]:
        """Return the headers of a further browser of a person, which the first has confirmed."""
        origin = {"origin": self.product.url}
        code = self._as(headers, "post", "/api/devices/codes").json()
        sent = self._as(origin, "post", "/api/session/device", json={"code": code["code"]})
        path = f"/api/devices/codes/{code['id']}/answer"
        assert self._as(headers, "post", path, json={"yes": True}).is_success
        claim = {"claim": sent.json()["claim"]}
        answer = self._as(origin, "post", "/api/session/device/answer", json=claim)
        assert answer.is_success, answer.text
        return origin | {"cookie": answer.headers["set-cookie"].partition(";")[0]}

    def _as(self, headers: dict[str, str], method: str, path: str, **more: Any) -> httpx.Response:
        return httpx.request(
            method,
            self.product.url + path,
            headers=headers,
            trust_env=False,
            timeout=90,
            verify=TLS,
            **more,
        )

    def revoke(self, kind: Kind, client: Client) -> None:
        """Carry out a revocation by the owner."""
        change: dict[str, Any] | None = None
        path = f"/api/members/{client.person}"
        match kind:
            case "session_ended":
                self.owner.post(f"/api/sessions/{client.session}/end").raise_for_status()
            case "device_ended":
                other = self._device(client.headers)  # now: whoever asks each route ends others
                path = f"/api/devices/{client.session}/end"
                assert self._as(other, "post", path).is_success
            case "person_ended":
                self.owner.post(f"{path}/end").raise_for_status()
            case "link_revoked":
                self.owner.post(f"/api/invitations/{client.session}/revoke").raise_for_status()
            case "token_revoked":
                self.owner.post(f"/api/tokens/{client.session}/revoke").raise_for_status()
            case "last_day":
                change = {"until": (datetime.now(UTC) - timedelta(seconds=1)).isoformat()}
            case "role_lowered":
                change = {"role": "viewer"}
            case "role_raised":
                change = {"role": "owner"}
            case "group_left":
                change = {"groups": []}
            case "groups_same":
                change = {"groups": [self.group]}
            case "robot_locked":
                body = {"reason": "repair"}
                self.robots.post("/api/robots/Rover/lock", json=body).raise_for_status()
            case "group_ended":
                self.owner.delete(f"/api/groups/{self.group}").raise_for_status()
            case "right_removed":
                self._set_operators("Rover")
            case "right_ended":
                past = (datetime.now(UTC) - timedelta(seconds=1)).isoformat()
                self._set_operators("Rover", self.group, until=past)
            case "rule_narrowed":
                self.rules([], [])
            case "rule_to_read":
                self.rules([self.group], [])
            case "graph_moved":
                self._file_graph(self.closed)
        if change is not None:
            self.owner.patch(path, json=change).raise_for_status()

    def some(self, every: Iterable[Any], most: int | None) -> list[Any]:
        found = list(every)
        return found if most is None else self.random.sample(found, min(most, len(found)))

    def things_of(self, path: str) -> list[Thing]:
        """Return the graphs with which a path is asked; none if it names nothing of a graph."""
        names = set(re.findall(r"\{(\w+)\}", path))
        if "run" in names:
            every = [each for each in self.things.values() if each.name != "draft"]
        else:
            named = names & OF_GRAPHS
            every = [
                each
                for each in self.things.values()
                if named and all(each.ids[name] != "nothing" for name in named)
                if named == {"graph_id"} or each.name != "draft"
            ]
        return self.some(every, THINGS)

    def recover(self, thing: Thing) -> None:
        """Bring a deleted graph back."""
        path = f"/api/graphs/{thing.ids['graph_id']}/recover"
        self.owner.post(path).raise_for_status()

    def room(self, thing: Thing) -> str:
        """Return the address of the room of a graph."""
        return f"{self.product.url}/api/graphs/{thing.ids['graph_id']}/room"

    def sockets(self) -> dict[str, str]:
        """Return the addresses of three sockets, by what they show."""
        return {
            "open": self.room(self.things["open"]),
            "edited": self.room(self.things["edited"]),
            "live": f"{self.product.runner_url}/api/live",
        }

    def opened(
        self, client: Client, state: State, stack: contextlib.ExitStack
    ) -> dict[str, ClientConnection]:
        """Open the sockets that the client may have, until the end of the stack."""
        return {
            name: stack.enter_context(open_socket(url, client.headers))
            for name, url in self.sockets().items()
            if name != "edited" or sees(state, "edited")
        }


def routes_of(process: str, document: dict[str, Any]) -> dict[str, str]:
    """Return the permission of each route of an OpenAPI document, in the words of the promise."""
    return {
        f"{process} {method} {path}": "anybody"
        if operation.get("security") == []
        else "link"
        if path.startswith(OF_LINKS)
        else operation.get("x-needs") or "itself"
        for path, item in document["paths"].items()
        for method, operation in item.items()
    }


def _file(name: str, action: str) -> dict[str, Any]:
    ends = [{"name": action, "instance_id": 0}]
    actions = [{"name": action, "instance_id": 0, "type": "sync"}]
    return {"graph_name": name, "graph_entry": ends, "graph_exit": ends, "actions": actions}


def _rule(readers: list[str], editors: list[str]) -> dict[str, Any]:
    return {"rule": {"readers": readers, "editors": editors}}


def open_socket(url: str, headers: dict[str, str]) -> Any:
    own = {name: value for name, value in headers.items() if name != "origin"}
    return connect(
        url.replace("http", "ws", 1),
        additional_headers=own,
        origin=headers.get("origin"),
        proxy=None,
        open_timeout=10,
    )
