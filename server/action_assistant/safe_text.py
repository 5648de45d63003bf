"""Texts of strangers on terminals, in logs and in sentences: without control sequences, without what
turns the words around a name, and without secrets.

Names of graphs and robots, paths and headers of requests and what engines say are written by anybody. A
character that is no text is shown as JSON writes it (`\\u001b`), so that JSON stays the same JSON.
"""

import logging
import re
import sys
from types import TracebackType
from typing import Any, Final, TextIO, TypeAlias

import msgspec

#: Controls of both kinds but tab and line feed, overrides of direction, other ends of lines, and halves
#: of characters, which cannot be written at all.
_STEERING: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
#: Embeddings, overrides and isolates: what they turn may reach beyond the name that has them.
_DIRECTING: Final = "\u202a-\u202e\u2066-\u2069"
#: Letters, digits and marks that are written from right to left.
_LEFTWARD: Final = (
    "\u0590-\u08ff\u200f\ufb1d-\ufdff\ufe70-\ufefc\U00010800-\U00010fff\U0001e800-\U0001efff"
)
_TURNING: Final = re.compile(f"[{_DIRECTING}{_LEFTWARD}]")
#: Words from right to left, as they stand in a name; isolated already, or not yet.
_WORDS: Final = f"[{_LEFTWARD}]+(?:[ _.-]?[0-9]*[ _.-]?[{_LEFTWARD}]+)*"
_ISOLATED: Final = re.compile(f"\u200e?\u2068({_WORDS})\u2069\u200e?")
_TURNED: Final = re.compile(f"\u2068({_WORDS})\u2069|({_WORDS})|([{_DIRECTING}])")
#: Secrets that let a person in, as patterns, and the part of each that may be shown.
_SECRETS: Final[tuple[tuple[re.Pattern[str], str], ...]] = (
    (re.compile(r"\b([A-Za-z0-9]{12})\.[\w-]{43}(?![\w-])"), r"\1.…"),  # an invitation
    (re.compile(r"\b(aat_[A-Za-z0-9]{1,12}_)\w+"), r"\1…"),  # a token of a program
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
    """Return the text with its control characters written as escape sequences. Line breaks and tabs
    stay as they are."""
    return _STEERING.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def told(text: str) -> str:
    """Return text for a terminal: printable, and in an order that no name in it reverses.
    Right-to-left words stand between marks (U+200E), not in isolates, which some terminals show as
    boxes."""
    return printable(_ISOLATED.sub("\u200e\\1\u200e", sentence(text)))


def one_line(text: str) -> str:
    """Return the text as `told` does, but in one line, so that a name in it cannot imitate another
    line."""
    return told(text).replace("\n", "\\n")


def sentence(text: str) -> str:
    """Return a sentence in an order that no name in it reverses. A character that controls the
    direction is shown as its JSON escape, since it is not known where the name ends; right-to-left
    words become isolates (U+2068 to U+2069). Other text, and a result of this function, stays
    unchanged."""
    return _TURNED.sub(_in_order, text) if _TURNING.search(text) else text


def _in_order(found: re.Match[str]) -> str:
    if found[3] is not None:
        return printable(found[3])
    return f"\u2068{found[1] or found[2]}\u2069"


def is_name(text: str) -> bool:
    """Return whether a text can be a name: it has a character that is seen, and none that controls a
    terminal, ends a line or turns the words around it."""
    seen = any(each.isprintable() and not each.isspace() for each in text)
    return seen and _STEERING.search(text) is None


def steering_in(text: str) -> str | None:
    """Return the first character of a text that controls how it is shown; None for a text without
    any. Line breaks and tabs are none."""
    found = _STEERING.search(text.replace("\r", ""))
    return None if found is None else found[0]


def hold_names(told: msgspec.Struct, *fields: str) -> None:
    """Replace the named text fields of a struct by their `sentence`. Structs that people read call
    this in `__post_init__`."""
    for field in fields:
        text = getattr(told, field)
        if text and _TURNING.search(text):
            msgspec.structs.force_setattr(told, field, sentence(text))


def redacted(text: str, secrets: tuple[str, ...] = ()) -> str:
    """Return the text with each of `secrets`, and all that has the form of a password or token,
    replaced."""
    for secret in secrets:
        text = text.replace(secret, "…")
    for pattern, shown in _SECRETS:
        text = pattern.sub(shown, text)
    return text


class PrintableStream:
    """A standard stream that lets no output control the terminal. With `sentences` it also fixes
    the order of right-to-left names; not for JSON and files."""

    def __init__(self, stream: TextIO, *, sentences: bool = False) -> None:
        self._stream = stream
        self._shown = told if sentences else printable

    def write(self, text: str) -> int:
        """Write the text in its printable form. Return the number of characters of `text`."""
        self._stream.write(self._shown(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def make_streams_printable() -> None:
    """Replace the standard output and the standard error by streams that write only printable text."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not None and not isinstance(stream, PrintableStream):
            setattr(sys, name, PrintableStream(stream, sentences=name == "stderr"))


class PrintableLog(logging.Formatter):
    """Writes each record as one line, with its traceback indented. `secrets` are never written."""

    def __init__(self, *secrets: str) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s")
        self._secrets = secrets

    def format(self, record: logging.LogRecord) -> str:
        """Return a record as text, with the secrets replaced."""
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
