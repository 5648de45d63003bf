"""One call of a behaviour: a process of its own, and a thread of this process that reads its output and ends it.

A call has ended when its process, and every process that it has started, have ended and were waited for.
Its output is lines of JSON, each checked before it is used.
"""

import math
import os
import selectors
import signal
import threading
import time
from collections.abc import Callable
from typing import Any, Final, TypeAlias

import msgspec

from action_assistant.runner.links.behaviours.folder import BehaviourFolder, Unusable, file_of
from action_assistant.runner.links.behaviours.supervisor import Supervisor
from action_assistant.safe_text import printable
from action_assistant.umrf.semantics import Call, Returned

_LINE: Final = 1 << 20  # bytes of a line
_TOLD: Final = 20  # messages that are kept, and as many printed lines
_TEXT: Final = 500  # characters of each


class BadOutput(Exception):
    """Output of a behaviour (the Python file that plays an action in a simulation) that breaks the
    rules, for which it is killed. The message is a sentence for people."""


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
    """Splits chunks of bytes into lines and passes each on. With `cut`, a line that is too long is
    cut; without, it raises BadOutput."""

    def __init__(self, hear: Callable[[bytes], None], *, cut: bool) -> None:
        self._hear = hear
        self._cut = cut  # drop the rest of a line that is too long, instead of refusing it
        self._rest = bytearray()
        self._drops = False

    def take(self, chunk: bytes) -> None:
        """Process the next chunk of bytes: pass on the lines that it completes."""
        *whole, rest = chunk.split(b"\n")
        for each in whole:
            self._add(each)
            if not self._drops:
                self._hear(bytes(self._rest))
            self._rest.clear()
            self._drops = False
        self._add(rest)

    def end(self) -> None:
        """Process the end of the output: a last line without a line end counts as a line."""
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
    """Collects and checks the output of one call of a behaviour. `types`: the types of the action's
    outputs, by flat name."""

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
        """Add one line that the behaviour has printed; only the first ones are kept."""
        self._printed.add(line.decode(errors="replace"))

    def text(self, *more: str) -> str | None:
        """Return the messages and printed lines, followed by `more`, as one text; None if there is
        no line at all."""
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
    """Return a value of an output as an engine holds it for the type `kind` (numbers as floats, a
    type with a final `s` is a list); for a type that engines do not know, return it unchanged.
    Raise ValueError or OverflowError if it does not have the type."""
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


_CHUNK: Final = 65_536  # bytes that are read at once, as many as a pipe holds
_PACE_S: Final = 0.025  # after a full chunk, so that a flood of output is read slowly
_LAST: Final = 64  # chunks of output that are read after the end of the process
_PENDING: Final = 65_536  # bytes of commands that wait; further ones are dropped, but for stop


