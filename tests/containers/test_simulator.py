"""One container without robots: from nothing to the first page, and the commands in it."""

import json
import time
from collections.abc import Iterator

import httpx
import pytest

from containers.images import say
from containers.stack import Stack, findings, running, state

PAGE = "http://127.0.0.1:8000"


@pytest.fixture(scope="module")
def stack() -> Iterator[Stack]:
    """Start the simulator's container without an `.env` file."""
    begun = time.monotonic()
    with running("simulator", "simulator") as found:
        assert found.token("simulator")
        say(f"from `up` to the link that signs in: {time.monotonic() - begun:.0f} s")
        yield found


def test_the_link_signs_in_and_the_page_is_there(stack: Stack) -> None:
    link = stack.said("simulator", "link").strip()
    assert link.startswith(f"{PAGE}/#t=")
    with httpx.Client(base_url=PAGE, headers={"origin": PAGE}, trust_env=False) as browser:
        assert '<div id="root">' in browser.get("/", headers={"accept": "text/html"}).text
        assert browser.get("/api/graphs").status_code == 401
        signed = browser.post("/api/session", json={"token": link.partition("#t=")[2]})
        assert signed.is_success, signed.text
        assert browser.get("/api/graphs").json()


def test_every_command_works_as_it_stands(stack: Stack) -> None:
    assert stack.said("simulator", "people", "list") == ""
    assert "nothing was running" in stack.said("simulator", "stop", "--all")
    assert findings(stack.execute("simulator", "action-assistant", "doctor", "--json").stdout) == {}
    assert stack.execute("simulator", "action-assistant", "doctor").returncode == 0


def test_an_example_runs_and_stops(stack: Stack) -> None:
    graphs = json.loads(stack.said("simulator", "graphs", "--json"))
    run = stack.said("simulator", "run", graphs[0]["id"], "--no-wait").strip()
    assert stack.said("simulator", "stop", "--all") in {"stopped\n", "nothing was running\n"}
    runs = json.loads(stack.said("simulator", "runs", "--json"))
    assert {each["state"] for each in runs if each["id"] == run} <= {"stopped", "finished"}


def test_the_container_listens_on_this_computer_alone_and_has_no_rights(stack: Stack) -> None:
    found = state(stack.container("simulator"))
    hosts = {
        each["HostIp"]
        for ports in found["NetworkSettings"]["Ports"].values()
        for each in ports or []
    }
    assert hosts == {"127.0.0.1"}
    assert found["HostConfig"]["ReadonlyRootfs"]
    assert found["EffectiveCaps"] in (None, [])
    assert found["HostConfig"]["Memory"] == 3 * 1024**3
    with pytest.raises(httpx.HTTPError):
        httpx.get("http://192.168.77.1:8000/healthz", trust_env=False, timeout=5)


def test_its_data_outlive_it_and_are_its_own(stack: Stack) -> None:
    made = stack.said("simulator", "graphs")
    token = stack.token("simulator")
    stack.down(volumes=False)
    stack.up("simulator")
    assert stack.said("simulator", "graphs") == made
    assert stack.token("simulator") == token
    assert "temoto-action-assistant_simulator" in str(state(stack.container("simulator"))["Mounts"])
