"""Persons: added by owners, or come by a provider; changed and ended by owners; and their groups.

The truth is the log. What both processes verify by are the files of `PeopleFiles` and the marks of
`Revocations`: a person is ended by a mark before the log has it, also on a full disk.

A personal link carries an id and its secret, like a group link (`Keys.secret_of`). It lets one
browser in, once. The command line makes one without a server as a file in `people/links`, which is
taken over into the log when the editor starts or the link is used.
"""

import asyncio
import hmac
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import Final

import msgspec
from msgspec.structs import replace
from sqlalchemy import select

from action_assistant import private_files
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.log import people_events as e
from action_assistant.editor.people.late_records import LateRecords
from action_assistant.editor.people.offline_links import LINKS, MOST_HOURS, offline_in
from action_assistant.editor.people.people import People
from action_assistant.errors import (
    BadInput,
    Conflict,
    NotFound,
    Unauthenticated,
    Unavailable,
    Withdrawn,
)
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.kit.moments import sent_us
from action_assistant.random_ids import random_id
from action_assistant.safe_text import is_name
from action_assistant.schema import editor_tables
from action_assistant.web.auth import people_files
from action_assistant.web.auth.caller import Origin, acting_for, origin_in
from action_assistant.web.auth.keys import Keys, PersonRef
from action_assistant.web.auth.people_files import NAME_LIMIT, PeopleFiles, PersonFile
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role, rank
from action_assistant.web.auth.sessions import Invited

log: Final = logging.getLogger(__name__)

LINK_HOURS: Final = 72.0

_USED: Final = (
    "This link was used already; it lets one browser in. On a browser that is signed in, add this device, or ask "
    "for a new link."
)
_MOST: Final = 1000  # persons that are not ended
_MOST_GROUPS: Final = 100


