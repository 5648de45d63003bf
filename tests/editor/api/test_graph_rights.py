"""Rights on graphs: each role, person, group and program at each route of the editor."""

import json
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import httpx
import msgspec
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from action_assistant.editor.api.graph_guard import FILTERED, PARAMETERS, WITHOUT_GRAPHS
from action_assistant.web.auth.graph_rules import OPEN, Rule
from action_assistant.web.auth.graph_seals import FILE, GraphSeals, Sight, Statement
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.roles import Role
from editor.api.test_subgraphs import graph_file
from support.product import TOKEN, Product, running

KEYS = Keys(TOKEN)
SEALS = GraphSeals(KEYS)
SECRET, STEP, DRAFT, FOLDER = "SecretErrand", "SecretStep", "SecretDraft", "SecretPlace"


class Who(NamedTuple):
    """A person with a browser, or their program: the role that counts, and what the rule says."""

    id: str
    headers: dict[str, str]
    role: str
    sees: bool
    edits: bool


class Things(NamedTuple):
    """Ids of things with a rule, by the name of the parameter in paths; and of an open graph that
    has an action standing for the one with a rule."""

    ids: dict[str, str]
    outer: str
    version_of_outer: str


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A running editor and runner."""
    with running(tmp_path_factory.mktemp("rights") / "data") as product:
        yield product


@pytest.fixture(scope="module")
def owner(product: Product) -> Iterator[httpx.Client]:
    """A program with the owner's token."""
    with product.editor() as client:
        yield client


class Named(NamedTuple):
    """Names a person in a rule: by their own id, or by a group."""

    readers: bool = False
    editors: bool = False


NAMED = {"reader": Named(readers=True), "editor": Named(editors=True), "nobody": Named()}


def member(owner: httpx.Client, name: str, role: str, groups: tuple[str, ...] = ()) -> str:
    """Return the id of a new person whom an owner has added."""
    body = {"name": name, "role": role, "groups": groups}
    answer = owner.post("/api/members", json=body)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def browser(product: Product, person: str, name: str, role: Role) -> dict[str, str]:
    """Return the headers of a browser of a person with a personal link."""
    session = KEYS.new_session(name, role=role, person_id=person, personal=True)
    return {"cookie": f"aa_{product.port}={KEYS.sealed(session)}", "origin": product.url}


def program(product: Product, headers: dict[str, str], scopes: tuple[str, ...]) -> dict[str, str]:
    """Return the headers of a program that acts for the person with this browser."""
    body = {"name": "script", "scopes": scopes, "days": 1}
    with httpx.Client(base_url=product.url, trust_env=False, headers=headers) as http:
        answer = http.post("/api/tokens", json=body)
    assert answer.status_code == 201, answer.text
    return {"authorization": f"Bearer {answer.json()['token']}"}


@pytest.fixture(scope="module")
def groups(owner: httpx.Client) -> dict[str, str]:
    """The ids of a group of readers and of one of editors."""
    made = {}
    for name in ("reader", "editor"):
        answer = owner.post("/api/groups", json={"name": f"{name}s of the secret"})
        made[name] = str(answer.json()["id"])
    return made


@pytest.fixture(scope="module")
def people(product: Product, owner: httpx.Client, groups: dict[str, str]) -> dict[str, Who]:
    """Persons of all roles, named as readers, as editors, by a group, and not at all; and programs
    of some."""
    found: dict[str, Who] = {}
    roles: tuple[Role, ...] = ("viewer", "editor", "operator", "owner")
    for role in roles:
        for name, named in NAMED.items():
            key = f"{role}, named {name}"
            person = member(owner, key, role)
            rights = role == "owner" or any(named), role == "owner" or named.editors
            found[key] = Who(person, browser(product, person, key, role), role, *rights)
    for name, group in groups.items():
        key = f"editor, in the group of {name}s"
        person = member(owner, key, "editor", (group,))
        headers = browser(product, person, key, "editor")
        found[key] = Who(person, headers, "editor", True, NAMED[name].editors)
        found[f"program of the {key}"] = Who(
            person, program(product, headers, ("edit",)), "editor", True, NAMED[name].editors
        )
    for key in ("operator, named nobody", "operator, named editor", "owner, named nobody"):
        who = found[key]
        headers = program(product, who.headers, ("read",))
        found[f"reading program of the {key}"] = who._replace(headers=headers, role="viewer")
    return found


