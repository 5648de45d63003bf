"""Persons while several owners, guests and disks act at once, and with what owners send."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack
from datetime import datetime
from pathlib import Path

import pytest

from action_assistant.editor.log import graph_events as h
from action_assistant.editor.log import people_events as e
from action_assistant.editor.people.members import Members
from action_assistant.editor.people.people import People
from action_assistant.errors import BadInput, Unauthenticated, Withdrawn
from action_assistant.journal.journal import Journal
from action_assistant.web.auth.keys import Keys, PersonRef
from action_assistant.web.auth.people_files import PeopleFiles
from action_assistant.web.auth.revocations import Revocations

OWNER = PersonRef("local", "Olga")
KEYS = Keys("k" * 43)


class House:
    """The persons of one data folder, opened as the editor opens them."""

    def __init__(self, data: Path) -> None:
        self.data = data
        self.stack = AsyncExitStack()

    async def open(self) -> Members:
        self.journal = await Journal.open(
            f"sqlite:///{self.data / 'editor.db'}", branch="editor", fold=h.fold
        )
        self.stack.push_async_callback(self.journal.close)
        people = await People.known(self.journal)
        self.revoked, self.files = Revocations(self.data), PeopleFiles(self.data)
        members = Members(self.journal, people, KEYS, self.revoked, self.files, self.data)
        await self.stack.enter_async_context(members.opened())
        return members

    async def close(self) -> None:
        await self.stack.aclose()


@pytest.fixture
async def house(tmp_path: Path) -> AsyncIterator[House]:
    made = House(tmp_path)
    yield made
    await made.close()


@pytest.mark.parametrize(
    "until",
    ["0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-14:00", "1969-12-31T00:00:00Z"],
)
async def test_a_time_that_no_calendar_holds_is_refused(house: House, until: str) -> None:
    members = await house.open()
    when = datetime.fromisoformat(until)
    with pytest.raises(BadInput):
        await members.add("Mari", "viewer", OWNER.id, until=when)
    assert members.all(with_links=True) == []


async def test_a_stored_time_that_no_calendar_holds_does_not_keep_the_editor_from_starting(
    house: House,
) -> None:
    await house.open()
    for n, until in enumerate((-(10**18), 10**18)):
        state = e.MemberState(f"p{n}", f"Mari {n}", "viewer", (), until)
        await house.journal.append(h.PEOPLE, [h.draft(e.ADDED, OWNER.id, state)])
    await house.close()
    again = House(house.data)
    members = await again.open()
    assert [each.id for each in members.all(with_links=True)] == ["p0", "p1"]
    await again.close()


async def test_a_person_who_is_ended_meanwhile_stays_ended(house: House) -> None:
    members = await house.open()
    group = await members.make_group("lab", OWNER.id)
    made = [
        await members.add(name, "viewer", OWNER.id, groups=(group.id,)) for name in ("Ada", "Ben")
    ]
    ada, ben = (each.id for each in made)
    await asyncio.gather(members.link(ada, OWNER.id), members.end(ada, OWNER))
    await asyncio.gather(members.remove_group(group.id, OWNER.id), members.end(ben, OWNER))
    assert all(members.get(each).ended_at is not None for each in (ada, ben))
    assert members.get(ben).groups == ()


async def test_a_link_that_is_used_meanwhile_stays_used(
    house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    members = await house.open()
    monkeypatch.setattr(house.revoked, "add", lambda link: None)  # as on a full disk
    group = await members.make_group("lab", OWNER.id)
    made = await members.add("Ada", "viewer", OWNER.id, groups=(group.id,))
    link = made.links[0].id
    await asyncio.gather(
        members.remove_group(group.id, OWNER.id), members.come_in(link, "s1", "Firefox", "")
    )
    with pytest.raises((Unauthenticated, Withdrawn)):
        await members.come_in(link, "s1", "Firefox", "")


@pytest.mark.parametrize("name", ["\0", "a\x1b[31m", "a\u202eb", "\u200b"])
async def test_a_name_that_steers_is_refused(house: House, name: str) -> None:
    members = await house.open()
    with pytest.raises(BadInput):
        await members.add(name, "viewer", OWNER.id)
    with pytest.raises(BadInput):
        await members.make_group(name, OWNER.id)
