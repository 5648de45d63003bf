"""Exports runs as files for other programs: JSON lines, CSV of intervals, and MCAP for Foxglove."""

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

import msgspec
from mcap.writer import CompressionType, Writer

from action_assistant.journal.events import Event
from action_assistant.runner.analysis.keyframes import fold
from action_assistant.runner.links.observations import NodeResult, NodeState, Snapshot
from action_assistant.runner.runs import views
from action_assistant.runner.runs.counts import VisitCount, visit_counts
from action_assistant.runner.runs.durations import of_visit
from action_assistant.runner.runs.events import Observed, PieceSeen
from action_assistant.runner.runs.question_views import answers_by_visit
from action_assistant.runner.runs.run import Run
from action_assistant.version import VERSION
from action_assistant.web.auth.caller import without_origin

#: A spreadsheet takes a cell that begins with one of these for a formula.
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")
_COLUMNS: Final = (
    "action",
    "visit",
    "from",
    "until",
    "not_before",
    "not_after",
    "seconds",
    "result",
    "how",
    "seconds_least",
    "seconds_most",
    "missed",
)
_LED_COLUMNS: Final = ("robot", "said_by", "answered_by")
_ANY: Final = b'{"type":"object"}'
#: The schema of foxglove.Log, so that Foxglove's panel shows messages of actions and engines.
_LOG: Final = msgspec.json.encode(
    {
        "type": "object",
        "properties": {
            "timestamp": {
                "type": "object",
                "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
            },
            "level": {"type": "integer"},
            "message": {"type": "string"},
            "name": {"type": "string"},
        },
    }
)
_INFO, _ERROR = 2, 4  # levels of foxglove.Log


class EventLine(msgspec.Struct, frozen=True):
    """A stored event as one line of JSON."""

    run: str
    seq: int
    kind: str
    author: str
    at: str
    body: msgspec.Raw


def lines(run: str, events: Iterable[Event]) -> Iterator[bytes]:
    """Yield each stored event of the run (`run`: its id) as a line of JSON."""
    for each in events:
        at = views.time(each.at).isoformat().replace("+00:00", "Z")
        body = msgspec.Raw(without_origin(each.body))
        line = EventLine(run, each.seq, each.kind, each.author, at, body)
        yield msgspec.json.encode(line) + b"\n"


def intervals(run: Run) -> bytes:
    """Return CSV with a line per visit of an action, sorted by its begin. A cell is empty if its
    value is unknown. If only bounds of a duration can be given, `seconds` is empty, and
    `seconds_least` and `seconds_most` have the bounds. `missed`: how many visits of the action have
    no line, "none" or "N or more". A led run has two columns more: `robot`, the engine that
    played the visit, and `said_by`, the person who stated its result."""
    text = io.StringIO()
    sheet = csv.writer(text)
    sheet.writerow(_COLUMNS if run.led is None else (*_COLUMNS, *_LED_COLUMNS))
    missed = {name: _missed(each) for name, each in visit_counts(run).items()}
    rows = [
        (visit.start, name, number, visit)
        for name, action in run.actions.items()
        for number, visit in enumerate(action.visits, action.older + 1)
    ]
    for _, name, number, visit in sorted(rows, key=lambda row: row[:3]):
        took = of_visit(visit)
        seconds, *bounds = (
            (None, None, None) if took is None else (took.exact, took.least, took.most)
        )
        moments = (visit.start, visit.until, visit.not_before, visit.not_after)
        shown = ("" if each is None else views.time(each).isoformat() for each in moments)
        cells = [plain_cell(name), number, *shown, _figure(seconds), visit.result or "", visit.how]
        row = [*cells, *map(_figure, bounds), missed[name]]
        sheet.writerow(row if run.led is None else [*row, *_led_cells(run, name, number)])
    return text.getvalue().encode()


def _led_cells(run: Run, name: str, number: int) -> tuple[str, str, str]:
    said = views.words_for(run.said.get(name, ())).get(number)
    answer = answers_by_visit(run.answers.get(name, ())).get(number)
    people = ("" if each is None else plain_cell(each.by.name) for each in (said, answer))
    return (plain_cell(run.actions[name].robot), next(people), next(people))


def _missed(count: VisitCount) -> str:
    return f"{count.least - count.seen} or more" if count.at_least else "none"


def _figure(seconds: float | None) -> str:
    return "" if seconds is None else f"{seconds:.3f}"