@pytest.fixture(scope="module")
def things(owner: httpx.Client) -> Things:
    """A graph in a folder, with a draft and a version, and an open graph around it."""

    def made(path: str, body: Any) -> Any:
        answer = owner.post(path, json=body)
        assert answer.status_code in {200, 201}, answer.text
        return answer.json()

    folder = made("/api/folders", {"name": FOLDER})["id"]
    graph = made(f"/api/graphs?folder={folder}", graph_file(SECRET, STEP))["id"]
    draft = made(f"/api/graphs/{graph}/drafts", {"name": DRAFT})["id"]
    version = made(f"/api/graphs/{graph}/versions", {})["id"]
    outer = made("/api/graphs", graph_file("Outer", SECRET))["id"]
    around = made(f"/api/graphs/{outer}/versions", {})["id"]
    action = made("/api/actions", {"name": "Look"})["id"]
    ids = {
        "graph_id": graph,
        "draft_id": draft,
        "version_id": version,
        "folder_id": folder,
        "action_id": action,
    }
    return Things(ids, outer, around)


@pytest.fixture(params=["of the graph", "of its folder"])
def ruled(
    request: pytest.FixtureRequest,
    owner: httpx.Client,
    things: Things,
    people: dict[str, Who],
    groups: dict[str, str],
) -> Iterator[None]:
    """The rule that names readers and editors, at the graph or at its folder."""
    kinds = {"of the graph": ("graphs", "graph_id"), "of its folder": ("folders", "folder_id")}
    kind, name = kinds[request.param]
    path = f"/api/{kind}/{things.ids[name]}/rule"
    rule = {
        name: [*(who.id for key, who in people.items() if key.endswith(f"named {one}")), group]
        for name, one, group in (
            ("readers", "reader", groups["reader"]),
            ("editors", "editor", groups["editor"]),
        )
    }
    assert owner.put(path, json={"rule": rule}).status_code == 200
    yield
    assert owner.put(path, json={"rule": None}).status_code == 200


def operations(owner: httpx.Client) -> list[tuple[str, str, str | None]]:
    """Method, path and permission of everything that the editor describes."""
    schema = owner.get("/schema/openapi.json").json()
    return [
        (method, path, operation.get("x-needs"))
        for path, item in schema["paths"].items()
        for method, operation in item.items()
    ]


def named_in(path: str) -> list[str]:
    return [name for name in re.findall(r"\{(\w+)\}", path) if name in PARAMETERS]


def url_of(path: str, ids: dict[str, str]) -> str:
    return re.sub(r"\{(\w+)\}", lambda match: ids.get(match[1], "other"), path)


def ask(http: httpx.Client, method: str, url: str, who: Who) -> tuple[int, str]:
    """Return the status and the text of an answer to a request without a meaning."""
    content = b"" if method in {"get", "delete"} else b"[]"
    answer = http.request(method, url, headers=who.headers, content=content)
    text = re.sub(r'"request_id": ?"[^"]*"', "", answer.text)
    return answer.status_code, text


def test_every_route_says_how_it_treats_rights(owner: httpx.Client) -> None:
    others = re.compile(
        r"/healthz|/readyz|/metrics|/api/(server|session|sessions|status|doctor|invitations"
        r"|people|members|groups|devices|audit|tokens|logins|confirmations|view|view-links"
        r"|notifications|mentions|passkeys)\b"
    )
    for method, path, _ in operations(owner):
        known = named_in(path) or path in FILTERED | WITHOUT_GRAPHS
        assert known or others.match(path), f"{method} {path}"


