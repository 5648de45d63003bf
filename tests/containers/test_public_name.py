"""A public name: the proxy asks an authority for its certificate, which proves the name by ACME.

The authority is another Caddy, since no public one can be reached; names are those of this network.
"""

import ssl
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest

from containers.engine import podman
from containers.stack import Stack, running

NAME = "robots.example.org"
_AUTHORITY = """
{
	admin off
	skip_install_trust
	http_port 9080
	https_port 9443
}
https://acme.example.org:9443 {
	tls internal
	acme_server
}
"""
_MORE = f"""
x-names: &names
  extra_hosts: ["{NAME}:192.168.77.1", "acme.example.org:192.168.77.1"]
services:
  authority:
    <<: *names
    image: caddy:2.10.0
    network_mode: host
    command: [caddy, run, --config, /etc/caddy/Caddyfile, --adapter, caddyfile]
    volumes: ["./authority.Caddyfile:/etc/caddy/Caddyfile:ro"]
  proxy:
    <<: *names
    volumes: ["./authority.pem:/etc/ssl/certs/ca-certificates.crt:ro"]
"""


@pytest.fixture(scope="module")
def stack() -> Iterator[Stack]:
    settings = {
        "ACTION_ASSISTANT_PUBLIC_URL": f"https://{NAME}/",
        "CERTIFICATE": "admin@example.org",
        "CERTIFICATE_AUTHORITY": "https://acme.example.org:9443/acme/local/directory",
    }
    with running("public", settings=settings, more=_MORE) as found:
        (found.folder / "authority.Caddyfile").write_text(_AUTHORITY)
        (found.folder / "authority.pem").write_text("")
        found.compose("up", "--detach", "--no-build", "authority")
        root = "/data/caddy/pki/authorities/local/root.crt"
        made = _until(lambda: podman("exec", found.container("authority"), "cat", root))
        (found.folder / "authority.pem").write_text(made)
        found.up("db", "editor", "proxy")
        yield found


def test_the_page_comes_with_a_certificate_of_the_authority(stack: Stack, tmp_path: Path) -> None:
    authority = tmp_path / "authority.pem"
    authority.write_text((stack.folder / "authority.pem").read_text())
    trust = ssl.create_default_context(cafile=str(authority))

    def page() -> str:
        with httpx.Client(verify=trust, trust_env=False, timeout=10) as browser:
            answer = browser.get(
                "https://192.168.77.1/",
                headers={"host": NAME, "accept": "text/html"},
                extensions={"sni_hostname": NAME},
            )
            return answer.text

    assert '<div id="root">' in _until(page)
    assert stack.said("editor", "link").startswith(f"https://{NAME}/#t=")
    assert "certificate obtained successfully" in stack.log("proxy")


def _until(ask: Callable[[], str], seconds: float = 60) -> str:
    """Return the answer of `ask`, once it no longer fails."""
    deadline = time.monotonic() + seconds
    while True:
        try:
            return ask()
        except (AssertionError, httpx.HTTPError):
            if time.monotonic() > deadline:
                raise
            time.sleep(0.5)
