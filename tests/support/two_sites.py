"""Two runners for one page: the halls of a lab, each a real process with a data folder of its own."""

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from support import warm
from support.product import TOKEN, Product, free_ports

HALL_A, HALL_B = "Hall A", "Hall B"


class SecondRunner:
    """The runner of Hall B."""

    def __init__(self, data: Path, product: Product, port: int) -> None:
        self.data = data
        self.port = port
        self._page_port = product.port
        self._environment = product.environment
        self._log = data.parent / "second.log"
        self._process: warm.Process | None = None

    @property
    def url(self) -> str:
        """Its URL."""
        return f"http://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start it and wait until it answers."""
        words = ["runner", "--data", str(self.data), "--port", str(self.port)]
        words += ["--page-port", str(self._page_port)]
        self._process = warm.start(words, self._environment, self._log)
        deadline = time.monotonic() + 120
        while not self._answers():
            if time.monotonic() > deadline or self._process.poll() is not None:
                raise AssertionError(f"not ready:\n{self._log.read_text()[-4000:]}")
            time.sleep(0.05)

    def _answers(self) -> bool:
        try:
            return httpx.get(f"{self.url}/readyz", trust_env=False, timeout=2).is_success
        except httpx.TransportError:
            return False

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal, such as SIGSTOP."""
        assert self._process is not None
        self._process.send_signal(number)

    def end(self) -> None:
        """Ask it to end, if it runs."""
        if self._process is not None:
            self._process.send_signal(signal.SIGCONT)
            self._process.terminate()
            self._process.wait(30)
            self._process = None

    def client(self) -> httpx.Client:
        """A client of it with the token."""
        headers = {"authorization": f"Bearer {TOKEN}"}
        return httpx.Client(base_url=self.url, headers=headers, trust_env=False, timeout=20)


@contextmanager
def two_sites(folder: Path) -> Iterator[tuple[Product, SecondRunner]]:
    """A product whose page leads the runners of two halls, and the second of them."""
    product = Product(folder / "data")
    port = free_ports()
    flags = (f"{HALL_A}={product.runner_url}", f"{HALL_B}=http://127.0.0.1:{port}")
    product.add_flags(*(word for each in flags for word in ("--runner", each)))
    second = SecondRunner(folder / "second", product, port)
    try:
        second.start()
        product.start()
        yield product, second
    finally:
        second.end()
        if product.end() != 0:
            raise AssertionError(f"serve failed:\n{product.log.read_text()[-4000:]}")
