"""Logging of a process: the place, the form and the amount of its lines.

What the command line says is put into the environment, where workers and children find it. No form of a line
shows a secret or lets a text of strangers begin a line.
"""

import logging
import os
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import MappingProxyType, TracebackType
from typing import Any, Final, Literal, TypeAlias, get_args

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.safe_text import PrintableLog, one_line, printable, redacted

Subject: TypeAlias = Literal["request", "run", "graph", "robot"]

_NOTHING: Final[Mapping[str, str]] = MappingProxyType({})
_SUBJECTS: Final[ContextVar[Mapping[str, str]]] = ContextVar("subjects", default=_NOTHING)


def subjects() -> Mapping[str, str]:
    """Return the ids that log lines of this task carry, by kind of subject."""
    return _SUBJECTS.get()


def request_id() -> str | None:
    """Return the id of the request that this task answers; None if there is none."""
    return _SUBJECTS.get().get("request")


def begin(ids: Mapping[str, str]) -> None:
    """Let log lines of this task, and of tasks that it starts, carry exactly the given ids, by kind
    of subject."""
    _SUBJECTS.set(ids)


def is_about(subject: Subject, id_of_it: str) -> None:
    """Add an id to the ids that log lines of this task, and of tasks that it starts, carry.
    `subject`: its kind, for example a run."""
    _SUBJECTS.set({**_SUBJECTS.get(), subject: id_of_it})


@contextmanager
def about(subject: Subject, id_of_it: str) -> Iterator[None]:
    """Return a context that adds a subject and its id to every log line written inside it."""
    token = _SUBJECTS.set({**_SUBJECTS.get(), subject: id_of_it})
    try:
        yield
    finally:
        _SUBJECTS.reset(token)


class ConsoleLog(PrintableLog):
    """Log lines for people, with the ids of a line in brackets behind it."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - as `logging` asks
        said = super().formatMessage(record)
        ids = " ".join(f"{name}={one_line(value)}" for name, value in subjects().items())
        return f"{said} [{ids}]" if ids else said


class JsonLog(PrintableLog):
    """Log lines for programs: one JSON object for each record.

    `time` (RFC 3339, UTC), `level`, `process`, `pid`, `logger`, `message`; `error` with a
    traceback, if any; and the ids of the context.
    """

    def __init__(self, process: str, *secrets: str) -> None:
        super().__init__(*secrets)
        self._process = process

    def format(self, record: logging.LogRecord) -> str:
        """Return a log record as one line of JSON."""
        at = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created))
        line: dict[str, Any] = {
            "time": f"{at}.{int(record.msecs):03}Z",
            "level": record.levelname.lower(),
            "process": self._process,
            "pid": record.process,
            "logger": record.name,
            "message": self._plain(record.getMessage()),
            **{name: self._plain(value) for name, value in subjects().items()},
        }
        if record.exc_info:
            line["error"] = self._plain(logging.Formatter.formatException(self, record.exc_info))
        if record.stack_info:
            line["stack"] = self._plain(record.stack_info)
        return msgspec.json.encode(line).decode()

    def _plain(self, text: str) -> str:
        return redacted(printable(text), self._secrets)


Form: TypeAlias = Literal["console", "json"]
Level: TypeAlias = Literal["debug", "info", "warning", "error"]
FORMS: Final[tuple[Form, ...]] = get_args(Form)
LEVELS: Final[tuple[Level, ...]] = get_args(Level)

_FORM: Final = "ACTION_ASSISTANT_LOG_FORMAT"
_LEVEL: Final = "ACTION_ASSISTANT_LOG_LEVEL"
#: Loggers that write much of no use to administrators; some of it, such as header fields, is secret.
_QUIET: Final = ("uvicorn.error", "httpx", "httpcore", "websockets", "asyncio")

log: Final = logging.getLogger("action_assistant")


class LogSettings(msgspec.Struct, frozen=True):
    """The form of the log of a process, and its lowest level."""

    form: Form = "console"
    level: Level = "info"


def log_settings(
    form: str | None = None, level: str | None = None, environ: Mapping[str, str] = os.environ
) -> LogSettings:
    """Return the settings of the log: `form` and `level` as the command line gives them, or else
    from the environment, or else console and info. Raise CannotStart for unknown values."""
    given = {
        "form": (form or environ.get(_FORM, "")).strip().lower() or "console",
        "level": (level or environ.get(_LEVEL, "")).strip().lower() or "info",
    }
    try:
        return msgspec.convert(given, LogSettings)
    except msgspec.ValidationError:
        name, known = (_FORM, FORMS) if given["form"] not in FORMS else (_LEVEL, LEVELS)
        wrong = given["form"] if name == _FORM else given["level"]
        raise CannotStart(f"{name} is one of {', '.join(known)}, not {wrong!r}.") from None


def hand_on(chosen: LogSettings) -> None:
    """Pass the settings of the log on to processes that this one starts, through the environment."""
    os.environ[_FORM], os.environ[_LEVEL] = chosen.form, chosen.level


def set_up(process: str, chosen: LogSettings, *secrets: str) -> None:
    """Write log lines to stderr from now on. `process`: the name that lines of JSON carry;
    `secrets` are replaced wherever they occur."""
    handler = logging.StreamHandler(sys.stderr)
    known = tuple(each for each in secrets if each)
    is_json = chosen.form == "json"
    handler.setFormatter(JsonLog(process, *known) if is_json else ConsoleLog(*known))
    logging.basicConfig(level=logging.INFO, handlers=[handler], force=True)
    log.setLevel(chosen.level.upper())
    for name in _QUIET:
        logging.getLogger(name).setLevel(logging.WARNING)
    if is_json:
        logging.captureWarnings(True)
        sys.excepthook = _failed
        threading.excepthook = lambda args: _failed(
            args.exc_type, args.exc_value or args.exc_type(), args.exc_traceback
        )


def set_up_worker(name: str) -> None:
    """Set up the log of a worker process named `name`, with the settings in its environment."""
    try:
        chosen = log_settings()
    except CannotStart:  # then its parent did not start either
        chosen = LogSettings()
    set_up(f"worker {name}", chosen)


def writes_json() -> bool:
    """Return whether the log is written as JSON, for programs."""
    return any(isinstance(each.formatter, JsonLog) for each in logging.getLogger().handlers)


def say(text: str, level: Level = "info") -> None:
    """Write a sentence for the person who started a command to stderr; as a log line of `level` if
    the log is written as JSON."""
    if writes_json():
        log.log(logging.getLevelName(level.upper()), "%s", text)
        return
    sys.stderr.write(f"action-assistant: {text}\n")
    sys.stderr.flush()


def _failed(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Log an exception that was caught nowhere; the parameters are those of `sys.excepthook`."""
    log.critical("failed", exc_info=(kind, error, trace))
