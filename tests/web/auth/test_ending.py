"""The end of links and sessions, whatever else has failed: a full disk, no database, no editor."""

import asyncio
import contextlib
import os
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import pytest

from action_assistant.errors import NotFound, Unavailable
from action_assistant.web.auth import session_files, sessions
from action_assistant.web.auth.identity import Credential, Standing
from action_assistant.web.auth.keys import Keys, PersonRef, Session
from action_assistant.web.auth.released_versions import Release, ReleasedVersions
from action_assistant.web.auth.revocations import Revocations, SessionGuards, sealed_standing
from action_assistant.web.auth.session_files import SessionFiles
from editor.process import running as editor_running
from journal import servers
from support.product import TOKEN, Product, running
from web.auth.test_invitations import LAB, Arrive, Guest, arrive, closed, eventually, invite, proof

__all__ = ["arrive"]  # a fixture

KEYS = Keys("k" * 43)


@contextlib.contextmanager
def full(disk: Path) -> Iterator[None]:
    """Fill the disk to the last byte."""
    ballast = disk / "ballast"
    with ballast.open("wb", buffering=0) as out, contextlib.suppress(OSError):
        while True:
            out.write(bytes(1 << 20))
    with ballast.open("ab", buffering=0) as out, contextlib.suppress(OSError):
        while True:
            out.write(bytes(512))
    try:
        yield
    finally:
        ballast.unlink()


