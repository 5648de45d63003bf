"""Tokens of programs at every route and socket of both processes: each scope, before and after each
end of the token. The routes are those that the two OpenAPI documents name.
"""

import re
import time
from collections.abc import Iterator
from typing import get_args

import httpx
import msgspec
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from action_assistant.web.auth.identity import Identity, Scope
from action_assistant.web.auth.keys import Keys, Person
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.rights import SCOPES_FOR
from action_assistant.web.auth.roles import Permission, Role, allowed
from action_assistant.web.auth.token_text import digest_of, new_text
from action_assistant.web.auth.tokens import TokenFiles, TokenRecord, completed
from support.product import TOKEN, Product, running
from web.auth.test_invitations import closed, eventually
from web.auth.test_roles import PROCESSES, url_of

KEYS = Keys(TOKEN)
SCOPES: tuple[Scope, ...] = get_args(Scope)
#: Each single scope, as a person gives it, and all together.
SETS = [completed([scope]) for scope in SCOPES] + [frozenset(SCOPES)]
ENDS = ("valid", "expired", "revoked", "person", "link")
#: Routes for people alone, whatever the token: they make or show what lets somebody in, or take the
#: word of somebody who looks.
FOR_PEOPLE = {
    ("get", "/api/tokens"),
    ("post", "/api/tokens"),
    ("post", "/api/logins/look"),
    ("post", "/api/logins/confirm"),
    ("post", "/api/logins/refuse"),
    ("post", "/api/tokens/{token}/revoke"),  # of another token
    ("get", "/api/mentions"),
    ("post", "/api/mentions/read"),
    ("post", "/api/approvals"),
    ("post", "/api/approvals/asked"),
    ("post", "/api/runs/{run}/at_rest"),
    ("post", "/api/runs/{run}/go_on"),
    ("post", "/api/runs/{run}/step"),
    ("put", "/api/runs/{run}/breakpoints"),
    ("post", "/api/runs/{run}/outcome"),
    ("post", "/api/runs/{run}/questions/{question}/answer"),
    ("post", "/api/runs/{run}/questions/{question}/photo"),
    ("post", "/api/repeats/{repeat}/start"),
    ("post", "/api/repeats/{repeat}/open"),
    ("post", "/api/queue/{entry}/start"),
    ("post", "/api/queue/robots/{name}/open"),
    ("post", "/api/robots/{name}/drills"),
}
#: Paths of which every route is for people, or for links that show one thing.
OF_OTHERS = ("/api/devices", "/api/view/", "/api/confirmations", "/api/passkeys")


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A running editor and runner."""
    with running(tmp_path_factory.mktemp("scopes") / "data") as found:
        yield found


def token(product: Product, scopes: frozenset[Scope], role: Role, end: str) -> str:
    """A token in the data folder that has ended, or not, in one of the ways."""
    tokens = TokenFiles(product.data, KEYS, Revocations(product.data))
    maker = Identity(Person(f"maker{time.monotonic_ns()}", "Mari", role))
    made = new_text("".join(f"{time.monotonic_ns():012}"[-12:]))
    record = TokenRecord(
        id=made.split("_")[1],
        name="nightly",
        sha256=digest_of(made),
        scopes=tuple(sorted(scopes)),
        role=role,
        person=maker.person,
        made_at=0.0,
        expires=time.time() + (-60 if end == "expired" else 600),
        invitation=f"link{made[4:16]}" if end.startswith("link") else None,
    )
    record = msgspec.structs.replace(record, seal=tokens._seal(record))
    tokens.adopt(record)
    revoked = Revocations(product.data)
    match end:
        case "revoked":
            tokens.revoke(record.id)
        case "person":
            revoked.end_person(record.person.id)
        case "link":
            revoked.add(record.invitation or "")
    return made


def expected(
    method: str,
    path: str,
    needed: Permission | None,
    scopes: frozenset[Scope],
    role: Role,
    end: str,
) -> int | None:
    """The refusal that a cell of the matrix has to have; None where it must be none."""
    if end in {"revoked", "person", "link"} or (end == "expired" and needed != "stop"):
        return 401
    if (method, path) in FOR_PEOPLE or path.startswith(OF_OTHERS):
        return 403
    if needed is None:
        return None
    return None if allowed(role, needed) and scopes & SCOPES_FOR[needed] else 403


def ask(client: httpx.Client, method: str, path: str, headers: dict[str, str]) -> int:
    """The status of a request for a thing that is not there, with a body that means nothing."""
    url = re.sub(r"\{[^}]*\}", "nothing", path.replace("{seq}", "1"))
    content = b"" if method in {"get", "delete"} else b"[]"
    with client.stream(method, url, headers=headers, content=content) as answer:
        if "event-stream" not in answer.headers.get("content-type", ""):
            answer.read()  # so that the connection is used again
        return answer.status_code


def declared(product: Product, process: str) -> list[tuple[str, str, Permission | None]]:
    """Method, path and permission of every route that does not answer strangers."""
    schema = httpx.get(
        f"{url_of(product, process)}/schema/openapi.json",
        headers={"authorization": f"Bearer {TOKEN}"},
        trust_env=False,
    ).json()
    return [
        (method, path, operation.get("x-needs"))
        for path, item in schema["paths"].items()
        for method, operation in item.items()
        if operation.get("security") != []
    ]


@pytest.mark.parametrize("process", PROCESSES)
def test_every_scope_at_every_route_before_and_after_every_end(
    product: Product, process: str
) -> None:
    found = declared(product, process)
    assert len(found) > 20
    every = frozenset(SCOPES)
    tokens = [("owner", each, end) for each in SETS for end in ("valid", "expired", "revoked")]
    tokens += [("owner", every, end) for end in ("person", "link")]
    # The role is looked at while a token is valid; an end is an end for every role.
    tokens += [(role, every, "valid") for role in get_args(Role)]
    wrong, cells = [], 0
    with httpx.Client(base_url=url_of(product, process), trust_env=False, timeout=20) as client:
        for role, scopes, end in tokens:
            headers = {"authorization": f"Bearer {token(product, scopes, role, end)}"}
            for method, path, needed in found:
                refusal = expected(method, path, needed, scopes, role, end)
                status = ask(client, method, path, headers)
                cells += 1
                if (status != refusal) if refusal else status in {401, 403}:
                    wrong.append((role, end, sorted(scopes), method, path, needed, status))
    assert wrong[:20] == []
    assert cells == len(tokens) * len(found)


def upgraded(url: str, text: str) -> int:
    """The status with which a program's socket is answered."""
    try:
        with connect(
            url.replace("http", "ws", 1),
            additional_headers={"authorization": f"Bearer {text}"},
            proxy=None,
            open_timeout=5,
        ):
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


