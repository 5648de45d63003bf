"""Pages of the list of graphs are sorted, searched and counted in the database, by what a person may see."""

import asyncio
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any, Final

import httpx
import msgspec
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from action_assistant.editor.catalogue import graph_facts, graph_pages, server_edits
from action_assistant.editor.catalogue.catalogue import Catalogue
from action_assistant.editor.catalogue.folders import Folders
from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.graph_facts import name_key
from action_assistant.editor.catalogue.graph_pages import GraphPages, LabelCount, Order, Wanted
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.catalogue.graph_rights import GraphRights
from action_assistant.editor.crdt import messages
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import NotFound
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal
from action_assistant.web.auth.caller import Caller, set_caller
from action_assistant.web.auth.graph_rules import Rule
from action_assistant.web.auth.graph_seals import RulesFile
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Person
from action_assistant.web.workers.lanes import run_here
from editor.api.test_api import NAV
from editor.client import Client

ANN: Final = Identity(Person("ann", "Ann", "owner"))
BEN: Final = Identity(Person("ben", "Ben", "editor"))
MINE: Final = Rule(("ann",), ())
ORDERS: Final[tuple[Order, ...]] = ("changed", "name", "problems", "size")


class Opened:
    """The parts of an editor that know graphs, on a database; work is done in this process."""

    def __init__(self, journal: Journal, rooms: Rooms, data: Path) -> None:
        keys = Keys("t" * 40)
        self.journal = journal
        self.rooms = rooms
        self.documents = 0  # that were read
        self.reader = GraphReader(journal, rooms, self._counted)
        self.rights = GraphRights(journal, rooms, RulesFile(data, keys), keys)
        self.checks = GraphChecks(journal, rooms, self.reader, self.rights.caller_sees)
        self.catalogue = Catalogue(journal, rooms, self.reader, self.checks)
        self.folders = Folders(journal, self.rights)
        self.pages = GraphPages(journal, rooms, self.checks, self.rights, self.catalogue)

    async def _counted(self, work: Any, /, *values: Any) -> Any:
        self.documents += 1
        return await run_here(work, *values)


class Database(msgspec.Struct, frozen=True):
    """A database of an editor, empty at first, and the data folder beside it."""

    url: str
    data: Path

    @asynccontextmanager
    async def opened(self) -> AsyncIterator[Opened]:
        """Start on the database, as after a restart."""
        journal = await Journal.open(self.url, branch="editor", fold=h.fold)
        rooms = Rooms(journal, linger=60, window=0)
        opened = Opened(journal, rooms, self.data)
        await opened.rights.refresh()
        async with opened.checks.kept_up():
            yield opened
        await rooms.close()
        await journal.close()


@pytest.fixture(params=["sqlite", "postgres"])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Database:
    if request.param == "postgres":
        return Database(request.getfixturevalue("postgres").new_database(), tmp_path)
    return Database(f"sqlite:///{tmp_path / 'editor.db'}", tmp_path)


@pytest.fixture
async def services(database: Database) -> AsyncIterator[Opened]:
    async with database.opened() as opened:
        yield opened


async def bring(services: Opened, name: str, **more: Any) -> str:
    """Make a graph, and return its id."""
    body = {**NAV, "graph_name": name, "graph_description": "", **more}
    made, _ = await services.catalogue.bring(json.dumps(body).encode(), "ann")
    return made.id


async def found(
    services: Opened, identity: Identity = ANN, *, limit: int = 200, **wanted: Any
) -> list[str]:
    """Return the names of the graphs on the first page."""
    page = await services.pages.page(identity, Wanted(**wanted), limit=limit)
    assert page.total == len(page.graphs) or limit < page.total
    return [view.name for view in page.graphs]


