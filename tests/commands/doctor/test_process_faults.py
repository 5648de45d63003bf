"""`doctor` on processes that do not fit together, for real; and behind proxies that are set up wrongly."""

import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
import pytest

from action_assistant.web.network.certificate import Certificate
from support.doctor import asked, fault, faults
from support.product import TOKEN, Product, free_ports, running
from support.provider import provided
from support.proxy import NGINX, nginx

NAME = "localhost"


@pytest.fixture(scope="module")
def product(
    served: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Product, int]]:
    """A product with a public address at a port where a test may put a proxy."""
    port = free_ports()
    data = tmp_path_factory.mktemp("process") / "data"
    shutil.copytree(served, data)
    with running(data, "--public-url", f"https://{NAME}:{port}/temoto/") as one:
        yield one, port


@contextmanager
def process(kind: str, data: Path, port: int, *, altered: str) -> Iterator[None]:
    """The editor or runner alone, in which something has been altered before it was imported."""
    code = f"import sys, time\n{altered}\nfrom action_assistant.cli import main\nsys.exit(main())"
    command = [sys.executable, "-c", code, kind, "--data", str(data), "--port", str(port)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as running_process:
        try:
            deadline = time.monotonic() + 60
            while not _answers(port):
                assert running_process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.05)
            yield
        finally:
            running_process.terminate()


def _answers(port: int) -> bool:
    try:
        return httpx.get(f"http://127.0.0.1:{port}/healthz", trust_env=False).status_code == 200
    except httpx.TransportError:
        return False


@pytest.mark.long
def test_an_installation_that_runs_and_is_sound_has_nothing_wrong(
    product: tuple[Product, int],
) -> None:
    one, _ = product
    before = {each.name: each.read_bytes() for each in one.data.glob("*.db")}
    assert asked(one.data, "--only", "machine", "--port", str(one.port)) == (0, [])
    assert {each.name: each.read_bytes() for each in one.data.glob("*.db")} == before
    told = one.cli("doctor", "--only", "machine", "--data", str(one.data), "--port", str(one.port))
    assert f"✓ 127.0.0.1:{one.port}: The editor runs there." in told.stdout


def test_a_folder_that_is_served_elsewhere_is_asked_at_its_own_address(
    product: tuple[Product, int],
) -> None:
    """Nobody has to know the port, and the editor of another folder is not examined for it."""
    one, _ = product
    told = one.cli("doctor", "--only", "machine", "--data", str(one.data))
    assert f"✓ 127.0.0.1:{one.port}: The editor runs there." in told.stdout
    assert f"✓ 127.0.0.1:{one.port + 1}: The runner runs there." in told.stdout
    assert "served-elsewhere" not in told.stdout


def test_a_port_that_another_program_has_is_named(data: Path) -> None:
    port = free_ports()
    with socket.socket() as other:
        other.bind(("127.0.0.1", port + 1))
        other.listen()
        found = fault(data, port=port)
    assert (found.code, found.where) == ("port-taken", f"127.0.0.1:{port + 1}")
    assert "Another program listens where the runner should" in found.message
    assert f"sport = {port + 1}" in found.remedy


def test_processes_with_the_token_of_another_folder_are_named(
    product: tuple[Product, int], data: Path
) -> None:
    (data / "token").write_text("another-" * 6)
    found = faults(data, port=product[0].port)
    assert [each.code for each in found] == ["token-differs", "token-differs"]


