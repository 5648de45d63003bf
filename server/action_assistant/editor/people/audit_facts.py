"""The facts of the audit in the log of the editor: its events in words."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

import msgspec
from sqlalchemy import Connection, select

from action_assistant.editor.log import graph_events as h
from action_assistant.editor.log import people_events as e
from action_assistant.editor.people.people import stored_people
from action_assistant.journal.databases import ask_from_worker
from action_assistant.journal.events import Event
from action_assistant.kit.moments import moment
from action_assistant.schema import editor_tables
from action_assistant.web.audit import events as audit
from action_assistant.web.audit.facts import described
from action_assistant.web.audit.rows import AuditFilter, AuditKind, AuditPage, Fact, audit_page
from action_assistant.web.auth.caller import Origin
from action_assistant.web.auth.graph_rules import Rule, rule_words

#: Events that are no facts about people: most of the log. A sitting of edits has an event of its own.
_NEVER: Final = (h.UPDATED, h.DEFERRED, h.IMPORTED)
_OURS: Final = frozenset({"", h.SERVER, h.EXAMPLES})


class _Body(msgspec.Struct, frozen=True):
    """The fields of bodies that stand in sentences."""

    id: str = ""
    name: str = ""
    label: str = ""
    role: str = ""
    origin: str = ""
    seq: int | None = None
    restored: int = 0
    upto: int = 0
    yes: bool = False
    note: str = ""
    kind: str = "graph"
    ended_well: bool = True
    person: str = ""
    browser: str = ""
    address: str | None = None
    rule: Rule | None = None
    until: int | None = None


#: What the events of one graph say, after the name of the person; fields of the body in braces.
_ABOUT: Final[Mapping[str, str]] = {
    h.CREATED: "made the {kind} {name}",
    h.DESCRIBED: "named the graph {name}",
    h.RESTORED: "went back to change {restored} of {graph}",
    h.REVERTED: "took back what one person had changed in {graph}",
    h.ADAPTED: "took over parameters of {name} in {graph}",
    h.DRAFTED: "made the draft {name}",
    h.MERGED: "merged the draft {name}",
    h.PROPOSED: "proposed to merge the draft {graph}",
    h.WITHDRAWN: "took back the proposal to merge {graph}",
    h.BUILT: "reported a build of {graph}",
    h.DELETED: "deleted {graph}",
    h.RECOVERED: "brought back {graph}",
    h.PUBLISHED: "published version {id} of {graph}",
    h.RELEASED: "released version {id} of {graph}",
    h.RELEASE_WITHDRAWN: "withdrew the release of version {id} of {graph}",
    "graph.filed.v1": "moved {graph} to another folder",
    h.RULED: "said who may see {graph}: {rule}",
}
_PEOPLE: Final[Mapping[str, tuple[AuditKind, str]]] = {
    h.NAMED: ("people", "goes by the name {name}"),
    h.INVITED: ("people", "made a link for the role {role}"),
    h.ACCEPTED: ("people", "came in by the link {id}"),
    h.REVOKED: ("people", "revoked the link {id}"),
    e.ADDED: ("people", "added the person {name} as {role}{ends}"),
    e.CHANGED: ("people", "set name, role and groups of {name} ({role}{ends})"),
    e.CAME: ("people", "came in by the identity provider for the first time, as {role}"),
    e.RENEWED: ("people", "got name, role and groups anew from the identity provider ({role})"),
    e.REFUSED: (
        "people",
        "was let in by no group of the identity provider, and may only stop runs",
    ),
    e.ENDED: ("people", "ended the person {who} everywhere"),
    e.LINKED: ("people", "made a personal link for {who}"),
    e.LINK_USED: ("people", "came in by a personal link with {browser}"),
    e.LINK_WITHDRAWN: ("people", "withdrew the personal link {id}"),
    e.DEVICE_ADDED: ("people", "added the device {browser}"),
    e.GROUP_MADE: ("people", "made the group {name}"),
    e.GROUP_RENAMED: ("people", "renamed a group to {name}"),
    e.GROUP_REMOVED: ("people", "removed the group {id}"),
    "token.made.v1": ("people", "made the token {name}"),
    "token.revoked.v1": ("people", "revoked the token {name}"),
    "folder.made.v1": ("graphs", "made the folder {name}"),
    "folder.changed.v1": ("graphs", "renamed or moved the folder {name}"),
    "folder.removed.v1": ("graphs", "removed a folder"),
    h.FOLDER_RULED: ("graphs", "said who may see the graphs in the folder {folder}: {rule}"),
}


class EditorFacts:
    """Says the events of the editor's log in words. Reads names over a connection, each once."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._person = stored_people(connection)
        self._graphs: dict[str, str] = {}

    def describe(self, event: Event) -> Fact | None:
        """Return an event in words; None for events that are no facts about people. Raise
        msgspec.DecodeError for a body that cannot be read."""
        fact = self._fact(event)
        if fact is None or event.author in _OURS or fact.person is not None:
            return fact
        return msgspec.structs.replace(fact, person=self._person(event.author))

    def _fact(self, event: Event) -> Fact | None:
        if audit.is_audit(event.stream):
            return described(event, self._graph_name)
        if event.kind == h.EPOCH:
            text = "The log begins anew here: a new server, or a restored backup"
            return Fact(kind="other", text=text, is_of_program=True)
        if event.author in _OURS:
            return None
        graph = h.graph_of(event.stream)
        body = _body(event)
        if graph is not None:
            return self._about(event.kind, graph, body)
        known = _PEOPLE.get(event.kind)
        if known is None:
            return None
        kind, sentence = known
        about = body.person or body.id
        ends = (
            f", who may start until {moment(body.until):%Y-%m-%d %H:%M} UTC" if body.until else ""
        )
        words = {
            **self._words(event.kind, body),
            "who": self._person(about).name or about,
            "ends": ends,
        }
        told = None if body.address is None else Origin(address=body.address)
        return Fact(kind=kind, text=sentence.format_map(words), origin=told)

    def _about(self, kind: str, graph: str, body: _Body) -> Fact | None:
        name = self._graph_name(graph)
        seq = body.seq or None
        if kind == h.ANSWERED:
            text = f"said {'yes' if body.yes else 'no'} to merging {name}"
        elif kind in _ABOUT:
            text = _ABOUT[kind].format_map({**self._words(kind, body), "graph": name})
        else:
            return None
        return Fact(kind="graphs", text=text, graph=graph, graph_name=name, seq=seq)

    def _words(self, kind: str, body: _Body) -> dict[str, Any]:
        """Return the fields of a body, with the rule of a graph or folder in words."""
        words: dict[str, Any] = msgspec.structs.asdict(body)
        if kind in {h.RULED, h.FOLDER_RULED}:
            folder, group = editor_tables.folder.c, editor_tables.people_group.c
            groups = self._names(group.id, group.name)
            words["folder"] = self._names(folder.id, folder.name).get(body.id, body.id)
            words["rule"] = (
                "as the folder around says"
                if body.rule is None
                else rule_words(
                    body.rule,
                    "it" if kind == h.RULED else "them",
                    lambda each: groups.get(each) or self._person(each).name,
                )
            )
        return words

    def _names(self, key: Any, name: Any) -> dict[str, str]:
        return {row[0]: row[1] for row in self._connection.execute(select(key, name))}

    def _graph_name(self, graph: str) -> str:
        """Return the present name of a graph; its id if it has none."""
        if graph not in self._graphs:
            table = editor_tables.graph
            found = select(table.c.name).where(table.c.id == graph)
            self._graphs[graph] = self._connection.execute(found).scalar() or graph
        return self._graphs[graph]


def _body(event: Event) -> _Body:
    return msgspec.json.decode(event.body, type=_Body) if event.body else _Body()


def page(wanted: AuditFilter, connection: Connection) -> AuditPage:
    """Return a page of the audit of the editor."""
    return audit_page(connection, "editor", wanted, EditorFacts(connection).describe, _NEVER)


def page_in_worker(address: str, wanted: AuditFilter) -> bytes:
    """Return a page of the audit as JSON. `address`: the URL of the editor's database. For workers.
    Raise Unavailable if it cannot be read."""
    question: Callable[[Connection], AuditPage] = partial(page, wanted)
    return msgspec.json.encode(ask_from_worker(address, question))
