"""Confirming on another device: who is asked, who may answer, and that it is one answer."""

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.sync.client import ClientConnection, connect

from action_assistant.errors import Conflict, NotFound, TooMany
from action_assistant.runner.api.confirmation_requests import REQUEST_S, ConfirmationRequests
from action_assistant.web.auth.confirmations import ADDED_S, Confirmations
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Session
from action_assistant.web.auth.revocations import Revocations
from runner.process import TOKEN, RunnerProcess

KEYS = Keys(TOKEN)


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def device(person: str = "mari", *, added: bool = False) -> Session:
    return KEYS.new_session("Mari", role="operator", person_id=person, added=added)


def whose(session: Session) -> Identity:
    return Identity(session.person, session=session)


@given(
    steps=st.lists(
        st.tuples(
            st.sampled_from(["ask", "yes", "no", "wait", "cancel"]),
            st.sampled_from(["tablet", "phone", "new", "eve", "program"]),
        ),
        max_size=25,
    )
)
def test_no_order_of_steps_confirms_by_anything_but_one_answer_of_another_trusted_device(
    steps: list[tuple[str, str]],
) -> None:
    clock = Clock()
    requests = ConfirmationRequests(clock)
    tablet, phone = device(), device()
    session = {
        "tablet": whose(tablet),
        "phone": whose(phone),
        "new": whose(device(added=True)),
        "eve": whose(device("eve")),
        "program": Identity(phone.person),
    }
    made, answers, asked_at = "", 0, 0.0
    for step, by in steps:
        try:
            if step == "ask":
                made = requests.ask(session["tablet"], tablet, "Chrome", ("David",)).id
                answers, asked_at = 0, clock.now
            elif step == "wait":
                clock.now += REQUEST_S / 2
            elif step == "cancel":
                requests.cancel(made, tablet)
                made = ""
            else:
                requests.answer(made, session[by], yes=step == "yes")
                answers += 1
                assert by == "phone"
                assert answers == 1
                assert clock.now < asked_at + REQUEST_S
        except (NotFound, Conflict, TooMany):
            pass
        is_open = bool(made) and answers == 0 and clock.now < asked_at + REQUEST_S
        seen = {name for name, identity in session.items() if requests.shown_to(identity)}
        assert seen == ({"phone"} if is_open else set())


def test_a_device_that_was_added_counts_after_a_day() -> None:
    wall = Clock()
    wall.now = time.time()
    requests = ConfirmationRequests(now=wall)
    tablet, new = device(), whose(device(added=True))
    requests.ask(whose(tablet), tablet, "Chrome", ())
    assert requests.shown_to(new) == []
    wall.now += ADDED_S + 1
    assert len(requests.shown_to(new)) == 1


def test_nobody_is_asked_until_they_say_yes_to_be_left_in_peace() -> None:
    clock = Clock()
    requests = ConfirmationRequests(clock)
    tablet = device()
    for _ in range(5):
        requests.ask(whose(tablet), tablet, "Chrome", ())
    with pytest.raises(TooMany, match="wait a minute"):
        requests.ask(whose(tablet), tablet, "Chrome", ())
    clock.now += 60
    assert requests.ask(whose(tablet), tablet, "Chrome", ()).number


class Browser:
    """A browser of a person at the runner."""

    def __init__(self, process: RunnerProcess, session: Session) -> None:
        self.session = session
        self._url = f"http://127.0.0.1:{process.port}"
        self._headers = {
            "cookie": f"aa_{process.port - 1}={KEYS.sealed(session)}",
            "origin": f"http://127.0.0.1:{process.port - 1}",
        }
        self.http = httpx.Client(
            base_url=self._url, headers=self._headers, trust_env=False, timeout=20
        )

    def ask(self, *robots: str) -> dict[str, Any]:
        answer = self.http.post("/api/confirmations", json={"robots": robots})
        assert answer.status_code == 201, answer.text
        found: dict[str, Any] = answer.json()
        return found

    def answer(self, request: str, yes: bool = True) -> httpx.Response:
        return self.http.post(f"/api/confirmations/{request}/answer", json={"yes": yes})

    def look(self, request: str) -> dict[str, Any]:
        found: dict[str, Any] = self.http.get(f"/api/confirmations/{request}").json()
        return found

    @contextmanager
    def live(self) -> Iterator[ClientConnection]:
        url = self._url.replace("http", "ws")
        headers = {"cookie": self._headers["cookie"]}
        origin = self._headers["origin"]
        with connect(
            f"{url}/api/live", additional_headers=headers, origin=origin, proxy=None, max_size=None
        ) as socket:
            assert json.loads(socket.recv())["type"] == "hello"
            yield socket