async def test_a_person_who_sees_less_changes_no_order_for_those_who_see_everything(
    services: Opened,
) -> None:
    def of(action: str, *, exits: bool) -> dict[str, Any]:
        end = [{"name": action, "instance_id": 0}]
        actions = [{**end[0], "type": "sync"}]
        return {"actions": actions, "graph_entry": end, "graph_exit": end if exits else []}

    async def bens() -> list[int | None]:
        set_caller(Caller("ben", identity=BEN))
        page = await services.pages.page(BEN, Wanted(), limit=9)
        return [view.problems and view.problems.error for view in page.graphs]

    inner = await bring(services, "Inner", **of("Step", exits=False))
    outer = await bring(services, "Outer", **of("Inner", exits=True))
    sound = await bring(services, "Sound", **of("Other", exits=True))
    await services.rights.rule_for_graph(inner, MINE, "ann")
    for description in ("", "later"):
        if description:
            for graph in (outer, sound):
                async with services.rooms.enter(h.graph_stream(graph)) as room:
                    await server_edits.rename(room, "ben", name=None, description=description)
        assert await asyncio.create_task(bens()) == [0, 0]
        page = await services.pages.page(ANN, Wanted(), limit=2, order="problems")
        assert {view.name for view in page.graphs} == {"Inner", "Outer"}
        last = services.checks.last_summary(outer, page.graphs[0].seq)
        assert last.problems is not None
        assert last.problems.error == 1
        assert await asyncio.create_task(bens()) == [0, 0]
        last = services.checks.last_summary(outer, page.graphs[0].seq)
        assert last.problems is not None
        assert last.problems.error == 1


@pytest.mark.parametrize("order", ORDERS)
async def test_the_pages_together_are_the_list_each_graph_once(
    services: Opened, order: Order
) -> None:
    for number in range(7):
        await bring(services, f"graph {number}", actions=NAV["actions"][: number % 3])
    whole = await services.catalogue.all()
    pages = [
        await services.pages.page(ANN, Wanted(), limit=3, offset=offset, order=order)
        for offset in (0, 3, 6)
    ]
    assert [page.total for page in pages] == [7] * 3
    listed = [view for page in pages for view in page.graphs]
    assert {view.id: view for view in listed} == {view.id: view for view in whole}
    assert len(listed) == 7
    if order == "changed":
        assert listed == whole
    if order == "size":
        assert [view.actions for view in listed] == [2, 2, 1, 1, 0, 0, 0]
    if order == "problems":
        told = [(view.wrong, view.to_fill_in) for view in listed]
        assert told == sorted(told, reverse=True)


async def test_named_graphs_come_first_in_their_order(services: Opened) -> None:
    made = [await bring(services, name) for name in "abcd"]
    page = await services.pages.page(ANN, Wanted(), limit=3, first=[made[1], "unknown", made[0]])
    assert [view.name for view in page.graphs] == ["b", "a", "d"]


async def test_every_word_stands_somewhere_in_what_is_searched(services: Opened) -> None:
    action = {**NAV["actions"][0], "actor": "Robot_7"}
    labels = {"labels": ["Nacht"]}
    await bring(services, "ÜBER the 100% line", graph_description="Slow", actions=[action])
    await bring(services, "other", gui_attributes=labels)
    for search in ("über", "LINE slow", "robot_7", "100%", "  the\tÜber "):
        assert await found(services, search=search) == ["ÜBER the 100% line"], search
    assert await found(services, search="nacht") == ["other"]
    for search in ("robotx7", "1000", "line other", "\\", "'", "\0x", "no_"):
        assert await found(services, search=search) == [], search
    assert len(await found(services, search="\0 ")) == 2


async def test_who_is_in_a_graph_is_found(services: Opened) -> None:
    await bring(services, "empty")
    made = await bring(services, "visited")
    async with services.rooms.enter(h.graph_stream(made)) as room:
        client = Client("mari")
        client.join(room)
        client.deliver(messages.presence([messages.PresenceEntry(1, 1, b"{}")]))
        await asyncio.sleep(0)
        assert await found(services, search="Mari visit") == ["visited"]
        client.leave()
    assert await found(services, search="mari") == []


async def test_a_change_is_found_and_sorted_at_once(services: Opened) -> None:
    made = await bring(services, "first")
    await bring(services, "second")
    assert await found(services) == ["second", "first"]
    await services.catalogue.describe(made, "ann", name="renamed", description=None)
    assert await found(services) == ["renamed", "second"]
    assert await found(services, search="renamed") == ["renamed"]
    assert await found(services, search="first") == []
    await services.catalogue.delete(made, "ann")
    assert await found(services) == ["second"]
    await services.catalogue.recover(made, "ann")
    assert sorted(await found(services)) == ["renamed", "second"]


