"""A model of several editors on one database, in virtual time: what is sent, lost, late, frozen and cut off.

Each editor is a set of generators. A generator that waits may be ended by a crash, or be held by a freeze, at every
`yield`. The rules are those of the product: a writer with a slot, known ends and a retry; owners by epoch; rooms that
acknowledge after the commit; clients that send again what was not acknowledged (rule R1).
"""

import heapq
import random
from collections.abc import Callable
from typing import Final

from editor.cluster.model_database import MUTANTS as MUTANTS
from editor.cluster.model_database import Broken as Broken
from editor.cluster.model_database import Database, link
from editor.cluster.model_database import Mutant as Mutant
from editor.cluster.model_editor import Connection, Editor

EDITORS: Final = 3
STREAMS: Final = ("graph/a", "graph/b")
EDITING: Final = 2  # clients that edit to the end
_FAULTS_END: Final = 12.0
_END: Final = 60.0


class World:
    """The time, the database, the editors and clients, and what is cut."""

    def __init__(self, seed: int, mutant: Mutant = "") -> None:
        self.dice = random.Random(seed)
        self.mutant: Mutant = mutant
        self.now = 0.0
        self._queue: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0
        self.db = Database()
        self.cuts: set[object] = set()
        self._held: dict[object, list[Callable[[], None]]] = {}
        self.acknowledged: dict[int, int] = {}
        self.faults = 0
        self.editors = [Editor(self, n) for n in range(EDITORS)]
        self.clients = [Client(self, n, STREAMS[n % len(STREAMS)]) for n in range(4)]

    def number(self) -> int:
        """Return a number that nothing else has."""
        self._count += 1
        return self._count

    def after(self, delay: float, call: Callable[[], None]) -> None:
        """Call something later."""
        self._count += 1
        heapq.heappush(self._queue, (self.now + delay, self._count, call))

    def over(self, link: object, call: Callable[[], None]) -> None:
        """Call something now, or when a link that is cut is healed: bytes on the way come late."""
        if link in self.cuts:
            self._held.setdefault(link, []).append(call)
        else:
            call()

    def heal(self, link: object) -> None:
        """Heal a link."""
        self.cuts.discard(link)
        for call in self._held.pop(link, []):
            self.after(self.latency(), call)

    def latency(self) -> float:
        """Return how long a message takes."""
        return 0.001 + self.dice.random() ** 3 * 0.05

    def run(self) -> None:
        """Let everything happen, and check what must hold at the end."""
        for editor in self.editors:
            editor.start()
        for client in self.clients:
            client.start()
        t = 0.5
        while t < _FAULTS_END:
            self.after(t, self.fault)
            t += self.dice.expovariate(0.8)
        while self._queue and self._queue[0][0] < _END:
            self.now, _, call = heapq.heappop(self._queue)
            call()
        self.check()

    def fault(self) -> None:
        """Let something go wrong; it is mended some seconds later."""
        self.faults += 1
        editor = self.dice.choice(self.editors)
        lasts = self.dice.choice((0.2, 1.0, 3.0, 6.0))
        match self.dice.randrange(10):
            case 0 | 1:
                editor.freeze()
                self.after(lasts, editor.thaw)
            case 2:
                editor.crash()
                self.after(lasts, editor.start)
            case 3:
                self.cut((editor.n, "db"), lasts)
            case 4:
                other = self.dice.choice(self.editors)
                self.cut(frozenset((editor.n, other.n)), lasts)
            case 5:
                self.db.end_session(editor.session)
            case 6:
                for session in list(self.db.sessions):
                    self.db.end_session(session)
            case 7 | 8:
                editor.spawn(editor.give_up_all())
            case _:
                editor.spawn(editor.drain())

    def cut(self, link: object, lasts: float) -> None:
        """Cut a link for some time."""
        self.cuts.add(link)
        self.after(lasts, lambda: self.heal(link))

    def check(self) -> None:
        """Check the log, and the documents of all clients, at rest."""
        db = self.db
        for stream, entries in db.log.items():
            chain = epoch = 0
            for n, entry in enumerate(entries, 1):
                chain = link(chain, entry)
                if entry.seq != n or entry.chain != chain or (entry.epoch or epoch) < epoch:
                    raise Broken(f"{stream} is damaged at {n}")
                epoch = entry.epoch or epoch
        for slot in {slot for slot, _ in db.places}:
            numbers = sorted(n for each, n in db.places if each == slot)
            if numbers != list(range(1, len(numbers) + 1)):
                raise Broken(f"slot {slot} has gaps")
        for edit in self.acknowledged:
            if edit not in db.edits:
                raise Broken(f"edit {edit} was acknowledged and is lost")
        for client in self.clients:
            if client.unacknowledged:
                raise Broken(f"client {client.n} waits for ever: {client.unacknowledged}")
            stored = {entry.edit for entry in db.log.get(client.stream, [])}
            if client.doc != stored:
                raise Broken(f"client {client.n} shows {len(client.doc ^ stored)} edits otherwise")