class PersonalLink(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A link for one person. `path` follows the origin of the page; it holds the secret, and is
    left out once the link opens nothing. `browser`, `address`: of the browser that used it."""

    id: str
    made_at: datetime
    made_by: PersonRef
    expires_at: datetime
    path: str | None = None
    used_at: datetime | None = None
    browser: str = ""
    address: str = ""
    withdrawn_at: datetime | None = None


class Group(msgspec.Struct, frozen=True):
    """A named set of persons."""

    id: str
    name: str


class ByProvider(msgspec.Struct, frozen=True):
    """The provider by which a person signs in, and the role that its groups give there: owners may
    give a lower one."""

    issuer: str
    role: Role


class Member(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A person as owners see them. `groups`: ids. `until`: when the right to do more than Stop ends.
    `links`: the newest first, for owners only. `unrecorded`: that the person is ended is not in
    the log yet. `provider`: None for a person who comes by personal links only."""

    id: str
    name: str
    role: Role
    groups: tuple[str, ...]
    made_at: datetime
    made_by: PersonRef
    until: datetime | None = None
    ended_at: datetime | None = None
    ended_by: PersonRef | None = None
    unrecorded: bool = False
    links: tuple[PersonalLink, ...] = ()
    provider: ByProvider | None = None


class Members:
    """All persons with personal links, and all groups, held in memory, so that ending one needs no
    database."""

    def __init__(
        self,
        journal: Journal,
        people: People,
        keys: Keys,
        revoked: Revocations,
        files: PeopleFiles,
        data: Path,
    ) -> None:
        self._journal = journal
        self._people = people
        self._keys = keys
        self._revoked = revoked
        self._files = files
        self._offline = data / people_files.FOLDER / LINKS
        self._members: dict[str, Member] = {}
        self._owner_of: dict[str, str] = {}  # link -> person
        self._groups: dict[str, Group] = {}
        self._records: dict[str, e.ProviderRecord] = {}  # by person
        self._late = LateRecords("the end of persons")
        self.turn: Final = asyncio.Lock()  # of what changes persons and groups

    @asynccontextmanager
    async def opened(self) -> AsyncIterator[None]:
        """Load all persons and groups. Files and log are made equal, since either may be older
        after a restore or crash: a person whom one of them calls ended is ended."""
        await self._read()
        for path in await asyncio.to_thread(self._offline_links):
            try:
                await self._take_over(path)
            except Unavailable as error:
                log.error("the link %s is not in the log: %s", path.stem, error.detail)
        for member in tuple(self._members.values()):
            if self._revoked.person_ended(member.id) and member.ended_at is None:
                await self._ended(member, PersonRef(h.SERVER, ""))
            elif member.ended_at is not None and not self._revoked.person_ended(member.id):
                _try(partial(self._revoked.end_person, member.id))
            if member.ended_at is None and self._files.get(member.id) != _file_of(member):
                _try(partial(self._files.write, _file_of(member)))
        _try(self._write_groups)
        try:
            yield
        finally:
            await self._late.aclose()

    async def refresh(self) -> None:
        """Read all persons and groups again, since another editor may have changed some. What was ended or
        used here and is not stored yet stays so. Raise Unavailable if the journal cannot be read."""
        async with self.turn:
            await self._read()

    def all(self, *, with_links: bool) -> list[Member]:
        """Return all persons by name; those who were ended last."""
        found = [self._view(each, with_links=with_links) for each in self._members.values()]
        return sorted(found, key=lambda each: (each.ended_at is not None, each.name.casefold()))

    def get(self, person: str) -> Member:
        """Return one person. Raise NotFound if there is none with this id."""
        return self._view(self._one(person), with_links=True)

    def groups(self) -> list[Group]:
        """Return all groups by name."""
        return sorted(self._groups.values(), key=lambda each: each.name.casefold())

    async def add(
        self,
        name: str,
        role: Role,
        author: str,
        *,
        groups: tuple[str, ...] = (),
        until: datetime | None = None,
        hours: float = LINK_HOURS,
    ) -> Member:
        """Add a person, with a link that lets one browser in within so many hours. Raise BadInput
        or Conflict for a bad name, group or time; Unavailable if the log cannot be written."""
        state = e.MemberState(
            random_id(), self._name(name), role, self._known(groups), _us(_later(until))
        )
        made = _link_for(state.id, hours)
        async with self.turn:
            self.refuse_more()
            self._refuse_twice(state.name)
            await self._append([h.draft(e.ADDED, author, state), h.draft(e.LINKED, author, made)])
            await self._read(state.id)
            await self._write(state.id)
        return self.get(state.id)

    async def change(
        self,
        person: str,
        author: str,
        *,
        name: str | None = None,
        role: Role | None = None,
        groups: tuple[str, ...] | None = None,
        until: datetime | msgspec.UnsetType | None = msgspec.UNSET,
    ) -> Member:
        """Change a person, everywhere at once. Raise BadInput, Conflict, NotFound or Unavailable."""
        async with self.turn:
            now = self._present(person)
            new = now if until is msgspec.UNSET else replace(now, until=_later(until))
            if name is not None and (given := self._name(name)) != now.name:
                self._refuse_twice(given)
                new = replace(new, name=given)
            new = replace(
                new,
                role=now.role if role is None else role,
                groups=now.groups if groups is None else self._known(groups),
            )
            record = self._records.get(person)
            lasts = new.until is None or new.until > datetime.now(UTC)
            if record is not None and record.refused and lasts:
                record = replace(record, refused=False, until=None)  # an owner lets them in again
            if record is not None and role is not None:
                record = _lowered(record, role, now.role)
            await self.store(e.CHANGED, author, new, record)
        return self.get(person)

    def known(self, person: str) -> tuple[Member | None, e.ProviderRecord | None]:
        """Return a person and as whom a provider knows them; None for what there is not."""
        return self._members.get(person), self._records.get(person)

    def refuse_ended(self, person: str) -> None:
        """Raise Withdrawn if an owner has ended a person, for good."""
        known = self._members.get(person)
        if self._revoked.person_ended(person) or (known is not None and known.ended_at is not None):
            raise Withdrawn("Your access was ended by an owner. Ask them to add you anew.")

    def refuse_more(self) -> None:
        """Raise Conflict if there are too many persons."""
        if sum(each.ended_at is None for each in self._members.values()) >= _MOST:
            raise Conflict(f"There are {_MOST} persons already; end some.")

    def has_name(self, name: str, *, but: str) -> bool:
        """Return whether a person who is not ended has this name, in upper or lower case. The
        person with the id `but` does not count."""
        return any(
            each.ended_at is None and each.id != but and each.name.casefold() == name.casefold()
            for each in self._members.values()
        )

    async def store(
        self, kind: str, author: str, new: Member, record: e.ProviderRecord | None
    ) -> PersonFile:
        """Store the name, role, groups and last day of a person, and as whom a provider knows them, by
        an event of this kind if that is anything new; in `turn` only. Return the person. Raise
        Unavailable if the log cannot be written."""
        if self.known(new.id) == (new, record):
            return _file_of(new)
        await self._append([h.draft(kind, author, _state(new, record))])
        self._members[new.id] = replace(  # who may have been ended, or come in, meanwhile
            self._members.get(new.id, new),
            name=new.name,
            role=new.role,
            groups=new.groups,
            until=new.until,
        )
        if record is not None:
            self._records[new.id] = record
        await self._write(new.id)
        return _file_of(self._members[new.id])

    async def link(self, person: str, author: str, hours: float = LINK_HOURS) -> Member:
        """Make a new link for a person; earlier ones that were not used open nothing any more."""
        async with self.turn:
            member = self._present(person)
            drafts = [
                h.draft(e.LINK_WITHDRAWN, author, e.LinkWithdrawn(each.id))
                for each in member.links
                if each.used_at is None and each.withdrawn_at is None
            ]
            made = h.draft(e.LINKED, author, _link_for(person, hours))
            await self._append([*drafts, made])
            await self._read(person)
        return self.get(person)

    async def end(self, person: str, by: PersonRef) -> Member:
        """End a person: all sessions, tokens and links, everywhere, at once and for good. Raise
        NotFound; raise Unavailable if neither log nor folder could store that."""
        member = self._one(person)
        if person == by.id:
            raise Conflict("You cannot end yourself: another owner can, or sign out.")
        unwritten: Unavailable | None = None
        try:
            await asyncio.to_thread(self._revoked.end_person, person)
        except Unavailable as error:
            unwritten = error
        if self._one(person).ended_at is None:
            await self._ended(member, by)
        log.info("the person %s was ended", person)
        if unwritten is not None and self._one(person).unrecorded:
            raise unwritten
        return self.get(person)

    async def make_group(self, name: str, author: str) -> Group:
        """Make a group. Raise BadInput, Conflict or Unavailable."""
        async with self.turn:
            if len(self._groups) >= _MOST_GROUPS:
                raise Conflict(f"There are {_MOST_GROUPS} groups already.")
            group = Group(random_id(), self._group_name(name))
            await self._append([h.draft(e.GROUP_MADE, author, e.GroupState(group.id, group.name))])
            self._groups[group.id] = group
            await asyncio.to_thread(_try, self._write_groups)
        return group

    async def rename_group(self, group: str, name: str, author: str) -> Group:
        """Rename a group. Raise BadInput, Conflict, NotFound or Unavailable."""
        async with self.turn:
            now = self._group(group)
            new = Group(group, now.name if name == now.name else self._group_name(name))
            await self._append([h.draft(e.GROUP_RENAMED, author, e.GroupState(group, new.name))])
            self._groups[group] = new
            await asyncio.to_thread(_try, self._write_groups)
        return new

    async def remove_group(self, group: str, author: str) -> None:
        """Remove a group, also from all its persons. Raise NotFound or Unavailable."""
        async with self.turn:
            self._group(group)
            left = {
                each.id: tuple(other for other in each.groups if other != group)
                for each in self._members.values()
                if group in each.groups
            }
            changes = [
                h.draft(
                    e.CHANGED,
                    author,
                    _state(
                        replace(self._members[person], groups=groups), self._records.get(person)
                    ),
                )
                for person, groups in left.items()
            ]
            gone = h.draft(e.GROUP_REMOVED, author, e.GroupRemoved(group))
            await self._append([*changes, gone])
            del self._groups[group]
            for person, groups in left.items():  # who may have been ended, or come in, meanwhile
                self._members[person] = replace(self._members[person], groups=groups)
            for person in left:
                await self._write(person)
            await asyncio.to_thread(_try, self._write_groups)

    async def look(self, proof: str) -> Invited | None:
        """Return the role and the name that a personal link gives; None if `proof` belongs to no
        personal link. Raise Unauthenticated or Withdrawn if the link is no longer valid."""
        link, _, secret = proof.partition(".")
        expected = self._keys.secret_of(link)
        if not hmac.compare_digest(secret.encode(errors="replace"), expected.encode()):
            return None
        path = self._offline / f"{link}.json"
        if link not in self._owner_of and await asyncio.to_thread(path.is_file):
            await self._take_over(path)
        if link not in self._owner_of:
            return None
        member, found = self._usable(link)
        by = self._people.inviter(found.made_by.id)
        return Invited(link, member.role, by, member.name)

    async def come_in(self, link: str, session: str, browser: str, address: str) -> PersonFile:
        """Use a personal link for the session with this id, and return its person. Of several who use
        it at once, one comes in. Raise Unauthenticated or Withdrawn for the others, Unavailable if the
        log cannot be written."""
        member, _ = self._usable(link)
        self._set_link(link, datetime.now(UTC), browser, address)
        try:
            used = e.LinkUsed(link, browser, address)
            with acting_for(member.id, Origin(member.name, session, address=address)):
                await self._append([h.draft(e.LINK_USED, member.id, used)])
        except Unavailable:
            self._set_link(link, None)  # nobody came in by it
            raise
        if await self._first_use(link) != session:  # another editor let somebody in meanwhile
            await self._read(member.id)
            raise Unauthenticated(_USED)
        # A backup that is restored later does not know of this use; the mark stays.
        await asyncio.to_thread(_try, lambda: self._revoked.add(link))
        return _file_of(self._one(member.id))

    async def _first_use(self, link: str) -> str:
        """Return the session that the log lets in by a link: the first one."""
        event = editor_tables.editor_event.c
        uses = select(event.body).where(event.stream == h.PEOPLE, event.kind == e.LINK_USED)
        for row in await self._journal.query(uses.order_by(event.seq)):
            if msgspec.json.decode(row.body, type=e.LinkUsed).id == link:
                origin = origin_in(row.body)
                return "" if origin is None else origin.session
        return ""

    async def device_added(self, person: str, session: str, browser: str, address: str) -> None:
        """Store in the log that a person has added a device. Raise Unavailable if that fails."""
        body = e.DeviceAdded(session, browser, address)
        await self._append([h.draft(e.DEVICE_ADDED, person, body)])

    def _usable(self, link: str) -> tuple[Member, PersonalLink]:
        """Return a link that lets in now, and its person."""
        member = self._one(self._owner_of[link])
        found = next(each for each in member.links if each.id == link)
        if member.ended_at is not None or self._revoked.person_ended(member.id):
            raise Withdrawn("Your access was ended by an owner. Ask for a new link.")
        if found.used_at is not None or self._revoked.holds(link):
            raise Unauthenticated(_USED)
        if found.withdrawn_at is not None:
            raise Withdrawn("This link was replaced by a newer one. Ask for that.")
        if datetime.now(UTC) >= found.expires_at:
            raise Unauthenticated("This link has expired. Ask for a new one.")
        return member, found

    async def _take_over(self, path: Path) -> None:
        """Store a link of the command line in the log, and its person if they are new there."""
        async with self.turn:
            try:
                offline = await asyncio.to_thread(offline_in, path)
            except (OSError, private_files.DamagedFile) as error:
                private_files.log_unreadable(path, error)
                return
            person = offline.person
            if offline.id not in self._owner_of:
                until = None if person.until is None else int(person.until * 1e6)
                provider = self._records.get(person.id)
                state = e.MemberState(
                    person.id, person.name, person.role, person.groups, until, provider
                )
                kind = e.CHANGED if person.id in self._members else e.ADDED
                made = e.LinkMade(offline.id, person.id, int(offline.expires * 1e6))
                drafts = [h.draft(kind, h.SERVER, state), h.draft(e.LINKED, h.SERVER, made)]
                await self._append(drafts)
                await self._read(person.id)
                await self._write(person.id)
            await asyncio.to_thread(path.unlink, missing_ok=True)

    async def _ended(self, member: Member, by: PersonRef) -> None:
        """Make a person's end known here, and store it in the log now or later."""
        self._members[member.id] = replace(
            self._members[member.id], ended_at=datetime.now(UTC), ended_by=by, unrecorded=True
        )

        async def store() -> None:
            if by.name:
                await self._people.seen(by)
            await self._append([h.draft(e.ENDED, by.id, e.MemberEnded(member.id))])
            self._members[member.id] = replace(self._members[member.id], unrecorded=False)
            await asyncio.to_thread(_try, self._revoked.write_again)

        await self._late.add(store)

    def _one(self, person: str) -> Member:
        if person not in self._members:
            raise NotFound(f"There is no person {person!r} with a personal link.")
        return self._members[person]

    def _present(self, person: str) -> Member:
        member = self._one(person)
        if member.ended_at is not None:
            raise Conflict(f"{member.name} was ended. Add them anew.")
        return member

    def _group(self, group: str) -> Group:
        if group not in self._groups:
            raise NotFound(f"There is no group {group!r}.")
        return self._groups[group]

    def _name(self, text: str) -> str:
        name = " ".join(text.split())
        if not 0 < len(name) <= NAME_LIMIT:
            raise BadInput(f"A name has 1 to {NAME_LIMIT} characters.", where={"path": "/name"})
        if not is_name(name):
            raise BadInput("A name has no control characters.", where={"path": "/name"})
        return name

    def _group_name(self, text: str) -> str:
        name = self._name(text)
        if any(each.name.casefold() == name.casefold() for each in self._groups.values()):
            raise Conflict(f"There is a group {name!r} already.")
        return name

    def _refuse_twice(self, name: str) -> None:
        if self.has_name(name, but=""):
            raise Conflict(f"There is a person {name!r} already: make a new link for them.")

    def _known(self, groups: tuple[str, ...]) -> tuple[str, ...]:
        for each in groups:
            if each not in self._groups:
                raise BadInput(f"There is no group {each!r}.", where={"path": "/groups"})
        return tuple(dict.fromkeys(groups))

    def _set_link(
        self, link: str, used_at: datetime | None, browser: str = "", address: str = ""
    ) -> None:
        """Set when and by which browser a link was used; None: it was not."""
        member = self._members[self._owner_of[link]]
        links = tuple(
            replace(each, used_at=used_at, browser=browser, address=address)
            if each.id == link
            else each
            for each in member.links
        )
        self._members[member.id] = replace(member, links=links)

    async def _append(self, drafts: list[Draft]) -> None:
        await self._journal.append(h.PEOPLE, drafts)

    async def _write(self, person: str) -> None:
        """Write the file of a person. If that fails, it holds in this process, and is written again
        at its next start."""
        file = _file_of(self._members[person])
        await asyncio.to_thread(_try, lambda: self._files.write(file))

    def _offline_links(self) -> list[Path]:
        return sorted(self._offline.glob("*.json"))

    def _write_groups(self) -> None:
        self._files.write_groups({each.id: each.name for each in self._groups.values()})

    async def _read(self, person: str | None = None) -> None:
        """Read one person from the tables into memory; without an id all persons and groups. An end
        or a use of a link that is not in the log yet stays."""
        table, links = editor_tables.member, editor_tables.personal_link
        members, made = select(table), select(links).order_by(links.c.made_at.desc())
        if person is not None:
            members, made = (
                members.where(table.c.id == person),
                made.where(links.c.person == person),
            )
        else:
            groups = await self._journal.query(select(editor_tables.people_group))
            self._groups = {row.id: Group(row.id, row.name) for row in groups}
        theirs: dict[str, list[PersonalLink]] = {}
        for row in await self._journal.query(made):
            self._owner_of[row.id] = row.person
            theirs.setdefault(row.person, []).append(
                PersonalLink(
                    id=row.id,
                    made_at=h.when(row.made_at),
                    made_by=PersonRef(row.made_by, ""),
                    expires_at=h.when(row.expires),
                    used_at=_time(row.used_at),
                    browser=row.browser or "",
                    address=row.address or "",
                    withdrawn_at=_time(row.withdrawn_at),
                )
            )
        for row in await self._journal.query(members):
            over = row.ended_at is not None
            stored = Member(
                id=row.id,
                name=row.name,
                role=row.role,
                groups=msgspec.json.decode(row.groups, type=tuple[str, ...]),
                made_at=h.when(row.made_at),
                made_by=PersonRef(row.made_by, ""),
                until=_time(row.until),
                ended_at=_time(row.ended_at),
                ended_by=PersonRef(row.ended_by, "") if over else None,
                links=tuple(theirs.get(row.id, ())),
            )
            if row.provider is not None:
                self._records[row.id] = msgspec.json.decode(row.provider, type=e.ProviderRecord)
            self._members[row.id] = _with_news(stored, self._members.get(row.id))

    def _view(self, member: Member, *, with_links: bool) -> Member:
        record = self._records.get(member.id)
        return replace(
            member,
            provider=None if record is None else ByProvider(record.issuer, record.role),
            made_by=self._people.person(member.made_by.id),
            ended_by=None if member.ended_by is None else self._people.person(member.ended_by.id),
            links=tuple(map(self._shown, member.links)) if with_links else (),
        )

    def _shown(self, link: PersonalLink) -> PersonalLink:
        try:
            self._usable(link.id)
        except Unauthenticated:
            path = None
        else:
            path = f"/#i={link.id}.{self._keys.secret_of(link.id)}"
        return replace(link, made_by=self._people.person(link.made_by.id), path=path)


def _with_news(stored: Member, known: Member | None) -> Member:
    """Return a person as stored, with what is known of them here and not stored yet: their end, and
    the uses of links."""
    if known is None:
        return stored
    used = {each.id: each for each in known.links if each.used_at is not None}
    links = tuple(
        each
        if each.used_at is not None or (use := used.get(each.id)) is None
        else replace(each, used_at=use.used_at, browser=use.browser, address=use.address)
        for each in stored.links
    )
    if stored.ended_at is not None or known.ended_at is None:
        return replace(stored, links=links)
    return replace(
        stored,
        links=links,
        ended_at=known.ended_at,
        ended_by=known.ended_by,
        unrecorded=known.unrecorded,
    )


def _link_for(person: str, hours: float) -> e.LinkMade:
    if not 0 < hours <= MOST_HOURS:
        raise BadInput(
            f"A link is valid for up to {MOST_HOURS:.0f} hours.", where={"path": "/hours"}
        )
    expires = datetime.now(UTC) + timedelta(hours=hours)
    return e.LinkMade(random_id(), person, int(expires.timestamp() * 1e6))


def _file_of(member: Member) -> PersonFile:
    until = None if member.until is None else member.until.timestamp()
    return PersonFile(member.id, member.name, member.role, member.groups, until)


def _state(member: Member, provider: e.ProviderRecord | None) -> e.MemberState:
    until = _us(member.until)
    return e.MemberState(member.id, member.name, member.role, member.groups, until, provider)


def _lowered(record: e.ProviderRecord, role: Role, now: Role) -> e.ProviderRecord:
    """Return the record of a person to whom an owner gives a role. Raise Conflict if the groups of the
    provider give less."""
    if rank(role) > rank(record.role) and role != now:
        raise Conflict(
            f"The groups of {record.issuer} make this person {record.role}: give a higher role there."
        )
    return replace(record, lowered=role if rank(role) < rank(record.role) else None)


def _later(until: datetime | None) -> datetime | None:
    if until is not None:
        sent_us(until, "/until")
    return until


def _us(at: datetime | None) -> int | None:
    return None if at is None else int(at.timestamp() * 1e6)


def _time(us: int | None) -> datetime | None:
    return None if us is None else h.when(us)


def _try(write: Callable[[], None]) -> None:
    """Write something that the log has already. A failure is logged: it holds here meanwhile."""
    try:
        write()
    except Unavailable as error:
        log.error("%s", error.detail)
