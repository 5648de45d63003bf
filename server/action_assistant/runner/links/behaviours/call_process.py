"""One call of a behaviour: a process of its own, and a thread of this process that reads its output and ends it.

A call has ended when its process, and every process that it has started, have ended and were waited for.
"""

import os
import selectors
import signal
import threading
import time
from collections.abc import Callable
from typing import Final

import msgspec

from action_assistant.runner.links.behaviours.call_output import BadOutput, CallOutput, LineReader
from action_assistant.runner.links.behaviours.folder import BehaviourFolder, Unusable, file_of
from action_assistant.runner.links.behaviours.supervisor import Supervisor
from action_assistant.umrf.semantics import Call, Returned

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
        self._wrong = ""  # why the call is killed
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
        """Kill the call; `ended` is called when that is done. Return its messages so far and `why`, as one text."""
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
        """Write as much to the behaviour as it accepts, and let the selector report when it accepts
        more."""
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
        """Read one chunk; return whether more may come."""
        try:
            chunk = os.read(number, _CHUNK)
        except BlockingIOError:
            return False
        self._take(lambda: lines.take(chunk))
        if len(chunk) == _CHUNK:
            time.sleep(_PACE_S)
        return bool(chunk)

    def _take(self, said: Callable[[], None]) -> None:
        """Take in output; output that breaks the rules is kept as the reason to kill the call."""
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
