"""Approvals: the yes of a second person to a graph, by its digest, which a robot may demand before
a start.

An approval is a person's word about exactly one graph. It stands in a stream of its own, is never
taken back, and says nothing about any other graph. Times are microseconds UTC.
"""

import logging
from collections import defaultdict, deque
from collections.abc import Iterable
from typing import Annotated, ClassVar, Final

import anyio
import msgspec

from action_assistant.errors import BadInput, Conflict, Forbidden, TooMany
from action_assistant.journal.events import Event
from action_assistant.kit.clock import ClockUs
from action_assistant.kit.lru_cache import LruCache
from action_assistant.kit.token_bucket import TokenBuckets
from action_assistant.runner.links.port import NotSent, Registration
from action_assistant.runner.runs.events import Author, draft_of
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.runs.sight import NO_RULES, RunGraphs, RunSight
from action_assistant.runner.start.admission import StartRequest
from action_assistant.runner.start.orders import Ordered, OrderLine, graphs_inside
from action_assistant.runner.start.preflight import Item
from action_assistant.runner.start.rights_registry import IdentityNow, unchanged
from action_assistant.umrf.facts import SECOND_PERSON
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.start_values import MOST_BYTES, StartValues
from action_assistant.web.auth import caller
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import SERVER_OWNER, Person
from action_assistant.web.auth.rights import Denied, may
from action_assistant.web.auth.roles import OWNER, Role

log = logging.getLogger(__name__)

#: Said to whoever may not see all graphs of an order.
HIDDEN_ORDER: Final = (
    "You may not see all graphs of this start, so you cannot say yes to it: whoever says yes has to see "
    "the whole order."
)
#: The stream of all approvals.
STREAM: Final = "approvals"

_DIGEST: Final = frozenset("0123456789abcdef")
_ASKED_US: Final = 600_000_000  # in which one person asks for one graph once
_GIVEN_AT_ONCE: Final = 60  # approvals of one person
_ASKED_AT_ONCE: Final = 20  # questions of one person for one robot, about different graphs
_PER_MINUTE: Final = 1  # of either, after that
_QUESTIONS: Final = 20  # that are remembered of one graph
_OPEN_US: Final = 86_400_000_000  # after which a question is no longer shown
_LOOKED: Final = 500  # orders that are remembered in words
_LOOKED_BYTES: Final = 8_000_000  # of the words of all of them


