"""Behind a proxy: the editor and the runner at one public address, below a path. Real processes; what
a proxy would send is sent as it sends it."""

from collections.abc import Iterator
from typing import Any

import anyio
import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from action_assistant.public_url import proxies
from action_assistant.web.server.proxy import Forwarded
from support.product import TOKEN, Product, running

ORIGIN = "https://robots.example.org"
BEARER = {"authorization": f"Bearer {TOKEN}"}
#: Headers of a browser's request as a proxy passes it on.
PROXIED = {"host": "robots.example.org", "x-forwarded-for": "203.0.113.9"}


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    flags = ("--public-url", f"{ORIGIN}/temoto/")
    with running(tmp_path_factory.mktemp("behind") / "data", *flags) as found:
        yield found


def ask(url: str, method: str = "GET", **more: Any) -> httpx.Response:
    """A request of its own, without cookies of others."""
    headers = {**PROXIED, **more.pop("headers", {})}
    return httpx.request(method, url, headers=headers, trust_env=False, timeout=20, **more)


def signed_in(product: Product, **headers: str) -> httpx.Response:
    """The answer to who trades the token at the public address."""
    return ask(
        f"{product.url}/temoto/api/session",
        "POST",
        headers={"origin": ORIGIN, **headers},
        json={"token": TOKEN, "name": "Ada"},
    )


def test_both_processes_answer_below_one_address_with_and_without_the_path(
    product: Product,
) -> None:
    for path in ("/temoto/healthz", "/healthz"):
        assert ask(product.url + path).json()["status"] == "ok"
    for path in ("/temoto/runner/healthz", "/healthz"):
        assert ask(product.runner_url + path).json()["status"] == "ok"
    for path in ("/temoto/api/config", "/api/config"):
        config = ask(product.url + path, headers=BEARER).json()
        assert config["runner_url"] == f"{ORIGIN}/temoto/runner"
    with product.editor() as direct:
        assert direct.get("/api/config").json()["runner_url"] == product.runner_url


def test_the_page_finds_what_is_beside_it_at_every_address_of_its_own(product: Product) -> None:
    pages = {path: ask(product.url + path, headers={"accept": "text/html"}).text for path in (
        "/temoto/", "/temoto/graphs/abc", "/graphs/abc", "/"
    )}  # fmt: skip
    assert len(set(pages.values())) == 1
    assert 'content="/temoto/"' in pages["/temoto/"]
    asset = pages["/temoto/"].split('src="', 1)[1].split('"', 1)[0]
    assert asset.startswith("/temoto/assets/")
    assert "javascript" in ask(product.url + asset).headers["content-type"]
    direct = httpx.get(product.url, headers={"accept": "text/html"}, trust_env=False).text
    assert 'content="/"' in direct
    assert 'src="/assets/' in direct
    slash = ask(f"{product.url}/temoto")
    assert (slash.status_code, slash.headers["location"]) == (308, "/temoto/")


def test_locations_of_new_graphs_are_below_the_public_path(product: Product) -> None:
    made = ask(f"{product.url}/temoto/api/graphs", "POST", headers=BEARER, json={"name": "patrol"})
    assert made.headers["location"] == f"/temoto/api/graphs/{made.json()['id']}"
    with product.editor() as direct:
        made = direct.post("/api/graphs", json={"name": "patrol 2"})
        assert made.headers["location"].startswith("/api/graphs/")


def test_a_session_is_for_this_path_and_this_encryption_only(product: Product) -> None:
    cookie = signed_in(product).headers["set-cookie"]
    attributes = {each.strip().lower() for each in cookie.split(";")[1:]}
    assert {"secure", "httponly", "samesite=strict", "path=/temoto/"} <= attributes
    value = {"cookie": cookie.split(";")[0]}
    assert ask(f"{product.runner_url}/temoto/runner/api/runs", headers=value).json() == []
    bye = ask(
        f"{product.url}/temoto/api/session", "DELETE", headers={**value, "origin": ORIGIN}
    ).headers["set-cookie"]
    assert "path=/temoto/" in bye.lower()
    plain = httpx.post(
        f"{product.url}/api/session", json={"token": TOKEN, "name": "Ada"}, trust_env=False
    ).headers["set-cookie"]
    assert "secure" not in plain.lower()
    assert "path=/;" in f"{plain.lower()};"


@pytest.mark.parametrize(
    "origin",
    ["http://robots.example.org", "https://robots.example.org:8000", "https://example.org"],
)
def test_only_pages_of_the_public_address_may_call(product: Product, origin: str) -> None:
    refused = signed_in(product, origin=origin)
    assert (refused.status_code, refused.json()["type"]) == (403, "wrong-origin")
    refused = ask(f"{product.url}/healthz", headers={"host": "robots.example.com"})
    assert (refused.status_code, refused.json()["type"]) == (403, "wrong-host")


