"""The whole log of a journal, for tests that compare it with what was appended."""

from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal


async def whole_log(journal: Journal) -> list[Event]:
    """Return all events of all streams, page by page, in order of their positions."""
    stored: list[Event] = []
    while page := await journal.read_all(after=stored[-1].position if stored else 0):
        stored += page
    return stored