def full_for_the_log(product: Product) -> None:
    """Fill the disk until the editor stores nothing any more, not even a small event."""
    refused = 0
    with product.editor() as editor:
        for number in range(500):
            wanted = {"name": f"g{number}", "description": "x" * (0 if refused else 900)}
            made = editor.post("/api/graphs", json=wanted)
            refused = refused + 1 if made.status_code == 503 else 0
            if refused == 4:
                return
    raise AssertionError("the disk never got full")


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A shared server."""
    with sharing(tmp_path_factory.mktemp("ending") / "data") as product:
        yield product


def sharing(data: Path) -> contextlib.AbstractContextManager[Product]:
    return running(data, "--share", "--host", "127.0.0.1", hosts=LAB)


def test_links_and_sessions_end_on_a_full_disk_and_the_log_catches_up(
    small_disk: Callable[[str], Path], arrive: Arrive
) -> None:
    disk = small_disk("24m")
    with sharing(disk / "data") as product:
        invitation, other = invite(product, "operator"), invite(product, "operator")
        guest, friend = arrive(product), arrive(product, "Ada")
        guest.come(invitation)
        friend.come(other)
        with guest.socket(f"{product.runner_url}/api/live") as live, full(disk):
            full_for_the_log(product)
            with product.editor() as editor:
                answer = editor.post(f"/api/invitations/{invitation['id']}/revoke")
                assert (answer.status_code, answer.json()["unrecorded"]) == (200, True)
                assert "path" not in answer.json()
                assert closed(live) == 4401
                assert guest.runner("POST", "/api/stop").status_code == 401
                assert guest.http.get("/api/graphs").status_code == 401
                assert guest.come(invitation).json()["type"] == "withdrawn"
                # Nobody else is signed out, and who comes with the token comes in.
                assert friend.runner("POST", "/api/stop").status_code == 202
                assert friend.http.get("/api/graphs").status_code == 200
                # Signing out needs no room either.
                assert friend.http.delete("/api/session").status_code == 204
                assert friend.runner("POST", "/api/stop").status_code == 401
                fresh = editor.post("/api/session", json={"token": TOKEN, "name": "Eve"})
                assert fresh.status_code == 200
        with product.editor() as editor:

            def recorded() -> bool:
                found = editor.get("/api/invitations").json()["invitations"]
                (mine,) = [each for each in found if each["id"] == invitation["id"]]
                return "unrecorded" not in mine

            eventually(recorded)


@pytest.mark.long
def test_a_link_is_revoked_without_postgres(tmp_path: Path) -> None:
    if servers.binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with (
        servers.server() as postgres,
        editor_running(tmp_path / "data", postgres.new_database()) as editor,
        editor.client() as owner,
        httpx.Client(base_url=editor.url, trust_env=False, timeout=20) as guest,
    ):
        made = owner.post("/api/invitations", json={"role": "viewer"}).json()
        come = {"invitation": proof(made), "name": "Mari"}
        assert guest.post("/api/session", json=come).status_code == 200
        postgres.stop()
        answer = owner.post(f"/api/invitations/{made['id']}/revoke")
        assert (answer.status_code, answer.json()["unrecorded"]) == (200, True)
        assert guest.get("/api/session").json()["type"] == "withdrawn"
        listed = owner.get("/api/invitations").json()["invitations"]
        assert [each["guests"][0]["person"]["name"] for each in listed] == ["Mari"]
        assert Revocations(editor.data).every() == {made["id"]}


def test_signing_out_ends_the_session_everywhere_at_once(product: Product, arrive: Arrive) -> None:
    guest, other = arrive(product), arrive(product)
    invitation = invite(product, "operator")
    guest.come(invitation)
    other.come(invitation)
    before = guest.http.headers["cookie"]
    guest.come(invitation)  # a later cookie of the same browser
    with product.editor() as editor:
        graph = editor.post("/api/graphs", json={"name": "task"}).json()["id"]
    room, live = f"{product.url}/api/graphs/{graph}/room", f"{product.runner_url}/api/live"
    with (
        guest.socket(room) as in_room,
        guest.socket(live) as at_runner,
        other.socket(live) as staying,
    ):
        assert guest.http.delete("/api/session").status_code == 204
        assert (closed(in_room), closed(at_runner)) == (4401, 4401)
        staying.send("{}")
        assert staying.recv(5)
    for cookie in (guest.http.headers["cookie"], before):  # whoever has a copy of one
        guest.http.headers["cookie"] = cookie
        assert guest.http.get("/api/graphs").status_code == 401
        assert guest.runner("POST", "/api/stop").status_code == 401
    assert other.http.get("/api/graphs").status_code == 200
    assert guest.come(invitation).json()["person"]["name"] == "Mari"  # the link goes on
    assert guest.http.get("/api/graphs").status_code == 200


@pytest.mark.parametrize("at_runner", [False, True])
def test_signing_out_ends_every_session_that_the_browser_holds(
    product: Product, arrive: Arrive, at_runner: bool
) -> None:
    """One may be of another path that the server had before."""
    guest, other = arrive(product), arrive(product)
    cookies = []
    for each in (guest, other):
        each.come(invite(product, "operator"))
        cookies.append(each.http.headers["cookie"])
    guest.http.headers["cookie"] = "; ".join(cookies)
    if at_runner:
        assert guest.runner("DELETE", "/api/session").status_code == 204
    else:
        assert guest.http.delete("/api/session").status_code == 204
    for cookie in cookies:
        guest.http.headers["cookie"] = cookie
        eventually(lambda: guest.http.get("/api/graphs").status_code == 401)
        eventually(lambda: guest.runner("POST", "/api/stop").status_code == 401)


def test_one_signs_out_at_the_runner_while_there_is_no_editor(
    product: Product, arrive: Arrive
) -> None:
    guest = arrive(product)
    guest.come(invite(product, "operator"))
    product.process("editor").suspend()
    try:
        assert guest.runner("DELETE", "/api/session").status_code == 204
        assert guest.runner("POST", "/api/stop").status_code == 401
    finally:
        product.process("editor").resume()
    eventually(lambda: guest.http.get("/api/graphs").status_code == 401)


def test_an_owner_sees_who_is_signed_in_and_signs_one_out(product: Product, arrive: Arrive) -> None:
    invitation = invite(product, "editor")
    mari, ada = arrive(product), arrive(product, "Ada")
    mari.come(invitation)
    ada.come(invitation)
    ada.http.headers["origin"] = product.url
    renamed = ada.http.post("/api/session", json={"name": "Ada K"})
    ada.http.headers["cookie"] = renamed.headers["set-cookie"].partition(";")[0]
    assert ada.http.get("/api/sessions").status_code == 403
    with product.editor() as editor:
        found = editor.get("/api/sessions").json()
        found = [each for each in found if each.get("invitation") == invitation["id"]]
        assert sorted(each["person"]["name"] for each in found) == ["Ada K", "Mari"]
        (hers,) = [each["id"] for each in found if each["person"]["name"] == "Ada K"]
        assert editor.post(f"/api/sessions/{hers}/end").status_code == 204
        assert hers not in {each["id"] for each in editor.get("/api/sessions").json()}
        assert editor.post("/api/sessions/nobody/end").status_code == 404
    assert ada.runner("POST", "/api/stop").status_code == 401
    assert mari.runner("POST", "/api/stop").status_code == 202


def test_a_mark_that_cannot_be_written_holds_here_and_says_so(tmp_path: Path) -> None:
    revoked = Revocations(tmp_path)
    (tmp_path / "revoked").rmdir()
    (tmp_path / "revoked").write_text("no folder")
    session = KEYS.new_session("Ada", invitation="abc")
    with pytest.raises(Unavailable, match="forgotten when this process ends"):
        revoked.add("abc")
    assert revoked.ends(session)
    assert not revoked.ended(session)
    with pytest.raises(Unavailable):
        revoked.end(session.id)
    assert revoked.ended(session)
    assert not Revocations(tmp_path).ends(session)
    (tmp_path / "revoked").unlink()
    revoked.write_again()
    assert Revocations(tmp_path).ends(session)
    assert Revocations(tmp_path).every() == {"abc"}


async def test_all_sessions_of_a_browser_end_even_if_no_mark_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "revoked").write_text("no folder")
    revoked = Revocations(tmp_path)
    held = [KEYS.new_session("Ada"), KEYS.new_session("Ada")]
    request: Any = SimpleNamespace(scope={"state": {"sessions": held}})
    with pytest.raises(Unavailable):
        await sessions._end(revoked, request)
    assert all(revoked.ends(each) for each in held)


def test_all_sessions_of_a_person_end_although_none_of_it_can_be_stored(tmp_path: Path) -> None:
    revoked = Revocations(tmp_path)
    browsers = SessionFiles(tmp_path, revoked)
    mine = [KEYS.new_session("Eve", person_id="eve") for _ in range(3)]
    for each in mine:
        browsers.note(each)
    (tmp_path / "revoked").rmdir()
    (tmp_path / "revoked").write_text("no folder")
    ended = browsers.end_all_of("eve", but=mine[0].id)
    assert ended.left is not None
    assert ended.left.detail.startswith("2 of 2 sessions: It holds here and now")
    assert [revoked.ends(each) for each in mine] == [False, True, True]
    assert set(ended.ids) == {each.id for each in mine[1:]}


def test_nobody_is_put_out_when_the_disk_is_gone(tmp_path: Path) -> None:
    revoked = Revocations(tmp_path)
    one, other = KEYS.new_session("Ada"), KEYS.new_session("Mari")
    revoked.end(one.id)
    (tmp_path / "revoked").rename(tmp_path / "gone")
    (tmp_path / "revoked").symlink_to("revoked")  # an error of the file system: ELOOP
    assert revoked.ended(one), "whoever was put out stays out"
    assert not revoked.ended(other)


def test_a_session_that_cannot_be_noted_fails_nothing_and_ended_ones_are_forgotten(
    tmp_path: Path,
) -> None:
    revoked = Revocations(tmp_path)
    browsers = SessionFiles(tmp_path, revoked)
    lasting, over = KEYS.new_session("Ada"), Session("s" * 16, KEYS.new_session("Eve").person, 1.0)
    (tmp_path / "sessions").write_text("no folder")
    browsers.note(lasting)
    (tmp_path / "sessions").unlink()
    for session in (lasting, over):
        browsers.note(session)
    assert [each.person.name for each in browsers.every()] == ["Ada"]
    assert [path.stem for path in (tmp_path / "sessions").iterdir()] == [lasting.id]
    browsers.end(lasting.id)
    assert revoked.ended(lasting)
    assert browsers.every() == []
    with pytest.raises(NotFound):
        browsers.end(lasting.id)


def test_a_cookie_of_an_older_version_goes_on_and_can_be_ended(
    product: Product, arrive: Arrive
) -> None:
    """Cookies of older versions were sealed in the same way, each with an id of its own."""
    keys = Keys(TOKEN)
    old = keys.new_session("Ada", role="operator")
    guest: Guest = arrive(product)
    guest.http.headers["cookie"] = f"aa_{product.port}={keys.sealed(old)}"
    told: dict[str, Any] = guest.http.get("/api/session").json()
    assert told["person"]["name"] == "Ada"
    with product.editor() as editor:
        assert old.id in {each["id"] for each in editor.get("/api/sessions").json()}
    assert guest.http.delete("/api/session").status_code == 204
    assert guest.runner("POST", "/api/stop").status_code == 401


async def test_hundreds_of_open_sockets_are_watched_with_one_look_at_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = 0
    stat = Path.stat

    def counted(path: Path, **more: Any) -> os.stat_result:
        nonlocal looks
        looks += 1
        return stat(path, **more)

    guards, cut = SessionGuards(Revocations(tmp_path)), list[str]()

    async def socket(session: Session) -> None:
        with guards.hold(session) as guard:
            try:
                await asyncio.sleep(60)
            except asyncio.CancelledError:
                assert guard.is_cut
                cut.append(session.id)

    sessions = [KEYS.new_session("", invitation=f"link{n % 3}") for n in range(300)]
    tasks = [asyncio.create_task(socket(each)) for each in sessions]
    await asyncio.sleep(0)
    monkeypatch.setattr(Path, "stat", counted)
    await asyncio.sleep(1)
    assert 1 <= looks < 20
    other = Revocations(tmp_path)  # another process
    for each in sessions[:3]:
        other.end(each.id)
        await asyncio.sleep(0.25)
    other.end(sessions[3].id)
    other.add("link2")
    await asyncio.sleep(0.5)
    gone = {each.id for n, each in enumerate(sessions) if n < 4 or n % 3 == 2}
    assert set(cut) == gone
    monkeypatch.undo()
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def test_a_revoked_session_also_ends_when_the_folder_cannot_be_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    revoked, session = Revocations(tmp_path), KEYS.new_session("")
    guards = SessionGuards(revoked)

    def unreadable(path: Path) -> Iterator[Path]:
        raise PermissionError(13, "Permission denied", str(path))

    async def socket() -> bool:
        with guards.hold(session) as guard:
            with contextlib.suppress(asyncio.CancelledError):
                await asyncio.sleep(5)
            return guard.is_cut

    monkeypatch.setattr(Path, "iterdir", unreadable)
    task = asyncio.create_task(socket())
    await asyncio.sleep(0.3)
    (tmp_path / "revoked" / f"session-{session.id}").touch()
    assert await task


async def test_a_session_whose_standing_cannot_be_read_keeps_no_other_one_open(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    revoked = Revocations(tmp_path)
    broken, ended = (Keys("k" * 43).new_session(name) for name in ("broken", "ended"))
    looks = iter(range(100))  # the first one is that of the beginning
    failed = asyncio.Event()

    def standing(credential: Credential) -> Standing:
        if credential.person.name == "broken" and next(looks) > 0:
            failed.set()
            raise ZeroDivisionError
        return sealed_standing(credential)

    guards = SessionGuards(revoked, standing)

    async def open_(session: Session) -> bool:
        with guards.hold(session) as guard:
            try:
                await asyncio.sleep(30)
            except asyncio.CancelledError:
                guard.let_go()
            return guard.is_cut

    sockets = [asyncio.create_task(open_(each)) for each in (broken, ended)]
    async with asyncio.timeout(25):
        await failed.wait()
        revoked.end(ended.id)
        assert await sockets[1]
    assert caplog.text.count("cannot be read whether a session has ended") == 1
    sockets[0].cancel()
    assert not await sockets[0]


def test_signing_a_person_out_ends_idle_sessions_too(tmp_path: Path) -> None:
    revoked, keys = Revocations(tmp_path), Keys("k" * 43)
    idle = keys.new_session("Mari", person_id="mari")
    files = SessionFiles(tmp_path, revoked, is_over=lambda session: session.id == idle.id)
    files.note(idle)
    assert files.every() == []
    assert files.end_all_of("mari").ids == [idle.id]
    assert revoked.ended(idle)  # whatever limits an owner gives later


def test_guests_that_fill_the_list_of_sessions_hide_no_person_that_an_owner_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_files, "_MOST", 2)
    files, keys = SessionFiles(tmp_path, Revocations(tmp_path)), Keys("k" * 43)
    for number in range(3):
        files.note(keys.new_session(f"guest {number}", role="viewer", invitation="link"))
    files.note(keys.new_session("Mari", person_id="mari", personal=True))
    assert {each.person.name for each in files.every()} == {"guest 0", "guest 1", "Mari"}
    assert len(files.end_all_of("mari").ids) == 1


def test_one_release_that_cannot_be_withdrawn_or_stored_keeps_no_other_one(tmp_path: Path) -> None:
    releases = ReleasedVersions(tmp_path)

    def release(digit: str) -> Release:
        by = PersonRef("mari", "Mari")
        return Release(version="v1", digest=digit * 64, by=by, at=datetime.now(UTC))

    releases.add(release("b"))
    folder = tmp_path / "released"
    for digit in "acd":
        (folder / f"{digit * 64}-v1.json").mkdir()  # neither deleted nor written as a file
    with pytest.raises(Unavailable):
        releases.make_equal([release("d"), release("e")])
    assert not (folder / f"{'b' * 64}-v1.json").exists()
    assert releases.of("e" * 64) is not None
