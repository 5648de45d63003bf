"""The messages that wait for an emulated engine: one queue for each topic, and one for gets."""

from collections import deque
from typing import Final

from action_assistant.runner.emulator.messages import TOPICS, Message

_GETS: Final = 10  # requests that wait, by the depth of a service


class Inbox:
    """Gives messages in the order of their topics, then gets. A full queue drops its oldest.

    `depth`: how many messages of one topic wait; 0 for any number.
    """

    def __init__(self, depth: int) -> None:
        self._depth = depth
        self._messages: dict[str, deque[Message]] = {topic: deque() for topic in TOPICS}
        self._gets: deque[int] = deque(maxlen=_GETS)

    def put(self, message: Message) -> None:
        """Add a command; of one topic only the newest ones stay, as many as its depth."""
        waiting = self._messages[message.topic]
        if self._depth and len(waiting) >= self._depth:
            waiting.popleft()
        waiting.append(message)

    def put_get(self, ticket: int) -> None:
        """Add a get, by the ticket that its answer carries."""
        self._gets.append(ticket)

    def taken(self) -> Message | int | None:
        """Remove and return the next message: a command, or the ticket of a get; None when nothing waits."""
        waiting = next((each for each in self._messages.values() if each), None)
        if waiting is not None:
            return waiting.popleft()
        return self._gets.popleft() if self._gets else None

    def clear(self) -> None:
        """Drop all messages and gets that wait."""
        for waiting in self._messages.values():
            waiting.clear()
        self._gets.clear()