class ApprovalGiven(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The event of an approval of the graph with this digest. `graph` and `version` say where the
    person saw it; `device` is their browser, "" where that is not known. `is_named`: an owner has
    named the person, by a personal link; None in events of before that was asked."""

    kind: ClassVar[str] = "approval.given.v1"

    at: int
    digest: str
    author: Author
    graph: str | None = None
    version: str = ""
    note: str = ""
    device: str = ""
    is_named: bool | None = None


class ApprovalAsked(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The event that a person asks others for an approval of the graph or order with this digest, for
    a start on these robots. `values`: those of the start; `order`: the whole of it in words, by the
    runner's own look, without any where that look is not known; `tree_digest`: of its version;
    `inside`, `unsighted`: as of a run, by that look. It lets nobody start anything."""

    kind: ClassVar[str] = "approval.asked.v1"

    at: int
    digest: str
    author: Author
    robots: tuple[str, ...]
    graph_name: str
    graph: str | None = None
    version: str = ""
    values: StartValues = {}
    order: tuple[OrderLine, ...] = ()
    tree_digest: str = ""
    inside: tuple[str, ...] = ()
    unsighted: bool = False

    @property
    def graphs(self) -> RunGraphs:
        """The facts that decide who may see the words, as of a run of this start."""
        graphs = dict.fromkeys([self.graph, *self.inside])
        return RunGraphs(self.author.id, tuple(filter(None, graphs)), self.unsighted)


class ApprovalQuestion(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The body of a request that asks others for an approval. `robots`, `values`: those of the start."""

    digest: Annotated[str, msgspec.Meta(min_length=64, max_length=64)]
    robots: Annotated[
        tuple[Annotated[str, msgspec.Meta(max_length=100)], ...],
        msgspec.Meta(min_length=1, max_length=20),
    ]
    graph_name: Annotated[str, msgspec.Meta(max_length=200)]
    graph: Annotated[str, msgspec.Meta(max_length=100)] | None = None
    version: Annotated[str, msgspec.Meta(max_length=100)] = ""
    values: StartValues = {}


class ApprovalRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The body of an approval of exactly one graph."""

    digest: Annotated[str, msgspec.Meta(min_length=64, max_length=64)]
    graph: Annotated[str, msgspec.Meta(max_length=100)] | None = None
    version: Annotated[str, msgspec.Meta(max_length=100)] = ""
    note: Annotated[str, msgspec.Meta(max_length=500)] = ""


class Demand(msgspec.Struct, frozen=True):
    """A start to which a second person has to say yes: its whole order, and the facts that decide who may
    see it. The author of these is its starter."""

    order: Ordered
    graphs: RunGraphs

    @property
    def what(self) -> str:
        """The thing to which somebody says yes, in words."""
        if "repeat" in self.order.parts:
            return "this repeat"
        return "this start" if self.order.parts else "this graph"


class Approved(msgspec.Struct, frozen=True):
    """The approvals, of which one has to count, by which a robot takes a start."""

    robot: str
    demand: Demand
    given: tuple[ApprovalGiven, ...]


class Approvals:
    """Stores approvals and reads them, each event once. Raises Unavailable while the journal cannot
    be read. `identity_now`: as of the rights of robots; `sight`: who may see which graphs."""

    def __init__(
        self,
        journal: RunnerJournal,
        clock_us: ClockUs,
        identity_now: IdentityNow = unchanged,
        sight: RunSight = NO_RULES,
    ) -> None:
        self._journal = journal
        self._clock_us = clock_us
        self._identity_now = identity_now
        self._sight = sight
        self._seq = 0
        self._by_digest: defaultdict[str, list[ApprovalGiven]] = defaultdict(list)
        self._questions: defaultdict[str, deque[ApprovalAsked]] = defaultdict(
            lambda: deque(maxlen=_QUESTIONS)
        )
        self._reading = anyio.Lock()
        self._asked: dict[tuple[str, str], ApprovalAsked] = {}
        self._looked: LruCache[tuple[str, str | None], Demand] = LruCache(_LOOKED, _LOOKED_BYTES)
        self._given_pace = TokenBuckets(_GIVEN_AT_ONCE, _PER_MINUTE / 60)
        self._asked_pace = TokenBuckets(_ASKED_AT_ONCE, _PER_MINUTE / 60)

    async def give(
        self, request: ApprovalRequest, author: Author, *, is_named: bool = True
    ) -> ApprovalGiven:
        """Store an approval. If the same person has approved the graph before with the same browser, by a
        link of the same kind, return that earlier approval. `is_named`: the person did not come by a link that several may use. Raise BadInput if
        the digest has the wrong form, TooMany if the person approves very many graphs, Unavailable if
        the journal cannot store it."""
        if not _DIGEST.issuperset(request.digest):
            raise BadInput("This is no digest of a graph.", where={"path": "/digest"})
        by = author.id, caller.device(), is_named
        for known in await self.given_for(request.digest):
            if (known.author.id, known.device, known.is_named is not False) == by:
                return known
        if not self._given_pace.of(author.id).take():
            raise TooMany("You have said yes to very many graphs; wait some minutes.")
        given = ApprovalGiven(
            at=self._clock_us(),
            digest=request.digest,
            author=author,
            graph=request.graph,
            version=request.version,
            note=request.note.strip(),
            device=caller.device(),
            is_named=is_named,
        )
        await self._journal.append(STREAM, [draft_of(given, author.id)])
        return given

    async def ask(self, question: ApprovalQuestion, author: Author) -> ApprovalAsked:
        """Store that a person asks for an approval; while one from the last ten minutes stands, return
        that instead. Raise BadInput if the digest has the wrong form, TooMany if the person asks for
        very many graphs, Unavailable if the journal cannot store it."""
        if not _DIGEST.issuperset(question.digest):
            raise BadInput("This is no digest of a graph.", where={"path": "/digest"})
        if len(as_json(question.values)) > MOST_BYTES:
            text = f"The values of a start have {MOST_BYTES:,} bytes at most."
            raise BadInput(text, where={"path": "/values"})
        now = self._clock_us()
        key = author.id, question.digest
        before = self._asked.get(key)
        if before is not None and now - before.at < _ASKED_US:
            return before
        for robot in dict.fromkeys(question.robots):
            if not self._asked_pace.of(f"{author.id} {robot}").take():
                raise TooMany(f"You have asked others very often about {robot}; wait some minutes.")
        asked = ApprovalAsked(at=now, author=author, **msgspec.structs.asdict(question))
        looked = self._looked.get((question.digest, question.graph))
        if looked is not None:
            asked = msgspec.structs.replace(
                asked,
                order=looked.order.lines,
                tree_digest=looked.order.tree_digest,
                inside=looked.graphs.graphs,
                unsighted=looked.graphs.unsighted,
            )
        self._asked = {k: v for k, v in self._asked.items() if now - v.at < _ASKED_US}
        self._asked[key] = asked
        try:
            await self._journal.append(STREAM, [draft_of(asked, author.id)])
        except BaseException:
            self._asked.pop(key, None)
            raise
        return asked

    def demand(self, order: Ordered, request: StartRequest, starter: str) -> Demand:
        """Return what a second person says yes to. `starter`: the id of the person who starts."""
        graphs = dict.fromkeys([request.graph, *graphs_inside(request)])
        unsighted = request.sight is None and self._sight.has_rules
        return Demand(order, RunGraphs(starter, tuple(filter(None, graphs)), unsighted))

    def remember(self, demand: Demand, graph: str | None) -> tuple[OrderLine, ...]:
        """Remember an order of this graph that a person has looked at, for a question about it, and
        return its words."""
        lines = demand.order.lines
        weight = sum(len(each.text) for each in lines)
        self._looked.put((demand.order.digest, graph), demand, weight)
        return lines

    async def require_seen(self, digest: str, graph: str | None, identity: Identity) -> None:
        """Raise Forbidden if a person may not see all graphs of this order, as far as these are known: they
        say no yes to what they cannot read."""
        unseen = self._sight.unseen(identity)
        if unseen is None:
            return
        await self._read()
        looked = self._looked.get((digest, graph))
        every = [each for asked in self._questions.values() for each in asked]
        known = [each.graphs for each in every if each.digest == digest]
        if any(unseen.hides(each) for each in [*known, *([looked.graphs] if looked else ())]):
            raise Forbidden(HIDDEN_ORDER)

    async def given_for(self, digest: str) -> tuple[ApprovalGiven, ...]:
        """Return the approvals of a graph, in order of time."""
        await self._read()
        return tuple(self._by_digest.get(digest, ()))

    def counts(self, given: ApprovalGiven, graphs: RunGraphs | None = None) -> bool:
        """Return whether whoever has given an approval may still give it: they may operate robots, and see
        the graph, and all `graphs` of the start. That of a person of whom nothing more is known counts."""
        role: Role = OWNER if given.author.id == SERVER_OWNER else "operator"
        who = Person(given.author.id, given.author.name, role)
        now = self._identity_now(Identity(who))
        if now is None or isinstance(may(now, "operate", now=self._clock_us() / 1e6), Denied):
            return False
        unseen = self._sight.unseen(now)
        if unseen is None:
            return True
        return given.graph not in unseen.graphs and (graphs is None or not unseen.hides(graphs))

    async def questions_of(self, graph: str) -> tuple[ApprovalAsked, ...]:
        """Return who asked others for an approval of a start of this graph within the last day, and
        for which start; the newest first."""
        await self._read()
        since = self._clock_us() - _OPEN_US
        return tuple(each for each in reversed(self._questions.get(graph, ())) if each.at >= since)

    async def _read(self) -> None:
        async with self._reading:
            while events := await self._journal.read(STREAM, after=self._seq, limit=500):
                for event in events:
                    try:
                        self._take(event)
                    except msgspec.MsgspecError as error:
                        log.error("Approval %s cannot be read: %s", event.seq, error)
                self._seq = events[-1].seq

    def _take(self, event: Event) -> None:
        if event.kind == ApprovalGiven.kind:
            given = msgspec.json.decode(event.body, type=ApprovalGiven)
            self._by_digest[given.digest].append(given)
        elif event.kind == ApprovalAsked.kind:
            asked = msgspec.json.decode(event.body, type=ApprovalAsked)
            if asked.graph is not None:
                self._questions[asked.graph].append(asked)

    async def look(self, robot: Registration, demand: Demand) -> tuple[Item, Approved] | None:
        """Return the pre-flight item about approval, and the approvals that count; None where the robot asks
        for none. It passes when somebody else than the starter has approved the order, by a digest of
        it, with another browser than that of this request, and may still do so and see all of it. A person
        who came by a link for several people is no second person (decision 126): nobody knows how many
        use it."""
        if robot.profile.get(SECOND_PERSON) is not True:
            return None
        orders, what = demand.order.approving, demand.what
        every = [each for digest in orders for each in await self.given_for(digest)]
        given = [each for each in every if each.author.id != demand.graphs.author]
        valid = [each for each in given if self.counts(each, demand.graphs)]
        named = [each for each in valid if each.is_named is not False]
        here = caller.device()
        others = tuple(each for each in named if not here or each.device != here)
        approved = Approved(robot.name, demand, others)
        if not others:
            why = f"nobody else has said yes to exactly {what}"
            if named:
                who = named[0].author.name or "somebody"
                why += f": the yes of {who} came from the browser that you use"
            elif given and not valid:
                who = given[0].author.name or "somebody"
                why += f": {who}, who did, {self._why_void(given[0])}"
            elif valid:
                who = valid[0].author.name or "somebody"
                why += (
                    f": {who} came by a link that several people may use. An owner can give them a "
                    "personal link"
                )
            text = f"{robot.name} takes only what a second person has said yes to, and {why}."
            return Item(code="approved", verdict="blocked", text=text), approved
        names = ", ".join(dict.fromkeys(each.author.name or "somebody" for each in others[:3]))
        text = f"{names} said yes to exactly {what}."
        return Item(code="approved", verdict="passed", text=text), approved

    async def require(self, robot: Registration, demand: Demand) -> tuple[Approved, ...]:
        """Return the approvals by which the robot takes a start; none where it asks for none. Raise
        Conflict if it needs one, and nobody but the starter has given one that counts."""
        looked = await self.look(robot, demand)
        if looked is None:
            return ()
        item, approved = looked
        if item.verdict == "blocked":
            raise Conflict(item.text, where={"path": "/engine", "item": item.code})
        return (approved,)

    def require_still(self, approved: Iterable[Approved]) -> None:
        """Raise NotSent if none of the people by whose yes a robot takes a start may still give it. Call
        this in the same step of the event loop in which the message is sent."""
        for each in approved:
            if not any(self.counts(given, each.demand.graphs) for given in each.given):
                who = each.given[0].author.name or "somebody"
                raise NotSent(
                    f"{each.robot} takes only what a second person has said yes to, and {who}, who did, "
                    f"{self._why_void(each.given[0])}."
                )

    def _why_void(self, given: ApprovalGiven) -> str:
        """Return why an approval that does not count does not, after the name of its person."""
        return "may not see all of it" if self.counts(given) else "may not say so any more"
