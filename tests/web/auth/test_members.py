"""Persons by personal links: once, by one, everywhere, and out at once whatever else has failed."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.web.auth.keys import Keys, Person, Session
from action_assistant.web.auth.revocations import Revocations
from editor.process import running as editor_running
from journal import servers
from support.product import TOKEN, Product, running
from test_data_folders import FOLDERS, unpacked
from web.auth.test_ending import full, full_for_the_log, sharing
from web.auth.test_invitations import Arrive, Guest, arrive, closed, eventually

__all__ = ["arrive"]  # a fixture

FIREFOX = "Mozilla/5.0 (X11; Linux x86_64; rv:140.0) Gecko/20100101 Firefox/140.0"


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A shared server."""
    with sharing(tmp_path_factory.mktemp("members") / "data") as product:
        yield product


def added(product: Product, name: str, role: str = "operator", **more: Any) -> dict[str, Any]:
    """A new person with a link."""
    with product.editor() as editor:
        answer = editor.post("/api/members", json={"name": name, "role": role, **more})
        assert answer.status_code == 201, answer.text
        made: dict[str, Any] = answer.json()
        return made


def come(guest: Guest, member: dict[str, Any]) -> httpx.Response:
    """Use the newest link of a person."""
    return guest.come({"path": member["links"][0]["path"]})


def change(product: Product, member: dict[str, Any], **what: Any) -> None:
    with product.editor() as editor:
        answer = editor.patch(f"/api/members/{member['id']}", json=what)
        assert answer.status_code == 200, answer.text


def test_a_personal_link_lets_one_browser_in_under_the_name_that_the_owner_gave(
    product: Product, arrive: Arrive
) -> None:
    mari = added(product, "Mari")
    guest, thief = arrive(product, "Somebody else"), arrive(product)
    guest.http.headers["user-agent"] = FIREFOX
    proof = mari["links"][0]["path"].removeprefix("/#i=")
    for _ in range(3):  # looking does not use it up
        looked = guest.http.post("/api/session/invitation", json={"invitation": proof}).json()
        assert (looked["name"], looked["role"]) == ("Mari", "operator")
    person = come(guest, mari).json()
    assert (person["person"]["id"], person["person"]["name"]) == (mari["id"], "Mari")
    assert person["personal"] is True
    refused = come(thief, mari)
    assert (refused.status_code, "used already" in refused.json()["detail"]) == (401, True)
    assert guest.http.post("/api/session", json={"name": "Root"}).status_code == 403
    with product.editor() as editor:
        (now,) = [p for p in editor.get("/api/members").json()["people"] if p["id"] == mari["id"]]
        (link,) = now["links"]
        assert ("path" in link, link["browser"]) == (False, "Firefox on Linux")
        (session,) = [
            each
            for each in editor.get("/api/sessions").json()
            if each["person"]["id"] == mari["id"]
        ]
        assert (session["browser"], session["personal"]) == ("Firefox on Linux", True)
        assert session["used_at"] >= now["made_at"][:19]
    assert "links" not in guest.http.get("/api/members").json()["people"][0]


def test_of_many_who_use_a_link_at_once_one_comes_in(product: Product, arrive: Arrive) -> None:
    for round_ in range(3):
        member = added(product, f"Racer {round_}")
        guests = [arrive(product) for _ in range(8)]
        with ThreadPoolExecutor(len(guests)) as pool:
            answers = list(pool.map(come, guests, [member] * len(guests)))
        assert sorted(each.status_code for each in answers) == [200, *[401] * 7]


def test_a_changed_role_counts_at_once_in_both_processes_and_closes_sockets(
    product: Product, arrive: Arrive
) -> None:
    member, guest = added(product, "Kai"), arrive(product)
    come(guest, member)
    assert guest.runner("POST", "/api/robots").status_code == 400
    with guest.socket(f"{product.runner_url}/api/live") as live:
        change(product, member, role="viewer")
        assert guest.runner("POST", "/api/robots").status_code == 403
        assert guest.role == "viewer"
        assert closed(live) == 4401
    change(product, member, until="2020-01-01T00:00:00Z")
    assert guest.http.get("/api/graphs").status_code == 401
    assert guest.runner("GET", "/api/runs").status_code == 401
    assert guest.runner("POST", "/api/stop").status_code == 202  # Stop still works
    change(product, member, until=None)
    assert guest.http.get("/api/graphs").status_code == 200