def test_a_proxy_that_replaces_the_host_is_told_so_before_anything_else_goes_wrong(
    product: Product,
) -> None:
    refused = signed_in(product, host=f"127.0.0.1:{product.port}")
    assert (refused.status_code, refused.json()["type"]) == (403, "wrong-host")
    assert "pass on the Host header" in refused.json()["detail"]
    page = ask(  # which says it to people
        f"{product.url}/temoto/graphs/abc",
        headers={"host": f"127.0.0.1:{product.port}", "origin": ORIGIN, "accept": "text/html"},
    )
    assert page.status_code == 200
    assert 'src="/temoto/assets/' in page.text


def test_a_proxy_that_leads_the_runners_part_to_the_editor_is_told_so(product: Product) -> None:
    for method, path in (("GET", "/api/runs"), ("POST", "/api/stop")):
        refused = ask(f"{product.url}/temoto/runner{path}", method, headers=BEARER)
        assert (refused.status_code, refused.json()["type"]) == (502, "misrouted")
        assert f"port {product.port + 1}" in refused.json()["detail"]


def test_stop_is_a_stop_below_the_path_too(product: Product) -> None:
    path = f"{product.runner_url}/temoto/runner/api/stop"
    answer = ask(path, "POST", headers={**BEARER, "origin": ORIGIN}, json={})
    assert answer.status_code in {200, 202}
    assert "server-timing" in answer.headers
    live = path.replace("http", "ws", 1).replace("/api/stop", "/api/live")
    with pytest.raises(InvalidStatus) as refused:
        connect(live, origin="https://evil.example", additional_headers=BEARER)
    assert refused.value.response.status_code == 403


def test_events_are_not_kept_back_by_a_proxy(product: Product) -> None:
    url = f"{product.url}/temoto/api/events?after=0"
    with httpx.stream(
        "GET", url, headers={**PROXIED, **BEARER}, trust_env=False, timeout=20
    ) as stream:
        assert stream.headers["x-accel-buffering"] == "no"


def test_tries_are_counted_for_who_makes_them_not_for_the_proxy(product: Product) -> None:
    def tries(chain: str) -> int:
        headers = {"origin": ORIGIN, "x-forwarded-for": chain}
        url = f"{product.url}/temoto/api/session"
        return ask(url, "POST", headers=headers, json={"token": "wrong"}).status_code

    answers = [tries(f"198.51.100.{each}, 203.0.113.7") for each in range(80)]
    assert answers[0] == 401
    assert answers[-1] == 429
    assert tries("203.0.113.8") == 401


@pytest.mark.parametrize(
    ("trusted", "chain", "seen"),
    [
        ("127.0.0.0/8", ["198.51.100.1, 203.0.113.9"], "203.0.113.9"),
        ("127.0.0.0/8", ["198.51.100.1", "203.0.113.9"], "203.0.113.9"),
        ("127.0.0.0/8", ["203.0.113.9:4711"], "203.0.113.9"),
        ("127.0.0.0/8", ["[2001:db8::9]:4711"], "2001:db8::9"),
        ("127.0.0.0/8", ["2001:db8::9"], "2001:db8::9"),
        ("127.0.0.0/8", ["203.0.113.9, nonsense"], "127.0.0.1"),
        ("127.0.0.0/8", [""], "127.0.0.1"),
        ("127.0.0.0/8", [], "127.0.0.1"),
        ("127.0.0.1, 10.0.0.0/8", ["198.51.100.1, 203.0.113.9, 10.2.3.4"], "203.0.113.9"),
        ("127.0.0.1, 10.0.0.0/8", ["10.2.3.4"], "10.2.3.4"),
        ("10.0.0.0/8", ["203.0.113.9"], "127.0.0.1"),
        ("", ["203.0.113.9"], "127.0.0.1"),
    ],
)
def test_the_client_is_the_address_that_the_last_trusted_proxy_saw(
    trusted: str, chain: list[str], seen: str
) -> None:
    found: list[Any] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        found.append(scope["client"][0])

    headers = [(b"x-forwarded-for", each.encode()) for each in chain]
    scope: Any = {"type": "http", "client": ("127.0.0.1", 5), "headers": headers, "path": "/"}
    nothing: Any = None
    anyio.run(Forwarded(app, proxies(trusted)), scope, nothing, nothing)
    assert found == [seen]
