"""The items of a pre-flight about where a run begins, and those that only led runs have: what leading a
graph means, which robots it moves, whether their owners allow it, and whether their engines may be
asked as often as it asks.

The last one is about hazard H15. An engine that reads its folders again while it is asked may
abort, with all that runs there, and a led run asks often. Where the runner cannot see how an engine
was started, a person says that it indexes once. That word counts for one life of the engine, and is
asked for again after its restart.
"""

from collections import Counter
from typing import ClassVar, Final

import anyio
import msgspec

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.links.port import Registration, Standing
from action_assistant.runner.runs.earlier import StartFrom
from action_assistant.runner.runs.earlier_views import earlier_view
from action_assistant.runner.runs.events import Author, draft_of
from action_assistant.runner.runs.history import RunnerJournal
from action_assistant.runner.start.admission import Prepared, PreparedPieces
from action_assistant.runner.start.preflight import SHOWN, Item, Preflight, Verdict, counted
from action_assistant.runner.start.start_from import beginning_text, is_doubtful
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.questions import spoken

#: The stream of all words about indexing.
STREAM: Final = "indexing"
#: The code of the item, and the one under which a start gives the word.
INDEXING: Final = "indexing"
#: What leading a graph step by step means: by code of its problems, whether a person has to accept it, and
#: what the start does then.
_LED: Final[tuple[tuple[str, Verdict, str], ...]] = (
    ("two-at-once", "blocked", "Accept that, or let one robot do one thing at a time."),
    ("stop-across", "blocked", ""),
    ("loaded-anew", "warned", ""),
)


def led_items(ready: PreparedPieces) -> tuple[Item, ...]:
    """Return the items about a graph that is led step by step: which robots it moves, and what differs
    from handing it over as a whole."""
    found = [_moving(ready)]
    if ready.asked:
        found.append(_asking(ready))
    for code, verdict, text in _LED:
        problems = tuple(each for each in ready.problems if each.code == code)
        if problems:
            more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
            said = (f"{problems[0].message}{more}", text, ready.remedies.get(code, ""))
            found.append(
                Item(
                    code=code,
                    verdict=verdict,
                    text=" ".join(filter(None, said)),
                    codes=(code,) if verdict == "blocked" else (),
                    overridable=verdict == "blocked",
                    problems=problems[:SHOWN],
                )
            )
    return tuple(found)


def beginning_items(ready: Prepared, start: StartFrom | None) -> tuple[Item, ...]:
    """Return the items that say where a start begins and what it takes for granted; none for the
    entry."""
    begins = ready.beginning
    if begins is None or start is None:
        return ()
    text = beginning_text(start, begins.earlier)
    verdict: Verdict = "warned" if is_doubtful(begins.earlier) else "passed"
    found = [Item(code="begins", verdict=verdict, text=text)]
    if begins.lacks:
        found.append(Item(code="choices", verdict="blocked", text=begins.lacks))
    return tuple(found)


def with_beginning(look: Preflight, ready: Prepared, start: StartFrom | None) -> Preflight:
    """Return a pre-flight with what the start takes for granted."""
    if ready.beginning is None:
        return look
    return msgspec.structs.replace(look, earlier=earlier_view(ready.beginning.earlier, start))


def _moving(ready: PreparedPieces) -> Item:
    """Return the pre-flight item that says which robots a led run moves, with the number of actions
    of each, and how many actions only the simulator plays."""
    played = Counter(ready.players.values())
    simulated = len(ready.whole.actions) - played.total() - len(ready.asked)
    robots = [f"{name} ({counted(count, 'action')})" for name, count in sorted(played.items())]
    if not robots:
        text = "Only the simulator plays: nothing moves." if simulated else "Nothing moves."
    else:
        text = f"{', '.join(robots)} may begin to move at any time until the run ends."
        if simulated:
            text += f" The simulator plays {counted(simulated, 'other action')} and moves nothing."
    return Item(code="moves", verdict="passed", text=text)