@pytest.mark.long
def test_a_runner_of_another_version_and_with_another_clock_is_named(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = free_ports()
    older = "import action_assistant.version as v; v.VERSION = '0.0.9'"
    behind = "real = time.time; time.time = lambda: real() - 3600"
    with process("runner", data, port + 1, altered=f"{older}\n{behind}"):
        found = {each.code: each for each in faults(data, port=port)}
    assert set(found) == {"version-differs", "clock-differs"}
    assert "version 0.0.9" in found["version-differs"].message
    assert "60 min behind" in found["clock-differs"].message
    assert {each.where for each in found.values()} == {f"127.0.0.1:{port + 1}"}


@pytest.mark.long
def test_certificates_of_ones_own_are_looked_at_where_they_are_shown(
    served: Path, tmp_path: Path
) -> None:
    data = tmp_path / "data"
    shutil.copytree(served, data)
    with running(data, "--tls") as one:
        assert faults(data, port=one.port) == []
        shutil.copytree(data, tmp_path / "copy")
        (tmp_path / "copy" / "tls" / "ca.pem").unlink()
        found = faults(tmp_path / "copy", port=one.port)
    assert {each.code for each in found} == {"certificate-untrusted"}


@pytest.mark.skipif(not NGINX, reason="nginx is not installed")
def test_certificates_that_expired_or_are_for_other_names_are_told_apart(
    product: tuple[Product, int], tmp_path: Path
) -> None:
    one, port = product
    long_ago = datetime.now(UTC) - timedelta(days=500)
    for code, name, now in (
        ("certificate-expired", NAME, long_ago),
        ("certificate-names", "elsewhere.local", datetime.now(UTC)),
    ):
        folder = tmp_path / code
        made = Certificate(folder)
        made.renew([name], now=now)
        shutil.copytree(one.data, folder / "data")
        shutil.copytree(folder / "tls", folder / "data" / "tls")
        with nginx(
            folder / "proxy", name=NAME, port=port, editor=one.port, identity=(made.key, made.chain)
        ):
            found = fault(folder / "data", public_url=f"https://{NAME}:{port}/temoto/")
        assert found.code == code
        assert name in found.message or code == "certificate-expired"


#: The text that is removed from the documented file, and the text that replaces it.
MISTAKES = {
    "proxy-sockets": ("    proxy_set_header Upgrade $http_upgrade;\n", ""),
    "proxy-host": ("proxy_set_header Host $http_host", "proxy_set_header Host $proxy_host"),
    "proxy-path": ("location /temoto/runner/", "location /temoto/walker/"),
    "proxy-target": ("location /temoto/", "location /tomato/"),
}


@pytest.mark.long
@pytest.mark.skipif(not NGINX, reason="nginx is not installed")
@pytest.mark.parametrize("code", [*MISTAKES, ""])
def test_a_proxy_that_is_set_up_wrongly_is_named_by_its_mistake(
    product: tuple[Product, int], tmp_path: Path, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, port = product
    monkeypatch.setenv("ACTION_ASSISTANT_PUBLIC_URL", f"https://{NAME}:{port}/temoto/")
    mistake = MISTAKES.get(code, ("", ""))
    with nginx(tmp_path / "proxy", name=NAME, port=port, editor=one.port, mistake=mistake) as chain:
        monkeypatch.setenv("SSL_CERT_FILE", str(chain))
        found = faults(one.data, port=one.port)
    assert {each.code for each in found} == ({code} if code else set())
    assert all("docs/proxy" in each.remedy for each in found)
    if code == "proxy-path":
        assert [each.where for each in found] == [f"https://{NAME}:{port}/temoto/runner"]


def test_a_public_address_where_nobody_answers_and_one_that_is_none_are_named(data: Path) -> None:
    found = faults(data, public_url="https://localhost:1/")
    assert {each.code for each in found} == {"proxy-unreachable"}
    assert fault(data, public_url="robots.example.org").code == "setting-wrong"


def test_the_token_is_never_shown_to_what_is_looked_at(data: Path) -> None:
    heard: list[bytes] = []
    port = free_ports()
    with socket.create_server(("127.0.0.1", port)) as other:
        other.settimeout(20)
        command = [sys.executable, "-m", "action_assistant", "doctor", "--only", "machine"]
        with subprocess.Popen(
            [*command, "--data", str(data), "--port", str(port)], stdout=subprocess.DEVNULL
        ) as looking:
            while looking.poll() is None:
                try:
                    other.settimeout(0.5)
                    wire, _ = other.accept()
                except TimeoutError:
                    continue
                with wire:
                    heard.append(wire.recv(65_536))
                    health = b'{"status":"ok","version":"0.1.0"}'
                    wire.sendall(
                        b"HTTP/1.1 200 OK\r\nconnection: close\r\ncontent-length: "
                        + str(len(health)).encode()
                        + b"\r\n\r\n"
                        + health
                    )
    assert len(heard) >= 2
    assert TOKEN.encode() not in b"".join(heard)


def test_an_identity_provider_that_cannot_be_used_is_told_with_the_reason(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def told(data: Path) -> dict[str, str]:
        return {each.code: each.message for each in faults(data)}

    named = "ACTION_ASSISTANT_OIDC_"
    monkeypatch.setenv(f"{named}ISSUER", f"http://127.0.0.1:{free_ports()}")
    assert "CLIENT_ID is missing" in told(data)["setting-wrong"]
    monkeypatch.setenv(f"{named}CLIENT_ID", "us")
    monkeypatch.setenv(f"{named}GROUPS", "lab=everything")
    assert "GROUP=ROLE" in told(data)["setting-wrong"]
    monkeypatch.setenv(f"{named}GROUPS", "*=viewer")
    codes = told(data)
    assert "cannot be reached" in codes["provider-unusable"]
    assert "on this computer only" in codes["provider-address"]
    monkeypatch.setenv("ACTION_ASSISTANT_PUBLIC_URL", f"https://{NAME}:1/")
    with provided() as provider:
        monkeypatch.setenv(f"{named}ISSUER", provider.issuer)
        codes = told(data)
        assert not {"provider-unusable", "provider-address"} & codes.keys()
        monkeypatch.setenv(f"{named}ISSUER", provider.issuer + "/")
        codes = told(data)
        assert f"it calls itself {provider.issuer}" in codes["provider-unusable"]
