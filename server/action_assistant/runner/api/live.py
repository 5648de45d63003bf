"""The live socket: sends the states of runs and engines to every page, and takes a Stop from any of
them.

Slow pages get no queue: of each run only the newest state waits, and the answer to a Stop is sent
before it.
"""

import logging
import math
import time
from collections import deque
from collections.abc import Awaitable, Callable
from datetime import datetime
from functools import partial
from typing import Any, Final, TypeAlias
from weakref import WeakKeyDictionary

import anyio
import anyio.lowlevel
import msgspec
from litestar import WebSocket
from litestar.exceptions import WebSocketDisconnect, WebSocketException

from action_assistant.errors import Forbidden, Refused
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.api.caller import author_of
from action_assistant.runner.api.confirmation_requests import (
    ConfirmationRequest,
    ConfirmationRequests,
    ConfirmationShown,
)
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.queues.service import Queues
from action_assistant.runner.robots.registration import Robot, seen_by
from action_assistant.runner.runs import views
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import Unseen, names_seen, run_graphs, sees_all
from action_assistant.runner.start.rights_registry import IdentityNow, unchanged
from action_assistant.runner.stop.foreign_stop import StoppedAll
from action_assistant.safe_text import hold_names
from action_assistant.web.auth.access import identity_of, is_expired
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.rights import Denied, may

log: Final = logging.getLogger(__name__)

_GAP_S: Final = 0.05  # between two states of one run
_SHARE: Final = 20  # at most one part in so many of the time goes into encoding one run
_HEARTBEAT_S: Final = 1.0
_LOOK_S: Final = 0.5  # between two looks at what a person may see
_SEND_S: Final = 15.0
_AT_ONCE: Final = 250  # actions whose views are made in one turn of the event loop
_ENGINES_GAP_S: Final = 0.25  # between two lists of engines
_ENGINES_S: Final = 1.0  # for which an encoded list of engines is used
_MOST_ANSWERS: Final = 64
_MOST_ASKED: Final = (
    10  # newest questions whether a page is visible; answers to older ones are late
)
_TOO_SLOW: Final = 1013
_LONGEST: Final = 10_000  # characters of a message from the page


class StopMessage(msgspec.Struct, frozen=True, tag="stop", tag_field="type"):
    """A press of Stop. `run`: the id of a run or a group, or
    "all"; `stop_id` and `again`: as in the body of `POST /api/stop`."""

    run: str
    stop_id: str = ""
    again: bool = False


class HereMessage(msgspec.Struct, frozen=True, tag="here", tag_field="type"):
    """The answer of a page that is visible to `there`, with its number. It gets none itself."""

    number: int


class Stopping(msgspec.Struct, frozen=True, tag="stopping", tag_field="type"):
    """The answer to a Stop: the ids of the runs that are being stopped and, if everything is
    stopped, the `graphs` of other programs by robot. `unknown`: by robot, why it is unknown which
    graphs it runs."""

    stop_id: str
    runs: list[str]
    graphs: dict[str, list[str]] = {}
    unknown: dict[str, str] = {}

    @classmethod
    def everything(
        cls, stop_id: str, stopped: StoppedAll, unseen: Callable[[], Unseen | None]
    ) -> "Stopping":
        """Return the message that answers a Stop of everything, which has begun. `unseen`: returns the
        graphs that its sender may not see."""
        return cls(stop_id, stopped.runs, names_seen(stopped.graphs, unseen), stopped.unknown)


class RefusedMessage(msgspec.Struct, frozen=True, tag="refused", tag_field="type"):
    """The reason why a message was not followed."""

    stop_id: str
    detail: str

    def __post_init__(self) -> None:
        hold_names(self, "detail")


class Hello(msgspec.Struct, frozen=True, tag="hello", tag_field="type"):
    """The first message: all engines and all open runs."""

    engines: list[Robot]
    runs: list[views.RunShown]


class RunMessage(msgspec.Struct, frozen=True, tag="run", tag_field="type"):
    """The present state of a run."""

    run: views.RunShown