def test_each_cell_of_routes_and_people_is_as_the_rule_says(
    product: Product, owner: httpx.Client, things: Things, people: dict[str, Who], ruled: None
) -> None:
    cells, wrong, answers = 0, [], dict[tuple[str, str, str], tuple[int, str]]()
    at_folder = ruled_by(owner, things) == "of its folder"
    asking = {key: who for key, who in people.items() if not at_folder or who.role == "editor"}
    with httpx.Client(base_url=product.url, trust_env=False, timeout=30) as http:
        for method, path, permission in operations(owner):
            names = [name for name in named_in(path) if name != "action_id"]
            if not names or (names == ["folder_id"] and not at_folder):
                continue
            unknown = url_of(path, {**things.ids, **dict.fromkeys(names, "AbCdEfGhIjKl")})
            for key, who in asking.items():
                may = permitted(who.role, permission)
                if method == "delete" and who.edits and may:
                    continue  # it would be done
                status, text = ask(http, method, url_of(path, things.ids), who)
                same = status, text.replace(things.ids[names[0]], "AbCdEfGhIjKl")
                kind = "program" if "program" in key else "person"
                none = method, path, f"{who.role}, {kind}"
                if none not in answers:
                    answers[none] = ask(http, method, unknown, who)
                hidden = same == answers[none]
                if not may:
                    right = status == 403
                elif not who.sees:
                    right = hidden and status == 404
                elif permission != "see" and not who.edits:
                    right = status == 403 and "not change it" in text
                else:
                    right = "not change it" not in text and not (hidden and status == 404)
                cells += 1
                if not right:
                    wrong.append(f"{key}: {method} {path} answered {status} {text[:200]}")
    assert wrong == []
    assert cells > (200 if at_folder else 600)


def permitted(role: str, permission: str | None) -> bool:
    least = {"see": 0, "edit": 1, "simulate": 1, "operate": 2, "share": 3, "restore": 3}
    return ["viewer", "editor", "operator", "owner"].index(role) >= least[permission or "see"]


def ruled_by(owner: httpx.Client, things: Things) -> str:
    own = owner.get(f"/api/folders/{things.ids['folder_id']}/rule").json()["own"]
    return "of the graph" if own is None else "of its folder"


def test_nothing_that_is_answered_tells_of_a_graph_out_of_sight(
    product: Product, owner: httpx.Client, things: Things, people: dict[str, Who], ruled: None
) -> None:
    nobody = people["editor, named nobody"]
    folder_too = ruled_by(owner, things) == "of its folder"
    secrets = [STEP, DRAFT, *(things.ids[name] for name in ("graph_id", "draft_id", "version_id"))]
    secrets += [FOLDER, things.ids["folder_id"]] if folder_too else []
    open_ids = {**things.ids, "graph_id": things.outer, "version_id": things.version_of_outer}
    queries = {
        "/api/graphs/{graph_id}/diff": {"from": 1},
        "/api/graphs/{graph_id}/document": {"at": 1},
        "/api/graphs/{graph_id}/changes": {"after": 0, "upto": 1},
        "/api/graphs/{graph_id}/blame": {"of": ""},
        "/api/graphs/{graph_id}/blame/values": {"of": "", "field": "name"},
    }
    bodies: dict[str, Any] = {
        "/api/graphs/{graph_id}/rehearsal": {},
        "/api/graphs/{graph_id}/flat": {"seq": 1, "name": "Flat"},
        "/api/graphs/{graph_id}/versions": {},
        "/api/graphs/{graph_id}/unpacking": {"action": "x"},
        "/api/actions": {"name": STEP, "from_graphs": True},
        "/api/graphs?preview=true": graph_file("Other", SECRET),
    }
    lists = [f"/api/graphs?{query}" for query in ("deleted=false", "deleted=true", "limit=50")]
    lists += ["/api/graphs/names", "/api/graphs/labels"]
    listed = {each: [*secrets, SECRET] for each in lists} | dict.fromkeys(
        ("/api/actions", "/api/actions/graphs", "/api/folders"), secrets
    )

    def told(headers: dict[str, str], sent: dict[str, Any]) -> list[tuple[str, str]]:
        """Return which secrets the answers to a person hold, by the path that was asked. `sent`: the
        bodies of what is posted, by path."""
        found = []
        with httpx.Client(
            base_url=product.url, trust_env=False, timeout=30, headers=headers
        ) as http:
            for path, words in listed.items():
                text = http.get(path).text
                found += [(path, each) for each in words if each in text]
            for method, path, _ in operations(owner):
                if "{" not in path or method != "get" or path.startswith("/api/sessions"):
                    continue
                url = url_of(path, open_ids)
                text = http.get(url, params=queries.get(path)).text
                asked = {each for each in secrets if each in url}  # echoed
                found += [(path, each) for each in secrets if each in text and each not in asked]
            for path, body in sent.items():
                text = http.post(url_of(path, open_ids), json=body).text
                own = json.dumps(body)  # echoed
                found += [(path, each) for each in secrets if each in text and each not in own]
            with http.stream("GET", "/api/events?after=0") as events:
                text, seen = "", 0
                for line in events.iter_lines():
                    text += line
                    seen += line.startswith("data:")
                    if json.dumps(things.outer)[1:-1] in line or seen > 500:
                        break
                found += [("/api/events", each) for each in secrets if each in text]
        return found

    assert told(nobody.headers, bodies) == []
    seen = {path for path, _ in told({"authorization": f"Bearer {TOKEN}"}, {})}
    assert {*lists[:1], *lists[2:4], "/api/actions/graphs", "/api/events"} <= seen
    assert len(seen) > 10  # so there is much that could be told


