"""People on the LAN reach the server without a proxy: by --tls, on other ports, with a token
from a file."""

import ssl
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from containers.engine import podman
from containers.stack import Stack, client, findings, running

PAGE = "https://192.168.77.1:9000"
TOKEN = "token-of-a-file-" + "0123456789abcdef" * 2
_SECRET = """
secrets:
  token: {file: ./secrets/token}
services:
  editor: {secrets: [token]}
  runner: {secrets: [token]}
"""


@pytest.fixture(scope="module")
def stack() -> Iterator[Stack]:
    settings = {
        "ACTION_ASSISTANT_SHARE": "tls",
        "ACTION_ASSISTANT_PORT": "9000",
        "ACTION_ASSISTANT_TOKEN_FILE": "/run/secrets/token",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    with running("lan", settings=settings, more=_SECRET) as found:
        secrets = found.folder / "secrets"
        secrets.mkdir(mode=0o700)
        (secrets / "token").write_text(f"{TOKEN}\n")
        (secrets / "token").chmod(0o444)
        found.up("db", "editor", "runner")
        yield found


def test_commands_find_the_server_over_tls_on_its_port(stack: Stack) -> None:
    for service in ("editor", "runner"):
        lines = stack.said(service, "link").split()
        assert lines == [f"https://127.0.0.1:9000/#t={TOKEN}"]
        assert stack.said(service, "stop", "--all") == "nothing was running\n"
        doctor = stack.execute(service, "action-assistant", "doctor", "--json")
        assert findings(doctor.stdout) == {}
        assert stack.is_healthy(service)


def test_people_enter_by_links_with_a_role(stack: Stack, tmp_path: Path) -> None:
    authority = tmp_path / "ca.pem"
    authority.write_text(podman("exec", stack.container("editor"), "cat", "/data/tls/ca.pem"))
    trust = ssl.create_default_context(cafile=str(authority))
    made = stack.said("editor", "people", "invite", "viewer").splitlines()
    assert made[1].strip().startswith(f"{PAGE}/#i=")
    with client(PAGE, TOKEN, verify=trust) as owner:
        assert owner.get("/api/graphs").json()
        runner = owner.get("/api/config").json()["runner_url"]
        assert runner == "https://192.168.77.1:9001"
        assert owner.get(f"{runner}/api/runs").status_code == 200
    with pytest.raises(httpx.HTTPError):
        httpx.get(f"{PAGE.replace('https', 'http')}/healthz", trust_env=False, timeout=5)
