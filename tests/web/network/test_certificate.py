"""The certificate of --tls: who may read its keys, for which names it is good, when it is renewed."""

import ipaddress
import ssl
import stat
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
import pytest
from cryptography import x509
from websockets.sync.client import connect

from action_assistant.web.network.certificate import Certificate
from support.product import TOKEN, running

NAMES = ("localhost", "127.0.0.1", "::1", "lab.local", "10.1.2.3")


def chain_of(certificate: Certificate) -> tuple[x509.Certificate, x509.Certificate]:
    """The server's certificate, and that of its authority."""
    found = x509.load_pem_x509_certificates(certificate.chain.read_bytes())
    return found[0], found[1]


def test_keys_are_for_this_user_alone(tmp_path: Path) -> None:
    certificate = Certificate(tmp_path)
    assert certificate.renew(NAMES)
    for file in ("ca-key.pem", "server-key.pem"):
        assert stat.S_IMODE((tmp_path / "tls" / file).stat().st_mode) == 0o600
    assert stat.S_IMODE((tmp_path / "tls").stat().st_mode) == 0o700
    assert certificate.trusting().get_ca_certs()


def test_a_certificate_is_kept_while_it_is_good_and_renewed_before_it_ends(tmp_path: Path) -> None:
    certificate = Certificate(tmp_path)
    certificate.renew(NAMES)
    first, authority = chain_of(certificate)
    assert not certificate.renew(NAMES)
    assert not certificate.renew(NAMES[:2])  # fewer names are no reason
    late = datetime.now(UTC) + timedelta(days=380)
    assert certificate.renew(NAMES, now=late)
    second, same = chain_of(certificate)
    assert second.not_valid_after_utc > first.not_valid_after_utc
    assert same == authority  # what people trusted stays


def test_other_names_renew_it_and_unforeseen_ones_need_another_authority(tmp_path: Path) -> None:
    certificate = Certificate(tmp_path)
    certificate.renew(NAMES)
    authority = chain_of(certificate)[1]
    assert certificate.renew((*NAMES, "192.168.7.7", "other.local"))
    found, same = chain_of(certificate)
    names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert ipaddress.ip_address("192.168.7.7") in names.get_values_for_type(x509.IPAddress)
    assert same == authority
    assert certificate.renew((*NAMES, "robots.example.org"))
    assert chain_of(certificate)[1] != authority


def test_the_authority_signs_for_this_network_only(tmp_path: Path) -> None:
    Certificate(tmp_path).renew(NAMES)
    limits = (
        chain_of(Certificate(tmp_path))[1]
        .extensions.get_extension_for_class(x509.NameConstraints)
        .value.permitted_subtrees
    )
    assert limits is not None
    domains = {each.value for each in limits if isinstance(each, x509.DNSName)}
    assert domains == {"localhost", "local"}
    networks = [each.value for each in limits if isinstance(each, x509.IPAddress)]
    assert not any(ipaddress.ip_address("8.8.8.8") in network for network in networks)


@pytest.mark.parametrize("damaged", ["ca.pem", "ca-key.pem", "server.pem"])
def test_a_damaged_certificate_is_made_again(tmp_path: Path, damaged: str) -> None:
    certificate = Certificate(tmp_path)
    certificate.renew(NAMES)
    (tmp_path / "tls" / damaged).write_bytes(b"not a certificate")
    certificate.renew((*NAMES, "new.local"))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate.chain, certificate.key)
    assert not certificate.renew((*NAMES, "new.local"))


def test_processes_that_start_at_once_agree_on_one_authority(tmp_path: Path) -> None:
    ask = (
        "import sys; from pathlib import Path;"
        "from action_assistant.web.network.certificate import Certificate;"
        "sys.stdin.read(1); c = Certificate(Path(sys.argv[1])); c.renew(['localhost']);"
        "print(c.fingerprint())"
    )
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", ask, str(tmp_path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        for _ in range(3)
    ]
    for process in processes:
        assert process.stdin
        process.stdin.write(b"g")
        process.stdin.flush()
    assert len({process.communicate()[0] for process in processes}) == 1


def test_both_processes_speak_tls_and_the_command_line_trusts_them(tmp_path: Path) -> None:
    with running(tmp_path / "data", "--tls") as product:
        trust = Certificate(product.data).trusting()
        headers = {"authorization": f"Bearer {TOKEN}"}
        with httpx.Client(verify=trust, headers=headers, trust_env=False) as client:
            config = client.get(f"{product.url}/api/config").json()
            assert config["runner_url"] == product.runner_url
            assert product.runner_url.startswith("https://")
            policy = client.get(f"{product.url}/").headers["content-security-policy"]
            assert f"{product.runner_url} wss://127.0.0.1:{product.port + 1}" in policy
            answer = client.post(f"{product.url}/api/session", json={"token": TOKEN})
            assert "secure" in answer.headers["set-cookie"].lower()
            origin = {"origin": product.url.replace("https", "http")}  # a page without TLS
            assert client.get(f"{product.url}/api/graphs", headers=origin).status_code == 403
            made = client.post(f"{product.url}/api/graphs", json={"name": "task"}).json()["id"]
        room = f"{product.url.replace('http', 'ws', 1)}/api/graphs/{made}/room"
        with connect(room, ssl=trust, additional_headers=headers, proxy=None) as socket:
            socket.send(b"\x00\x00\x01\x00")
            while not bytes(socket.recv(10)).startswith(b"\x00\x01"):  # until the document comes
                pass
        live = product.runner_url.replace("http", "ws", 1) + "/api/live"
        with connect(live, ssl=trust, additional_headers=headers, proxy=None) as socket:
            assert '"hello"' in str(socket.recv(10))
        with pytest.raises(httpx.ConnectError):
            httpx.get(f"{product.url}/healthz", trust_env=False)
        assert product.cli("graphs", "--data", str(product.data)).returncode == 0
