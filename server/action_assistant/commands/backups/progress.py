"""The progress of long work, printed to stderr."""

import sys
import time
from typing import Final

from action_assistant.safe_text import printable

_EVERY: Final = 1.0  # seconds


class Progress:
    """Reports the progress of long work on stderr.

    It writes nothing in the first second, then one text a second: on a terminal each replaces the
    last, elsewhere each has its own line.
    """

    def __init__(self) -> None:
        self._next = time.monotonic() + _EVERY
        self._shown = False

    def tell(self, text: str) -> None:
        """Print `text` about how far the work has come, but at most once a second."""
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + _EVERY
        self._shown = sys.stderr.isatty()
        if self._shown:
            _steer(f"\r\x1b[K{printable(text)} …")
        else:
            sys.stderr.write(f"{text} …\n")
            sys.stderr.flush()

    def end(self) -> None:
        """Clear the line of a terminal before other output."""
        if self._shown:
            _steer("\r\x1b[K")
        self._shown = False


def _steer(text: str) -> None:
    """Write control characters to the terminal itself, bypassing the filter that makes output
    plain."""
    stream = sys.__stderr__ or sys.stderr
    stream.write(text)
    stream.flush()