def test_an_ended_person_is_out_everywhere_and_stays_out(product: Product, arrive: Arrive) -> None:
    member, guest = added(product, "Uku"), arrive(product)
    come(guest, member)
    with product.editor() as editor, guest.socket(f"{product.runner_url}/api/live") as live:
        made = editor.post(f"/api/members/{member['id']}/link", json={}).json()
        assert editor.post(f"/api/members/{member['id']}/end").status_code == 200
        assert closed(live) == 4401
    for answer in (guest.http.get("/api/graphs"), guest.runner("POST", "/api/stop")):
        assert (answer.status_code, answer.json()["type"]) == (401, "withdrawn")
    assert come(arrive(product), made).json()["type"] == "withdrawn"
    with product.editor() as editor:
        gone = next(
            p for p in editor.get("/api/members").json()["people"] if p["id"] == member["id"]
        )
        assert "ended_at" in gone
        assert editor.post(f"/api/members/{member['id']}/link", json={}).status_code == 409


def test_a_person_ends_on_a_full_disk_and_the_log_catches_up(
    small_disk: Callable[[str], Path], arrive: Arrive
) -> None:
    with sharing(small_disk("24m") / "data") as product:
        mari, ada = added(product, "Mari"), added(product, "Ada")
        guest, friend = arrive(product), arrive(product)
        come(guest, mari)
        come(friend, ada)
        with product.editor() as editor, full(product.data.parent):
            full_for_the_log(product)
            answer = editor.post(f"/api/members/{mari['id']}/end")
            assert (answer.status_code, answer.json()["unrecorded"]) == (200, True)
            assert guest.runner("POST", "/api/stop").status_code == 401
            assert guest.http.get("/api/graphs").status_code == 401
            assert friend.http.get("/api/graphs").status_code == 200

        def recorded() -> bool:
            with product.editor() as editor:
                people = editor.get("/api/members").json()["people"]
            return all("unrecorded" not in each for each in people)

        eventually(recorded)


@pytest.mark.long
def test_a_person_ends_without_postgres(tmp_path: Path) -> None:
    if servers.binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with (
        servers.server() as postgres,
        editor_running(tmp_path / "data", postgres.new_database()) as editor,
        editor.client() as owner,
        httpx.Client(base_url=editor.url, trust_env=False, timeout=20) as guest,
    ):
        made = owner.post("/api/members", json={"name": "Mari", "role": "viewer"}).json()
        proof = made["links"][0]["path"].removeprefix("/#i=")
        assert guest.post("/api/session", json={"invitation": proof}).status_code == 200
        postgres.stop()
        answer = owner.post(f"/api/members/{made['id']}/end")
        assert (answer.status_code, answer.json()["unrecorded"]) == (200, True)
        assert guest.get("/api/session").json()["type"] == "withdrawn"
        assert Revocations(editor.data).person_ended(made["id"])


def test_a_personal_link_changes_the_person_and_the_session_of_a_browser(
    product: Product, arrive: Arrive
) -> None:
    """An attacker who plants the cookie of a session that they know gains nothing (fixation)."""
    planted = Keys(TOKEN).new_session("Eve", role="viewer")
    guest, eve = arrive(product), arrive(product)
    for each in (guest, eve):
        each.http.headers["cookie"] = f"aa_{product.port}={Keys(TOKEN).sealed(planted)}"
    assert eve.http.get("/api/session").status_code == 200
    member = added(product, "Leo")
    assert come(guest, member).json()["person"]["id"] == member["id"]
    assert eve.http.get("/api/session").status_code == 401
    session = Keys(TOKEN).session(guest.http.headers["cookie"].partition("=")[2])
    assert session is not None
    assert session.id != planted.id
    # Neither does the owner's token make another session of the same person.
    owner = guest.http.post("/api/session", json={"token": TOKEN}).json()
    assert owner["person"]["id"] != member["id"]


