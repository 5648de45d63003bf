"""The links by which people come in: personal ones, and those of groups."""

from action_assistant.editor.people.invitations import Invitations
from action_assistant.editor.people.members import Members
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.people_files import PersonFile
from action_assistant.web.auth.sessions import Invited


class Reception:
    """Knows all links, and records who came in by them."""

    def __init__(self, invitations: Invitations, members: Members) -> None:
        self._invitations = invitations
        self._members = members

    async def look(self, proof: str) -> Invited:
        """Return what a link leads to. Raise Unauthenticated or Withdrawn if it lets nobody in."""
        return await self._members.look(proof) or self._invitations.look(proof)

    async def welcome(self, invitation: str, person: PersonRef) -> None:
        """Record that a person came in by a group link."""
        await self._invitations.welcome(invitation, person)

    async def come_in(self, link: str, session: str, browser: str, address: str) -> PersonFile:
        """Use a personal link for the session with this id, and return its person."""
        return await self._members.come_in(link, session, browser, address)