def plain_cell(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def mcap(events: Iterable[Event], pieces: Iterable[Iterable[Event]] = ()) -> bytes:
    """Return an MCAP file (for robotics viewers) with JSON messages: `/run` (state),
    `/actions/NAME` (state and result, at the time they were shown), `/visits/NAME` (an ended visit,
    at the time its end was seen; with `at_least`, visits may have been missed and `visit` is a
    lower bound), `/log`. `pieces`: the events of each piece of a led run, whose robots showed
    them under the names of their own graphs."""
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.NONE)
    writer.start(profile="", library=f"temoto-action-assistant {VERSION}")
    track = _Track(writer)
    fold(None, list(events), track.see)
    for piece in pieces:
        fold(None, list(piece), track.see_piece)
    finish: Callable[[], None] = writer.finish
    finish()
    return out.getvalue()


class _Track:
    """Writes what every event showed, with the time at which it was shown."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._channels: dict[str, int] = {}
        self._schemas = {
            "run": writer.register_schema("action_assistant.Run", "jsonschema", _ANY),
            "action": writer.register_schema("action_assistant.Action", "jsonschema", _ANY),
            "visit": writer.register_schema("action_assistant.Visit", "jsonschema", _ANY),
            "log": writer.register_schema("foxglove.Log", "jsonschema", _LOG),
        }
        self._count = 0

    def see(self, event: Event, decoded: Any, before: Run | None, after: Run) -> None:
        """Write the messages of one event. `decoded`: its decoded body; `before`, `after`: the run
        before and after it."""
        at = getattr(decoded, "at", event.at)
        if before is None or before.state != after.state or before.desired != after.desired:
            body = {"state": after.state, "desired": after.desired, "result": after.result}
            self._write("run", "/run", at, {**body, "event": event.kind})
        if isinstance(decoded, Observed):
            for item in decoded.seen:
                self._seen(item)
        if isinstance(decoded, PieceSeen):
            topic = f"/actions/{after.graph_name}/{decoded.node}"
            shown = {"state": decoded.state, "how": "observed"}
            self._write("action", topic, decoded.at, shown)
        self._ended(at, before, after)
        self._said(before, after)

    def see_piece(self, event: Event, decoded: Any, before: Run | None, after: Run) -> None:
        """Write what one event of a piece showed of its robot; all else is in the led run's
        own events. `decoded`: the decoded body of the event; `before`, `after`: the piece before
        and after it."""
        if isinstance(decoded, Observed):
            for item in decoded.seen:
                self._seen(item)

    def _ended(self, at: int, before: Run | None, after: Run) -> None:
        counts: dict[str, VisitCount] = {}
        for name, action in after.actions.items():
            was = before.actions.get(name) if before is not None else None
            if was is action:
                continue
            known = () if was is None else was.visits
            for number, visit in enumerate(action.visits, action.older + 1):
                if visit.until is not None and visit not in known:
                    said = views.words_for(after.said.get(name, ())).get(number, msgspec.UNSET)
                    answers = answers_by_visit(after.answers.get(name, ()))
                    answered = answers.get(number, msgspec.UNSET)
                    view = views.visit_view(visit, action.robot, said, answered)
                    shown = msgspec.to_builtins(view)
                    counts = counts or visit_counts(after)
                    missed = counts[name].at_least
                    body = {"visit": number, **shown, "took": of_visit(visit), "at_least": missed}
                    self._write("visit", f"/visits/{name}", at, body)

    def _seen(self, item: object) -> None:
        match item:
            case NodeState():
                topic = f"/actions/{item.graph}/{item.node}"
                self._write("action", topic, item.at, {"state": item.state, "how": "observed"})
            case NodeResult():
                topic = f"/actions/{item.graph}/{item.node}"
                self._write("action", topic, item.at, {"result": item.result, "how": "observed"})
            case Snapshot():
                for node, state in item.nodes.items():
                    shown = {"state": state, "how": item.source}
                    self._write("action", f"/actions/{item.graph}/{node}", item.at, shown)
            case _:
                return

    def _said(self, before: Run | None, after: Run) -> None:
        old_alarms = before.alarms if before is not None else ()
        for alarm in after.alarms:
            if alarm not in old_alarms:
                self._log(alarm.at, _ERROR, alarm.code, alarm.text)
        for name, action in after.actions.items():
            was = before.actions.get(name) if before is not None else None
            if was is action:
                continue
            for message in action.messages:
                if was is None or message not in was.messages:
                    self._log(message.at, _INFO, name, message.text)

    def _log(self, at: int, level: int, name: str, text: str) -> None:
        stamp = {"sec": at // 1_000_000, "nsec": at % 1_000_000 * 1000}
        body = {"timestamp": stamp, "level": level, "message": text, "name": name}
        self._write("log", "/log", at, body)

    def _write(self, schema: str, topic: str, at: int, body: Mapping[str, Any]) -> None:
        channel = self._channels.get(topic)
        if channel is None:
            channel = self._writer.register_channel(topic, "json", self._schemas[schema])
            self._channels[topic] = channel
        self._count += 1
        data = msgspec.json.encode(body)
        self._writer.add_message(channel, at * 1000, data, at * 1000, sequence=self._count)