def _asking(ready: PreparedPieces) -> Item:
    """Return the pre-flight item that says which actions people answer, and for which the runner waits."""
    people = [spoken(name) for name, each in ready.asked.items() if each.by == "people"]
    waits = [spoken(name) for name, each in ready.asked.items() if each.by == "runner"]
    texts: list[str] = []
    if people:
        texts.append(f"People answer {_listed(people)}.")
    if waits:
        texts.append(f"The runner waits for {_listed(waits)}.")
    return Item(code="asks", verdict="passed", text=" ".join(texts))


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return f"{', '.join(names[:5])}{more}"


def led_item(robot: Registration) -> Item:
    """Return the item that says whether the owner of a robot allows runs that the runner leads."""
    if robot.led:
        text = f"The owner of {robot.name} allows led runs."
        return Item(code="led", verdict="passed", text=text)
    text = f"Led runs are off for {robot.name}: its owner can switch them on in its registration."
    return Item(code="led", verdict="blocked", text=text)


class IndexesOnce(msgspec.Struct, frozen=True, kw_only=True):
    """A person said that the engine of a robot does not index while it runs. `life`: the incarnation
    of the engine; `reason`: how the person knows."""

    kind: ClassVar[str] = "engine.indexes_once.v1"

    at: int
    robot: str
    life: str
    author: Author
    reason: str


class IndexingWords:
    """Stores the words of people about indexing and reads them, each event once. Raises Unavailable
    while the journal cannot be used."""

    def __init__(self, journal: RunnerJournal, clock_us: ClockUs) -> None:
        self._journal = journal
        self._clock_us = clock_us
        self._seq = 0
        self._newest: dict[str, IndexesOnce] = {}  # by robot
        self._reading = anyio.Lock()

    async def give(self, robot: str, life: str, author: Author, reason: str) -> None:
        """Store the word of a person about this life of a robot's engine."""
        word = IndexesOnce(
            at=self._clock_us(), robot=robot, life=life, author=author, reason=reason.strip()
        )
        await self._journal.append(STREAM, [draft_of(word, author.id)])

    async def of(self, robot: str, life: str) -> IndexesOnce | None:
        """Return the newest word about a robot's engine; None if it is about another life."""
        async with self._reading:
            while events := await self._journal.read(STREAM, after=self._seq, limit=500):
                for event in events:
                    if event.kind == IndexesOnce.kind:
                        word = msgspec.json.decode(event.body, type=IndexesOnce)
                        self._newest[word.robot] = word
                self._seq = events[-1].seq
        found = self._newest.get(robot)
        return found if found is not None and found.life == life else None


def indexing_item(
    robot: str, facts: EngineFacts, standing: Standing, word: IndexesOnce | None
) -> Item:
    """Return the item that says whether a robot's engine may be asked as often as a led run does."""
    if "H15" not in facts.hazards:
        text = f"By the profile of {robot}, its engine can be asked while it indexes."
        return Item(code=INDEXING, verdict="passed", text=text)
    if standing.indexes is False:
        text = f"The engine of {robot} does not index while it runs."
        return Item(code=INDEXING, verdict="passed", text=text)
    if standing.indexes:
        text = (
            f"The engine of {robot} indexes again and again while it runs, and a led run asks it often: it "
            "may abort then, with all that runs there (H15). Start it with --indexing-rate 0."
        )
        return Item(code=INDEXING, verdict="blocked", text=text)
    if word is not None:
        text = (
            f"{word.author.name or 'Somebody'} said, since its last restart, that the engine of {robot} "
            f"does not index while it runs: “{word.reason}”."
        )
        return Item(code=INDEXING, verdict="passed", text=text)
    text = (
        f"How the engine of {robot} was started cannot be seen from here. If it indexes while it runs, it "
        "may abort when a led run asks it (H15). Start it with --indexing-rate 0, and say so here: that "
        "counts until it is restarted."
    )
    return Item(code=INDEXING, verdict="blocked", text=text, codes=(INDEXING,), overridable=True)
