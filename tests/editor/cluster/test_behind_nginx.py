"""Three editors behind the documented nginx: whoever comes by it sees one server, also when an editor is killed."""

import asyncio
import contextlib
import ssl
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
import pytest

from editor.cluster.clients import Stubborn
from editor.cluster.several import OneOfSeveral, started
from editor.process import BEARER
from journal.servers import Server
from support.product import free_ports
from support.provider import CLIENT, SECRET, provided
from support.proxy import EDITORS, NGINX, nginx
from support.waiting import wait_until
from web.auth.test_passkeys import Authenticator

pytestmark = pytest.mark.skipif(not NGINX, reason="nginx is not installed")


class ByProxy:
    """The way through nginx."""

    def __init__(self, url: str, chain: Path) -> None:
        self.url = url
        self.trust = ssl.create_default_context(cafile=str(chain))

    @contextlib.asynccontextmanager
    async def socket(self, graph: str) -> AsyncIterator[httpx_ws.AsyncWebSocketSession]:
        """A socket into a room."""
        room = f"{self.url.replace('https', 'wss', 1)}/api/graphs/{graph}/room"
        async with (
            httpx.AsyncClient(verify=self.trust, trust_env=False) as client,
            httpx_ws.aconnect_ws(room, client, headers={**BEARER}) as session,
        ):
            yield session


@contextlib.contextmanager
def three_editors(
    folder: Path, postgres: Server, mistake: tuple[str, str] = ("", "")
) -> Iterator[tuple[list[OneOfSeveral], ByProxy]]:
    """Three editors behind nginx. `mistake`: a text of its documented file, and its replacement."""
    port, database = free_ports(), postgres.new_database()
    url = f"https://localhost:{port}"
    editors = [
        OneOfSeveral(folder / "data", database, n, f"127.0.0.{n + 1}", "--public-url", url)
        for n in range(3)
    ]
    for each in editors[1:]:
        each.port = editors[0].port
    proxy = nginx(
        folder / "proxy",
        name="localhost",
        port=port,
        editor=editors[0].port,
        mistake=mistake,
        documented=EDITORS,
    )
    with started(editors), proxy as chain:
        yield editors, ByProxy(url, chain)


async def test_a_killed_editor_is_not_missed_behind_the_documented_nginx(
    tmp_path: Path, postgres: Server
) -> None:
    with three_editors(tmp_path, postgres) as (editors, way):
        url = way.url
        async with httpx.AsyncClient(
            base_url=url, verify=way.trust, trust_env=False, timeout=20
        ) as page:
            origin = {"origin": url}
            token = BEARER["authorization"][7:]
            came = await page.post(
                "/api/session", json={"token": token, "name": "Ada"}, headers=origin
            )
            assert came.is_success, came.text
            graphs: list[str] = []
            for n in range(4):
                made = await page.post("/api/graphs", json={"name": f"g{n}"}, headers=origin)
                graphs.append(made.json()["id"])
            ways: list[Any] = [way]
            people = {
                graph: [Stubborn(f"{n}", ways, 0, graph) for n in range(3)] for graph in graphs
            }
            for round_ in range(60):
                for some in people.values():
                    some[round_ % 3].write()
                await asyncio.sleep(0.05)
                if round_ == 20:
                    editors[1].kill()
                if round_ == 40:
                    editors[0].kill()
            for some in people.values():
                keys = set().union(*(each.written for each in some))
                await wait_until(
                    lambda some=some, keys=keys: all(each.has(keys) for each in some), 90
                )
            for some in people.values():
                for each in some:
                    await each.aclose()
            listed = await page.get("/api/graphs")
            assert {each["id"] for each in listed.json()} >= set(graphs)
            assert (await page.get("/api/session")).is_success


