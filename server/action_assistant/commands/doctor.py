"""`doctor`: says in plain sentences what is wrong with this installation, and what to do about it."""

import argparse
import os
import shutil
import sqlite3
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

import anyio
import httpx
import msgspec
from sqlalchemy import create_engine
from sqlalchemy.exc import DBAPIError

from action_assistant import paths as places
from action_assistant import settings
from action_assistant.commands.processes import port_number
from action_assistant.editor.log import database_location
from action_assistant.errors import CannotStart
from action_assistant.interpreter import for_runner
from action_assistant.journal.database import cause_of
from action_assistant.journal.databases import database_of
from action_assistant.journal.migrate import recognize
from action_assistant.private_files import holds_nothing_else, open_to_others, prove_writable
from action_assistant.runner.links.diagnostics import Diagnostic, Verdict
from action_assistant.runner.links.port import Registration
from action_assistant.runner.links.ros2.checkup import look
from action_assistant.runner.runs import queries
from action_assistant.safe_text import one_line
from action_assistant.settings import reached
from action_assistant.version import VERSION
from action_assistant.web.auth.access import REFUSED_SOCKET
from action_assistant.web.network.certificate import Certificate
from action_assistant.web.server.sockets import bound

_SIGNS: Final[dict[Verdict, str]] = {"fine": "✓", "note": "·", "wrong": "✗"}
_SOUND_SQLITE: Final = (3, 51, 3)
_ROS_S: Final = 60.0
_UPGRADE: Final = {
    "connection": "Upgrade",
    "upgrade": "websocket",
    "sec-websocket-version": "13",
    "sec-websocket-key": "dGhlIHNhbXBsZSBub25jZQ==",
}


def _add_doctor(doctor: argparse.ArgumentParser) -> None:
    doctor.epilog = (
        "example: action-assistant doctor --data ./data; exit code 1 if something is wrong"
    )
    doctor.add_argument(
        "--data", type=Path, default=places.data(), metavar="DIR", help="default: %(default)s"
    )
    doctor.add_argument(
        "--database",
        metavar="URL",
        default=settings.database(),
        help="of the editor; default: the one that was served last",
    )
    doctor.add_argument("--host", default="127.0.0.1", metavar="H", help="default: %(default)s")
    doctor.add_argument(
        "--port",
        type=port_number,
        default=settings.port(),
        metavar="N",
        help="default: %(default)s",
    )
    doctor.add_argument(
        "--public-url", metavar="URL", help="where a proxy shows the page; it is asked there"
    )
    doctor.add_argument(
        "--only", choices=("machine", "ros"), help="look at one side of it only; default: at both"
    )
    doctor.add_argument("--json", action="store_true", help="print the findings as JSON")
    doctor.add_argument("--here", action="store_true", help=argparse.SUPPRESS)  # with this Python
    doctor.set_defaults(handler=_doctor)


COMMANDS: Final = {"doctor": _add_doctor}


def _doctor(options: argparse.Namespace) -> int:
    found: list[Diagnostic] = []
    if options.only != "ros":
        found += _machine(options)
    if options.only != "machine":
        found += _ros(options)
    if options.json:
        print(msgspec.json.encode(found).decode())
    else:
        for each in found:
            print(one_line(f"{_SIGNS[each.verdict]} {each.topic}: {each.what}"))
            if each.advice:
                print(f"    {each.advice}")
    return 1 if any(each.verdict == "wrong" for each in found) else 0


def _machine(options: argparse.Namespace) -> Iterator[Diagnostic]:
    python = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    yield _fine("program", f"Version {VERSION} on Python {python}.")
    yield _page()
    yield _folder(options.data)
    yield _graphs(options)
    yield _database("runs", f"sqlite:///{options.data / 'runner.db'}")
    yield from _sqlite()
    yield _port("editor", options.host, options.port, options.data)
    yield _port("runner", options.host, options.port + 1, options.data)
    yield from _public(options)
    yield _clock()


def _fine(topic: str, what: str) -> Diagnostic:
    return Diagnostic(topic=topic, verdict="fine", what=what)


def _wrong(topic: str, what: str, advice: str = "") -> Diagnostic:
    return Diagnostic(topic=topic, verdict="wrong", what=what, advice=advice)


