"""How a line of a log looks. Neither form shows a secret, nor lets a text of strangers begin a line."""

import logging
import time
from typing import Any

import msgspec

from action_assistant.logs.context import subjects
from action_assistant.safe_text import PrintableLog, one_line, printable, redacted


class ConsoleLog(PrintableLog):
    """For people: what a line is about stands behind it, in brackets."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - as `logging` asks
        said = super().formatMessage(record)
        ids = " ".join(f"{name}={one_line(value)}" for name, value in subjects().items())
        return f"{said} [{ids}]" if ids else said


class JsonLog(PrintableLog):
    """For programs: one JSON object for each record, whatever is in it.

    `time` (RFC 3339, UTC), `level`, `process`, `pid`, `logger`, `message`; `error` where something was
    raised; and the ids of what it is about.
    """

    def __init__(self, process: str, *secrets: str) -> None:
        super().__init__(*secrets)
        self._process = process

    def format(self, record: logging.LogRecord) -> str:
        """Return a record as one line of JSON."""
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
