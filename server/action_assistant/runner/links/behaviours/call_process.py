"""One call of a behaviour: a process of its own, and a thread here that hears it and sees to its end.

A call has ended when nothing of it is left: its process, and all that it has started, were waited for.
"""

import os
import selectors
import signal
import threading
import time
from collections.abc import Callable
from typing import Final

import msgspec

from action_assistant.runner.links.behaviours.folder import BehaviourFolder, Unusable, file_of
from action_assistant.runner.links.behaviours.keeper import Keeper
from action_assistant.runner.links.behaviours.sayings import LineReader, Sayings, Unbelievable
from action_assistant.umrf.semantics import Call, Returned

_CHUNK: Final = 65_536  # bytes that are read at once, as many as a pipe holds
_PACE_S: Final = 0.025  # after so much: who floods is heard slowly, and waits
_LAST: Final = 64  # chunks that are read of what it has left behind
_PENDING: Final = (
    65_536  # bytes of commands that it does not read; what comes after them is dropped
)


class CallProcess:
    """A call that goes on. `ended` hears once, on another thread, when nothing of it is left."""

    def __init__(
        self, folder: BehaviourFolder, call: Call, ended: Callable[[Returned], None]
    ) -> None:
        self._folder = folder
        self._call = call
        self._ended = ended
        self._lock = threading.Lock()
        self._sayings = Sayings(call.outputs)
        self._commands = bytearray()
        self._order = b""
        self._wrong = ""  # why it is ended by force
        self._closed = False
        self._nudge = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._thread = threading.Thread(target=self._live, name="behaviour", daemon=True)

    def begin(self) -> None:
        """Let it run. Raises RuntimeError where no thread can be had."""
        self._thread.start()

    def tell(self, command: str) -> None:
        """`stop`, `pause` or `resume`; waits for nothing."""
        with self._lock:
            if len(self._commands) < _PENDING or command == "stop":
                self._commands += msgspec.json.encode({"kind": command}) + b"\n"
            self._wake()

    def kill(self, why: str) -> str | None:
        """End it by force; `ended` hears when that is done. What it had to say, and why."""
        with self._lock:
            self._wrong = self._wrong or why
            self._wake()
            return self._sayings.told(why)

    def joined(self, seconds: float) -> bool:
        """Whether nothing of it is left, after so many seconds at most."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _wake(self) -> None:
        if not self._closed:
            os.eventfd_write(self._nudge, 1)

    # --- on its thread --------------------------------------------------------------------------

    def _live(self) -> None:
        try:
            error = self._carried_out()
        except Unusable as unusable:
            error = str(unusable)
        except OSError as failed:
            error = f"No process could be begun for the behaviour: {failed}."
        with self._lock:
            self._closed = True
            os.close(self._nudge)
            said = self._sayings
            message = said.told(*([error] if error else []))
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

    def _carried_out(self) -> str:
        """Begin the process, hear it, see all of it end; what went wrong, or "". Raises OSError,
        Unusable."""
        source = self._folder.source(self._call.name)
        order = {
            "kind": "run",
            "file": file_of(self._call.name),
            "source": source,
            "inputs": self._call.inputs,
        }
        self._order = msgspec.json.encode(order) + b"\n"
        with Keeper() as keeper:
            self._hear_out(keeper)
            code = keeper.ended()
        with self._lock:
            done = self._sayings.done
            if self._wrong:
                return self._wrong
        return _death(code) if done is None else done.error or ""

    def _hear_out(self, keeper: Keeper) -> None:
        """Tell and hear it until its keeper has ended."""
        readers = {
            keeper.said: LineReader(self._sayings.hear, cut=False),
            keeper.printed: LineReader(self._sayings.hear_print, cut=True),
        }
        with selectors.DefaultSelector() as selector:
            for number in (keeper.end_sign, self._nudge, *readers):
                selector.register(number, selectors.EVENT_READ)
            while not keeper.is_over():
                self._tell_on(keeper, selector)
                for key, _ in selector.select(keeper.patience):
                    if key.fd == self._nudge:
                        os.eventfd_read(self._nudge)
                    elif key.fd in readers and not self._hear(key.fd, readers[key.fd]):
                        selector.unregister(key.fd)
                if self._wrong or self._sayings.done is not None:
                    keeper.let_go()
        for number, lines in readers.items():
            for _ in range(_LAST):
                if not self._hear(number, lines):
                    break
            self._take(lines.end)

    def _tell_on(self, keeper: Keeper, selector: selectors.BaseSelector) -> None:
        """Write what it can take; be woken for the rest."""
        if self._order:
            self._order = self._order[keeper.write(self._order) :]
        with self._lock:
            if self._commands and not self._order:
                del self._commands[: keeper.write(bytes(self._commands))]
            waits = bool(self._order or self._commands)
        if waits and keeper.commands not in selector.get_map():
            selector.register(keeper.commands, selectors.EVENT_WRITE)
        elif not waits and keeper.commands in selector.get_map():
            selector.unregister(keeper.commands)

    def _hear(self, number: int, lines: LineReader) -> bool:
        """Read once; whether more may come."""
        try:
            chunk = os.read(number, _CHUNK)
        except BlockingIOError:
            return False
        self._take(lambda: lines.take(chunk))
        if len(chunk) == _CHUNK:
            time.sleep(_PACE_S)
        return bool(chunk)

    def _take(self, said: Callable[[], None]) -> None:
        """Believe it, as far as it keeps the rules."""
        with self._lock:
            try:
                if not self._wrong:
                    said()
            except Unbelievable as wrong:
                self._wrong = str(wrong)


_RESULTS: Final = {True: "on_true", False: "on_false"}


def _death(code: int) -> str:
    """What to say of a process that has ended without a result."""
    if code == -signal.SIGXCPU:
        return "The behaviour has used all the processor time that a call may have."
    how = f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"
    return f"The process of the behaviour {how} before it had a result."
