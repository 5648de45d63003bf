"""Rights that change while people are here: sockets, session ids, devices, and runners elsewhere."""

import time
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from action_assistant.web.auth import session_files
from action_assistant.web.auth.keys import Keys, Session
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.session_files import SessionFiles
from support.product import TOKEN, Product
from web.auth.test_ending import sharing
from web.auth.test_invitations import Arrive, Guest, arrive, closed, eventually, invite
from web.auth.test_members import added, change, come

__all__ = ["arrive"]  # a fixture

KEYS = Keys(TOKEN)


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A shared server."""
    with sharing(tmp_path_factory.mktemp("changed") / "data") as product:
        yield product


def session_of(guest: Guest) -> Session:
    found = KEYS.session(guest.http.headers["cookie"].partition("=")[2])
    assert found is not None
    return found


@pytest.mark.parametrize("what", ["groups", "name", "role"])
def test_open_sockets_of_a_changed_person_close_within_a_second_and_come_back_changed(
    product: Product, arrive: Arrive, what: str
) -> None:
    with product.editor() as editor:
        group = editor.post("/api/groups", json={"name": f"of {what}"}).json()["id"]
        graph = editor.post("/api/graphs", json={"name": "task"}).json()["id"]
    mari = added(product, f"Mari {what}")
    guest = arrive(product)
    come(guest, mari)
    new: Any = {"groups": [group], "name": f"Mary {what}", "role": "editor"}[what]
    live, room = f"{product.runner_url}/api/live", f"{product.url}/api/graphs/{graph}/room"
    with guest.socket(live) as first, guest.socket(room) as second:
        change(product, mari, **{what: new})
        begun = time.monotonic()
        assert (closed(first), closed(second)) == (4401, 4401)
        assert time.monotonic() - begun < 5  # a second, on a computer that has time for it
    with guest.socket(live), guest.socket(room):
        person = guest.http.get("/api/session").json()["person"]
    name = f"Mary {what}" if what == "name" else f"Mari {what}"
    assert (person["name"], person["role"] == "editor") == (name, what == "role")
    rule = {"rule": {"readers": [group], "editors": []}}
    with product.editor() as editor:
        assert editor.put(f"/api/graphs/{graph}/rule", json=rule).status_code == 200
    sees = guest.http.get(f"/api/graphs/{graph}/umrf").status_code
    assert sees == (200 if what == "groups" else 404)


def test_a_session_whose_role_rises_gets_a_new_id_and_the_old_one_ends(
    product: Product, arrive: Arrive
) -> None:
    guest = arrive(product, "Ada")
    guest.come(invite(product, "viewer"))
    planted, viewer = guest.http.headers["cookie"], session_of(guest)
    assert guest.come(invite(product, "operator")).status_code == 200
    risen = session_of(guest)
    assert (risen.person.id, risen.person.role) == (viewer.person.id, "operator")
    assert risen.id != viewer.id
    headers = {**guest.http.headers, "cookie": planted}
    assert (
        httpx.get(f"{product.url}/api/graphs", headers=headers, trust_env=False).status_code == 401
    )
    assert guest.http.post("/api/session", json={"name": "Ada B"}).status_code == 200
    assert session_of(guest).id == risen.id  # nothing has risen by another name


def test_a_person_adds_so_many_devices_and_no_more(product: Product, arrive: Arrive) -> None:
    guest = arrive(product)
    come(guest, added(product, "Greedy", "viewer"))
    me = session_of(guest)
    files = SessionFiles(product.data, Revocations(product.data))
    for _ in range(session_files.MOST_DEVICES - 2):
        files.note(KEYS.new_session("Greedy", role="viewer", person_id=me.person.id, personal=True))
    code = guest.http.post("/api/devices/codes").json()
    other = arrive(product)
    claim = other.http.post("/api/session/device", json={"code": code["code"]}).json()["claim"]
    answer = f"/api/devices/codes/{code['id']}/answer"
    assert guest.http.post(answer, json={"yes": True}).status_code == 204
    files.note(KEYS.new_session("Greedy", role="viewer", person_id=me.person.id, personal=True))
    refused = other.http.post("/api/session/device/answer", json={"claim": claim})
    assert (refused.status_code, "sign one of them out" in refused.text) == (409, True)
    assert guest.http.post("/api/devices/codes").status_code == 409
    with product.editor() as editor:
        ended = editor.post(f"/api/people/{me.person.id}/sessions/end").json()["ended"]
    assert ended == session_files.MOST_DEVICES


def test_a_runner_elsewhere_takes_the_word_of_a_person_about_their_own_sessions_alone(
    product: Product, arrive: Arrive
) -> None:
    guest = arrive(product)
    come(guest, added(product, "Own"))
    me = session_of(guest)
    listed = guest.http.get("/api/devices").json()
    assert set(listed["ends"]) == {me.id}
    url = f"{product.runner_url}/api/sessions/ended"
    end = {"session": me.id, "person": me.person.id, "seal": listed["ends"][me.id]}
    for forged in ({"session": "other"}, {"person": "other"}, {"seal": "x"}, {"seal": "\u00e9"}):
        assert httpx.post(url, json=end | forged, trust_env=False).status_code == 400
    with guest.socket(f"{product.runner_url}/api/live") as live:
        assert httpx.post(url, json=end, trust_env=False).status_code == 204
        assert closed(live) == 4401
    with product.runner() as runner:

        def told() -> list[str]:
            rows = runner.get("/api/audit").json()["rows"]
            return [r["person"]["id"] for r in rows if r["event"] == "audit.ended_here.v1"]

        eventually(lambda: told() == [me.person.id])


def test_the_last_day_of_a_person_is_in_the_audit(product: Product) -> None:
    mari = added(product, "Dated")
    change(product, mari, until="2030-05-06T07:08:00Z")
    with product.editor() as editor:
        texts = [row["text"] for row in editor.get("/api/audit").json()["rows"]]
    assert any("Dated" in text and "until 2030-05-06 07:08 UTC" in text for text in texts)


def test_the_yes_of_a_person_counts_no_more_when_they_may_not_say_it_any_more(
    product: Product, arrive: Arrive
) -> None:
    mari = added(product, "Mari says yes")
    guest = arrive(product)
    come(guest, mari)
    digest = "5" * 64
    assert guest.runner("POST", "/api/approvals", {"digest": digest}).is_success

    def counts(times: int) -> bool:
        with product.runner() as runner:
            return len(runner.get("/api/approvals", params={"digest": digest}).json()) == times

    eventually(lambda: counts(1))
    change(product, mari, role="editor")
    eventually(lambda: counts(0))
    change(product, mari, role="operator")
    eventually(lambda: counts(1))
    with product.editor() as editor:
        assert editor.post(f"/api/members/{mari['id']}/end").is_success
    eventually(lambda: counts(0))
