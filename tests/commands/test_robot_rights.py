"""`robots rights`, `baton`, `lock` and `unlock`: the rights of a robot from the command line."""

from collections.abc import Callable, Iterator

import pytest

from action_assistant.cli import main
from support.product import TOKEN, Product, running


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """One server for the module."""
    with running(tmp_path_factory.mktemp("rights") / "data") as found:
        yield found


@pytest.fixture(autouse=True)
def there(product: Product, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command line finds this server."""
    monkeypatch.setenv("ACTION_ASSISTANT_URL", product.url)
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)


def test_rights_a_baton_and_locks_are_set_and_shown(capfd: pytest.CaptureFixture[str]) -> None:
    def said(*words: str, code: int = 0) -> str:
        assert main(["robots", *words]) == code
        told = capfd.readouterr()
        return told.err if code else told.out

    said("add", "David", "--domain", "183")
    assert "every operator may start there" in said("rights", "David")
    assert "has no baton" in said("baton", "David", "show")
    assert "an owner can switch it on" in said("baton", "David", "take", code=1)
    assert "nobody holds the baton of David" in said("rights", "David", "--baton", "on")
    assert "holds the baton of David, and has no page open" in said("baton", "David", "take")
    assert "baton: " in said("list")
    assert "No persons called 'Ben' can get it" in said(
        "baton", "David", "hand", "--to", "Ben", code=1
    )
    assert "nobody holds the baton" in said("baton", "David", "drop")
    shown = said("rights", "David", "--operator", "abc=2027-01-31", "--operator", "def")
    assert "only abc (abc) until 2027-02-01 00:00, def (def) may start there" in shown
    assert "only abc or def may. Ask" in said("baton", "David", "take", code=1)
    assert "is no date" in said("rights", "David", "--operator", "abc=soon", code=1)
    assert "not both" in said("rights", "David", "--all", "--operator", "abc", code=1)
    assert "every operator may" in said("rights", "David", "--all", "--baton", "off")
    rules = ("--watched", "on", "--drill-days", "30", "--released-only", "on")
    shown = said("rights", "David", *rules)
    for words in ("they watch it", "only released versions start", "counts for 30 days"):
        assert words in shown
    shown = said("rights", "David", "--watched", "off", "--drill-days", "0", "--baton", "on")
    assert ("watch it" in shown, "30 days" in shown, "released" in shown) == (False, False, True)
    assert "released" not in said("rights", "David", "--released-only", "off", "--baton", "off")
    shown = said("rights", "David", "--limit", "torque=..60", "--limit", "Grip.arm::force=-5..5")
    assert "torque at most 60 on David\narm::force of Grip from -5 to 5 on David" in shown
    assert "torque at most 60" in said("rights", "David", "--watched", "off")  # they stay
    for wrong in ("torque=60", "=..60", "torque=..much", "torque=..nan"):
        assert "is no limit" in said("rights", "David", "--limit", wrong, code=1)
    for wrong, why in (("torque=..", "Say the least or the most"), ("a=2..1", "above its most")):
        assert why in said("rights", "David", "--limit", wrong, code=1)
    assert "torque" not in said("rights", "David", "--no-limits")
    shown = said("rights", "David", "--stop-topic", "/estop", "--stop-age", "0.5")
    assert "the hardware stop of David is pressed: true on /estop, 0.5 s old at most" in shown
    assert "false on /estop, 0.5 s" in said("rights", "David", "--stop-pressed", "false")
    assert "false on /estop, 2 s" in said("rights", "David", "--stop-age", "2")
    assert "counts as pressed" in said("rights", "David", "--watched", "off")  # nobody publishes
    assert "no name of a ROS 2 topic" in said("rights", "David", "--stop-topic", "a b", code=1)
    assert "0.1 to 3600 s" in said(
        "rights", "David", "--stop-topic", "a", "--stop-age", "0", code=1
    )
    assert "estop" not in said("rights", "David", "--stop-topic", "")
    assert "Name the topic" in said("rights", "David", "--stop-age", "2", code=1)
    shown = said("rights", "David", "--page-present", "10..60")
    assert "waits after 10 s, and each run is stopped after 60 s; no enabling device" in shown
    assert "visible page" in said("rights", "David", "--watched", "off")  # it stays
    for wrong, why in (("10", "write it as"), ("60..10", "Stop follows"), ("1..9", "3 s or later")):
        assert why in said("rights", "David", "--page-present", wrong, code=1)
    assert "visible page" not in said("rights", "David", "--page-present", "")
    health_is_set_and_shown(said)
    assert main(["robots", "drill", "David"]) == 1  # none was ever made
    assert "There is no such run" in said(
        *("drill", "David", "--run", "x", "--saw-it-stop", "yes", "--hardware-stop", "no"), code=1
    )
    assert "Say why it is out of service" in said("lock", "David", "--reason", " ", code=1)
    assert "was not stopped" in said("lock", "David", "--reason", "It leaks oil.")
    assert "OUT OF SERVICE" in said("list")
    assert said("unlock", "David") == "David is in service\n"
    assert "in service already" in said("unlock", "David", code=1)


def health_is_set_and_shown(said: Callable[..., str]) -> None:
    shown = said("rights", "David", "--health", "/battery=30%,block", "--health", "/d:a: b=1,5s")
    assert (
        "battery below 30 % on /battery blocks a start; unknown (older than 30 s) blocks" in shown
    )
    assert "a: b at WARN or above on /d warns; unknown (older than 5 s) warns" in shown
    assert "The battery of David is unknown: " in shown
    assert "battery below" in said("rights", "David", "--watched", "off")  # it stays
    for wrong in ("/battery=30", "/battery=low%", "=30%", "/battery=nan%", "/d:a=1,soon"):
        assert "is no such check" in said("rights", "David", "--health", wrong, code=1)
    assert "100 % at most" in said("rights", "David", "--health", "/battery=101%", code=1)
    assert "battery" not in said("rights", "David", "--no-health")


def test_only_an_owner_switches_off_that_a_second_person_is_asked(product: Product) -> None:
    from action_assistant.web.auth.keys import Keys

    session = Keys(TOKEN).new_session("Oli", role="operator")
    headers = {
        "cookie": f"aa_{product.port}={Keys(TOKEN).sealed(session)}",
        "origin": product.url,
        "authorization": "",
    }
    with product.runner() as runner:
        careful = {"name": "Carol", "domain": 184, "profile": {"second_person": True}}
        assert runner.post("/api/robots", json=careful, headers=headers).status_code == 201
        plain = careful | {"profile": {}}
        for refused in (
            runner.post("/api/robots", json=plain, headers=headers),
            runner.patch("/api/robots/Carol", json={"profile": {}}, headers=headers),
            runner.delete("/api/robots/Carol", headers=headers),
            runner.put("/api/robots/Carol/rights", json={"baton": True}, headers=headers),
        ):
            assert refused.status_code == 403, refused.text
        assert runner.patch("/api/robots/Carol", json={"domain": 185}, headers=headers).is_success
        assert runner.patch("/api/robots/Carol", json={"profile": {}}).is_success


def test_a_version_is_released_and_withdrawn_in_both_processes(
    product: Product, capfd: pytest.CaptureFixture[str]
) -> None:
    def said(*words: str) -> str:
        assert main(["release", *words]) == 0
        return capfd.readouterr().out

    with product.editor() as editor:
        graph = editor.post("/api/graphs", json={"name": "crossing"}).json()["id"]
        made = editor.post(f"/api/graphs/{graph}/versions", json={"label": "tested"}).json()
        released = product.data / "released" / f"{made['digest']}-{made['id']}.json"
        assert said("crossing@tested") == "tested is released\n"
        (listed,) = editor.get(f"/api/graphs/{graph}/versions").json()
        assert listed["released"]["by"]["id"] == "local"
        assert released.exists()
        assert said(graph) == "tested is released\n"  # again: it stays
        assert said(f"crossing@{made['id']}", "--withdraw") == "tested is not released any more\n"
        assert "released" not in editor.get(f"/api/versions/{made['id']}").json()
        assert not released.exists()
        draft = editor.post(f"/api/graphs/{graph}/drafts", json={"name": "try"}).json()
        version = editor.post(f"/api/graphs/{draft['id']}/versions", json={}).json()
        refused = editor.put(f"/api/versions/{version['id']}/release")
        assert (refused.status_code, "can never be released" in refused.text) == (409, True)
        assert editor.put("/api/versions/none/release").status_code == 404
        kinds = [each["text"] for each in editor.get("/api/audit").json()["rows"]]
        assert any(each.startswith("released version") for each in kinds)