Browse = Callable[..., Browser]


@pytest.fixture
def browse(process: RunnerProcess) -> Iterator[Browse]:
    """Make browsers of a person, each with a session; by default a new one."""
    with ExitStack() as stack:

        def made(session: Session | None = None) -> Browser:
            browser = Browser(process, session or device())
            stack.enter_context(browser.http)
            return browser

        yield made


def shown(socket: ClientConnection) -> list[dict[str, Any]]:
    """The requests that the next message about them has."""
    for text in socket:
        message = json.loads(text)
        if message["type"] == "confirm":
            found: list[dict[str, Any]] = message["asked"]
            return found
    raise AssertionError


def test_another_device_that_is_not_new_confirms_by_one_answer(
    process: RunnerProcess, browse: Browse
) -> None:
    tablet, phone, thief = browse(), browse(), browse(device(added=True))
    with process.client() as owner:
        owner.post("/api/robots", json={"name": "Asker", "domain": 187}).raise_for_status()
        rules = owner.put("/api/robots/Asker/rights", json={"ask_again": 5})
        assert rules.json()["ask_again"] == 5
        assert owner.put("/api/robots/Asker/rights", json={"ask_again": 1441}).status_code == 400
    assert tablet.http.get("/api/rights").json()["robots"][0]["why"] == ""
    assert tablet.http.post("/api/confirmations", json={"robots": ["<b>"]}).status_code == 404
    with phone.live() as socket, thief.live():
        asked = tablet.ask("Asker")
        (request,) = shown(socket)
        assert (request["number"], request["robots"]) == (asked["number"], ["Asker"])
        assert tablet.look(asked["id"])["devices"] == 1  # the added one is not asked
        assert tablet.answer(asked["id"]).status_code == 404
        assert thief.answer(asked["id"]).status_code == 404
        assert phone.answer(asked["id"], yes=False).status_code == 204
        assert shown(socket) == []
        assert tablet.look(asked["id"])["state"] == "refused"
        assert tablet.http.get("/api/confirmations/mine").json()["last"] is None
        asked = tablet.ask("Asker")
        with ThreadPoolExecutor(8) as threads:
            answers = threads.map(lambda _: phone.answer(asked["id"]).status_code, range(8))
        assert sorted(answers) == [204, *[409] * 7]
        found = tablet.look(asked["id"])
        assert (found["state"], found["record"]["how"]) == ("confirmed", "device")
    assert tablet.http.get("/api/confirmations/mine").json()["last"] == found["record"]
    assert phone.http.get("/api/confirmations/mine").json()["last"] is None
    with process.client() as owner:
        owner.delete("/api/robots/Asker")


def test_an_ended_device_confirms_nothing_and_an_ended_session_is_not_confirmed(
    process: RunnerProcess, browse: Browse
) -> None:
    revoked = Revocations(process.data)
    tablet, phone, other = browse(), browse(), browse()
    asked = tablet.ask()
    revoked.end(phone.session.id)
    assert phone.answer(asked["id"]).status_code == 401
    revoked.end(tablet.session.id)
    assert other.answer(asked["id"]).status_code == 404
    assert Confirmations(process.data, KEYS).confirmed_at(tablet.session.id) is None


def test_a_record_of_the_other_process_is_adopted_only_with_its_seal(
    browse: Browse, tmp_path: Path
) -> None:
    tablet = browse()
    made = Confirmations(tmp_path, KEYS).confirm(tablet.session.id, "passkey")
    record = {"session": made.session, "at": made.at, "how": made.how, "seal": made.seal}
    post = tablet.http.post
    assert post("/api/confirmations/records", json=record | {"at": made.at + 9}).status_code == 401
    assert post("/api/confirmations/records", json=record).status_code == 204
    assert tablet.http.get("/api/confirmations/mine").json()["last"] == record