def test_several_owners_and_groups(product: Product, arrive: Arrive) -> None:
    second, guest = added(product, "Second", "owner"), arrive(product)
    come(guest, second)
    group = guest.http.post("/api/groups", json={"name": "Lab"}).json()
    assert guest.http.post("/api/groups", json={"name": "lab"}).status_code == 409
    made = guest.http.post(
        "/api/members", json={"name": "Third", "role": "editor", "groups": [group["id"]]}
    ).json()
    assert made["groups"] == [group["id"]]
    assert guest.http.post(f"/api/members/{second['id']}/end").status_code == 409  # oneself
    own = guest.http.patch(f"/api/members/{second['id']}", json={"role": "viewer"})
    assert own.status_code == 409
    assert guest.http.delete(f"/api/groups/{group['id']}").status_code == 204
    assert guest.http.get("/api/members").json()["groups"] == []


def test_a_device_is_added_by_a_code_that_the_first_one_confirms(
    product: Product, arrive: Arrive
) -> None:
    first, phone, late = arrive(product), arrive(product), arrive(product)
    come(first, added(product, "Nora"))
    made = first.http.post("/api/devices/codes").json()
    assert len(made["code"]) == 9
    sent = phone.http.post("/api/session/device", json={"code": made["code"].lower()}).json()
    used = late.http.post("/api/session/device", json={"code": made["code"]})
    assert used.status_code == 401
    claim = {"claim": sent["claim"]}
    assert phone.http.post("/api/session/device/answer", json=claim).json() == {}
    asking = first.http.get(f"/api/devices/codes/{made['id']}").json()
    assert asking["number"] == sent["number"]
    code = f"/api/devices/codes/{made['id']}/answer"
    assert phone.http.post(code, json={"yes": True}).status_code == 401
    assert first.http.post(code, json={"yes": True}).status_code == 204
    answer = phone.http.post("/api/session/device/answer", json=claim)
    assert answer.json()["signed_in"]["person"]["name"] == "Nora"
    phone.http.headers["cookie"] = answer.headers["set-cookie"].partition(";")[0]
    assert phone.http.post("/api/session/device/answer", json=claim).status_code == 401
    devices = first.http.get("/api/devices").json()
    assert len(devices["sessions"]) == 2
    # Whoever takes up an unlocked device can add their own: it confirms nothing for a day.
    asked = first.runner("POST", "/api/confirmations", {}).json()
    answer = f"/api/confirmations/{asked['id']}/answer"
    assert phone.runner("POST", answer, {"yes": True}).status_code == 404
    assert first.runner("GET", f"/api/confirmations/{asked['id']}").json()["state"] == "waiting"
    assert first.http.get("/api/confirmations/mine").json()["last"] is None
    said = product.cli("people", "confirm", "nora", "--data", str(product.data))
    assert said.returncode == 0, said.stderr
    mine = first.http.get("/api/confirmations/mine").json()["last"]
    assert (mine["how"], mine["session"]) == ("command", devices["this"])
    assert first.runner("GET", "/api/confirmations/mine").json()["last"] == mine
    other = next(each["id"] for each in devices["sessions"] if each["id"] != devices["this"])
    assert first.http.post(f"/api/devices/{other}/end").status_code == 204
    assert phone.http.get("/api/graphs").status_code == 401
    assert first.http.get("/api/graphs").status_code == 200


