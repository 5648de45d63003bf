"""A thread that repeats a failed write of a small file until the disk takes it."""

import threading
import time
from collections.abc import Callable
from typing import Final

AGAIN_S: Final = 2.0


class RetryingThread:
    """Calls a function periodically, on a thread of its own, until it returns True. It holds up no
    event loop and no end of the process."""

    def __init__(self, attempt: Callable[[], bool], name: str) -> None:
        self._attempt = attempt
        self._name = name
        self._lock = threading.Lock()
        self._is_running = self._is_asked = False

    def start(self) -> None:
        """Start the attempts, unless they go on already. The first one follows after a pause."""
        with self._lock:
            self._is_asked = True
            if not self._is_running:
                self._is_running = True
                threading.Thread(target=self._run, name=self._name, daemon=True).start()

    def _run(self) -> None:
        is_done = False
        while True:
            with self._lock:
                if is_done and not self._is_asked:
                    self._is_running = False
                    return
                self._is_asked = False
            time.sleep(AGAIN_S)
            is_done = self._attempt()
