"""What people say about where they are, told to the others window by window."""

from collections.abc import Collection, Sequence

from action_assistant.editor.crdt.messages import PresenceEntry
from action_assistant.editor.rooms.batch_window import BatchWindow
from action_assistant.editor.rooms.member import Member
from action_assistant.editor.rooms.presence import PresenceNews


class PresenceSpread:
    """Collects what the members of a room said in one window. `members` are those of the moment."""

    def __init__(self, members: Collection[Member], window: BatchWindow) -> None:
        self._members = members
        self._window = window
        self._said: dict[int, tuple[PresenceEntry, Member]] = {}  # in this window, by client

    def tell(self, entries: Sequence[PresenceEntry], speaker: Member) -> None:
        """Tell the others at the end of this window; of each client only the last word."""
        if entries and not self._said:
            self._window.when_open(self._spread)
        for entry in entries:
            self._said[entry.client] = entry, speaker

    def _spread(self) -> None:
        said, self._said = self._said, {}
        speakers = {speaker for _, speaker in said.values()}
        # Of several each hears its own words, too, as stock servers have it: they are no news to a client,
        # and so there is one message for all.
        alone = speakers.pop() if len(speakers) == 1 else None
        everything = PresenceNews([entry for entry, _ in said.values()])
        for member in self._members:
            if member is not alone and not member.sends(everything.framed):
                member.post_presence(everything)
