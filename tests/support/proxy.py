"""nginx as the documentation has it, in front of a product."""

import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

DOCUMENTED = Path(__file__).parents[2] / "docs" / "proxy" / "nginx.conf"
EDITORS = DOCUMENTED.with_name("nginx-editors.conf")
NGINX = shutil.which("nginx", path="/usr/sbin:/usr/local/sbin:/usr/bin") or ""


@contextmanager
def nginx(
    folder: Path,
    *,
    name: str,
    port: int,
    editor: int,
    mistake: tuple[str, str] = ("", ""),
    identity: tuple[Path, Path] | None = None,
    documented: Path = DOCUMENTED,
) -> Iterator[Path]:
    """Run nginx inside the block, and yield the file with the certificate that it shows.
    `mistake`: the documented text, and its replacement. `identity`: key and chain, else new ones
    for the name. `documented`: the file of the documentation."""
    folder.mkdir()
    key, chain = identity or _identity(folder, name)
    text = documented.read_text()
    whole = _configured(folder, (key, chain), (name, port, editor), text, mistake)
    log = folder / "log"
    with log.open("wb") as out:
        process = subprocess.Popen(
            [NGINX, "-p", str(folder), "-c", str(whole), "-g", "daemon off;"], stderr=out
        )
    try:
        _wait(port, process, log)
        yield chain
    finally:
        process.terminate()
        process.wait(10)


def _configured(
    folder: Path,
    identity: tuple[Path, Path],
    at: tuple[str, int, int],
    text: str,
    mistake: tuple[str, str],
) -> Path:
    """The documented file (`text`) for a name, a port and the editor's port, in a configuration of nginx."""
    key, chain = identity
    name, port, editor = at
    documented, instead = mistake
    assert documented in text
    changes = {
        "listen 443": f"listen 127.0.0.1:{port}",
        "robots.example.org;": f"{name};",
        "/etc/ssl/certs/robots.example.org.pem": str(chain),
        "/etc/ssl/private/robots.example.org.key": str(key),
        ":8000": f":{editor}",
        ":8001": f":{editor + 1}",
    }
    text = text.replace(documented, instead) if documented else text
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    temporary = " ".join(f"{kind}_temp_path {folder}/{kind};" for kind in kinds)
    whole = folder / "nginx.conf"
    whole.write_text(
        f"user root; pid {folder}/pid; error_log stderr; events {{}}\n"
        f"http {{ access_log off; {temporary}\n{text} }}"
    )
    return whole


def _identity(folder: Path, name: str) -> tuple[Path, Path]:
    """A key, and a certificate that signs itself."""
    key, chain = folder / "key.pem", folder / "chain.pem"
    subject = ("-subj", f"/CN={name}", "-addext", f"subjectAltName=DNS:{name}")
    command = ("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key)
    subprocess.run([*command, "-out", chain, *subject], check=True, capture_output=True)
    return key, chain


def _wait(port: int, process: "subprocess.Popen[bytes]", log: Path) -> None:
    deadline = time.monotonic() + 20
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
        except OSError:
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.05)
        else:
            return
