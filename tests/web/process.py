"""An editor or a runner as a process of its own, and what clients say to it by hand."""

import os
import resource
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from support import warm
from support.product import COMMAND, TOKEN, free_ports

BEARER = {"authorization": f"Bearer {TOKEN}"}
UPGRADE = (
    b"GET /api/graphs/%b/room HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer %b\r\n"
    b"connection: Upgrade\r\nupgrade: websocket\r\nsec-websocket-version: 13\r\n"
    b"sec-websocket-key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


@contextmanager
def started(
    name: str, folder: Path, *flags: str, descriptors: int | None = None
) -> Iterator[tuple[int, warm.Process]]:
    """Its port, and the process, which may have so many descriptors. Its log is the file `log`."""
    port = free_ports()
    scheme = "https" if "--tls" in flags else "http"

    words = [name, "--data", str(folder / "data"), "--port", str(port), *flags]
    environ = {**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN}
    log = folder / "log"
    if descriptors is None:
        running = warm.start(words, environ, log)
    else:
        limits = (descriptors, descriptors)
        with log.open("ab") as out:
            running = subprocess.Popen(
                [*COMMAND, *words],
                env=environ,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, limits),
                stdout=out,
                stderr=out,
            )
    try:
        deadline = time.monotonic() + 120
        while True:
            try:
                url = f"{scheme}://127.0.0.1:{port}/readyz"
                if httpx.get(url, trust_env=False, verify=False).status_code == 200:
                    break
            except httpx.TransportError:
                assert time.monotonic() < deadline, log.read_text()
                time.sleep(0.05)
        yield port, running
    finally:
        running.terminate()
        running.wait()
