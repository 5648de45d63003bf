"""Supervision of both processes under one command: started together, restarted when they die, ended together."""

import os
import signal
import ssl
import subprocess
import sys
import threading
import time
import webbrowser
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import msgspec

from action_assistant.interpreter import Interpreter, for_runner
from action_assistant.logs import say, writes_json
from action_assistant.private_files import opener
from action_assistant.settings import (
    EVERYWHERE,
    INDEX_FOLDERS,
    RUNNERS,
    WATCHDOG_S,
    Reachability,
    Site,
    as_index_folders,
    more_hosts,
)
from action_assistant.share_links import invitations_as_text, is_alive, is_ours
from action_assistant.system.parent import PARENT
from action_assistant.system.posix import cause_of_end
from action_assistant.web.auth.keys import Keys
from action_assistant.web.network.addresses import addresses_of
from action_assistant.web.server.sockets import bound

_PATIENCE: Final = 30.0  # seconds until a start that does not answer is called failed
_STEADY: Final = 30.0  # seconds after which a process counts as healthy again
_BACK_OFF: Final = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0)  # seconds before the n-th restart in a row
_TICK: Final = 0.1
_ENDING: Final = (
    12.0  # seconds that a process gets to end: its grace, and as long for what it stores then
)
_ASKED_EACH: Final = 5.0  # seconds between two questions whether a process answers, at most
_ASKED_FIRST: Final = 0.2  # seconds between two questions until a start has answered
_SAID_AFTER: Final = 15.0  # seconds of silence after which it is said, at most
_SAID_EACH: Final = 60.0  # seconds of silence between two lines about it
#: What hangs and may be ended: the editor keeps nothing in memory that it has acknowledged.
_ENDED_WHEN_SILENT: Final = frozenset({"editor"})


class BackupPlan(msgspec.Struct, frozen=True):
    """Backups into a folder, every `every` seconds; `keep` and `after` as the command `backup`
    takes them."""

    into: Path
    every: float
    keep: str
    after: str | None


class ServePlan(msgspec.Struct, frozen=True, kw_only=True):
    """The settings of `serve`. The runner listens on the port after the editor's."""

    data: Path
    database: str | None
    switch_database: bool
    host: str
    port: int
    share: bool
    tls: bool
    opens: bool
    reached: Reachability = Reachability()
    behaviours: Path | None = None
    backups: BackupPlan | None = None
    index_folders: Mapping[str, Path] = {}
    sites: tuple[Site, ...] = ()
    watchdog: float | None = WATCHDOG_S


class EndSignal:
    """Remembers whether one of some signals was received.

    Python runs a handler in the main thread at any time, also while that thread holds a lock, for
    example inside `threading.Event.wait`; a handler that took the same lock would deadlock. This
    handler takes no lock.
    """

    def __init__(self, *signals: signal.Signals) -> None:
        self._came = False
        for number in signals:
            signal.signal(number, self._hear)

    def _hear(self, *_: object) -> None:
        self._came = True

    def within(self, seconds: float) -> bool:
        """Wait up to this many seconds, unless a signal has come before, and return whether one has
        come."""
        if not self._came:
            time.sleep(seconds)
        return self._came