def test_every_scope_at_both_sockets(product: Product) -> None:
    with product.editor() as editor:
        graph = editor.post("/api/graphs", json={"name": "task"}).json()["id"]
    sockets = (f"{product.url}/api/graphs/{graph}/room", f"{product.runner_url}/api/live")
    for scopes, end in ((each, end) for each in SETS for end in ENDS):
        text = token(product, scopes, "owner", end)
        for url in sockets:
            sees = bool(scopes & SCOPES_FOR["see"])
            wanted = 401 if end != "valid" else 101 if sees else 403
            assert upgraded(url, text) == wanted, (url, sorted(scopes), end)


def test_no_address_lets_a_token_in(product: Product) -> None:
    text = token(product, frozenset(SCOPES), "owner", "valid")
    for url in (f"{product.url}/api/graphs", f"{product.runner_url}/api/runs"):
        for query in ({"token": text}, {"access_token": text}, {"authorization": f"Bearer {text}"}):
            assert httpx.get(url, params=query, trust_env=False).status_code == 401
    assert text.split("_")[2] not in product.log.read_text()


def test_a_token_is_no_session(product: Product) -> None:
    text = token(product, frozenset(SCOPES), "owner", "valid")
    with httpx.Client(base_url=product.url, trust_env=False) as client:
        assert client.post("/api/session", json={"token": text}).status_code == 401
        assert (
            client.post("/api/session", json={"name": "Eve"}, headers=bearer(text)).status_code
            == 401
        )


def test_an_open_socket_of_a_revoked_token_is_closed_in_both_processes(product: Product) -> None:
    with product.editor() as editor:
        graph = editor.post("/api/graphs", json={"name": "task"}).json()["id"]
    for end in ("token", "person", "link"):
        text = token(
            product, completed(["edit"]), "owner", "link-later" if end == "link" else "valid"
        )
        name = text.split("_")[1]
        tokens = TokenFiles(product.data, KEYS, Revocations(product.data))
        record = tokens.get(name)
        with (
            connect(
                f"{product.url}/api/graphs/{graph}/room".replace("http", "ws", 1),
                additional_headers=bearer(text),
                proxy=None,
            ) as room,
            connect(
                f"{product.runner_url}/api/live".replace("http", "ws", 1),
                additional_headers=bearer(text),
                proxy=None,
            ) as live,
        ):
            match end:
                case "token":
                    with product.editor() as editor:
                        editor.post(f"/api/tokens/{name}/revoke").raise_for_status()
                case "person":
                    Revocations(product.data).end_person(record.person.id)
                case "link":
                    Revocations(product.data).add(record.invitation or "")
            assert (closed(room), closed(live)) == (4401, 4401)


def test_a_token_with_read_alone_stops_runs_also_when_it_has_expired(product: Product) -> None:
    for end in ("valid", "expired"):
        headers = bearer(token(product, completed(["read"]), "viewer", end))
        answer = httpx.post(f"{product.runner_url}/api/stop", headers=headers, trust_env=False)
        assert answer.status_code == 202
    for scope in ("scrape", "hooks"):
        headers = bearer(token(product, frozenset([scope]), "owner", "valid"))
        answer = httpx.post(f"{product.runner_url}/api/stop", headers=headers, trust_env=False)
        assert answer.status_code == 403


