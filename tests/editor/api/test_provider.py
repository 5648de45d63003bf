"""Sign-in by a provider: who comes in as what, and what strangers make of it in between."""

import re
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest

from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.keys import Keys
from editor.process import Editor, running
from support.product import TOKEN
from support.provider import CLIENT, SECRET, Provider, provided

GROUPS = "admins=owner,lab=operator,students=viewer"


@pytest.fixture(scope="module")
def provider() -> Iterator[Provider]:
    """A running provider."""
    with provided() as provider:
        yield provider


def told(environ: pytest.MonkeyPatch, provider: Provider, *, limits: bool = False) -> None:
    """Set the environment of an editor with that provider, without limits unless `limits`."""
    given = {
        "ISSUER": provider.issuer,
        "CLIENT_ID": CLIENT,
        "CLIENT_SECRET": SECRET,
        "GROUPS": GROUPS,
        "NAME": "Lab login",
    }
    for name, value in given.items():
        environ.setenv(f"ACTION_ASSISTANT_OIDC_{name}", value)
    if not limits:
        environ.setenv("ACTION_ASSISTANT_LIMITS", "off")


@pytest.fixture(scope="module")
def editor(tmp_path_factory: pytest.TempPathFactory, provider: Provider) -> Iterator[Editor]:
    """An editor with that provider."""
    with pytest.MonkeyPatch.context() as environ:
        told(environ, provider)
        with running(tmp_path_factory.mktemp("oidc") / "data") as editor:
            yield editor


@pytest.fixture(autouse=True)
def truthful(provider: Provider) -> None:
    """Each test begins with a provider that lies about nothing."""
    provider.reset()


class Browser:
    """A browser: its cookies, and the page that asks."""

    def __init__(self, editor: Editor, provider: Provider) -> None:
        self.http = httpx.Client(
            base_url=editor.url, headers={"origin": editor.url}, trust_env=False, timeout=20
        )
        self.provider = provider

    def begin(self, goal: str = "/", *, again: bool = False) -> dict[str, str]:
        """Go to the provider; what it sends back."""
        asked = self.http.post("/api/session/provider", json={"goal": goal, "again": again})
        assert asked.status_code == 200, asked.text
        return self.provider.authorize(asked.json()["url"])

    def hand_in(self, answer: dict[str, str]) -> httpx.Response:
        """Hand in an answer of the provider."""
        return self.http.post("/api/session/provider/answer", json=answer)

    def come(self, subject: str, *groups: str, **claims: Any) -> httpx.Response:
        """Sign in as a person of these groups."""
        self.provider.subject = subject
        self.provider.claims = {"name": subject.title(), "groups": list(groups), **claims}
        return self.hand_in(self.begin())

    @property
    def person(self) -> dict[str, Any]:
        who: dict[str, Any] = self.http.get("/api/session").json()["person"]
        return who

    def cookies(self) -> list[str]:
        return [each.name for each in self.http.cookies.jar if "provider" in each.name]


Open = Callable[[], Browser]


@pytest.fixture
def browser(editor: Editor, provider: Provider) -> Iterator[Open]:
    """Opens browsers."""
    with ExitStack() as opened:

        def one() -> Browser:
            made = Browser(editor, provider)
            opened.callback(made.http.close)
            return made

        yield one


def change(editor: Editor, person: str, **what: Any) -> httpx.Response:
    """Change a person, as an owner."""
    with editor.client() as owner:
        return owner.patch(f"/api/members/{person}", json=what)


def test_a_person_comes_in_with_the_role_of_their_groups(
    editor: Editor, provider: Provider, browser: Open
) -> None:
    mari = browser()
    assert mari.http.get("/api/session/provider").json() == {"name": "Lab login", "mine": False}
    came = mari.hand_in(mari.begin("/graphs/g1?level=2#x"))
    assert came.status_code == 200, came.text
    assert came.json()["goal"] == "/graphs/g1?level=2#x"
    set_by = {each.split("=")[0]: each for each in came.headers.get_list("set-cookie")}
    session = set_by[f"aa_{editor.port}"]
    assert re.search("SameSite=strict", session, re.IGNORECASE)
    assert "httponly" in session.lower()
    assert mari.cookies() == []  # that of the sign-in is gone
    assert (mari.person["name"], mari.person["role"]) == ("Mari", "operator")
    assert came.json()["signed_in"]["personal"] is True
    again = browser()
    assert again.come("mari", "students", "admins", "others").status_code == 200
    assert (again.person["id"], again.person["role"]) == (mari.person["id"], "owner")
    assert mari.person["role"] == "owner"  # the same person, everywhere
    assert again.come("mari", "students").status_code == 200
    assert mari.person["role"] == "viewer"
    with editor.client() as owner:
        facts = owner.get("/api/audit").json()["rows"]
    told = [each["text"] for each in facts if each.get("person", {}).get("id") == mari.person["id"]]
    assert any("for the first time, as operator" in each for each in told)
    assert any("identity provider (viewer)" in each for each in told)
    assert sum("signed in" in each for each in told) == 3


