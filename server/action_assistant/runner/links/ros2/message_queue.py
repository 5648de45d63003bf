"""A bounded queue from the thread of a domain to its event loop, with commands apart from the rest.

Nodes may log faster than the loop reads. Log lines then push out other lines and feedback, of which some is
always missing anyway, but never a command of somebody else, which is sent once.
"""

import threading
from collections import deque
from heapq import merge
from operator import itemgetter
from typing import Final, NamedTuple, TypeAlias

from action_assistant.runner.links.ros2.ros_values import OverheardCommand, RosValue

_KEPT: Final = 512  # values of each kind; a further one drops the oldest

_Numbered: TypeAlias = tuple[int, RosValue]


class QueuedMessages(NamedTuple):
    """The values that have waited, oldest first, and how many were dropped."""

    values: list[RosValue]
    dropped: int
    dropped_commands: int


class MessageQueue:
    """A queue that one thread adds to and another one takes from."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._number = 0
        self._begin()

    def _begin(self) -> None:
        self._commands: deque[_Numbered] = deque(maxlen=_KEPT)
        self._others: deque[_Numbered] = deque(maxlen=_KEPT)
        self._dropped = self._dropped_commands = 0
        self._is_empty = True

    def add(self, value: RosValue) -> bool:
        """Add a value; if the queue is full, the oldest value of its kind is dropped. Return
        whether the queue was empty, so that the reader has to be woken."""
        with self._lock:
            self._number += 1
            if isinstance(value, OverheardCommand):
                self._dropped_commands += len(self._commands) == _KEPT
                self._commands.append((self._number, value))
            else:
                self._dropped += len(self._others) == _KEPT
                self._others.append((self._number, value))
            is_first, self._is_empty = self._is_empty, False
            return is_first

    def take(self) -> QueuedMessages:
        """Return all waiting values in order, and empty the queue."""
        with self._lock:
            commands, others = self._commands, self._others
            dropped, dropped_commands = self._dropped, self._dropped_commands
            self._begin()
        in_order = merge(commands, others, key=itemgetter(0))
        return QueuedMessages([value for _, value in in_order], dropped, dropped_commands)