def told_until(product: Product, headers: dict[str, str], last: str) -> str:
    """Return what the stream of events tells from its beginning until a text comes."""
    text = ""
    with (
        httpx.Client(base_url=product.url, trust_env=False, timeout=30) as http,
        http.stream("GET", "/api/events?after=0", headers=headers) as events,
    ):
        for line in events.iter_lines():
            text += line
            if last in line:
                break
    return text


def test_the_stream_of_events_tells_of_the_audit_to_owners_alone(
    product: Product, owner: httpx.Client, people: dict[str, Who]
) -> None:
    came = httpx.post(
        f"{product.url}/api/session",
        json={"token": TOKEN, "name": "Ann"},
        headers={"origin": product.url},
        trust_env=False,
    )
    assert came.is_success
    told_until(product, people["owner, named nobody"].headers, "audit.signed_in.v1")
    marker = owner.post("/api/graphs", json=graph_file("Marker", "Go")).json()["id"]
    text = told_until(product, people["operator, named nobody"].headers, marker)
    assert "person.named.v1" in text
    assert "audit" not in text


def test_a_check_counts_no_graph_out_of_sight_among_those_of_one_name(
    product: Product, owner: httpx.Client, people: dict[str, Who]
) -> None:
    made = [
        owner.post("/api/graphs", json=graph_file(name, step)).json()["id"]
        for name, step in (("Twin", "Go"), ("Twin", "Wait"), ("Of twins", "Twin"))
    ]
    nobody = people["editor, named nobody"].headers

    def codes(headers: dict[str, str]) -> set[str]:
        url = f"{product.url}/api/graphs/{made[2]}/problems"
        answer = httpx.get(url, headers=headers, trust_env=False, timeout=30)
        assert answer.status_code == 200, answer.text
        return {each["code"] for each in answer.json()["problems"]}

    before = codes(nobody)
    rule = {"readers": [], "editors": []}
    owner.put(f"/api/graphs/{made[1]}/rule", json={"rule": rule}).raise_for_status()
    mine = {"authorization": f"Bearer {TOKEN}"}
    assert (codes(mine), codes(nobody)) == (before, before - {"subgraph-ambiguous"})
    owner.put(f"/api/graphs/{made[1]}/rule", json={"rule": None}).raise_for_status()
    for graph in made:
        owner.delete(f"/api/graphs/{graph}").raise_for_status()


def closed_with(socket: ClientConnection, seconds: float = 5) -> int | None:
    """Return the code with which the server closes a socket; 0 if it stays open so long."""
    try:
        while True:
            socket.recv(timeout=seconds)
    except ConnectionClosed as closed:
        return closed.rcvd.code if closed.rcvd is not None else None
    except TimeoutError:
        return 0


def test_an_open_room_is_closed_when_the_right_is_taken(
    product: Product, owner: httpx.Client, things: Things, people: dict[str, Who]
) -> None:
    graph = things.ids["graph_id"]
    url = f"ws://127.0.0.1:{product.port}/api/graphs/{graph}/room"
    rule = {"readers": [people["editor, named reader"].id], "editors": []}

    def room(key: str) -> ClientConnection:
        return connect(url, additional_headers=people[key].headers, open_timeout=20)

    with (
        room("editor, named nobody") as out,
        room("editor, named reader") as reader,
        room("owner, named nobody") as stays,
    ):
        assert owner.put(f"/api/graphs/{graph}/rule", json={"rule": rule}).status_code == 200
        assert closed_with(out) == 4404
        assert closed_with(reader) == 1012  # it comes back and may only look
        assert closed_with(stays, 1) == 0
    with room("editor, named reader"):
        pass
    with pytest.raises(InvalidStatus) as refused:
        room("editor, named nobody").close()
    assert refused.value.response.status_code == 404
    owner.put(f"/api/graphs/{graph}/rule", json={"rule": None})
    with room("editor, named nobody"):
        pass