def test_a_person_without_a_mapped_group_is_refused_and_put_out(
    editor: Editor, browser: Open
) -> None:
    uku = browser()
    for groups in ((), ("others",), ("lab ",), ("LAB",), ("admins,lab",)):
        refused = uku.come("uku", *groups)
        assert (refused.status_code, "none of your groups" in refused.text) == (403, True)
        assert uku.http.get("/api/session").status_code == 401
    assert uku.come("uku", "lab").status_code == 200
    day = (datetime.now(UTC) + timedelta(days=3)).isoformat()
    assert change(editor, uku.person["id"], until=day).status_code == 200
    made = uku.http.post("/api/tokens", json={"name": "nightly", "scopes": ["edit"]}).json()
    program = {"authorization": f"Bearer {made['token']}"}

    def reads() -> int:
        return httpx.get(f"{editor.url}/api/graphs", headers=program, trust_env=False).status_code

    unknown = browser()
    assert unknown.come("uku", "lab").status_code == 200
    for file in (editor.data / "sessions").glob("*.json"):
        file.unlink()  # as on a full disk
    assert uku.http.get("/api/session").status_code == 200  # notes this one
    assert (reads(), unknown.http.get("/api/graphs").status_code) == (200, 200)
    other = browser()
    for _ in range(2):
        assert other.come("uku").status_code == 403
        for out in (uku, unknown):
            assert (
                out.http.get("/api/graphs").status_code == 401
            )  # rights that are gone, everywhere
        assert reads() == 401
    assert uku.come("uku", "lab").status_code == 200
    assert (uku.http.get("/api/graphs").status_code, reads()) == (200, 200)
    with editor.client() as owner:
        people = owner.get("/api/members").json()["people"]
        assert [each["until"][:10] for each in people if each["id"] == uku.person["id"]] == [
            day[:10]
        ]
        audit = owner.get("/api/audit", params={"kind": "people"}).text
        assert audit.count("let in by no group") == 1


def test_an_owner_lowers_a_person_for_good_and_raises_nobody(editor: Editor, browser: Open) -> None:
    kai = browser()
    kai.come("kai", "lab")
    person = kai.person["id"]
    raised = change(editor, person, role="owner")
    assert (raised.status_code, "make this person operator" in raised.text) == (409, True)
    assert change(editor, person, role="editor").json()["role"] == "editor"
    assert kai.person["role"] == "editor"
    for groups, role in [("lab", "editor"), ("students", "viewer"), ("admins", "editor")]:
        kai.come("kai", groups)
        assert kai.person["role"] == role
    back = change(editor, person, role="owner").json()  # as the groups say by now
    assert (back["role"], back["provider"]["role"]) == ("owner", "owner")
    kai.come("kai", "lab")
    assert kai.person["role"] == "operator"