class Client:
    """Makes edits, and sends again what was not acknowledged."""

    def __init__(self, world: World, n: int, stream: str) -> None:
        self.world = world
        self.n = n
        self.stream = stream
        self.doc: set[int] = set()
        self.unacknowledged: dict[int, float] = {}
        self.connection: Connection | None = None

    def start(self) -> None:
        """Connect, and begin to edit."""
        self._connect()
        self._watch()
        t = 0.0
        while t < (
            _FAULTS_END + 2 if self.n < EDITING else _FAULTS_END / 4
        ):  # later some only read
            t += self.world.dice.expovariate(2.0)
            self.world.after(t, self._edit)

    def _edit(self) -> None:
        edit = self.world.number()
        self.doc.add(edit)
        self.unacknowledged[edit] = self.world.now
        if self.connection is not None and self.connection.room is not None:
            self._send(self.connection, edit)

    def _send(self, connection: Connection, edit: int) -> None:
        world = self.world
        connection.up = max(world.now + world.latency(), connection.up + 1e-6)
        owner = connection.inner or connection.outer
        life = connection.inner_life if connection.inner is not None else connection.life

        def forward() -> None:
            pair = frozenset((connection.outer.n, owner.n))
            arrive = lambda: owner.act(life, lambda: owner.receive(connection, edit))  # noqa: E731
            connection.outer.act(connection.life, lambda: world.over(pair, arrive))

        world.after(connection.up - world.now, forward)

    def _connect(self) -> None:
        world = self.world
        up = [each for each in world.editors if each.life and not each.draining]
        if not up:
            world.after(0.3, self._connect)
            return
        editor = world.dice.choice(up)
        connection = self.connection = Connection(self, editor, editor.life)
        world.after(
            world.latency(),
            lambda: editor.act(connection.life, lambda: editor.spawn(editor.accept(connection))),
        )

    def joined(self, connection: Connection, doc: set[int]) -> None:
        """Take the document in, and send what it lacks."""
        if connection is self.connection:
            self.doc |= doc
            for edit in list(self.unacknowledged):
                self._send(connection, edit)

    def was_kept(self, edit: int, by: int) -> None:
        """Hear that an edit is stored."""
        if edit not in self.world.db.edits:
            raise Broken(f"edit {edit} was acknowledged before it was stored")
        if self.unacknowledged.pop(edit, None) is not None:
            if edit in self.world.acknowledged:
                raise Broken(f"edit {edit} was acknowledged by two")
            self.world.acknowledged[edit] = by

    def closed(self, connection: Connection) -> None:
        """Connect again."""
        connection.is_open = False
        if connection is self.connection:
            self.connection = None
            self.world.after(0.3 * (0.5 + self.world.dice.random()), self._connect)

    def _watch(self) -> None:
        """Leave a socket that ended, that is silent, or on which nothing is acknowledged."""
        connection, now = self.connection, self.world.now
        if connection is not None:
            gone = connection.outer.life != connection.life
            inner = connection.inner
            gone = gone or (inner is not None and inner.life != connection.inner_life)
            silent = any(now - since > 5 for since in self.unacknowledged.values())
            leaves = now < _FAULTS_END and self.world.dice.random() < 0.3
            if (
                gone
                or silent
                or leaves
                or (connection.room is None and self.world.dice.random() < 0.1)
            ):
                self.closed(connection)
                if silent:
                    self.unacknowledged = dict.fromkeys(self.unacknowledged, now)
        self.world.after(1.0, self._watch)
