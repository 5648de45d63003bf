"""Reads the output of a call's process: lines of JSON, each checked before it is used."""

import math
from collections.abc import Callable
from typing import Any, Final, TypeAlias

import msgspec

from action_assistant.safe_text import printable

_LINE: Final = 1 << 20  # bytes of a line
_TOLD: Final = 20  # messages that are kept, and as many printed lines
_TEXT: Final = 500  # characters of each


class BadOutput(Exception):
    """Output of a behaviour that breaks the rules, for which it is killed; the message is a sentence for people."""


class OutputLine(msgspec.Struct, frozen=True, tag_field="kind", tag="output"):
    """The behaviour has set an output to this value."""

    name: str
    value: Any


class MessageLine(msgspec.Struct, frozen=True, tag_field="kind", tag="message"):
    """The behaviour has a message for people."""

    text: str


class DoneLine(msgspec.Struct, frozen=True, tag_field="kind", tag="done"):
    """The behaviour has ended; with an `error` the result does not count."""

    result: bool
    error: str | None = None


_Line: TypeAlias = OutputLine | MessageLine | DoneLine


class LineReader:
    """Splits chunks of bytes into lines and passes each on. A line that is too long is cut (`cut`), or raises
    BadOutput."""

    def __init__(self, hear: Callable[[bytes], None], *, cut: bool) -> None:
        self._hear = hear
        self._cut = cut  # drop the rest of a line that is too long, instead of refusing it
        self._rest = bytearray()
        self._drops = False

    def take(self, chunk: bytes) -> None:
        """Take in the next chunk of bytes."""
        *whole, rest = chunk.split(b"\n")
        for each in whole:
            self._add(each)
            if not self._drops:
                self._hear(bytes(self._rest))
            self._rest.clear()
            self._drops = False
        self._add(rest)

    def end(self) -> None:
        """Take in the end of the output: a last line without a line end counts as a line."""
        if self._rest and not self._drops:
            self._hear(bytes(self._rest))
        self._rest.clear()

    def _add(self, part: bytes) -> None:
        most = 4 * _TEXT if self._cut else _LINE
        if self._drops:
            return
        if len(self._rest) + len(part) <= most:
            self._rest += part
        elif self._cut:
            self._hear(bytes(self._rest + part[:most]))
            self._rest.clear()
            self._drops = True
        else:
            raise BadOutput(f"The behaviour said more than {most >> 20} MB in one line.")


class CallOutput:
    """The checked output of one call. `types`: the types of the action's outputs, by flat name."""

    def __init__(self, types: dict[str, str]) -> None:
        self._types = types
        self.outputs: dict[str, Any] = {}
        self.done: DoneLine | None = None
        self._messages = _Kept()
        self._printed = _Kept()

    def take_line(self, line: bytes) -> None:
        """Add one output line of a behaviour's process. Raise BadOutput if it does not follow the
        protocol."""
        try:
            said = msgspec.json.decode(line, type=_Line)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise BadOutput(f"The behaviour said what nobody can read: {error}.") from error
        match said:
            case OutputLine(name=name, value=value):
                self.outputs[name] = self._checked(name, value)
            case MessageLine(text=text):
                self._messages.add(text)
            case DoneLine():
                self.done = self.done or said

    def take_printed(self, line: bytes) -> None:
        """Add one line that the behaviour has printed."""
        self._printed.add(line.decode(errors="replace"))

    def text(self, *more: str) -> str | None:
        """Return the messages and printed lines, followed by `more`, as one text; None if there are none."""
        lines = [*self._messages.lines("messages"), *self._printed.lines("printed lines"), *more]
        return "\n".join(lines) or None

    def _checked(self, name: str, value: Any) -> Any:
        if name not in self._types:
            raise BadOutput(f"The action has no output “{name[:80]}”.")
        kind = self._types[name]
        try:
            return value_of(kind, value)
        except (ValueError, OverflowError):
            given = type(value).__name__
            raise BadOutput(f"The output “{name[:80]}” is a {kind}, not {given}.") from None


class _Kept:
    """Keeps the first lines, and counts the omitted ones."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._more = 0

    def add(self, text: str) -> None:
        if len(self._lines) < _TOLD:
            shown = printable(text.strip("\n"))
            self._lines.append(shown if len(shown) <= _TEXT else f"{shown[:_TEXT]}…")
        else:
            self._more += 1

    def lines(self, what: str) -> list[str]:
        more = [f"… and {self._more:,} more {what}"] if self._more else []
        return [*self._lines, *more]


def value_of(kind: str, value: Any) -> Any:
    """Return a value as an engine holds it for this type, numbers as floats; any value for a type
    that is not native. Raise ValueError or OverflowError if it does not have the type."""
    if kind.endswith("s") and (one := kind[:-1]) in _NATIVE:
        if not isinstance(value, list):
            raise ValueError
        return [_NATIVE[one](each) for each in value]
    return _NATIVE[kind](value) if kind in _NATIVE else value


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError
    return value


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError
    if not math.isfinite(number := float(value)):
        raise ValueError
    return number


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError
    return value


_NATIVE: Final[dict[str, Callable[[Any], Any]]] = {
    "string": _text,
    "number": _number,
    "bool": _truth,
}