class EnginesMessage(msgspec.Struct, frozen=True, tag="engines", tag_field="type"):
    """All engines, sent when one of them has changed."""

    engines: list[Robot]


class ConfirmMessage(msgspec.Struct, frozen=True, tag="confirm", tag_field="type"):
    """All requests to confirm who somebody is that this page can answer now."""

    asked: list[ConfirmationShown]


class QueueMessage(msgspec.Struct, frozen=True, tag="queue", tag_field="type"):
    """The queue has changed: so many starts wait in it, and of the person of this page so many may be
    started now, the newest one since `ready_at`. The first message comes if something waits."""

    number: int
    yours: int
    ready_at: datetime | None


class ThereMessage(msgspec.Struct, frozen=True, tag="there", tag_field="type"):
    """Asks a page of an operator to answer if it is visible, while a robot asks for such pages. The
    answer repeats `number`, which is another one for each question."""

    number: int


class Heartbeat(msgspec.Struct, frozen=True, tag="beat", tag_field="type"):
    """Sent once a second while the link is alive. `seen`: when each open run was last shown by its
    engine; `heard`: when each robot last answered."""

    at: datetime
    seen: dict[str, datetime]
    heard: dict[str, datetime]


#: The messages of the runner over the socket, and those of a page.
RunnerMessage: TypeAlias = (
    Hello
    | RunMessage
    | EnginesMessage
    | ConfirmMessage
    | QueueMessage
    | ThereMessage
    | Heartbeat
    | Stopping
    | RefusedMessage
)
PageMessage: TypeAlias = StopMessage | HereMessage


class _EncodedHello(msgspec.Struct, frozen=True, tag="hello", tag_field="type"):
    """The first message, made of robots and runs that are encoded already."""

    engines: msgspec.Raw
    runs: list[msgspec.Raw]


class EncodedMessage(msgspec.Struct, frozen=True, tag="run", tag_field="type"):
    """A message about a run that is encoded already."""

    run: msgspec.Raw


class EncodedRun(msgspec.Struct, frozen=True):
    """A message about a run (`text`) and the run in it, both encoded; the seconds that encoding took
    (`cost`), and when it may be encoded again (`next`, in the loop's time)."""

    revision: int
    text: str
    cost: float
    next: float
    run: bytes = b""


class _Engines(msgspec.Struct, frozen=True):
    """All robots as everybody with the same sight of their runs sees them: encoded, as a message, and
    the seconds that encoding took."""

    robots: bytes
    text: str
    cost: float


#: The part of what somebody may not see that changes what they see of robots: whether there is anything, and
#: the runs on robots that are hidden. None if they see everything.
_Audience: TypeAlias = tuple[bool, frozenset[str]] | None


def _nobody_asked(_number: int) -> None:
    """Do nothing: where no page is asked whether it is visible."""