def test_an_ended_person_stays_out(
    editor: Editor, provider: Provider, browser: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    uno = browser()
    uno.come("uno", "lab")
    with editor.client() as owner:
        assert owner.post(f"/api/members/{uno.person['id']}/end").status_code == 200
    for groups in (("lab",), ("admins",), ()):
        refused = browser().come("uno", *groups)
        assert (refused.status_code, refused.json()["type"]) == (401, "withdrawn")
    editor.kill()
    told(monkeypatch, provider)
    for file in (editor.data / "people").glob("*.json"):
        file.unlink()
    editor.start()
    assert browser().come("uno", "admins").json()["type"] == "withdrawn"
    ann = browser()
    assert ann.come("ann", "lab").status_code == 200  # others come in as before


def test_groups_here_follow_the_named_groups_of_the_provider(editor: Editor, browser: Open) -> None:
    with editor.client() as owner:
        ids = {
            name: owner.post("/api/groups", json={"name": name}).json()["id"]
            for name in ("lab", "night shift", "own")
        }
    eva = browser()
    eva.come("eva", "lab", "night shift")  # which the setting does not name

    def groups() -> set[str]:
        with editor.client() as owner:
            people = owner.get("/api/members").json()["people"]
        return set(next(each for each in people if each["id"] == eva.person["id"])["groups"])

    assert groups() == {ids["lab"]}
    change(editor, eva.person["id"], groups=[ids["lab"], ids["own"]])
    eva.come("eva", "students")
    assert groups() == {ids["own"]}
    eva.come("eva", "lab")
    assert groups() == {ids["own"], ids["lab"]}


def test_names_are_text_and_nobody_gets_the_name_of_another(editor: Editor, browser: Open) -> None:
    one, two = browser(), browser()
    one.come("n1", "lab", name="Ada\u202e\x00<b>\n Lovelace " + "x" * 500)
    assert one.person["name"] == ("Ada <b> Lovelace " + "x" * 60)[:60]
    one.come("n1", "lab", name="Ada")
    two.come("n2", "lab", name=" ADA ")
    assert (one.person["name"], two.person["name"]) == ("Ada", "ADA (2)")
    two.come("n2", "lab", name=" ADA ")
    assert two.person["name"] == "ADA (2)"
    assert change(editor, two.person["id"], name="Other Ada").status_code == 200
    two.come("n2", "lab", name=" ADA ")
    assert two.person["name"] == "Other Ada"  # until the provider says something else
    for name in ("\u200b", " ", "\x00", None, 7, ["x"]):
        three = browser()
        three.come(f"n3 {name!r}", "lab", name=name)
        assert three.person["name"].startswith(("Somebody", "\u200b"))


def test_an_answer_belongs_to_one_browser_once(provider: Provider, browser: Open) -> None:
    mine, victim = browser(), browser()
    answer = mine.begin()
    assert victim.hand_in(answer).status_code == 401  # login CSRF: the thief's account for a victim
    provider.claims["groups"] = ["lab"]
    ok = mine.hand_in(answer)
    assert ok.status_code == 200
    assert mine.hand_in(answer).status_code == 401
    # Its cookie is of no use to anybody who keeps it.
    kept = browser()
    first = kept.begin()
    jar = {each.name: each.value for each in kept.http.cookies.jar}
    assert kept.hand_in(first).status_code == 200
    kept.http.cookies.update(jar)
    provider.codes["another"] = {}
    assert kept.hand_in({**first, "code": "another"}).status_code == 401
    for change_ in ({"state": "x"}, {"state": ""}, {"state": answer["state"][:12]}):
        assert browser().hand_in({**browser().begin(), **change_}).status_code == 401


def test_a_cookie_is_of_its_state_its_time_and_this_server(
    editor: Editor, provider: Provider, browser: Open
) -> None:
    thief = browser()
    one, two = thief.begin(), thief.begin()
    cookies = {each.name: each.value for each in thief.http.cookies.jar}
    name_of_two = next(name for name in cookies if name.endswith(two["state"].split(".")[0]))
    name_of_one = next(name for name in cookies if name.endswith(one["state"].split(".")[0]))

    def tried(cookie: str | None, answer: dict[str, str]) -> int:
        fresh = browser()
        if cookie is not None:
            fresh.http.cookies.set(name_of_one, cookie)
        return fresh.hand_in(answer).status_code

    assert tried(None, one) == 401
    assert tried(str(cookies[name_of_two]), one) == 401
    assert tried("x.y", one) == 401
    assert tried(str(cookies[name_of_one]) + "x", one) == 401
    keys = Keys(TOKEN)
    content = keys.question(str(cookies[name_of_one])) or b""
    old = re.sub(rb'"begun":[0-9.]+', b'"begun":%f' % (time.time() - 601), content)
    assert tried(keys.sealed_question(old), one) == 401
    other = content.replace(provider.issuer.encode(), b"https://other.example")
    assert tried(keys.sealed_question(other), one) == 401
    assert tried(Keys("another token of another server, long").sealed_question(content), one) == 401
    assert tried(keys.sealed_question(content), one) == 200
    # No session cookie passes for it, and it for none.
    assert keys.session(str(cookies[name_of_one])) is None


def test_an_answer_of_elsewhere_signs_nobody_in(provider: Provider, browser: Open) -> None:
    for change_ in ({"iss": "https://other.example"}, {"iss": None}, {"code": "guessed"}):
        lost = browser()
        refused = lost.hand_in({**lost.begin(), **change_})
        assert (refused.status_code, lost.cookies() == []) == (401, False)
        assert lost.http.get("/api/session").status_code == 401
    lost = browser()
    one, two = lost.begin(), lost.begin()
    injected = lost.hand_in({**one, "code": two["code"]})  # PKCE ties a code to its begin
    assert (injected.status_code, "invalid_grant" in injected.text) == (401, True)
    denied = {"error": "access_denied", "error_description": "no way " + "x" * 900}
    answer = {**lost.begin(), **denied}
    del answer["code"]
    said = lost.hand_in(answer).json()["detail"]
    assert "says “no way xx" in said
    assert len(said) < 400
    assert lost.hand_in({**lost.begin(), "error": "\x1b[2J"}).status_code == 400


def test_nobody_is_sent_elsewhere_afterwards(browser: Open) -> None:
    for goal in (
        *("https://evil.example/", "//evil.example", "/\\evil.example", "\\\\evil", "javascript:x"),
        *("/\t/evil.example", "evil", "", "/api/session", "/graphs\r\nset-cookie: x=y"),
    ):
        here = browser()
        came = here.hand_in(here.begin(goal))
        assert (came.status_code, came.json()["goal"]) == (200, "/"), goal


def test_pages_of_others_neither_begin_nor_answer(editor: Editor, browser: Open) -> None:
    here = browser()
    answer = here.begin()
    here.http.headers["origin"] = "https://evil.example"
    assert here.hand_in(answer).status_code == 403
    assert here.http.post("/api/session/provider", json={}).status_code == 403
    with httpx.Client(base_url=editor.url, trust_env=False) as rebound:
        rebound.headers["host"] = "evil.example"
        assert rebound.get("/api/session/provider").status_code == 403


def test_two_tabs_and_many_begins(provider: Provider, browser: Open) -> None:
    here = browser()
    one, two = here.begin("/one"), here.begin("/two")
    assert here.hand_in(two).json()["goal"] == "/two"
    session = here.http.get("/api/devices").json()["this"]
    assert here.hand_in(one).json()["goal"] == "/one"
    assert here.http.get("/api/devices").json()["this"] == session  # the first tab stays in
    for _ in range(20):
        last = here.begin()
    assert len(here.cookies()) <= 5
    assert here.hand_in(last).status_code == 200
    # The same person for the first time in many browsers at once is one person.
    provider.subject, provider.claims = "racer", {"name": "Racer", "groups": ["lab"]}
    many = [browser() for _ in range(6)]
    answers = [each.begin() for each in many]
    with ThreadPoolExecutor(6) as pool:
        came = list(pool.map(Browser.hand_in, many, answers))
    assert {each.status_code for each in came} == {200}
    assert len({each.person["id"] for each in many}) == 1


def test_another_person_in_the_same_browser_ends_the_session_before(browser: Open) -> None:
    here = browser()
    here.come("first", "lab")
    before = dict(here.http.cookies)
    here.come("second", "lab")
    thief = browser()
    thief.http.cookies.update(before)
    assert thief.http.get("/api/session").status_code == 401
    assert here.person["name"] == "Second"
    assert here.http.delete("/api/session").status_code == 204
    assert here.http.get("/api/session").status_code == 401


def test_a_provider_that_hangs_is_told_and_nobody_else_waits(
    editor: Editor, provider: Provider, browser: Open
) -> None:
    provider.slow["/token"] = 8.0
    here = browser()
    answer = here.begin()
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(here.hand_in, answer)
        with editor.client() as other:
            slowest = 0.0
            while not waiting.done():
                begun = time.monotonic()
                assert other.get("/api/graphs").status_code == 200
                slowest = max(slowest, time.monotonic() - begun)
                time.sleep(0.05)
        refused = waiting.result()
    assert (refused.status_code, "has not answered" in refused.text) == (503, True)
    assert slowest < 4  # none waited for the provider


def test_a_person_proves_again_that_it_is_they(
    editor: Editor, provider: Provider, browser: Open
) -> None:
    here = browser()
    here.come("vera", "lab")
    assert here.http.get("/api/session/provider").json()["mine"] is True
    session = here.http.get("/api/devices").json()["this"]
    kept = Confirmations(editor.data, Keys(TOKEN))
    now = int(time.time())

    def tried(subject: str = "vera", **claims: Any) -> httpx.Response:
        provider.subject = subject
        provider.claims = {"name": "Vera", "groups": ["lab"], **claims}
        return here.hand_in(here.begin("/robots", again=True))

    for refused in (
        tried("uku"),
        tried(auth_time=now - 60),
        tried(auth_time=None),
        tried(auth_time=now + 600),
    ):
        assert refused.status_code == 403, refused.text
    assert kept.last(session) is None
    proven = tried()
    assert proven.json() == {"goal": "/robots", "signed_in": None}
    found = kept.last(session)
    assert found is not None
    assert (found.how, abs(found.at - time.time()) < 60) == ("oidc", True)
    with editor.client() as owner:
        rows = owner.get("/api/audit").json()["rows"]
    mine = [each["text"] for each in rows if each.get("person", {}).get("name") == "Vera"]
    assert sum("confirmed" in each for each in mine) == 1, mine
    # It is the proof of the session that began, and of no other one.
    answer = here.begin(again=True)
    here.http.delete("/api/session")
    here.come("vera", "lab")
    assert here.hand_in(answer).status_code == 401
    here.http.delete("/api/session")
    other = browser()
    assert other.http.post("/api/session/provider", json={"again": True}).status_code == 401
    with editor.client() as owner:
        link = owner.post("/api/members", json={"name": "By link", "role": "operator"}).json()
    proof = link["links"][0]["path"].removeprefix("/#i=")
    other.http.post("/api/session", json={"invitation": proof}).raise_for_status()
    assert other.http.post("/api/session/provider", json={"again": True}).status_code == 409
