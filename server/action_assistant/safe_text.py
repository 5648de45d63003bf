"""Texts of strangers on terminals and in logs: without control sequences, and without secrets.

Names of graphs and robots, paths and headers of requests and what engines say are written by anybody. A
character that is no text is shown as JSON writes it (`\\u001b`), so that JSON stays the same JSON.
"""

import logging
import re
import sys
from types import TracebackType
from typing import Any, Final, TextIO, TypeAlias

#: Controls of both kinds but tab and line feed, overrides of direction, other ends of lines, and halves
#: of characters, which cannot be written at all.
_STEERING: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
#: What lets somebody in, wherever it stands, and how much of it may be shown.
_SECRETS: Final[tuple[tuple[re.Pattern[str], str], ...]] = (
    (re.compile(r"\b([A-Za-z0-9]{12})\.[\w-]{43}(?![\w-])"), r"\1.…"),  # an invitation
    (re.compile(r"(?i)\b(bearer\s+)[^\s,;'\"]+"), r"\1…"),
    (re.compile(r"\b(aa_\d+=)[^\s;,'\"]+"), r"\1…"),  # a session
    (re.compile(r"([#?&/](?:t|i|token|password)=)[^\s&'\"]+"), r"\1…"),
    (re.compile(r"(\w://[^\s/:@]*:)[^\s/]*@"), r"\1…@"),
    (re.compile(r"(\bpostgres[\w+]*:/+[^\s/:@]*:)[^\s@]*@"), r"\1…@"),  # may have slashes in it
    (re.compile(r"(?<![\w-])[\w-]{43}(?![\w-])"), "…"),  # 256 bits, as tokens of ours are written
)

_Raised: TypeAlias = (
    tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None]
)


def printable(text: str) -> str:
    """The text, with lines and tabs as they were."""
    return _STEERING.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def one_line(text: str) -> str:
    """The text, which cannot pretend to be another line."""
    return printable(text).replace("\n", "\\n")


def redacted(text: str, secrets: tuple[str, ...] = ()) -> str:
    """The text without what would let its readers in."""
    for secret in secrets:
        text = text.replace(secret, "…")
    for pattern, shown in _SECRETS:
        text = pattern.sub(shown, text)
    return text


class PrintableStream:
    """A standard stream, through which nothing steers a terminal."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Returns how many characters were taken."""
        self._stream.write(printable(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def make_streams_printable() -> None:
    """From here on, for `print` and everything else."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None and not isinstance(stream, PrintableStream):
            setattr(sys, name, PrintableStream(stream))


class PrintableLog(logging.Formatter):
    """One line for each record; what belongs to it is indented. `secrets` are never shown."""

    def __init__(self, *secrets: str) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s")
        self._secrets = secrets

    def format(self, record: logging.LogRecord) -> str:
        """As `logging` asks."""
        return redacted(super().format(record), self._secrets)

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - as `logging` asks
        record.message = one_line(record.message)
        return super().formatMessage(record)

    def formatException(self, ei: _Raised) -> str:  # noqa: N802
        return _indented(super().formatException(ei))

    def formatStack(self, stack_info: str) -> str:  # noqa: N802
        return _indented(super().formatStack(stack_info))


def _indented(text: str) -> str:
    return "\n".join(f"    {line}" for line in printable(text).split("\n"))