class Hub:
    """Has the outboxes of all pages. A run is encoded once for all who see it and once for all who do
    not; robots once for all from whom the same runs are hidden. `identity_now`: says which role and
    groups a person has now."""

    def __init__(
        self,
        control: ExecutionService,
        clock_us: ClockUs,
        requests: ConfirmationRequests | None = None,
        identity_now: IdentityNow = unchanged,
        queues: Queues | None = None,
    ) -> None:
        self.control = control
        self._queues = queues
        self.identity_now = identity_now
        self.requests = requests or ConfirmationRequests()
        self.clock_us = clock_us
        self.boxes: set[Outbox] = set()
        self._frames: Final[dict[bool, WeakKeyDictionary[OpenRun, EncodedRun]]] = {
            is_hidden: WeakKeyDictionary() for is_hidden in (False, True)
        }
        self._view_caches: WeakKeyDictionary[OpenRun, views.ActionViewCache] = WeakKeyDictionary()
        self._robots: list[Robot] = []  # as those see them who see everything
        self._engines: dict[_Audience, _Engines] = {}
        self._engines_until = 0.0  # for which these are true: some facts change with the time alone
        control.watch(self._changed)
        control.watch_robots(self._robots_changed)
        self.requests.watch(self._requests_changed)
        if queues is not None:
            queues.watch(self._queue_changed)

    def _queue_changed(self) -> None:
        for box in self.boxes:
            box.mark_queue()

    def queue(self, person: str) -> QueueMessage:
        """Return the message about the queue for a person."""
        entries = self._queues.entries if self._queues is not None else ()
        ready = [
            each.ready_at
            for each in entries
            if each.ready_at is not None
            and each.entered.author.id == person
            and (each.differs or not each.entered.by_itself)
        ]
        newest = views.time(max(ready)) if ready else None
        return QueueMessage(len(entries), len(ready), newest)

    def _requests_changed(self, person: str) -> None:
        for box in self.boxes:
            if box.identity.person.id == person:
                box.mark_requests()

    def devices_shown(self, request: ConfirmationRequest) -> int:
        """Return how many devices have a page open that can answer a request to confirm."""
        person = request.identity.person.id
        shown = (
            box.identity.session
            for box in self.boxes
            if box.identity.person.id == person
            and any(each.id == request.id for each in self.requests.shown_to(box.identity))
        )
        return len({session.id for session in shown if session is not None})

    def _robots_changed(self) -> None:
        self._engines.clear()
        for box in self.boxes:
            box.mark_engines()

    def engines(self, unseen: Unseen | None) -> _Engines:
        """Return all engines, encoded once per change for all from whom the same runs are hidden."""
        if not self._engines or anyio.current_time() >= self._engines_until:
            self._engines.clear()
            self._robots = self.control.robot_views()
            self._engines_until = anyio.current_time() + _ENGINES_S
        audience = self._audience(unseen)
        found = self._engines.get(audience)
        if found is None:
            began = anyio.current_time()
            robots = [seen_by(each, unseen, self.control.graphs_now) for each in self._robots]
            text = msgspec.json.encode(EnginesMessage(robots)).decode()
            encoded = msgspec.json.encode(robots)
            found = _Engines(encoded, text, anyio.current_time() - began)
            self._engines[audience] = found
        return found

    def engines_gap(self, engines: _Engines) -> float:
        """Return the seconds between two lists of engines to one page: all lists of all audiences
        together take a bounded share of the time."""
        return max(_ENGINES_GAP_S, _SHARE * engines.cost * len(self._engines))

    def _audience(self, unseen: Unseen | None) -> _Audience:
        if unseen is None:
            return None
        held = {each.run for robot in self._robots for each in robot.holds if each.run is not None}
        graphs = {run: self.control.graphs_now(run) for run in held}
        hidden = (run for run, of in graphs.items() if of is not None and unseen.hides(of))
        return unseen.is_some, frozenset(hidden)

    def heartbeat(self) -> str:
        """Return the text of a heartbeat message, with the present times."""
        seen = {
            run: views.time(opened.watch.seen_at)
            for run, opened in self.control.shown.items()
            if opened.watch.seen_at is not None
        }
        heard = {name: views.time(at) for name, at in self.control.robots.last_answers().items()}
        return _text(Heartbeat(views.time(self.clock_us()), seen, heard))

    def _changed(self, opened: OpenRun) -> None:
        for box in self.boxes if not opened.is_led else ():
            box.mark(opened)

    def frame(self, opened: OpenRun, *, is_hidden: bool = False) -> EncodedRun:
        """Return the message about an open run, as text with its costs; each revision is encoded once
        for those who see the run, and once for those from whom it `is_hidden`."""
        frames = self._frames[is_hidden]
        frame = frames.get(opened)
        if frame is None or frame.revision != opened.revision:
            began, view = anyio.current_time(), self.run_view(opened)
            run = msgspec.json.encode(views.hidden(view) if is_hidden else view)
            text = msgspec.json.encode(EncodedMessage(msgspec.Raw(run))).decode()
            now = anyio.current_time()
            next_ = now + _SHARE * (now - began)
            frame = EncodedRun(opened.revision, text, now - began, next_, run)
            frames[opened] = frame
        return frame

    def due(self, opened: OpenRun, *, is_hidden: bool = False) -> float:
        """Return the time, in seconds of the event loop, from which a run may be encoded again:
        encoding takes a bounded share of the time, however many pages follow it."""
        frame = self._frames[is_hidden].get(opened)
        return 0.0 if frame is None or frame.revision == opened.revision else frame.next

    def unseen(self, identity: Identity) -> Unseen | None:
        """Return the graphs that a person may not see now; None if they see everything."""
        return self.control.sight.unseen(self.identity_now(identity))

    async def hello(self, unseen: Callable[[], Unseen | None]) -> str:
        """Return the first message for a page. The event loop stays free while large runs are
        prepared. `unseen`: returns what the reader may not see, and is called once they are."""
        for opened in tuple(self.control.shown.values()):
            await self.prepare_view(opened)
        now = unseen()
        runs = []
        for opened in tuple(self.control.shown.values()):
            runs.append(msgspec.Raw(self.frame(opened, is_hidden=_is_hidden(opened, now)).run))
            await anyio.lowlevel.checkpoint()
        robots = msgspec.Raw(self.engines(now).robots)
        return msgspec.json.encode(_EncodedHello(robots, runs)).decode()

    async def prepare_view(self, opened: OpenRun) -> None:
        """Fill the cache of an open run's view, with pauses for other tasks, so that encoding it
        takes little time afterwards."""
        await prepare_view(opened.run, self.view_cache(opened))

    def view_cache(self, opened: OpenRun) -> views.ActionViewCache:
        """Return the cache of the view of an open run; the first call makes it."""
        return self._view_caches.setdefault(opened, views.ActionViewCache())

    def run_view(self, opened: OpenRun) -> views.RunShown:
        """Return the view of an open run, by its cache."""
        recorded = opened.recorder.recorded
        return views.run_view(opened.run, recorded=recorded, cache=self.view_cache(opened))

    async def follow(
        self,
        text: str,
        author: Author,
        *,
        denied: str = "",
        unseen: Callable[[], Unseen | None] = sees_all,
        here: Callable[[int], None] = _nobody_asked,
    ) -> str:
        """Carry out a message of a page in the name of `author`, and return the text of the answer, ""
        for none.
        A message that cannot be understood or carried out is answered with the reason, not raised.
        `denied`: why its sender may not stop anything; "" if they may. `unseen`: returns the graphs
        that they may not see; it is asked for the answer only, once the Stop has begun. `here`: called
        with the number to which a visible page has answered.
        """
        stop_id = ""
        try:
            if len(text) > _LONGEST:
                raise msgspec.ValidationError("too long")
            message: PageMessage = msgspec.json.decode(text, type=PageMessage)
            if isinstance(message, HereMessage):
                here(message.number)
                return ""
            stop_id = message.stop_id
            if denied:
                raise Forbidden(denied)
            if message.run == "all":
                stopped = self.control.stop_all(author, stop_id, message.again)
                return _text(Stopping.everything(stop_id, stopped, unseen))
            runs = await self.control.stop(message.run, author, stop_id)
        except (msgspec.DecodeError, RecursionError, UnicodeError) as wrong:
            return _text(RefusedMessage(stop_id, f"Not understood: {wrong}"))
        except Refused as refused:
            return _text(RefusedMessage(stop_id, refused.detail))
        return _text(Stopping(stop_id, runs))


