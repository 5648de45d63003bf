"""The editors in the model: a writer, owners of streams, rooms, and sockets that are relayed."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from editor.cluster.model_database import (
    DEAD,
    Entry,
    Head,
    LostError,
    OvertakenError,
    Registered,
    link,
)

if TYPE_CHECKING:
    from editor.cluster.model import Client, World

Steps = Generator[Any, Any, Any]

_SHARED: Final = "audit"
_CUT_OFF: Final = 1.5


@dataclass(eq=False)
class Job:
    """Edits for one stream, and perhaps a note in a shared one; `done` gets the seq or None."""

    stream: str
    edits: list[int]
    expected: int
    epoch: int
    note: int | None
    done: Callable[[int | None], None]


@dataclass(eq=False)
class Room:
    """A document in memory."""

    stream: str
    epoch: int
    seq: int
    doc: set[int]
    members: list["Connection"] = field(default_factory=list)
    waiting: list[tuple["Connection", int]] = field(default_factory=list)
    is_busy: bool = False
    has_ended: bool = False


@dataclass(eq=False)
class Connection:
    """A socket of a client at an editor, with or without one behind it at the owner."""

    client: "Client"
    outer: "Editor"
    life: int
    inner: "Editor | None" = None
    inner_life: int = 0
    room: Room | None = None
    is_open: bool = True
    down: float = 0.0  # when the last message to the client arrives
    up: float = 0.0


class Editor:
    """An editor in one life after another."""

    def __init__(self, world: "World", n: int) -> None:
        self.world = world
        self.n = n
        self.life = 0
        self.session: int | None = None
        self.is_frozen = False
        self._held: list[Callable[[], None]] = []

    # --- processes --------------------------------------------------------------------------------

    def start(self) -> None:
        """Begin a life, unless one goes on."""
        if self.life:
            return
        self.life = self.world.number()
        self.slot: int | None = None
        self.is_doubtful = False  # whether the session may have ended
        self.position = 0
        self.known: dict[str, Head] = {}
        self.mine: dict[str, int] = {}
        self.rooms: dict[str, Room] = {}
        self.loading: dict[str, list[Callable[[], None]]] = {}
        self.jobs: list[Job] = []
        self.wake: Callable[[], None] | None = None
        self.draining = False
        self.beaten = self.world.now
        self.spawn(self._write())
        self.spawn(self._beat())
        self.spawn(self._watch())
        self.spawn(self._unload())

    def crash(self) -> None:
        """End at once: the server sees the connection close, unless it is cut off."""
        if not self.life:
            return
        session = self.session
        self.world.over((self.n, "db"), lambda: self.world.db.end_session(session))
        self.life, self.session, self.is_frozen = 0, None, False
        self._held = []

    def freeze(self) -> None:
        """Stop all that this editor does."""
        self.is_frozen = bool(self.life)

    def thaw(self) -> None:
        """Go on."""
        if self.is_frozen:
            self.is_frozen = False
            held, self._held = self._held, []
            for call in held:
                self.act(self.life, call)

    def act(self, life: int, call: Callable[[], None]) -> None:
        """Call something in a life, when it is not frozen."""
        if life != self.life or not life:
            return
        if self.is_frozen:
            self._held.append(lambda: self.act(life, call))
        else:
            call()

    def spawn(self, steps: Steps) -> None:
        """Let a generator run in this life."""
        if self.life:
            self._step(self.life, steps, None, None)

    def _step(self, life: int, steps: Steps, value: Any, error: Exception | None) -> None:
        def go() -> None:
            try:
                effect = steps.send(value) if error is None else steps.throw(error)
            except StopIteration:
                return
            effect(lambda value=None, error=None: self._step(life, steps, value, error))

        self.act(life, go)

    def pause(self, seconds: float) -> Callable[[Callable[[], None]], None]:
        """Wait."""
        return lambda done: self.world.after(seconds, done)

    def ask(
        self, query: Callable[[], Any], session: int | None = None, patience: float = 1.0
    ) -> Any:
        """Ask the database; the answer may be lost, and the question may come late."""
        world, where = self.world, (self.n, "db")

        def effect(done: Callable[..., None]) -> None:
            is_over = False

            def finish(value: Any = None, error: Exception | None = None) -> None:
                nonlocal is_over
                if not is_over:
                    is_over = True
                    done(value, error)

            def answer(value: Any, error: Exception | None) -> None:
                if session is not None and session not in world.db.sessions:
                    error = LostError()
                finish(value, error)

            def arrive() -> None:
                value, error = None, None
                if session is not None and session not in world.db.sessions:
                    error = LostError()
                else:
                    try:
                        value = query()
                    except (OvertakenError, LostError) as refusal:
                        error = refusal
                found, why = value, error
                world.after(world.latency(), lambda: world.over(where, lambda: answer(found, why)))

            world.after(world.latency(), lambda: world.over(where, arrive))
            world.after(patience, lambda: finish(None, LostError()))

        return effect

    # --- the writer -------------------------------------------------------------------------------

    def submit(self, job: Job) -> None:
        """Queue a job for the writer."""
        self.jobs.append(job)
        wake, self.wake = self.wake, None
        if wake is not None:
            wake()

    def _write(self) -> Steps:
        while True:
            if not self.jobs:
                yield lambda done: setattr(self, "wake", done)
            count = self.world.dice.randint(1, 3)
            jobs, self.jobs = self.jobs[:count], self.jobs[count:]
            outcomes = yield from self._commit(jobs)
            for job in jobs:
                job.done(outcomes.get(job))

    def _commit(self, jobs: list[Job]) -> Steps:
        db, mutant = self.world.db, self.world.mutant

        def read(stream: str) -> Callable[[], Head]:
            return lambda: db.heads.get(stream, Head())

        for _ in range(5):
            entries: list[Entry] = []
            outcomes: dict[Job, int] = {}
            try:
                if self.session is None or self.slot is None or self.is_doubtful:
                    yield from self._connect()
                slot = self.slot or 0
                known: dict[str, Head] = {}
                ends: dict[str, Head] = {}
                n = self.position
                for job in jobs:
                    if not job.edits:
                        continue  # it only has the writer connect
                    wanted = [(job.stream, edit) for edit in job.edits]
                    wanted += [] if job.note is None else [(_SHARED, job.note)]
                    for stream in dict.fromkeys(stream for stream, _ in wanted):
                        if stream not in self.known:
                            self.known[stream] = yield self.ask(read(stream), self.session)
                        known.setdefault(stream, self.known[stream])
                        ends.setdefault(stream, self.known[stream])
                    if not self._is_right(job, ends[job.stream]):
                        if ends[job.stream] == known[job.stream]:  # another may have moved it
                            self.known[job.stream] = yield self.ask(read(job.stream), self.session)
                            known[job.stream] = ends[job.stream] = self.known[job.stream]
                        if not self._is_right(job, ends[job.stream]):
                            continue  # this job alone is refused
                    for stream, edit in wanted:
                        n += 1
                        if mutant == "position from a sequence":
                            db.sequence += 1
                            n = db.sequence
                        end, epoch = ends[stream], job.epoch if stream == job.stream else None
                        bare = Entry(stream, end.seq + 1, edit, slot, n, 0, epoch)
                        chain = link(end.chain, bare)
                        entries.append(Entry(stream, end.seq + 1, edit, bare.slot, n, chain, epoch))
                        ends[stream] = Head(end.seq + 1, chain, end.epoch)
                    outcomes[job] = ends[job.stream].seq
                known = {entry.stream: known[entry.stream] for entry in entries}
                if mutant == "check without lock":
                    yield self.ask(partial(self._same, known), self.session)
                if entries:
                    yield self.ask(partial(db.store, entries, known, mutant), self.session)
            except OvertakenError:
                self.known.clear()
                continue
            except LostError:
                if not entries or not (yield from self._was_stored(entries[-1])):
                    return {}
                return outcomes
            self.position = entries[-1].n if entries else self.position
            self.known |= {stream: ends[stream] for stream in known}
            return outcomes
        return {}

    def _is_right(self, job: Job, end: Head) -> bool:
        """Return whether a job was made for the end of its stream."""
        has_epoch = self.world.mutant == "no epoch in the compare" or end.epoch == job.epoch
        return end.seq == job.expected and has_epoch

    def _same(self, known: dict[str, Head]) -> None:
        """Check the ends of streams in a statement of its own."""
        if any(self.world.db.heads.get(stream, Head()) != head for stream, head in known.items()):
            raise OvertakenError

    def _was_stored(self, entry: Entry) -> Steps:
        """Return whether an entry is in the log, once the session that sent it has ended."""
        self._disconnect()
        until = self.world.now + 10
        while self.world.now < until:
            try:
                yield from self._connect()
                found = yield self.ask(
                    lambda: self.world.db.places.get((entry.slot, entry.n)), self.session
                )
            except LostError:
                self._disconnect()
                yield self.pause(0.1)
            else:
                return found is not None and found.chain == entry.chain
        return False

    def _disconnect(self) -> None:
        self.is_doubtful = True
        self.known.clear()

    def _connect(self) -> Steps:
        """Take a slot with a new session, once the last one has ended."""
        db, old, new = self.world.db, self.session, self.world.number()
        was = self.slot

        life = self.life

        def take() -> tuple[int, int]:
            if (self.life, self.session) != (life, new):
                raise LostError  # nobody waits for this connection any more
            db.end_session(old)
            free = [slot for slot in (was, *range(64)) if slot is not None and slot not in db.slots]
            db.sessions.add(new)
            db.slots[free[0]] = new
            return free[0], max((n for slot, n in db.places if slot == free[0]), default=0)

        self.session = new
        self.known.clear()
        self.is_doubtful = True
        self.slot, self.position = yield self.ask(take)
        self.is_doubtful = False

    # --- owning streams ---------------------------------------------------------------------------

    def _owner(self, stream: str) -> Steps:
        if stream in self.mine:
            return "here", self.mine[stream]
        world = self.world
        life = self.life
        kind, number = yield self.ask(lambda: world.db.look(stream, life, world.now))
        if kind == "here":
            self.mine[stream] = number
        return kind, number

    def _beat(self) -> Steps:
        db, world, life, count = self.world.db, self.world, self.life, 0
        while True:
            begun = world.now
            try:
                slot = self.slot

                def beat(slot: int | None = slot) -> bool:
                    if slot is None or db.slots.get(slot) != self.session:
                        return False
                    for other in [k for k, row in db.registered.items() if row.slot == slot]:
                        if other != life:
                            del db.registered[other]
                    row = db.registered.setdefault(
                        life, Registered(self.n, slot, world.now, self.draining)
                    )
                    row.slot, row.beat_at = slot, world.now
                    return True

                if (yield self.ask(beat)):
                    if begun - self.beaten > DEAD:
                        self._lose(dict(self.mine))
                    self.beaten = begun
                    if count % 4 == 0:
                        owned = dict(self.mine)
                        shown = yield self.ask(lambda: dict(db.rooms))
                        self._lose({s: e for s, e in owned.items() if shown.get(s) != (life, e)})
                else:
                    self.is_doubtful = True
                    self.submit(Job("", [], -1, 0, None, lambda _: None))
            except LostError:
                pass
            count += 1
            yield self.pause(max(0.0, begun + 0.5 - world.now))

    def _watch(self) -> Steps:
        while True:
            yield self.pause(0.25)
            if self.world.now - self.beaten > _CUT_OFF:
                self._lose(dict(self.mine))

    def _lose(self, streams: dict[str, int]) -> None:
        for stream, epoch in streams.items():
            if self.mine.get(stream) == epoch:
                del self.mine[stream]
                if stream in self.rooms:
                    self.end_room(self.rooms[stream])

    def _unload(self) -> Steps:
        """Give up rooms that nobody uses."""
        while True:
            yield self.pause(0.1 + self.world.dice.random())
            for room in list(self.rooms.values()):
                if not room.is_busy and not any(each.is_open for each in room.members):
                    yield from self._give_up(room)

    def give_up_all(self) -> Steps:
        """Give up all rooms, also those in use."""
        for room in list(self.rooms.values()):
            yield from self._give_up(room)

    def _give_up(self, room: Room) -> Steps:
        db, life = self.world.db, self.life

        def forget() -> None:
            if db.rooms.get(room.stream, (0, 0))[0] == life:
                del db.rooms[room.stream]

        self.end_room(room)
        try:
            yield self.ask(forget)
        except LostError:
            return

    def drain(self) -> Steps:
        """Give the rooms up one by one, end, and begin again."""
        world, life = self.world, self.life
        self.draining = True

        def tell() -> None:
            if life in world.db.registered:
                world.db.registered[life].draining = True

        try:
            yield self.ask(tell)
            for room in list(self.rooms.values()):
                yield self.pause(0.02)
                yield from self._give_up(room)
        except LostError:
            pass
        world.after(0.5, self.start)
        self.crash()

    # --- rooms ------------------------------------------------------------------------------------

    def accept(self, connection: Connection) -> Steps:
        """Take a socket in, or relay it to the owner of its stream."""
        stream = connection.client.stream
        for tried in range(3):
            yield self.pause(0.3 * tried)
            try:
                kind, number = yield from self._owner(stream)
                if kind == "here":
                    connection.inner = None
                    room = yield from self._room(stream, number)
                    self.join(room, connection)
                    return
                if kind == "elsewhere" and (
                    yield self._relay(connection, self.world.editors[number])
                ):
                    return
            except LostError:
                continue
        connection.client.closed(connection)

    def _relay(self, connection: Connection, other: "Editor") -> Any:
        """Ask another editor to take a socket in."""
        world, pair = self.world, frozenset((self.n, other.n))

        def effect(done: Callable[..., None]) -> None:
            is_over = False

            def finish(taken: bool) -> bool:
                nonlocal is_over
                if is_over:
                    return False  # nobody waits for this socket any more
                is_over = True
                done(taken)
                return True

            def arrive() -> None:
                life = other.life
                if not is_over:
                    connection.inner, connection.inner_life = other, life
                    other.act(life, lambda: other.spawn(other.take_relayed(connection, finish)))

            slow = world.dice.choice((1, 1, 20))  # a new connection
            world.after(world.latency() * slow, lambda: world.over(pair, arrive))
            world.after(1.0, lambda: finish(False))

        return effect

    def take_relayed(self, connection: Connection, told: Callable[[bool], bool]) -> Steps:
        """Take a relayed socket in, if the stream is owned here; never relay it on."""
        stream = connection.client.stream
        try:
            kind, number = yield from self._owner(stream)
            if kind != "here" and self.world.mutant == "relay without 421":
                head = yield self.ask(lambda: self.world.db.heads.get(stream, Head()))
                kind, number = "here", head.epoch
            if kind == "here":
                room = yield from self._room(stream, number)
                if connection.is_open and told(True):
                    self.join(room, connection)
                return
        except LostError:
            pass
        told(False)

    def _room(self, stream: str, epoch: int) -> Steps:
        room = self.rooms.get(stream)
        if room is not None:
            return room
        if stream in self.loading:
            yield lambda done: self.loading[stream].append(done)
            if stream not in self.rooms:
                raise LostError
            return self.rooms[stream]
        loading = self.loading  # of this life
        loading[stream] = []
        try:
            db = self.world.db
            entries = yield self.ask(lambda: list(db.log.get(stream, [])))
            doc = {entry.edit for entry in entries}
            if self.world.mutant == "take over without loading":
                doc = set()
            room = self.rooms[stream] = Room(stream, epoch, len(entries), doc)
        finally:
            for done in loading.pop(stream, []):
                done()
        if self.mine.get(stream) != epoch and self.world.mutant != "relay without 421":
            self.end_room(room)
            raise LostError
        return room

    def join(self, room: Room, connection: Connection) -> None:
        """Let a socket join a room, and send it the document."""
        if room.has_ended or not connection.is_open:
            connection.client.closed(connection)
            return
        connection.room = room
        room.members.append(connection)
        doc = set(room.doc)
        self.send(connection, lambda: connection.client.joined(connection, doc))

    def send(self, connection: Connection, call: Callable[[], None]) -> None:
        """Send a message down to a client, by the editor that has its socket."""
        world = self.world
        connection.down = max(world.now + world.latency(), connection.down + 1e-6)

        def outer() -> None:
            if not connection.is_open:
                return
            connection.outer.act(connection.life, lambda: connection.is_open and call())

        delay = connection.down - world.now
        if connection.inner is None:
            world.after(delay, outer)
        else:
            pair = frozenset((connection.outer.n, connection.inner.n))
            world.after(delay, lambda: world.over(pair, outer))

    def receive(self, connection: Connection, edit: int) -> None:
        """Take an edit in."""
        room = connection.room
        if room is None or room.has_ended:
            return
        room.waiting.append((connection, edit))
        if not room.is_busy:
            room.is_busy = True
            self.world.after(0.005, lambda: self.act(self.life, lambda: self._batch(room)))

    def _batch(self, room: Room) -> None:
        if room.has_ended:
            return
        batch, room.waiting = room.waiting, []
        fresh: list[int] = []
        for _, edit in batch:
            if edit not in room.doc:
                room.doc.add(edit)
                fresh.append(edit)
        if not fresh:
            self._committed(room, batch, [], room.seq)
            return
        dice = self.world.dice
        note = self.world.number() if dice.random() < 0.3 else None
        if self.world.mutant == "acknowledge before the commit":
            self._acknowledge(batch)

        def done(seq: int | None) -> None:
            if room.has_ended:
                return
            if seq is None:
                self.end_room(room)
            else:
                self._committed(room, batch, fresh, seq)

        self.submit(Job(room.stream, fresh, room.seq, room.epoch, note, done))

    def _committed(
        self, room: Room, batch: list[tuple[Connection, int]], fresh: list[int], seq: int
    ) -> None:
        room.seq = seq
        self._acknowledge(batch)
        for member in room.members:
            self.send(member, lambda member=member: member.client.doc.update(fresh))
        room.is_busy = False
        if room.waiting:
            room.is_busy = True
            self.world.after(0.005, lambda: self.act(self.life, lambda: self._batch(room)))

    def _acknowledge(self, batch: list[tuple[Connection, int]]) -> None:
        for connection, edit in batch:
            self.send(
                connection,
                lambda connection=connection, edit=edit: connection.client.was_kept(edit, self.n),
            )

    def end_room(self, room: Room) -> None:
        """Close a room, and all sockets in it."""
        room.has_ended = True
        self.rooms.pop(room.stream, None)
        self.mine.pop(room.stream, None)
        for member in room.members:
            self.send(member, lambda member=member: member.client.closed(member))
