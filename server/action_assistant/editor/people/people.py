"""The people who have acted on this server, by the name that they gave last."""

from collections.abc import Callable

from sqlalchemy import Connection, select

from action_assistant.editor.log.graph_events import (
    EXAMPLES,
    NAMED,
    PEOPLE,
    SERVER,
    PersonNamed,
    draft,
)
from action_assistant.errors import Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables
from action_assistant.web.auth.caller import caller
from action_assistant.web.auth.keys import SERVER_OWNER, PersonRef

_OURS = {SERVER: "Action Assistant", EXAMPLES: "Examples"}


class People:
    """Names by id. Knows everyone who ever acted."""

    def __init__(self, journal: Journal, names: dict[str, str]) -> None:
        self._journal = journal
        self._names = names

    @classmethod
    async def known(cls, journal: Journal) -> "People":
        """Return the people whose names are in the journal."""
        return cls(journal, await _stored_names(journal))

    async def refresh(self) -> None:
        """Read the names again, since another editor may have stored some. Raise Unavailable if the journal
        cannot be read."""
        self._names |= await _stored_names(self._journal)

    async def seen(self, person: PersonRef) -> None:
        """Store the name of a person if it is new or has changed. A program's token has the name of
        its time, and changes none. Raise Unavailable if the journal cannot be written."""
        asking = caller()
        token = "" if asking is None or asking.origin is None else asking.origin.token
        of_program = token not in {"", "server"}
        if self._names.get(person.id) == person.name or (of_program and person.id in self._names):
            return
        before = self._names.get(person.id)
        self._names[person.id] = person.name
        try:
            await self._journal.append(PEOPLE, [draft(NAMED, person.id, PersonNamed(person.name))])
        except Unavailable:  # it is told when they act next
            self._names.pop(person.id)
            if before is not None:
                self._names[person.id] = before
            raise

    def person(self, author: str) -> PersonRef:
        """Return the id and name of the author of an event; the name is empty where it is unknown."""
        return PersonRef(author, self._names.get(author) or _OURS.get(author, ""))

    def inviter(self, author: str) -> str:
        """Return the name of a person who invites others; empty for the owner of the server's token,
        who has chosen no name."""
        return "" if author == SERVER_OWNER else self.person(author).name

    def everyone(self) -> list[PersonRef]:
        """Return all people, sorted by name."""
        return sorted((PersonRef(*item) for item in self._names.items()), key=lambda p: p.name)


async def _stored_names(journal: Journal) -> dict[str, str]:
    rows = await journal.query(select(editor_tables.person.c.id, editor_tables.person.c.name))
    return {row.id: row.name for row in rows}


def stored_people(connection: Connection) -> Callable[[str], PersonRef]:
    """Return who the author of an event is, by the names that are stored. For workers."""
    person, member = editor_tables.person.c, editor_tables.member.c
    # A person of a personal link has a name before they act; the name that they gave last counts.
    named = select(member.id, member.name), select(person.id, person.name)
    rows = (row for each in named for row in connection.execute(each))
    names = {row.id: row.name for row in rows if row.name}
    return lambda author: PersonRef(author, names.get(author) or _OURS.get(author, ""))