async def test_folders_and_labels_limit_the_list(services: Opened) -> None:
    outer = await services.folders.make("outer", None, "ann")
    inner = await services.folders.make("inner", outer.id, "ann")
    for name, folder in {"top": None, "out": outer.id, "in": inner.id}.items():
        made = await bring(services, name, gui_attributes={"labels": [name, "all"]})
        if folder is not None:
            await services.folders.file(made, folder, "ann")
    assert await found(services, folder="") == ["top"]
    assert await found(services, folder=outer.id) == ["out"]
    assert sorted(await found(services, folder=outer.id, deep=True)) == ["in", "out"]
    assert len(await found(services, folder="", deep=True)) == 3
    assert await found(services, folder=outer.id, deep=True, label="in") == ["in"]
    labels = await services.pages.labels(ANN, Wanted(folder=outer.id, deep=True))
    assert labels == (LabelCount("all", 2), LabelCount("in", 1), LabelCount("out", 1))
    with pytest.raises(NotFound):
        await found(services, folder="unknown")


async def test_nothing_tells_of_a_graph_out_of_sight(services: Opened) -> None:
    secret = await services.folders.make("secret", None, "ann")
    shared = await services.folders.make("shared", secret.id, "ann")
    places = {"open": None, "hidden": None, "in secret": secret.id, "in shared": shared.id}
    made = {name: await bring(services, name, gui_attributes={"labels": [name]}) for name in places}
    for name, folder in places.items():
        if folder is not None:
            await services.folders.file(made[name], folder, "ann")
    await services.rights.rule_for_graph(made["hidden"], MINE, "ann")
    await services.rights.rule_for_folder(secret.id, MINE, "ann")
    await services.rights.rule_for_folder(shared.id, Rule("all", ()), "ann")
    pages = services.pages

    assert sorted(await found(services)) == sorted(places)
    seen = {"open", "in shared"}
    assert set(await found(services, BEN)) == seen
    assert {each.name for each in await pages.names(BEN)} == seen
    assert {each.label for each in await pages.labels(BEN, Wanted())} == seen
    assert await found(services, BEN, search="hidden") == []
    assert await found(services, BEN, label="in secret") == []
    page = await pages.page(BEN, Wanted(), limit=1, first=[made["hidden"]])
    assert page.total == 2
    assert page.graphs[0].name in seen
    with pytest.raises(NotFound):
        await found(services, BEN, folder=secret.id, deep=True)
    # A folder whose outer one is out of sight is shown as in none.
    assert await found(services, BEN, folder=shared.id) == ["in shared"]
    assert len(await found(services, BEN, folder="", deep=True)) == 2
    restricted = {
        view.name: view.restricted for view in (await pages.page(ANN, Wanted(), limit=9)).graphs
    }
    assert restricted == {"open": False, "hidden": True, "in secret": True, "in shared": True}
    await services.rights.rule_for_graph(made["hidden"], Rule(("ben",), ()), "ann")
    assert set(await found(services, BEN)) == {*seen, "hidden"}