def test_only_owners_move_things_where_others_would_see_them(
    product: Product, owner: httpx.Client, things: Things, people: dict[str, Who], ruled: None
) -> None:
    if ruled_by(owner, things) != "of its folder":
        return
    graph, folder = things.ids["graph_id"], things.ids["folder_id"]
    editor = people["editor, named editor"]
    with httpx.Client(
        base_url=product.url, trust_env=False, timeout=30, headers=editor.headers
    ) as http:
        out = http.put(f"/api/graphs/{graph}/folder", json={"folder": None})
        gone = http.delete(f"/api/folders/{folder}")
        alike = http.post("/api/folders", json={"name": FOLDER})
        assert (out.status_code, gone.status_code) == (403, 403)
        assert alike.status_code == 409  # who sees the folder is told
    nobody = people["editor, named nobody"]
    with httpx.Client(
        base_url=product.url, trust_env=False, timeout=30, headers=nobody.headers
    ) as http:
        alike = http.post("/api/folders", json={"name": FOLDER})
        assert alike.status_code == 201
        assert http.delete(f"/api/folders/{alike.json()['id']}").status_code == 204


def test_only_persons_and_groups_that_are_known_are_named(
    owner: httpx.Client, things: Things, people: dict[str, Who]
) -> None:
    known = people["editor, named reader"].id
    path = f"/api/graphs/{things.ids['graph_id']}/rule"
    answer = owner.put(path, json={"rule": {"readers": [known, "NoBoDy"], "editors": "all"}})
    assert (answer.status_code, answer.json()["where"]) == (400, {"path": "/rule/readers/1"})
    answer = owner.put(
        f"/api/graphs/{things.ids['draft_id']}/rule", json={"rule": {"readers": [], "editors": []}}
    )
    assert (answer.status_code, "its graph" in answer.text) == (409, True)


def test_the_runner_finds_sealed_what_counts(
    product: Product, owner: httpx.Client, things: Things, ruled: None
) -> None:
    graph = things.ids["graph_id"]
    folder = owner.get(f"/api/folders/{things.ids['folder_id']}/rule").json()
    rule = msgspec.convert(
        folder["own"] or owner.get(f"/api/graphs/{graph}/rule").json()["own"], Rule
    )
    deeper = owner.post(f"/api/graphs/{things.ids['draft_id']}/drafts", json={}).json()["id"]
    stored = msgspec.json.decode((product.data / FILE).read_bytes(), type=Statement)
    assert SEALS.holds(stored)
    assert {graph, things.ids["draft_id"], deeper} <= stored.graphs.keys()
    assert {stored.rule_of(each) for each in stored.graphs} == {rule}
    assert stored.rule_of(things.outer) == OPEN
    text = owner.get("/api/graph-rules").content
    assert msgspec.json.decode(text, type=Statement) == stored
    for version, graphs in (
        (things.ids["version_id"], {graph: rule}),
        (things.version_of_outer, {things.outer: OPEN, graph: rule}),
    ):
        content = owner.get(f"/api/versions/{version}/sight").content
        sight = msgspec.json.decode(content, type=Sight)
        assert SEALS.holds(sight)
        assert sight.at > stored.at
        assert dict(zip(sight.graphs, sight.rules, strict=True)) == graphs