async def prepare_view(run: Run, cache: views.ActionViewCache) -> None:
    """Fill the cache of a run's view, with pauses for other tasks."""
    for _ in cache.prepare(run, _AT_ONCE):
        await anyio.lowlevel.checkpoint()


def _is_hidden(opened: OpenRun, unseen: Unseen | None) -> bool:
    return unseen is not None and unseen.hides(run_graphs(opened.run))


class Outbox:
    """The messages that wait for one page: answers in order, and the runs that have changed."""

    def __init__(self, hub: Hub, is_allowed: Callable[[], bool], identity: Identity) -> None:
        self.identity = identity
        self._hub = hub
        self._is_allowed = is_allowed
        self._unseen: Unseen | None = None
        self._hidden: dict[str, bool] = {}  # by run, since the last look: whether it is hidden
        self._look_at = 0.0  # when to look again what the person may see, in seconds of the loop
        self._answers: deque[str] = deque()
        self._changed: dict[str, OpenRun] = {}
        self._next: dict[str, float] = {}  # run -> when it may be sent again
        self._engines_at = math.inf  # when the engines are to be sent
        self._engines_next = 0.0  # not before
        self._has_requests = False
        self._has_queue = hub.queue(identity.person.id).number > 0
        self._asked: deque[float] = deque(maxlen=_MOST_ASKED)  # when `there` was sent
        self._asks = 0  # how often it was
        self._news = anyio.Event()

    def mark(self, opened: OpenRun) -> None:
        """Have the newest state of this open run sent to the page."""
        if self._changed.get(opened.run.id) is not opened:
            self._changed[opened.run.id] = opened
            self._news.set()

    def mark_engines(self) -> None:
        """Have the list of engines sent to the page, since a robot has changed."""
        if self._engines_at == math.inf:
            self._engines_at = self._engines_next
            self._news.set()

    def mark_requests(self) -> None:
        """Have the requests to confirm sent to the page, since one of its person has changed."""
        self._has_requests = True
        self._news.set()

    def mark_queue(self) -> None:
        """Have it said to the page that the queue has changed."""
        self._has_queue = True
        self._news.set()

    def here(self, number: int) -> None:
        """Take the answer of a visible page to the `there` with this number: its person was there when
        that was sent. An answer to an older one, or by who may not operate, shows nothing."""
        place = number - self._asks + len(self._asked)
        if 0 <= place < len(self._asked) and self._counts():
            self._hub.control.rights.see(self.identity, self._asked[place])

    def _counts(self) -> bool:
        """Return whether this page can be that of an operator: no program, and no viewer."""
        now = self._hub.identity_now(self.identity)
        if now is None or now.session is None or not self._is_allowed():
            return False
        return not isinstance(may(now, "operate", now=time.time()), Denied)

    def _there(self, now: float) -> str | None:
        """Return the text that asks whether this page is visible; None if it is not to be asked now."""
        is_early = bool(self._asked) and now - self._asked[-1] < _HEARTBEAT_S
        if is_early or not self._hub.control.rights.asks_for_pages or not self._counts():
            return None
        self._asked.append(now)
        self._asks += 1
        return _text(ThereMessage(self._asks - 1))

    def post(self, text: str) -> bool:
        """Queue the text of an answer without waiting; return False when too many answers wait,
        since the page does not read."""
        self._answers.append(text)
        self._news.set()
        return len(self._answers) <= _MOST_ANSWERS

    async def deliver(self, send: Callable[[str], Awaitable[None]]) -> None:
        """Send messages until cancelled. Raises TimeoutError when the page does not read."""
        beat = anyio.current_time() + _HEARTBEAT_S
        while True:
            self._news = anyio.Event()
            while (text := self._pick(beat)) is not None:
                with anyio.fail_after(_SEND_S):
                    await send(text)
                if text.startswith('{"type":"beat"'):
                    beat = anyio.current_time() + _HEARTBEAT_S
            runs = (self._due(run, opened) for run, opened in self._changed.items())
            due = min([beat, self._look_at, self._engines_at, *runs])
            with anyio.move_on_after(max(0.0, due - anyio.current_time())):
                await self._news.wait()

    def look(self) -> Unseen | None:
        """Read the rights of the person anew, and return the graphs that they may not see now; None
        if they see everything."""
        self._look_at = anyio.current_time() + _LOOK_S
        self._unseen = self._hub.unseen(self.identity)
        self._hidden.clear()
        return self._unseen

    def _hides(self, opened: OpenRun) -> bool:
        """Return whether the person may not see a run. This is asked for each run that has changed, at
        each message."""
        found = self._hidden.get(opened.run.id)
        if found is None:
            found = self._hidden[opened.run.id] = _is_hidden(opened, self._unseen)
        return found

    def _look_again(self) -> None:
        """Send everything anew if a rule, or the role or groups of the person, have changed what they
        may see."""
        before = self._unseen
        if self.look() is not before and self._unseen != before:
            for opened in self._hub.control.shown.values():
                self.mark(opened)
            self.mark_engines()

    def _due(self, run: str, opened: OpenRun) -> float:
        due = self._hub.due(opened, is_hidden=self._hides(opened))
        return max(self._next.get(run, 0.0), due)

    def _pick(self, beat: float) -> str | None:
        """Return the text of the next message: answers first, then a heartbeat if the time `beat`
        (seconds of the event loop) has come, engines, and runs that may be sent again. None if
        nothing may be sent now. A page that reads slowly is never idle, so what its person may see is
        looked at here, before anything is chosen."""
        now = anyio.current_time()
        if self._answers:
            return self._answers.popleft()
        if now >= beat:
            return self._hub.heartbeat()
        if not self._is_allowed():
            self._changed.clear()
            self._engines_at, self._look_at = math.inf, now + _LOOK_S
            return None
        if now >= self._look_at:
            self._look_again()
        if (there := self._there(now)) is not None:
            return there
        if self._has_requests:
            self._has_requests = False
            return _text(ConfirmMessage(self._hub.requests.shown_to(self.identity)))
        if self._has_queue:
            self._has_queue = False
            return _text(self._hub.queue(self.identity.person.id))
        if now >= self._engines_at:
            engines = self._hub.engines(self._unseen)
            self._engines_at = math.inf
            self._engines_next = now + self._hub.engines_gap(engines)
            return engines.text
        for run, opened in self._changed.items():
            if self._due(run, opened) <= now:
                del self._changed[run]
                frame = self._hub.frame(opened, is_hidden=self._hides(opened))
                self._next[run] = now + max(_GAP_S, _SHARE * frame.cost)
                if opened.run.end is not None and opened.recorder.idle:
                    self._next.pop(run)
                return frame.text
        return None