class CallProcess:
    """A running call of a behaviour. `ended` is called once, on another thread, when every process
    of the call has ended."""

    def __init__(
        self, folder: BehaviourFolder, call: Call, ended: Callable[[Returned], None]
    ) -> None:
        self._folder = folder
        self._call = call
        self._ended = ended
        self._lock = threading.Lock()
        self._output = CallOutput(call.outputs)
        self._commands = bytearray()
        self._order = b""
        self._wrong = ""  # the reason for which the call is killed
        self._closed = False
        self._nudge = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._live, name="behaviour", daemon=True)

    def begin(self) -> None:
        """Start the call on its thread. Raises RuntimeError when no thread can be started."""
        self._thread.start()

    def tell(self, command: str) -> None:
        """Send the behaviour a command (`stop`, `pause` or `resume`) without waiting."""
        with self._lock:
            if len(self._commands) < _PENDING or command == "stop":
                self._commands += msgspec.json.encode({"kind": command}) + b"\n"
            self._wake()

    def kill(self, why: str) -> str | None:
        """Kill the process of the call, without waiting for its end, which is reported by `ended`.
        Return its messages so far and the reason `why` as one text; None if there is neither."""
        with self._lock:
            self._wrong = self._wrong or why
            self._wake()
            return self._output.text(why)

    def wait(self, seconds: float) -> bool:
        """Wait for the end of the call, so many seconds at most; return whether it has ended."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _wake(self) -> None:
        if not self._closed:
            os.eventfd_write(self._nudge, 1)

    # --- on its thread --------------------------------------------------------------------------

    def _live(self) -> None:
        try:
            error = self._run()
        except Unusable as unusable:
            error = str(unusable)
        except OSError as failed:
            error = f"No process could be begun for the behaviour: {failed}."
        with self._lock:
            self._closed = True
            os.close(self._nudge)
            said = self._output
            message = said.text(*([error] if error else []))
        is_good = not error and said.done is not None
        result = "on_error" if not is_good or said.done is None else _RESULTS[said.done.result]
        self._ended(
            Returned(
                number=self._call.number,
                result=result,
                outputs=said.outputs if is_good else {},
                message=message,
            )
        )

    def _run(self) -> str:
        """Start the process, read its output and wait for its end; return what went wrong, or "".
        Raise OSError if it cannot be started, Unusable if the behaviour cannot be read."""
        source = self._folder.source(self._call.name)
        order = {
            "kind": "run",
            "file": file_of(self._call.name),
            "source": source,
            "inputs": self._call.inputs,
        }
        self._order = msgspec.json.encode(order) + b"\n"
        with Supervisor() as supervisor:
            self._exchange(supervisor)
            code = supervisor.ended()
        with self._lock:
            done = self._output.done
            if self._wrong:
                return self._wrong
        return _death(code) if done is None else done.error or ""

    def _exchange(self, supervisor: Supervisor) -> None:
        """Send commands to the behaviour and read its output until its supervisor has ended."""
        readers = {
            supervisor.said: LineReader(self._output.take_line, cut=False),
            supervisor.printed: LineReader(self._output.take_printed, cut=True),
        }
        with selectors.DefaultSelector() as selector:
            for number in (supervisor.end_sign, self._nudge, *readers):
                selector.register(number, selectors.EVENT_READ)
            while not supervisor.is_over():
                self._write_on(supervisor, selector)
                for key, _ in selector.select(supervisor.patience):
                    if key.fd == self._nudge:
                        os.eventfd_read(self._nudge)
                    elif key.fd in readers and not self._hear(key.fd, readers[key.fd]):
                        selector.unregister(key.fd)
                if self._wrong or self._output.done is not None:
                    supervisor.let_go()
        for number, lines in readers.items():
            for _ in range(_LAST):
                if not self._hear(number, lines):
                    break
            self._take(lines.end)

    def _write_on(self, supervisor: Supervisor, selector: selectors.BaseSelector) -> None:
        """Write as much of the waiting commands to the behaviour as it accepts without waiting, and
        have the selector report when it accepts more."""
        if self._order:
            self._order = self._order[supervisor.write(self._order) :]
        with self._lock:
            if self._commands and not self._order:
                del self._commands[: supervisor.write(bytes(self._commands))]
            waits = bool(self._order or self._commands)
        if waits and supervisor.commands not in selector.get_map():
            selector.register(supervisor.commands, selectors.EVENT_WRITE)
        elif not waits and supervisor.commands in selector.get_map():
            selector.unregister(supervisor.commands)

    def _hear(self, number: int, lines: LineReader) -> bool:
        """Read one chunk from the descriptor `number` and pass it to `lines`. Return False at the
        end of the output, or if none is there now."""
        try:
            chunk = os.read(number, _CHUNK)
        except BlockingIOError:
            return False
        self._take(lambda: lines.take(chunk))
        if len(chunk) == _CHUNK:
            time.sleep(_PACE_S)
        return bool(chunk)

    def _take(self, said: Callable[[], None]) -> None:
        """Call `said`, which processes output. If it raises BadOutput, keep the reason, for which
        the call is killed then; later output is ignored."""
        with self._lock:
            try:
                if not self._wrong:
                    said()
            except BadOutput as wrong:
                self._wrong = str(wrong)


_RESULTS: Final = {True: "on_true", False: "on_false"}


def _death(code: int) -> str:
    """Return the sentence for a process that has ended without a result, by its exit code or minus its
    signal."""
    if code == -signal.SIGXCPU:
        return "The behaviour has used all the processor time that a call may have."
    how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
    return f"The process of the behaviour {how} before it had a result."