class Child:
    """Runs one process of the program, and starts it again when it dies."""

    def __init__(
        self,
        name: str,
        arguments: list[str],
        port: int,
        interpreter: Interpreter,
        settings: Mapping[str, str],
    ) -> None:
        self.name = name
        self.port = port
        self._settings = settings  # all users may read arguments, but not the environment
        self._interpreter = interpreter
        self._arguments = arguments
        self._process: subprocess.Popen[bytes] | None = None
        self._deaths = 0
        self._born = 0.0
        self.starts = 0
        self._again = 0.0  # when to start, by the monotonic clock

    def start(self, parent: int) -> None:
        """Start the process. `parent` is the reading end of a pipe that closes when this process
        dies."""
        environment = {**self._interpreter.environment(os.environ), **self._settings}
        environment[PARENT] = str(parent)
        for name in ("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"):
            environment.pop(name, None)  # the service manager hears this process alone
        self._born = time.monotonic()
        self.starts += 1
        self._process = subprocess.Popen(
            [self._interpreter.path, "-m", "action_assistant", *self._arguments],
            env=environment,
            pass_fds=[parent],
            stdin=subprocess.DEVNULL,
        )

    def tend(self, parent: int) -> int | None:
        """Start the process if it has died and a pause has passed; call this again and again.
        Return None, or its exit code if a new start is hopeless. `parent`: the reading end of a
        pipe that closes when this process dies."""
        now = time.monotonic()
        if self._process is None:
            if now >= self._again:
                self.start(parent)
            return None
        code = self._process.poll()
        if code is None:
            return None
        self._process = None
        # The process has reported that it cannot start. Once both have worked, neither ends the other: a runner
        # stops robots while the editor's database is away.
        if code == 2 and self.starts == 1:
            return code
        self._deaths = 1 if now - self._born > _STEADY else self._deaths + 1
        wait = _BACK_OFF[min(self._deaths, len(_BACK_OFF)) - 1]
        self._again = now + wait
        say(f"{self.name} died ({cause_of_end(code)}); starting it again in {wait:g} s")
        return None

    def kill(self) -> None:
        """End the process at once, also one that hears no signal; `tend` will start it again."""
        process = self._process
        if process is not None:
            process.kill()

    def end(self) -> None:
        """Ask the process to end, wait for that, and kill it if it takes too long."""
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(_ENDING)
        except subprocess.TimeoutExpired:
            say(f"{self.name} does not end; killing it")
            self._process.kill()
            self._process.wait()
        self._process = None


class Watchdog:
    """Notices a process that lives and does not answer: says so, and ends the editor after `limit`
    seconds of silence, so that it is started anew.

    Silence counts from an answer on, so a start that changes tables for hours is none. It is counted
    in questions without an answer, each with the time that it may take at most, so the sleep of the
    computer is none either. `data`: the folder in which it is kept that a process was ended.
    """

    def __init__(
        self,
        child: Child,
        origin: str,
        trust: ssl.SSLContext | None,
        limit: float,
        data: Path | None = None,
    ) -> None:
        self._data = data
        self._child = child
        self._url = f"{origin}:{child.port}"
        self._trust = trust
        self._limit = limit
        self._pause = min(_ASKED_EACH, limit / 4)
        self._ends = child.name in _ENDED_WHEN_SILENT
        self._starts = 0  # of the process that answered last
        self._silent = 0.0
        self._lines = 0  # that were written about this silence
        self._first_line = min(_SAID_AFTER, limit / 2)

    def run(self) -> None:
        """Ask for ever; run it on a daemon thread, since an answer may take long."""
        while True:
            starts, asked = self._child.starts, time.monotonic()
            answers = is_alive(self._url, self._trust, self._pause)
            took = min(time.monotonic() - asked, self._pause)
            self.note(starts, answers=answers, seconds=took + self._pause)
            time.sleep(self._pause if self.has_heard else _ASKED_FIRST)

    @property
    def has_heard(self) -> bool:
        """Return whether the process has answered since its last start, so that silence counts."""
        return self._starts == self._child.starts

    def note(self, starts: int, *, answers: bool, seconds: float) -> None:
        """Take up whether the process answered a question. `starts`: how often it had been started
        before the question; `seconds`: the time that the question counts."""
        if answers:
            if self._lines:
                say(f"{self._child.name} answers again after {self._silent:.0f} s")
            self._heard(starts)
            return
        if not self.has_heard or self._starts != starts:
            return  # it has never answered since its start
        self._silent += seconds
        if self._ends and self._silent >= self._limit:
            say(f"{self._child.name} has not answered for {self._silent:.0f} s; ending it", "error")
            silent = self._silent
            self._heard(0)
            self._child.kill()
            self._note_hang(silent)
        elif self._silent >= self._first_line + self._lines * _SAID_EACH:
            self._lines += 1
            say(self._sentence(), "error")

    def _note_hang(self, silent: float) -> None:
        """Keep it for the administration page."""
        if self._data is None:
            return
        # Most never need it, and it takes as long to load as much of the rest.
        from action_assistant.web.monitoring.faults import Hang, note_hang

        try:
            note_hang(self._data, self._child.name, Hang(time.time(), silent))
        except OSError as error:
            say(f"this could not be kept in the data folder: {error.strerror}")

    def _heard(self, starts: int) -> None:
        self._starts, self._silent, self._lines = starts, 0.0, 0

    def _sentence(self) -> str:
        said = f"{self._child.name} has not answered for {self._silent:.0f} s"
        if self._ends:
            return f"{said}; it is started anew after {self._limit:g} s"
        return (
            f"{said}: NO STOP MAY ARRIVE. Use the robots' hardware stop. It is left alone, since it may "
            "be stopping robots; end it yourself if it is not"
        )