def _page() -> Diagnostic:
    if (places.page() / "index.html").is_file():
        return _fine("page", "The page is built.")
    advice = "Run `make setup` in the checkout."
    if shutil.which("node") is None:
        advice += " Node.js is not here either; `make setup` fetches one."
    return _wrong("page", f"The page is not built: {places.page()} has no index.html.", advice)


def _folder(path: Path) -> Diagnostic:
    if not path.exists():
        return Diagnostic(
            topic="data folder", verdict="note", what=f"{path} is not there yet; serve makes it."
        )
    try:
        prove_writable(path)
        found = open_to_others(path)
    except CannotStart as error:
        return _wrong("data folder", str(error), "Choose another with --data, or mend its rights.")
    if found:
        advice = "The next start of this program closes them."
        if path in found and not holds_nothing_else(path):
            advice += f" The folder has other things in it, too: `chmod 700 {path}`, or move them."
        return _wrong(
            "data folder", f"Other users of this computer can read {_listed(path, found)}.", advice
        )
    free = shutil.disk_usage(path).free // 2**20
    if free < 100:
        return _wrong("data folder", f"{path} has {free} MiB left.", "Make room: edits need it.")
    return _fine("data folder", f"{path} can be written, by you alone read; {free} MiB are free.")


def _listed(data: Path, paths: list[Path]) -> str:
    """Some of them, by their names in the folder."""
    names = [str(path.relative_to(data)) if path != data else str(data) for path in paths]
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more


def _graphs(options: argparse.Namespace) -> Diagnostic:
    try:
        return _database("database", options.database or database_location.of(options.data))
    except CannotStart as error:
        return _wrong("database", str(error))


def _database(topic: str, url: str) -> Diagnostic:
    """Whether a database can be read, without changing anything of it."""
    path = Path(url.removeprefix("sqlite:///"))
    if url.startswith("sqlite:") and not path.exists():
        return Diagnostic(
            topic=topic, verdict="note", what=f"{path} is not there yet; serve makes it."
        )
    name = topic
    try:
        name = database_of(url).name
        if url.startswith("sqlite:"):
            database_of(url).look(recognize)
            _read_only(path).close()
        else:
            anyio.run(_reached, url)
    except CannotStart as error:
        return _wrong(topic, str(error))
    except (sqlite3.Error, DBAPIError, OSError) as error:
        return _wrong(topic, f"{name} cannot be read: {cause_of(error)}.", "`verify` looks closer.")
    return _fine(topic, f"{name} can be read.")


async def _reached(url: str) -> None:
    """Raises CannotStart, or what the driver raises."""
    database = database_of(url)
    try:
        await database.ask(lambda connection: connection.exec_driver_sql("SELECT 1").scalar())
    finally:
        await database.close()


def _read_only(path: Path) -> sqlite3.Connection:
    """A connection that cannot write. Raises sqlite3.Error for what is no database of ours."""
    connection = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        connection.execute("SELECT count(*) FROM alembic_version").fetchone()
    except sqlite3.Error:
        connection.close()
        raise
    return connection


def _sqlite() -> Iterator[Diagnostic]:
    if sqlite3.sqlite_version_info < _SOUND_SQLITE:
        yield Diagnostic(
            topic="database",
            verdict="note",
            what=f"SQLite {sqlite3.sqlite_version} is older than 3.51.3, which mended a rare damage "
            "to files that several processes write. Each of ours is written by one.",
        )


def _port(name: str, host: str, port: int, data: Path) -> Diagnostic:
    try:
        for probe in bound(host, port):
            probe.close()
    except CannotStart as error:
        if _ours(host, port, data):
            return _fine(name, f"It runs on port {port}.")
        return _wrong(name, str(error), "Something else listens there.")
    return _fine(name, f"Port {port} is free; nothing runs there.")


def _ours(host: str, port: int, data: Path) -> bool:
    trust = Certificate(data).trusting_too()
    for scheme in ("http", "https"):
        try:
            url = f"{scheme}://{host}:{port}/healthz"
            with urllib.request.urlopen(url, timeout=2, context=trust) as answer:
                return bool(answer.status == 200)
        except (urllib.error.URLError, OSError):
            continue
    return False