async def attend(socket: WebSocket[Any, Any, Any], hub: Hub) -> None:
    """Serve the socket of one page until it disconnects. A page with an expired session may still
    stop runs, but gets no more states."""
    box = Outbox(hub, lambda: not is_expired(socket), identity_of(socket))
    await socket.accept()
    async with anyio.create_task_group() as tasks:
        # Before anything else: a Stop does not wait until the first message is made.
        tasks.start_soon(_read, socket, hub, box, tasks.cancel_scope)
        await anyio.lowlevel.checkpoint()
        hub.boxes.add(box)
        try:
            if hub.requests.shown_to(box.identity):
                box.mark_requests()
            with hub.control.rights.here(box.identity):
                await _write(socket, hub, box)
        finally:
            hub.boxes.discard(box)
        tasks.cancel_scope.cancel()


async def _read(
    socket: WebSocket[Any, Any, Any],
    hub: Hub,
    box: Outbox,
    scope: anyio.CancelScope,
) -> None:
    author, identity = author_of(socket), identity_of(socket)
    unseen = partial(hub.unseen, identity)
    try:
        while True:
            text = await socket.receive_text()
            stop = may(identity, "stop", now=time.time())
            denied = stop.reason if isinstance(stop, Denied) else ""
            answer = await hub.follow(text, author, denied=denied, unseen=unseen, here=box.here)
            if answer and not box.post(answer):
                await socket.close(code=_TOO_SLOW, reason="too slow")
                break
    except (WebSocketDisconnect, WebSocketException, OSError):
        pass  # the page has gone
    scope.cancel()


async def _write(socket: WebSocket[Any, Any, Any], hub: Hub, box: Outbox) -> None:
    try:
        box.post(await hub.hello(box.look))
        await box.deliver(socket.send_text)
    except TimeoutError:
        log.info("a page does not read its messages; its live socket is closed")
        with anyio.move_on_after(1):
            await socket.close(code=_TOO_SLOW, reason="too slow")
    except (WebSocketDisconnect, WebSocketException, OSError):
        pass


def _text(
    message: Stopping | RefusedMessage | Heartbeat | ConfirmMessage | QueueMessage | ThereMessage,
) -> str:
    return msgspec.json.encode(message).decode()