async def test_what_begins_at_one_editor_while_somebody_signs_in_ends_at_another_once(
    tmp_path: Path, postgres: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    with provided() as provider:
        for name, value in {
            "ISSUER": provider.issuer,
            "CLIENT_ID": CLIENT,
            "CLIENT_SECRET": SECRET,
            "GROUPS": "lab=operator",
        }.items():
            monkeypatch.setenv(f"ACTION_ASSISTANT_OIDC_{name}", value)
        # Each request goes to the next editor.
        with three_editors(tmp_path, postgres, (" backup;", ";")) as (_, way):
            async with contextlib.AsyncExitStack() as stack:

                async def browser() -> Asking:
                    page = httpx.AsyncClient(
                        base_url=way.url, verify=way.trust, trust_env=False, timeout=20
                    )
                    return Asking(await stack.enter_async_context(page), way.url)

                ada = await browser()
                token = BEARER["authorization"][7:]
                await ada.ask("/api/session", token=token, name="Ada")
                for _ in range(3):
                    await adds_a_device(ada, [await browser() for _ in range(6)])
                await lets_a_program_in(ada, [await browser() for _ in range(6)])
                await registers_a_passkey(ada)
                guesses = [await ada.post("/api/logins/look", code=f"BBBB{n}") for n in range(25)]
                assert {each.status_code for each in guesses} == {404, 429}

                mari = await browser()
                url = (await mari.ask("/api/session/provider"))["url"]
                answer = provider.authorize(url)
                cookies = "; ".join(f"{name}={value}" for name, value in mari.page.cookies.items())
                asked = dict(provider.codes)
                came = await mari.ask("/api/session/provider/answer", **answer)
                assert came["signed_in"]["person"]["name"] == "Mari"
                for _ in range(3):
                    provider.codes.update(asked)  # it forgets that it was used
                    again = await browser()
                    again.page.headers["cookie"] = cookies
                    refused = await again.post("/api/session/provider/answer", **answer)
                    assert (refused.status_code, "answered already" in refused.text) == (401, True)


class Asking:
    """A browser."""

    def __init__(self, page: httpx.AsyncClient, origin: str) -> None:
        self.page = page
        self.origin = origin

    async def post(self, path: str, **body: Any) -> httpx.Response:
        """Send a request, and return the answer."""
        return await self.page.post(path, json=body, headers={"origin": self.origin})

    async def ask(self, path: str, **body: Any) -> Any:
        """Return what is answered to a request, which must not be refused."""
        answer = await self.post(path, **body)
        assert answer.is_success, answer.text
        return answer.json() if answer.content else None


async def adds_a_device(ada: Asking, others: list[Asking]) -> None:
    """Let all others send a code of Ada at once, and then all ask for the session."""
    made = await ada.ask("/api/devices/codes")
    sent = [each.post("/api/session/device", code=made["code"]) for each in others]
    answers = await asyncio.gather(*sent)
    assert sorted(each.status_code for each in answers) == [200, 401, 401, 401, 401, 401]
    (waiting,) = (each.json() for each in answers if each.is_success)
    path = f"/api/devices/codes/{made['id']}"
    seen = (await ada.page.get(path)).json()
    assert seen["number"] == waiting["number"]
    assert not await others[0].ask("/api/session/device/answer", claim=waiting["claim"])
    await ada.ask(f"{path}/answer", yes=True)
    collected = [each.post("/api/session/device/answer", claim=waiting["claim"]) for each in others]
    came = [each for each in await asyncio.gather(*collected) if each.is_success]
    assert [each.json()["signed_in"]["person"]["name"] for each in came] == ["Ada"]


async def lets_a_program_in(ada: Asking, others: list[Asking]) -> None:
    """Let a program ask for a token in six requests at once."""
    begun = await others[0].ask("/api/logins", name="nightly", scopes=["read"])
    waits = await others[1].ask("/api/logins/claim", secret=begun["secret"])
    assert waits["state"] == "waiting"
    wanted = await ada.ask("/api/logins/look", code=begun["code"])
    assert (wanted["name"], wanted["state"]) == ("nightly", "waiting")
    await ada.ask("/api/logins/confirm", code=begun["code"], name="nightly", scopes=["read"])
    asked = [each.ask("/api/logins/claim", secret=begun["secret"]) for each in others]
    states = sorted(each["state"] for each in await asyncio.gather(*asked))
    assert states == ["gone", "gone", "gone", "gone", "gone", "granted"]


async def registers_a_passkey(ada: Asking) -> None:
    """Let Ada register a passkey by three requests at once: a challenge counts once."""
    options = (await ada.ask("/api/passkeys/challenge"))["options"]
    made = Authenticator().create(options, ada.origin)
    sent = [ada.post("/api/passkeys", name="Key", credential=made) for _ in range(3)]
    statuses = sorted(each.status_code for each in await asyncio.gather(*sent))
    assert statuses == [201, 403, 403]
