"""Strangers who guess codes and links from many addresses: nobody comes in, and neither the owner nor a
Stop waits for them. A code that is sent by two at once lets one in.

`TEST_GUESSES=1000` for the long dose (`make soak ARGS=guesses`).
"""

import os
import secrets
import statistics
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

import httpx
import pytest

from action_assistant.random_ids import random_id
from support.product import Product
from web.auth.test_ending import sharing
from web.auth.test_invitations import Arrive, arrive
from web.auth.test_members import added, come

__all__ = ["arrive"]  # a fixture

GUESSES: Final = int(os.environ.get("TEST_GUESSES", "60"))  # of each kind
ADDRESSES: Final = min(100, GUESSES)
_LETTERS: Final = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A shared server, with its limits."""
    with sharing(tmp_path_factory.mktemp("guesses") / "data") as product:
        yield product


def code() -> str:
    return "".join(secrets.choice(_LETTERS) for _ in range(8))


def link() -> str:
    return f"{random_id()}.{secrets.token_urlsafe(32)}"


#: What is guessed: the path, and the body of one guess.
KINDS: Final[dict[str, tuple[str, Callable[[], dict[str, Any]]]]] = {
    "code of a device": ("/api/session/device", lambda: {"code": code()}),
    "claim of a device": (
        "/api/session/device/answer",
        lambda: {"claim": secrets.token_urlsafe(32)},
    ),
    "secret of a login": ("/api/logins/claim", lambda: {"secret": secrets.token_urlsafe(32)}),
    "link": ("/api/session", lambda: {"invitation": link(), "name": "Eve"}),
    "look at a link": ("/api/session/invitation", lambda: {"invitation": link()}),
    "token": ("/api/session", lambda: {"token": secrets.token_urlsafe(32)}),
}


def at_once(number: int, ask: Callable[[], httpx.Response]) -> list[int]:
    """Return the statuses of requests that are sent in the same moment."""
    gate = threading.Barrier(number)

    def one(_: int) -> int:
        gate.wait()
        return ask().status_code

    with ThreadPoolExecutor(number) as pool:
        return sorted(pool.map(one, range(number)))


@pytest.mark.long
def test_a_code_and_a_claim_that_are_sent_at_once_let_one_in(
    product: Product, arrive: Arrive
) -> None:
    """Before the guesses, which use up the tries of a minute."""
    guest = arrive(product)
    come(guest, added(product, "Mari"))
    headers = {"origin": product.url}

    def post(path: str, **body: Any) -> httpx.Response:
        url = product.url + path
        return httpx.post(url, json=body, headers=headers, trust_env=False, timeout=30)

    for _ in range(4):
        made = guest.http.post("/api/devices/codes").json()
        claims: list[str] = []

        def send(code: str = made["code"], claims: list[str] = claims) -> httpx.Response:
            answer = post("/api/session/device", code=code)
            if answer.is_success:
                claims.append(answer.json()["claim"])
            return answer

        statuses = at_once(6, send)
        assert statuses == [200, *[401] * 5]
        path = f"/api/devices/codes/{made['id']}/answer"
        assert guest.http.post(path, json={"yes": True}).status_code == 204
        claim = claims[0]
        asked = at_once(6, lambda claim=claim: post("/api/session/device/answer", claim=claim))
        assert asked == [200, *[401] * 5]


def times(product: Product, over: threading.Event | None, at_least: int) -> dict[str, list[float]]:
    """Return how long the owner waited for a list and for a Stop, in seconds, until `over`."""
    found: dict[str, list[float]] = {"list": [], "stop": []}
    with product.editor() as editor, product.runner() as runner:
        while len(found["stop"]) < at_least or (over is not None and not over.is_set()):
            for name, ask in (
                ("list", lambda: editor.get("/api/graphs")),
                ("stop", lambda: runner.post("/api/stop")),
            ):
                begun = time.monotonic()
                assert ask().is_success
                found[name].append(time.monotonic() - begun)
    return found


def test_guesses_from_many_addresses_let_nobody_in_and_disturb_nobody(product: Product) -> None:
    idle = times(product, None, 20)
    answers: Counter[tuple[str, int]] = Counter()
    over = threading.Event()

    def guess(number: int) -> None:
        transport = httpx.HTTPTransport(local_address=f"127.0.1.{number + 1}")
        with httpx.Client(base_url=product.url, transport=transport, timeout=60) as stranger:
            for kind, (path, body) in KINDS.items():
                for _ in range(GUESSES // ADDRESSES):
                    answer = stranger.post(path, json=body(), headers={"origin": product.url})
                    answers[kind, answer.status_code] += 1

    with ThreadPoolExecutor(9) as pool:
        watching = pool.submit(times, product, over, 20)
        for done in [pool.submit(guess, number) for number in range(ADDRESSES)]:
            done.result()
        over.set()
        busy = watching.result()
    assert {status for _, status in answers} <= {401, 429} | {200}
    assert {kind for kind, status in answers if status == 200} <= {"secret of a login"}  # "gone"
    assert sum(answers.values()) == len(KINDS) * (GUESSES // ADDRESSES) * ADDRESSES
    for name in ("list", "stop"):
        before, beside = (sorted(each[name]) for each in (idle, busy))
        told = (
            f"{statistics.median(before) * 1e3:.1f} ms idle, {statistics.median(beside) * 1e3:.1f}"
        )
        print(f"{name}: {told} beside the guesses, at most {beside[-1] * 1e3:.0f}")  # noqa: T201
    with product.editor() as editor:  # who is known goes on as before
        assert editor.get("/api/members").status_code == 200
