"""Pages of the audit: every fact once, newest first, whatever the filter and the size of a page."""

import asyncio
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.editor.log import graph_events as h
from action_assistant.editor.log import people_events as e
from action_assistant.editor.people import audit_facts
from action_assistant.journal.databases import ask_once
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.web.audit import rows
from action_assistant.web.audit.events import (
    STREAM,
    EditingBegan,
    SessionEnded,
    SignedIn,
    draft_of,
    stream_at,
)
from action_assistant.web.audit.rows import AuditFilter, AuditPage, AuditRow
from action_assistant.web.auth.caller import Origin, acting_for
from action_assistant.web.auth.keys import PersonRef

PEOPLE = ("ada", "ben", "eve")
#: What a person did: 0 an edit, 1 a sitting, 2 a deletion, 3 an end of a session, 4 a newer kind.
DEEDS = st.lists(st.tuples(st.sampled_from(PEOPLE), st.integers(0, 4)), max_size=40)


async def filled(folder: Path, deeds: list[tuple[str, int]]) -> str:
    url = f"sqlite:///{folder / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    await journal.append(
        h.about_stream("g"), [h.draft(h.CREATED, h.EXAMPLES, h.GraphCreated("Pick", ""))]
    )
    for who, deed in deeds:
        with acting_for(who, Origin(who.title(), f"s-{who}", address="10.0.0.7")):
            match deed:
                case 0:
                    await journal.append(h.graph_stream("g"), [Draft(h.UPDATED, who, b"\0")])
                case 1:
                    await journal.append(STREAM, [draft_of(EditingBegan("g", 3), who)])
                case 2:
                    await journal.append(h.about_stream("g"), [h.draft(h.DELETED, who)])
                case 3:
                    await journal.append(STREAM, [draft_of(SessionEnded("s", own=True), who)])
                case _:
                    body = h.PersonNamed("x")
                    await journal.append("later", [h.draft("thing.happened.v7", who, body)])
    await journal.close()
    return url


def page(url: str, wanted: AuditFilter) -> AuditPage:
    return ask_once(url, lambda connection: audit_facts.page(wanted, connection))


async def everything(url: str, wanted: AuditFilter) -> list[AuditRow]:
    return await asyncio.to_thread(_everything, url, wanted)


def _everything(url: str, wanted: AuditFilter) -> list[AuditRow]:
    found: list[AuditRow] = []
    while True:
        now = page(url, wanted)
        found += now.rows
        if now.before is None:
            return found
        assert wanted.before is None or now.before < wanted.before
        wanted = msgspec.structs.replace(wanted, before=now.before)


@settings(max_examples=25, deadline=None)
@given(DEEDS, st.integers(1, 7), st.sampled_from((2, 5, 50)))
async def test_pages_hold_every_fact_once(
    tmp_path_factory: pytest.TempPathFactory, deeds: list[tuple[str, int]], limit: int, most: int
) -> None:
    url = await filled(tmp_path_factory.mktemp("log"), deeds)
    told = [deed for deed in deeds if deed[1] != 0][::-1]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rows, "_MOST", most)
        patch.setattr(rows, "_SLICE", 3)
        found = await everything(url, AuditFilter(limit=limit))
    assert [each.person.id for each in found if each.person is not None] == [d[0] for d in told]
    positions = [each.position for each in found]
    assert positions == sorted(set(positions), reverse=True)
    for each in found:
        assert each.origin is not None
        assert (each.origin.session, each.origin.address) == (f"s-{each.person.id}", "10.0.0.7")  # type: ignore[union-attr]
    kinds = {1: "edits", 2: "graphs", 3: "sessions", 4: "other"}
    assert [each.kind for each in found] == [kinds[deed] for _, deed in told]


async def test_filters_choose_by_person_kind_graph_words_and_time(tmp_path: Path) -> None:
    deeds = [("ada", 1), ("ben", 2), ("ada", 3), ("eve", 4), ("ada", 0)]
    url = await filled(tmp_path, deeds)
    every = await everything(url, AuditFilter())

    async def chosen(**filters: object) -> list[str]:
        found = await everything(url, AuditFilter(**filters))  # type: ignore[arg-type]
        return [each.event for each in found]

    assert [each.event for each in every] == [
        "thing.happened.v7",
        SessionEnded.kind,
        h.DELETED,
        EditingBegan.kind,
    ]
    assert await chosen(person="ada") == [SessionEnded.kind, EditingBegan.kind]
    assert await chosen(kinds=("graphs", "edits")) == [h.DELETED, EditingBegan.kind]
    assert await chosen(graph="g") == await chosen(graph="Pick") == [h.DELETED, EditingBegan.kind]
    assert await chosen(text="BEN deleted") == [h.DELETED]
    assert await chosen(text="10.0.0.7 edited") == [EditingBegan.kind]
    assert await chosen(robot="Carrier") == []
    middle = round(every[2].at.timestamp() * 1e6)
    assert await chosen(since=middle) == [each.event for each in every[:3]]
    assert await chosen(until=middle) == [EditingBegan.kind]


async def test_an_event_of_before_is_shown_as_not_recorded(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    await journal.append(h.about_stream("g"), [Draft(h.DELETED, "ada", b"")])
    await journal.append(h.about_stream("g"), [Draft(h.RECOVERED, "ada", b"\xff{")])
    await journal.close()
    broken, old = await everything(url, AuditFilter())
    assert (old.event, old.origin) == (h.DELETED, None)
    assert broken.text.endswith("(it cannot be read)")


async def test_a_person_who_has_only_come_in_is_called_by_the_name_of_the_link(
    tmp_path: Path,
) -> None:
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    added = e.MemberState("p1", "Ben of the lab", "operator")
    for kind, author, body in (
        (e.ADDED, "ada", added),
        (e.LINKED, "ada", e.LinkMade("l1", "p1", 1)),
        (e.LINK_USED, "p1", e.LinkUsed("l1", "Chrome on Linux", "10.0.0.7")),
    ):
        await journal.append(h.PEOPLE, [h.draft(kind, author, body)])
    await journal.close()
    used, linked, _ = await everything(url, AuditFilter())
    assert linked.text == "made a personal link for Ben of the lab"
    assert used.person is not None
    assert used.person.name == "Ben of the lab"


async def test_a_person_who_has_only_signed_in_is_called_by_the_name_of_their_session(
    tmp_path: Path,
) -> None:
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    with acting_for("p1", Origin("Ann", "s1")):
        came = draft_of(SignedIn("token", "owner", "Ann", "s1", ""), "p1")
    await journal.append(stream_at(0), [came])
    await journal.close()
    (row,) = await everything(url, AuditFilter())
    assert row.person == PersonRef("p1", "Ann")