def test_a_browser_that_becomes_the_device_of_another_person_leaves_its_session(
    product: Product, arrive: Arrive
) -> None:
    first, tablet = arrive(product), arrive(product)
    come(first, added(product, "Nadia"))
    come(tablet, added(product, "Nick"))
    before = tablet.http.headers["cookie"]
    made = first.http.post("/api/devices/codes").json()
    sent = tablet.http.post("/api/session/device", json={"code": made["code"]}).json()
    code = f"/api/devices/codes/{made['id']}/answer"
    assert first.http.post(code, json={"yes": True}).status_code == 204
    answer = tablet.http.post("/api/session/device/answer", json={"claim": sent["claim"]})
    assert answer.json()["signed_in"]["person"]["name"] == "Nadia"
    assert tablet.http.headers["cookie"] == before
    for left in (tablet.http.get("/api/graphs"), tablet.runner("POST", "/api/stop")):
        assert left.status_code == 401


@pytest.mark.long
def test_a_recovery_link_of_the_command_line_works_with_the_server_down_and_up_and_damaged_files(
    tmp_path: Path, arrive: Arrive
) -> None:
    data = tmp_path / "data"
    with sharing(data) as product:
        eve = added(product, "Eve")
        tablet = arrive(product)
        assert come(tablet, eve).status_code == 200
        up = product.cli("people", "link", "Ann", "--role", "owner", "--data", str(data))
        assert up.returncode == 0, up.stderr
    down = product.cli("people", "link", "Bob", "--role", "owner", "--data", str(data))
    assert down.returncode == 0, down.stderr
    small = [f"{name}.json" for name in ("people/x", "graph-rules", "graph-sights", "tokens/x")]
    small += [f"{name}.json" for name in ("passkeys/x", "confirmed/x", "views/x", "released/x")]
    small += [f"people/{eve['id']}.json", "people/groups.json", "sessions/x.json"]
    for name in small:
        (data / name).parent.mkdir(mode=0o700, exist_ok=True)
        (data / name).write_bytes(b'{"id":"\xff"}')
    with sharing(data) as product:
        person = data / "people" / f"{eve['id']}.json"
        assert b"Eve" in person.read_bytes()  # the log has her
        assert list(person.parent.glob(f"{person.name}.damaged-*"))
        person.write_bytes(b"\0" * 60)
        session = tablet.http.headers["cookie"].partition("=")[2]
        tablet = arrive(product)
        tablet.http.headers["cookie"] = f"aa_{product.port}={session}"
        assert tablet.runner("POST", "/api/stop").is_success
        assert tablet.runner("GET", "/api/runs").status_code == 200
        assert tablet.runner("POST", "/api/runs").status_code == 403
        for name, said in (("Ann", up), ("Bob", down)):
            path = "/#i=" + said.stdout.split("#i=")[1].split()[0]
            guest = arrive(product)
            assert guest.come({"path": path}).json()["person"]["name"] == name
            assert guest.role == "owner"
            assert arrive(product).come({"path": path}).status_code == 401


@pytest.mark.parametrize("folder", FOLDERS[-1:], ids=[path.name for path in FOLDERS[-1:]])
def test_links_and_cookies_of_an_earlier_version_go_on_working(
    tmp_path: Path, folder: Path
) -> None:
    data = tmp_path / "data"
    unpacked(folder / "sqlite.tar.xz", data)
    keys = Keys(TOKEN)
    session = Session("oldsession00", Person("oldperson000", "Old", "operator"), time.time() + 1e6)
    with running(data) as product, product.editor() as owner:
        cookie = keys.sealed(session)
        headers = {"cookie": f"aa_{product.port}={cookie}", "origin": product.url}
        with httpx.Client(
            base_url=product.url, headers=headers, trust_env=False, timeout=20
        ) as browser:
            assert browser.get("/api/session").json()["person"]["name"] == "Old"
            assert browser.post("/api/graphs", json={"name": "mine"}).status_code == 201
        made = owner.post("/api/invitations", json={"role": "viewer"}).json()
        proof = made["path"].removeprefix("/#i=")
        come = {"invitation": proof, "name": "New"}
        with httpx.Client(base_url=product.url, trust_env=False, timeout=20) as browser:
            headers = {"origin": product.url}
            assert browser.post("/api/session", json=come, headers=headers).status_code == 200
