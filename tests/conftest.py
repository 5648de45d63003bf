"""Fixtures for all tests."""

import inspect
import os
import ssl
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

import httpx
import pytest
from hypothesis import settings

from journal import servers
from journal.servers import Server
from support import doses, skips, warm
from support.recordings import CORPUS, NO_CORPUS, family

# `make containers` runs these, as root, for a quarter of an hour.
collect_ignore = [] if "CONTAINERS" in os.environ else ["containers"]

# No test speaks to another machine, whatever robots it registers.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

# Machines are slow at times; a test that is too slow is found by its time limit, not by chance.
settings.register_profile("default", deadline=None)
settings.load_profile("default")


@cache
def _context(verify: Any, cert: Any, trust_env: bool, *_: str | None) -> ssl.SSLContext:
    return httpx.create_ssl_context(verify=verify, cert=cert, trust_env=trust_env)


def _context_once(verify: Any = True, cert: Any = None, trust_env: bool = True) -> ssl.SSLContext:
    named = map(os.environ.get, ("SSL_CERT_FILE", "SSL_CERT_DIR"))
    return _context(verify, cert, trust_env, *named)


# Each client of httpx would read all certificates of the machine, 30 ms of a processor, also for plain http.
httpx._transports.default.create_ssl_context = _context_once

# httpx waits 5 s for an answer by itself. Beside seven other processes on two cores a server that works
# may take longer; one that does not answer at all is found by the time limit of the test.
_timeout: httpx.Timeout = inspect.signature(httpx.get).parameters["timeout"].default
_timeout.connect = _timeout.read = _timeout.write = _timeout.pool = 60.0


#: Files and folders whose tests are few and long, the longest first: begun last, they would end alone.
_FIRST: Final = ("tests/web/auth/test_matrix.py", "tests/web/")


def _turn(item: pytest.Item) -> int:
    """Return after how many entries of `_FIRST` a test begins."""
    found = (n for n, start in enumerate(_FIRST) if item.nodeid.startswith(start))
    return next(found, len(_FIRST))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let long files begin first. Skip what only `make soak` has time for, and what has its turn on
    another day, unless its file is named."""
    items.sort(key=_turn)
    if "TEST_LONG" in os.environ:
        return
    files_named = any(".py" in argument for argument in config.args)
    for item in items:
        if item.get_closest_marker("long"):
            item.add_marker(pytest.mark.skip(reason="takes long: `make soak ARGS=long`"))
            continue
        of_turns = item.get_closest_marker("turns") and not doses.has_its_turn(item.nodeid)
        if (of_turns or doses.waits_with_its_file(item.nodeid)) and not files_named:
            item.add_marker(
                pytest.mark.skip(
                    reason="has its turn on another day: name its file, or set TEST_DAY"
                )
            )


def skipped(config: pytest.Config) -> Counter[str]:
    """Reasons of the tests that were skipped; nothing in a process of several, which only sees some."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None or hasattr(config, "workerinput"):
        return Counter()
    return skips.reasons(reporter.stats.get("skipped", []))


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """CI skips only what is on the list."""
    if "CI" in os.environ and exitstatus == 0 and skips.unaccepted(skipped(session.config)):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> Generator[None]:
    """Print the skipped tests at the very end, where people read logs."""
    yield
    found = skipped(config)
    if found:
        terminalreporter.write_line(skips.closing_line(found))
    if "CI" in os.environ:
        for reason in skips.unaccepted(found):
            terminalreporter.write_line(
                f"CI may not skip this (tests/skips.toml): {reason}", red=True
            )


@pytest.fixture(scope="session")
def anyio_backend() -> str:
    """The servers run on asyncio; so do the tests."""
    return "asyncio"


@pytest.fixture(autouse=True)
def no_settings_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Settings of whoever runs the tests must not change what they test."""
    for name in [name for name in os.environ if name.startswith("ACTION_ASSISTANT_")]:
        monkeypatch.delenv(name)


@pytest.fixture
def new_interpreters(monkeypatch: pytest.MonkeyPatch) -> None:
    """The test is about how processes start: each is a new interpreter, and no fork of a warm one."""
    monkeypatch.setenv(warm.NEW_INTERPRETERS, "1")


@pytest.fixture(scope="session")
def postgres() -> Iterator[Server]:
    """A Postgres server that no test harms."""
    if servers.binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with servers.server() as one:
        yield one


@pytest.fixture
def small_disk() -> Iterator[Callable[[str], Path]]:
    """Makes a file system of so many bytes (`2m`).

    Beside the folders of the tests: a later run that tidies those up fails at the mounts of a test
    that was killed.
    """
    places: list[Path] = []

    def one(size: str) -> Path:
        place = Path(tempfile.mkdtemp(prefix="action-assistant-disk-"))
        mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
        try:
            subprocess.run(mount, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError):
            place.rmdir()
            pytest.skip("mounting a small file system needs root")
        places.append(place)
        return place

    yield one
    for place in places:
        subprocess.run(["umount", "--lazy", str(place)], check=True)
        place.rmdir()


@pytest.fixture(params=["recorded", "real"])
def graph_files(request: pytest.FixtureRequest) -> list[Path]:
    """Graphs that the engine was given; files that people keep, some of which are unreadable."""
    if request.param == "recorded":
        return sorted(family("engine").rglob("*.graph.json"))
    if not CORPUS.is_dir():
        pytest.skip(NO_CORPUS)
    return sorted(CORPUS.rglob("*.json"))