def test_what_is_made_of_a_graph_is_for_those_who_see_it(
    product: Product, owner: httpx.Client, things: Things, people: dict[str, Who], ruled: None
) -> None:
    editor, nobody = people["editor, named editor"], people["editor, named nobody"]
    graph = things.ids["graph_id"]
    with httpx.Client(
        base_url=product.url, trust_env=False, timeout=30, headers=editor.headers
    ) as http:
        seq = http.get(f"/api/graphs/{things.outer}").json()["seq"]
        body = {"seq": seq, "name": "Flat copy"}
        flat = http.post(f"/api/graphs/{things.outer}/flat", json=body)
        assert flat.status_code == 201, flat.text
        document = http.get(f"/api/graphs/{graph}/document", params={"at": 1}).json()
        seq = http.get(f"/api/graphs/{graph}").json()["seq"]
        aid = next(iter(document["actions"])).partition("|")[0]
        body = {"seq": seq, "actions": [aid], "name": f"A part {ruled_by(owner, things)}"}
        part = http.post(f"/api/graphs/{graph}/subgraphs", json=body)
        assert part.status_code == 201, part.text
        copy = http.post(
            f"/api/graphs?copy_of={graph}", json=http.get(f"/api/graphs/{graph}/umrf").json()
        )
        assert copy.status_code == 201, copy.text
        for made in (flat.json()["id"], part.json()["graph"]["id"], copy.json()["id"]):
            assert http.get(f"/api/graphs/{made}").status_code == 200
            answer = httpx.get(f"{product.url}/api/graphs/{made}", headers=nobody.headers)
            assert answer.status_code == 404


def test_a_room_follows_the_groups_of_a_person(
    product: Product, owner: httpx.Client, groups: dict[str, str], things: Things
) -> None:
    graph, name = things.ids["graph_id"], "comes and goes"
    person = member(owner, name, "editor", (groups["reader"],))
    headers = browser(product, person, name, "editor")
    url = f"ws://127.0.0.1:{product.port}/api/graphs/{graph}/room"
    rule = {"readers": [groups["reader"]], "editors": []}
    assert owner.put(f"/api/graphs/{graph}/rule", json={"rule": rule}).status_code == 200
    with connect(url, additional_headers=headers, open_timeout=20) as socket:
        assert owner.patch(f"/api/members/{person}", json={"groups": []}).status_code == 200
        assert closed_with(socket, 20) == 4401  # the page comes back with what it may see now
    with pytest.raises(InvalidStatus) as refused:
        connect(url, additional_headers=headers).close()
    assert refused.value.response.status_code == 404
    assert owner.put(f"/api/graphs/{graph}/rule", json={"rule": None}).status_code == 200


def test_history_names_no_graph_out_of_sight(
    product: Product, owner: httpx.Client, things: Things, people: dict[str, Who], ruled: None
) -> None:
    action = owner.post("/api/actions", json={"name": STEP, "from_graphs": True})
    assert action.status_code == 201, action.text
    path = f"/api/actions/{action.json()['id']}"
    one_more_input = owner.get(f"{path}/umrf").json()
    one_more_input["input_parameters"] = {"speed": {"pvf_type": "number"}}
    owner.put(f"{path}/umrf", json=one_more_input)
    taken = owner.post(f"{path}/take", json={"graph": things.ids["graph_id"]})
    history = f"/api/graphs/{action.json()['id']}/history"
    sources = {
        key: [
            entry["adapted"]["document"]
            for entry in httpx.get(product.url + history, headers=people[key].headers).json()
            if "adapted" in entry
        ]
        for key in ("editor, named reader", "editor, named nobody")
    }
    assert taken.status_code == 200, taken.text
    assert things.ids["graph_id"] in sources["editor, named reader"]
    assert sources["editor, named nobody"] == [
        None if source == things.ids["graph_id"] else source
        for source in sources["editor, named reader"]
    ]
    assert httpx.delete(
        f"{product.url}/api/graphs/{action.json()['id']}",
        headers=people["owner, named nobody"].headers,
    ).is_success


def test_a_graph_is_deleted_and_brought_back_by_who_may_edit_it(
    product: Product, owner: httpx.Client, things: Things, people: dict[str, Who], ruled: None
) -> None:
    made = owner.post(f"/api/graphs?folder={things.ids['folder_id']}", json={"name": "Short"})
    graph = made.json()["id"]
    own = owner.get(f"/api/graphs/{things.ids['graph_id']}/rule").json()["counts"]
    assert owner.put(f"/api/graphs/{graph}/rule", json={"rule": own}).status_code == 200
    keys = ("editor, named nobody", "editor, named reader", "editor, named editor")
    codes = [
        httpx.delete(f"{product.url}/api/graphs/{graph}", headers=people[key].headers).status_code
        for key in keys
    ]
    assert codes[:2] == [404, 403]
    assert codes[2] < 300
    listed = {
        key: graph
        in httpx.get(f"{product.url}/api/graphs?deleted=true", headers=people[key].headers).text
        for key in keys
    }
    assert list(listed.values()) == [False, True, True]