def test_a_token_ends_itself_and_no_other(product: Product) -> None:
    mine, other = (token(product, completed(["read"]), "owner", "valid") for _ in range(2))
    with httpx.Client(base_url=product.url, trust_env=False, headers=bearer(mine)) as client:
        path = "/api/tokens/{}/revoke"
        assert client.post(path.format(other.split("_")[1])).status_code == 403
        assert client.post(path.format(mine.split("_")[1])).status_code == 204
        assert client.get("/api/graphs").status_code == 401
    answer = httpx.get(f"{product.runner_url}/api/runs", headers=bearer(mine), trust_env=False)
    assert answer.status_code == 401


def test_an_owner_sees_all_tokens_others_their_own(product: Product) -> None:
    session = KEYS.new_session("Ada", role="editor")
    page = {"cookie": f"aa_{product.port}={KEYS.sealed(session)}", "origin": product.url}
    with httpx.Client(base_url=product.url, trust_env=False) as http, product.editor() as owner:
        made = http.post("/api/tokens", json={"name": "a", "scopes": ["edit"]}, headers=page).json()
        theirs = owner.post("/api/tokens", json={"name": "b", "scopes": ["operate"]}).json()
        mine = http.get("/api/tokens", headers=page).json()["tokens"]
        assert [each["record"]["id"] for each in mine] == [made["record"]["id"]]
        every = {each["record"]["id"] for each in owner.get("/api/tokens").json()["tokens"]}
        assert every >= {made["record"]["id"], theirs["record"]["id"]}
        path = f"/api/tokens/{theirs['record']['id']}/revoke"
        assert http.post(path, headers=page).status_code == 403
        too_much = http.post("/api/tokens", json={"name": "c", "scopes": ["operate"]}, headers=page)
        assert too_much.status_code == 403
        assert "cannot give the scope operate" in too_much.json()["detail"]
        used = {"authorization": f"Bearer {made['token']}"}
        assert http.get("/api/graphs", headers=used).status_code == 200

        def noted() -> bool:
            (found,) = http.get("/api/tokens", headers=page).json()["tokens"]
            return found.get("used", {}).get("address") == ""

        eventually(noted)
        assert owner.post(f"/api/tokens/{made['record']['id']}/revoke").status_code == 204


def test_a_program_renames_nobody(product: Product) -> None:
    session = KEYS.new_session("Mari", role="editor")
    page = {"cookie": f"aa_{product.port}={KEYS.sealed(session)}", "origin": product.url}
    with httpx.Client(base_url=product.url, trust_env=False) as http:
        body = {"name": "nightly", "scopes": ["edit"]}
        made = http.post("/api/tokens", json=body, headers=page).json()
        renamed = KEYS.new_session("Mari K", role="editor", person_id=session.person.id)
        page["cookie"] = f"aa_{product.port}={KEYS.sealed(renamed)}"
        for headers in (page, bearer(made["token"])):
            http.post("/api/graphs", json={"name": "task"}, headers=headers).raise_for_status()
        known = {each["id"]: each["name"] for each in http.get("/api/people", headers=page).json()}
        assert known[session.person.id] == "Mari K"


def test_strangers_who_ask_for_codes_disturb_neither_the_owner_nor_stop(product: Product) -> None:
    wanted = {"name": "x", "scopes": ["operate"]}
    with httpx.Client(base_url=product.url, trust_env=False) as stranger:
        states = [stranger.post("/api/logins", json=wanted).status_code for _ in range(30)]
        assert states.count(200) == 10
        assert states[-1] == 429
        claims = [
            stranger.post("/api/logins/claim", json={"secret": f"{number:043}"}).status_code
            for number in range(200)
        ]
        assert set(claims) == {200, 429}
        assert stranger.post("/api/logins/look", json={"code": "BCDF-GHJK"}).status_code == 401
    with product.editor() as owner, product.runner() as runner:
        assert owner.get("/api/graphs").status_code == 200
        assert runner.post("/api/stop").status_code == 202


def test_a_runner_takes_no_record_of_strangers(product: Product) -> None:
    tokens = TokenFiles(
        product.data.parent / "other", Keys("o" * 43), Revocations(product.data.parent / "other")
    )
    made = tokens.make(Identity(Person("eve", "Eve", "owner")), "x", ["operate"])
    body = {"record": msgspec.to_builtins(made.record)}
    url = f"{product.runner_url}/api/tokens/records"
    assert httpx.post(url, json=body, trust_env=False).status_code == 400
    assert (
        httpx.get(
            f"{product.runner_url}/api/runs", headers=bearer(made.token), trust_env=False
        ).status_code
        == 401
    )


def bearer(text: str) -> dict[str, str]:
    return {"authorization": f"Bearer {text}"}