def _public(options: argparse.Namespace) -> Iterator[Diagnostic]:
    """Whether the proxy leads to both processes, and passes sockets on. Nothing secret is sent."""
    try:
        public = reached(options.public_url, None).public
    except CannotStart as error:
        yield _wrong("public address", str(error))
        return
    if public is not None:
        trust = Certificate(options.data).trusting_too()
        with httpx.Client(verify=trust, timeout=5, trust_env=False) as client:
            yield _shown(client, "page", public.page)
            yield _shown(client, "runner", public.runner)


def _shown(client: httpx.Client, name: str, url: str) -> Diagnostic:
    topic = f"{name} in public"
    advice = "docs/proxy has the files for nginx and Caddy."
    try:
        health = client.get(f"{url}/healthz")
        live = client.get(f"{url}/api/live", headers=_UPGRADE)
    except httpx.HTTPError as error:
        return _wrong(topic, f"{url} does not answer: {error}.", "Is the proxy running? " + advice)
    if health.status_code != 200 or "version" not in health.text:
        what = f"What answers at {url} is not the {name} ({health.status_code})."
        return _wrong(topic, what, f"The proxy has to lead it to the {name}'s port. {advice}")
    if REFUSED_SOCKET[0].decode() not in live.headers:
        what = f"The proxy at {url} passes no WebSockets on."
        return _wrong(topic, what, f"nginx: the headers Upgrade and Connection. {advice}")
    return _fine(topic, f"{url} leads to the {name}, and passes WebSockets on.")


def _clock() -> Diagnostic:
    """A clock cannot be compared with anything here but the files of this program."""
    newest = max(each.stat().st_mtime for each in Path(__file__).parent.glob("*.py"))
    if time.time() < newest - 86_400:
        return _wrong(
            "clock",
            f"It is {time.strftime('%Y-%m-%d')} by the clock, earlier than the program was installed.",
            "Set it: histories of runs would be dated wrongly.",
        )
    return _fine("clock", f"It is {time.strftime('%Y-%m-%d %H:%M:%S %Z')} by the clock.")


def _ros(options: argparse.Namespace) -> list[Diagnostic]:
    """The side of the robots, looked at by the Python that the runner would have."""
    if options.here:
        return anyio.run(look, _registered(options.data), lambda: time.time_ns() // 1000)
    interpreter = for_runner()
    notes = [
        Diagnostic(topic="rclpy", verdict="note", what=interpreter.remark)
        for _ in range(bool(interpreter.remark))
    ]
    command = [
        str(interpreter.path),
        *("-m", "action_assistant", "doctor", "--only", "ros", "--here", "--json"),
        *("--data", str(options.data)),
    ]
    try:
        answer = subprocess.run(
            command,
            env=interpreter.environment(os.environ),
            capture_output=True,
            timeout=_ROS_S,
            check=False,
        )
        return notes + msgspec.json.decode(answer.stdout, type=list[Diagnostic])
    except subprocess.TimeoutExpired:
        return [*notes, _wrong("rclpy", f"{interpreter.path} did not answer in {_ROS_S:g} s.")]
    except msgspec.DecodeError:
        said = answer.stderr.decode(errors="replace").strip().splitlines()
        why = said[-1] if said else f"exit code {answer.returncode}"
        return [*notes, _wrong("rclpy", f"{interpreter.path} cannot run this program: {why}")]


def _registered(data: Path) -> list[Registration]:
    """Robots in the registry, read without waiting for the runner; none when there is none yet."""
    path = data / "runner.db"
    if not path.exists():
        return []
    reader: Callable[[], sqlite3.Connection] = lambda: _read_only(path)  # noqa: E731
    engine = create_engine("sqlite://", creator=reader)
    try:
        with engine.connect() as connection:
            rows = connection.execute(queries.all_robots()).all()
    except (sqlite3.Error, DBAPIError):
        return []  # what is wrong with the file is said elsewhere
    finally:
        engine.dispose()
    return [
        Registration(
            name=row.name,
            domain=row.domain,
            rmw=row.rmw,
            get_service=row.get_service,
            profile=row.profile,
        )
        for row in rows
    ]