def serve(plan: ServePlan) -> int:
    """Run the editor, the runner and the regular backups until a signal comes or one of them cannot
    start; return the exit code. Raise CannotStart if a port is taken."""
    for port in (plan.port, plan.port + 1):
        for probe in bound(plan.host, port):
            probe.close()
    keys = Keys.of(plan.data)
    trust = _certified(plan)
    enough = EndSignal(signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    # The writing end is never written to: it closes when this process dies, however it dies.
    reading, _writing = os.pipe()
    children = _children(plan)
    keeper = _keeper(plan)
    say("starting …")
    watchdogs: list[Watchdog] = []
    for child in children:
        child.start(reading)
        if plan.watchdog is not None:
            watchdog = Watchdog(child, _origin(plan), trust, plan.watchdog, plan.data)
            threading.Thread(target=watchdog.run, name=f"watch {child.name}", daemon=True).start()
            watchdogs.append(watchdog)
    greeting = (plan, keys, trust, children, watchdogs, enough)
    threading.Thread(target=_announce_page, args=greeting, name="greet", daemon=True).start()
    try:
        while not enough.within(_TICK):
            for child in children:
                code = child.tend(reading)
                if code is not None:
                    return code
            if keeper is not None and keeper.tend(reading) is not None:
                say("no backups are made; the message above says why")
                keeper = None
        return 0
    finally:
        say("ending …")
        for child in [*children, *([keeper] if keeper is not None else [])]:
            child.end()


def _children(plan: ServePlan) -> list[Child]:
    """Return the processes of a plan, not started yet, in the order in which they are started and
    ended: the editor, then the runner."""
    address = ["--data", str(plan.data), "--host", plan.host]
    address += [flag for flag, on in (("--share", plan.share), ("--tls", plan.tls)) if on]
    database = {"ACTION_ASSISTANT_DATABASE": plan.database} if plan.database else {}
    behaviours = ["--behaviours", str(plan.behaviours)] if plan.behaviours is not None else []
    switch = ["--switch-database"] if plan.switch_database else []
    ports = str(plan.port), str(plan.port + 1)
    settings = _as_settings(plan.reached)
    this = Interpreter(path=Path(sys.executable), origin="this")
    speaking = for_runner()
    if speaking.remark:
        say(speaking.remark)
    return [
        Child(
            "editor",
            ["editor", *address, *switch, "--port", ports[0], "--runner-port", ports[1]],
            plan.port,
            this,
            {**settings, **database, **_as_runners(plan.sites)},
        ),
        Child(
            "runner",
            ["runner", *address, *behaviours, "--port", ports[1], "--page-port", ports[0]],
            plan.port + 1,
            speaking,
            {**settings, INDEX_FOLDERS: as_index_folders(plan.index_folders)},
        ),
    ]


def _as_runners(sites: Sequence[Site]) -> dict[str, str]:
    return {RUNNERS: ";".join(f"{each.name}={each.url}" for each in sites)}


def _keeper(plan: ServePlan) -> Child | None:
    """Return the process, not started yet, that makes backups with a low priority; None if no
    backups are planned."""
    if plan.backups is None:
        return None
    keeps = plan.backups
    into = ["--data", str(plan.data), "--into", str(keeps.into), "--keep", keeps.keep]
    after = ["--after", keeps.after] if keeps.after is not None else []
    database = {"ACTION_ASSISTANT_DATABASE": plan.database} if plan.database else {}
    this = Interpreter(path=Path(sys.executable), origin="this")
    return Child(
        "backup", ["backup", *into, *after, "--every", f"{keeps.every:g}s"], 0, this, database
    )


def _as_settings(reached: Reachability) -> dict[str, str]:
    """Return the public address and the trusted proxies as environment variables for both
    processes. They are not arguments, which might contain a text by which people look for
    processes."""
    return {
        "ACTION_ASSISTANT_PUBLIC_URL": f"{reached.public.page}/" if reached.public else "",
        "ACTION_ASSISTANT_TRUSTED_PROXIES": ",".join(str(each) for each in reached.proxies),
    }


def _certified(plan: ServePlan) -> ssl.SSLContext | None:
    """With --tls, issue the certificate before the processes start, and return the TLS context that
    trusts it; else return None."""
    if not plan.tls:
        return None
    # Most do without, and it takes as long to load as much of the rest.
    from action_assistant.web.network.certificate import Certificate

    addresses = addresses_of(
        host=plan.host, page_port=plan.port, hosts=more_hosts(), share=plan.share, secure=True
    )
    certificate = Certificate(plan.data)
    certificate.renew(addresses.certified())
    say(
        "browsers warn until they trust the authority that signs for this computer: import\n"
        f"    {certificate.authority}\n    SHA-256 {certificate.fingerprint()}"
    )
    return certificate.trusting()


def _announce_page(
    plan: ServePlan,
    keys: Keys,
    trust: ssl.SSLContext | None,
    children: list[Child],
    watchdogs: list[Watchdog],
    enough: EndSignal,
) -> None:
    """Wait until both processes answer and are watched, then print the URL of the page and open it in
    a browser. Do nothing if the program is told to end (`enough`) before."""
    origin = _origin(plan)
    if not _wait_for_answers(origin, keys, trust, children, enough):
        return
    while not all(watchdog.has_heard for watchdog in watchdogs):
        if enough.within(_TICK):
            return
    base = f"{origin}:{plan.port}"
    url = f"{base}/#t={keys.token}"
    shown_at = f"{plan.reached.public.page}/#t={keys.token}" if plan.reached.public else url
    # Through a file that only this user can read: arguments of a browser are visible to all.
    redirect = plan.data / "open.html"
    opens = plan.opens and _has_screen()
    try:
        with open(redirect, "w", opener=opener) as out:
            out.write(f'<!doctype html><meta http-equiv="refresh" content="0;url={url}">')
    except OSError as error:
        say(f"{redirect} cannot be written: {error.strerror}")
        opens = False
    at_terminal = sys.stderr.isatty() and not writes_json()  # a log is kept, and read by others
    if at_terminal:
        say(f"ready. Open this link (it signs you in, keep it to yourself):\n\n    {shown_at}\n")
        if shown_at != url:
            say(f"or, on this computer and without the proxy:\n\n    {url}\n")
    else:
        say(f"ready at {base}. {redirect} signs you in; the link is shown at a terminal only.")
    if plan.share:
        say(invitations_as_text(base, keys, trust, secret=not at_terminal))
    if opens:
        webbrowser.open(redirect.as_uri())


def _origin(plan: ServePlan) -> str:
    """Return the scheme and host, without a port, at which this computer reaches both processes."""
    here = plan.host if plan.host not in {"0.0.0.0", "::", "localhost", EVERYWHERE} else "127.0.0.1"
    return f"{'https' if plan.tls else 'http'}://{f'[{here}]' if ':' in here else here}"


def _wait_for_answers(
    origin: str,
    keys: Keys,
    trust: ssl.SSLContext | None,
    children: list[Child],
    enough: EndSignal,
) -> bool:
    """Wait until every process of `children` answers at `origin`, without a limit of time. Return
    False if a signal to end comes before (`enough`)."""
    deadline = time.monotonic() + _PATIENCE
    for child in children:
        while not is_ours(f"{origin}:{child.port}", keys, trust):
            if enough.within(_TICK):
                return False
            if time.monotonic() > deadline:
                say(f"{child.name} does not answer yet; the messages above may say why")
                deadline = float("inf")
    return True


def _has_screen() -> bool:
    if sys.platform in {"darwin", "win32"}:
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