async def test_facts_of_another_version_are_searched_until_they_are_computed_again(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with database.opened() as services:
        for name in ("b", "a"):
            await bring(services, name, gui_attributes={"labels": [name]})
        before = await services.pages.page(ANN, Wanted(), limit=9)
    monkeypatch.setattr(graph_facts, "form", lambda: b"another")
    monkeypatch.setattr(graph_pages, "_READ", 1)
    async with database.opened() as services:
        assert await found(services, label="a") == ["a"]
        await services.checks.computed()
        assert await services.pages.page(ANN, Wanted(), limit=9) == before


async def test_a_list_without_stored_facts_is_whole_at_once(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with database.opened() as services:
        for name in ("b", "a"):
            await bring(services, name)
        before = [view.name for view in await services.catalogue.all()]
        await services.checks.facts.write()
        await services.journal.derive(
            lambda connection: connection.execute(graph_facts.graph_facts.delete())
        )
    monkeypatch.setattr(graph_pages, "_READ", 0)
    async with database.opened() as services:
        assert await found(services, search="") == before == ["a", "b"]
        assert await found(services, search="b") == ["b"]


class Reading:
    """Counts statements, and the rows that they answer."""

    def __init__(self) -> None:
        self.statements = self.rows = 0


@contextmanager
def reading(monkeypatch: pytest.MonkeyPatch) -> Iterator[Reading]:
    """Count what is read of journals meanwhile."""
    count = Reading()
    query = Journal.query

    async def watched(self: Journal, *arguments: Any) -> Any:
        rows = await query(self, *arguments)
        count.statements += 1
        count.rows += len(rows)
        return rows

    with monkeypatch.context() as patch:
        patch.setattr(Journal, "query", watched)
        yield count


async def seed(services: Opened, graphs: int) -> None:
    """Make graphs through the journal, whose documents and facts are those of one graph."""
    made = await bring(services, "pattern")
    facts = services.checks.facts.get(made)
    assert facts is not None
    (update,) = await services.journal.read(h.graph_stream(made))
    about = h.draft(h.CREATED, "ann", h.GraphCreated("pattern", ""))
    for start in range(0, graphs, 100):
        ids = [f"seeded{number:06}" for number in range(start, min(graphs, start + 100))]
        await services.journal.append_all(
            [
                addition
                for each in ids
                for addition in (
                    Addition(h.about_stream(each), (about,)),
                    Addition(h.graph_stream(each), (Draft(h.UPDATED, "ann", update.body),)),
                )
            ]
        )
        for each in ids:
            services.checks.facts.put(each, facts)
    await services.checks.facts.write()


PAGES: Final = (
    {},
    {"order": "name"},
    {"order": "problems"},
    {"order": "size"},
    {"wanted": Wanted(search="pattern nav")},
    {"wanted": Wanted(label="none")},
)


async def read_by_pages(
    database: Database, graphs: int, monkeypatch: pytest.MonkeyPatch
) -> list[tuple[int, int, int]]:
    """Return what each page reads after a restart with so many graphs: statements, rows, documents."""
    async with database.opened() as services:
        await seed(services, graphs)
    async with database.opened() as services:
        await services.checks.names.refresh()
        counts = []
        for asked in PAGES:
            with reading(monkeypatch) as count:
                page = await services.pages.page(ANN, **{"wanted": Wanted(), "limit": 20, **asked})
            assert page.total in {0, graphs + 1}
            counts.append((count.statements, count.rows, services.documents))
        return counts


async def test_a_page_reads_no_more_of_many_graphs_than_of_fifty(
    database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts = await read_by_pages(database, 200, monkeypatch)
    for statements, rows, documents in counts:
        assert statements <= 8
        assert rows <= 20 * 4
        assert documents == 0


@pytest.mark.long
async def test_a_page_of_ten_thousand_graphs_reads_what_one_of_fifty_reads(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    for statements, rows, documents in await read_by_pages(database, 10_000, monkeypatch):
        assert (statements <= 8, rows <= 80, documents) == (True, True, 0)


@given(st.text(max_size=10), st.text(max_size=10))
@example("graph 9", "graph 10")
def test_names_are_sorted_without_regard_to_case(one: str, other: str) -> None:
    assert name_key(one.upper().lower()) == name_key(one.lower().upper().lower())
    assert (name_key(one) == name_key(other)) or one != other


def test_numbers_in_names_are_sorted_by_size_and_accents_do_not_matter() -> None:
    names = ["arm 2", "Arm 10", "Ärm 010b", "b 1", "Z"]
    assert sorted(set(names), key=name_key) == names


def test_the_routes_answer_pages_names_and_labels(http: httpx.Client) -> None:
    label = "of the routes"
    made = [
        http.post(
            "/api/graphs",
            json={**NAV, "graph_name": f"paged {n}", "gui_attributes": {"labels": [label]}},
        ).json()
        for n in range(3)
    ]
    query = {"q": "paged", "label": label, "limit": 2, "sort": "name", "folder": ""}
    answer = http.get("/api/graphs", params=query)
    assert answer.headers["x-total"] == "3"
    assert [each["name"] for each in answer.json()] == ["paged 0", "paged 1"]
    last = http.get("/api/graphs", params={**query, "offset": 2}).json()
    assert [each["id"] for each in last] == [made[2]["id"]]
    whole = {each["id"]: each for each in http.get("/api/graphs").json()}
    assert whole[made[2]["id"]] == last[0]
    names = {each["id"]: each["name"] for each in http.get("/api/graphs/names").json()}
    assert names == {graph: each["name"] for graph, each in whole.items()}
    labels = http.get("/api/graphs/labels", params={"folder": "", "deep": True}).json()
    assert {"label": label, "graphs": 3} in labels


@pytest.mark.parametrize(
    "query", ["q=x", "offset=1", "limit=0", "limit=201", "limit=5&deleted=true", "limit=1&sort=x"]
)
def test_a_page_that_cannot_be_is_refused(http: httpx.Client, query: str) -> None:
    assert http.get(f"/api/graphs?{query}").status_code == 400


async def thumbnails(services: Opened, identity: Identity = ANN) -> dict[str, str]:
    """Return the digests of the thumbnails of the graphs on the first page, by the ids of graphs."""
    page = await services.pages.page(identity, Wanted(), limit=200)
    return {view.id: view.thumbnail for view in page.graphs if view.thumbnail is not None}


async def test_after_a_restart_lists_have_thumbnails_and_read_no_document(
    database: Database,
) -> None:
    async with database.opened() as services:
        await bring(services, "one")
        await bring(services, "empty", actions=[])
        before = await thumbnails(services)
        assert len(before) == 1
    async with database.opened() as services:
        assert await thumbnails(services) == before
        found = await services.pages.thumbnails(ANN, before)
        assert [{each.graph: each.digest} for each in found] == [before]
        assert services.documents == 0


async def test_a_thumbnail_has_another_digest_only_if_what_it_shows_has_changed(
    services: Opened,
) -> None:
    graph = await bring(services, "one")
    before = await thumbnails(services)
    await services.catalogue.describe(graph, "ann", name="two", description="another")
    assert await thumbnails(services) == before
    await services.catalogue.call_uses([graph], NAV["actions"][0]["name"], "Goes elsewhere", "ann")
    after = await thumbnails(services)
    assert after[graph] != before[graph]
    assert await services.pages.thumbnails(ANN, before) == ()
    assert len(await services.pages.thumbnails(ANN, after)) == 1


async def test_nobody_gets_the_thumbnail_of_a_graph_out_of_sight_by_its_digest(
    services: Opened,
) -> None:
    mine = (await services.catalogue.bring(json.dumps(NAV).encode(), "ann", rule=MINE))[0].id
    public = await bring(services, "public", actions=NAV["actions"][:1])
    await services.rights.refresh()
    digests = await thumbnails(services)
    assert set(digests) == {mine, public}
    assert set(await thumbnails(services, BEN)) == {public}
    stolen = {mine: digests[mine], public: digests[mine]}
    assert await services.pages.thumbnails(BEN, stolen) == ()
    found = await services.pages.thumbnails(BEN, digests)
    assert [each.graph for each in found] == [public]


def test_only_a_complete_answer_with_thumbnails_may_be_kept(http: httpx.Client) -> None:
    graph = http.post("/api/graphs", json=NAV).json()["id"]
    digest = http.get("/api/graphs", params={"limit": 9}).json()[0]["thumbnail"]
    right = http.get("/api/graphs/thumbnails", params={"of": f"{graph}.{digest}"})
    assert [each["graph"] for each in right.json()] == [graph]
    assert "immutable" in right.headers["cache-control"]
    assert "private" in right.headers["cache-control"]
    assert "cookie" in right.headers["vary"]
    for other in (f"{graph}.0", f"nothing.{digest}"):
        wrong = http.get("/api/graphs/thumbnails", params={"of": [f"{graph}.{digest}", other]})
        assert wrong.headers["cache-control"] == "no-store"
    assert http.get("/api/graphs/thumbnails", params={"of": digest}).status_code == 400
