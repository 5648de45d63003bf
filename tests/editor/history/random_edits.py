"""People who edit a graph at random, at once and one after another, and what came of each edit."""

import random
import string
from collections.abc import Callable
from typing import Any, Final

import msgspec
from pycrdt import Doc, Map

from action_assistant.editor.documents.document import Maps, maps_of
from action_assistant.editor.history.change_summaries import graph_of
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.rooms.open_rooms import Rooms

GRAPH: Final = "g"
PEOPLE: Final = ("ada", "mari", "hella")
_OUTCOMES: Final = ("on_true", "on_false", "on_error")
_RESPONSES: Final = ("run", "stop", "ignore")


class Person:
    """A person with a document of their own."""

    def __init__(self, name: str, dice: random.Random) -> None:
        self.name = name
        self.doc: Doc[Any] = Doc()
        self._dice = dice
        self._made: list[bytes] = []
        self.doc.observe(lambda event: self._made.append(event.update))

    def hear(self, update: bytes) -> None:
        """Take what others did."""
        self.doc.apply_update(update)
        self._made.clear()

    def edit(self) -> list[bytes]:
        """Do something; as the updates that a page would send."""
        self._made.clear()
        for _ in range(self._dice.choice((1, 1, 1, 2, 3))):
            with self.doc.transaction():
                self._dice.choice(_EDITS)(self)
        return [*self._made]

    def map(self, root: str) -> "Map[Any]":
        """A root map."""
        found: Map[Any] = self.doc.get(root, type=Map)
        return found

    def actions(self) -> list[str]:
        """The keys of actions."""
        return sorted(key for key in self.map("actions") if "|" not in key)

    def some_action(self) -> str | None:
        """Return one of the actions at random, or None."""
        return self._dice.choice(actions) if (actions := self.actions()) else None

    def number(self) -> int:
        """A number that is not often the same."""
        return self._dice.randrange(1000)

    def new_aid(self) -> str:
        """A key for an action."""
        return "".join(self._dice.choices(string.ascii_letters, k=12))

    def long_number(self) -> int:
        """A number that is hardly ever the same."""
        return self._dice.randrange(10**9)

    def one_of(self, values: tuple[str, ...]) -> str:
        """Return one of the values at random."""
        return self._dice.choice(values)


def _add(me: Person) -> None:
    key = me.new_aid()
    me.map("actions")[key] = f"Act{me.long_number()}"
    me.map("actions")[f"{key}|order"] = float(me.number())
    me.map("positions")[key] = [float(me.number()), 2.0]


def _type(me: Person) -> None:
    if (key := me.some_action()) is not None:
        me.map("actions")[f"{key}|in/speed"] = f'{{"pvf_type":"number","pvf_value":{me.number()}}}'


def _rename(me: Person) -> None:
    if (key := me.some_action()) is not None:
        me.map("actions")[key] = f"Act{me.long_number()}"


def _drag(me: Person) -> None:
    if (key := me.some_action()) is not None:
        me.map("positions")[key] = [1.0, float(me.number())]


def _connect(me: Person) -> None:
    parent, child = me.some_action(), me.some_action()
    if parent and child and parent != child:
        me.map("relations")[f"{parent}>{child}|{me.one_of(_OUTCOMES)}"] = me.one_of(_RESPONSES)


def _cut(me: Person) -> None:
    relations = me.map("relations")
    if keys := sorted(relations):
        head = keys[me.number() % len(keys)].partition("|")[0]
        for key in [each for each in keys if each.startswith(f"{head}|")]:
            del relations[key]


def _delete(me: Person) -> None:
    if (key := me.some_action()) is None:
        return
    for root in ("actions", "positions"):
        shared = me.map(root)
        for each in [k for k in shared if k.partition("|")[0] == key]:
            del shared[each]
    relations = me.map("relations")
    for each in [k for k in relations if key in k.partition("|")[0].split(">")]:
        del relations[each]


def _note(me: Person) -> None:
    me.map("positions")[f"g/n{me.number() % 4}"] = f'{{"text":"note {me.number()}"}}'


def _say(me: Person) -> None:
    me.map("comments")[f"t{me.number() % 3}/m{me.number()}"] = '"look"'


def _describe(me: Person) -> None:
    me.map("meta")["description"] = f"the {me.number()}"


def _again(me: Person) -> None:
    """Write the present description again."""
    me.map("meta")["description"] = me.map("meta").get("description", "")


_EDITS: Final[list[Callable[[Person], None]]] = [
    *[_add] * 4,
    *[_type] * 4,
    _rename,
    _drag,
    *[_connect] * 3,
    _cut,
    _delete,
    _note,
    _say,
    _describe,
    _again,
]


async def edited(rooms: Rooms, seed: int, edits: int) -> list[Maps]:
    """Edit the graph; what the document held after each event, by its number less one."""
    dice = random.Random(seed)
    people = [Person(name, dice) for name in PEOPLE]
    waiting: dict[str, list[bytes]] = {name: [] for name in PEOPLE}
    held: list[Maps] = []
    async with rooms.enter(graph_stream(GRAPH)) as room:

        async def submit(author: str, update: bytes) -> None:
            before = room.seq
            if await room.submit(update, author) > before:
                held.append(maps_of((await room.quiet()).doc))
            for other in people:
                if other.name != author:
                    waiting[other.name].append(update)

        for _ in range(edits):
            me = dice.choice(people)
            if dice.random() < 0.8:  # else they have not yet heard what others did
                for update in waiting[me.name]:
                    me.hear(update)
                waiting[me.name].clear()
            made = me.edit()
            if len(made) > 1 and dice.random() < 0.3:
                made.reverse()  # one overtakes the other
            for update in made:
                await submit(me.name, update)
    return held


def plain(maps: Maps) -> bytes:
    """Maps as bytes that are the same when the maps are."""
    return msgspec.msgpack.encode(maps, order="deterministic")


__all__ = ["GRAPH", "PEOPLE", "edited", "graph_of", "plain"]
