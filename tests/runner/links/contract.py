"""Every link keeps these promises: a simulator, an emulated robot or a real engine.

A promise is a coroutine function over a `Bench`. It works in virtual and in real time, so it waits
for what must happen and never for a number of seconds to pass.
"""

from collections.abc import Awaitable, Callable
from contextlib import suppress

import anyio
import msgspec
import pytest

from action_assistant.runner.execution.evidence import difference
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.links.port import (
    Answer,
    EngineRefused,
    Feedback,
    Link,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Transitions,
)
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph


class Bench(msgspec.Struct, frozen=True, kw_only=True):
    """A link that is kept going, and two graphs for its engine: `endless` goes on for at least ten
    seconds, `quick` ends by itself within five. `patience` is how long anything may take."""

    link: Link
    endless: Graph
    quick: Graph
    patience: float = 20.0


Promise = Callable[[Bench], Awaitable[None]]


def placed(graph: Graph, run: str) -> Order:
    """A start of a graph as a run."""
    return Order(run=run, graph=graph, umrf=codec.write(graph, codec.Stamp("g", "v", run)))


async def answer(bench: Bench) -> Answer:
    """An answer, however often it has to be asked for."""
    with anyio.fail_after(bench.patience):
        while True:
            with suppress(NoAnswer, TimeoutError), anyio.fail_after(1):
                return await bench.link.get()
            await anyio.sleep(0.05)


async def shown(bench: Bench, graph: Graph, true: Callable[[Snapshot], bool]) -> Snapshot:
    """The graph as soon as it is shown like this."""
    with anyio.fail_after(bench.patience):
        while True:
            for each in (await answer(bench)).graphs:
                if each.graph == graph.name and true(each):
                    return each
            await anyio.sleep(0.05)


def moves(snapshot: Snapshot) -> bool:
    """An action runs."""
    return snapshot.active


def has_ended(*states: str) -> Callable[[Snapshot], bool]:
    """The graph has ended like this, and nothing moves."""
    return lambda snapshot: snapshot.state in states and not snapshot.active


async def an_answer_shows_a_graph_under_the_identity_it_was_started_with(bench: Bench) -> None:
    await bench.link.start(placed(bench.endless, "r1"))
    found = await shown(bench, bench.endless, moves)
    assert (found.run, found.state, found.source) == ("r1", "RUNNING", "get")
    names = {each.full_name for each in bench.endless.actions}
    assert found.nodes.keys() == names


async def the_answer_to_a_get_tells_when_it_was_asked_for(bench: Bench) -> None:
    first, second = await answer(bench), await answer(bench)
    assert first.asked_at <= first.at <= second.asked_at <= second.at


async def a_graph_that_has_ended_stays_in_the_answers(bench: Bench) -> None:
    await bench.link.start(placed(bench.quick, "r2"))
    found = await shown(bench, bench.quick, has_ended("FINISHED"))
    assert found.run == "r2"


async def stop_may_be_sent_again_and_again_and_for_graphs_that_are_not_there(bench: Bench) -> None:
    await bench.link.stop("nothing")
    await bench.link.start(placed(bench.endless, "r3"))
    await shown(bench, bench.endless, moves)
    for _ in range(5):
        await bench.link.stop(bench.endless.name)
    await shown(bench, bench.endless, has_ended("STOPPED"))
    await bench.link.stop(bench.endless.name)
    assert (await shown(bench, bench.endless, lambda _: True)).state == "STOPPED"


async def the_incarnation_stays_for_one_life_of_an_engine(bench: Bench) -> None:
    before = (await answer(bench)).incarnation
    await bench.link.start(placed(bench.quick, "r4"))
    await shown(bench, bench.quick, has_ended("FINISHED"))
    assert before == (await answer(bench)).incarnation
    assert before == bench.link.standing.incarnation
    assert before != ""


async def a_start_of_a_running_graph_starts_nothing_and_stops_that_one(bench: Bench) -> None:
    await bench.link.start(placed(bench.endless, "r5"))
    await shown(bench, bench.endless, moves)
    with suppress(EngineRefused):  # real ones do not say so
        await bench.link.start(placed(bench.endless, "r6"))
    found = await shown(bench, bench.endless, has_ended("STOPPED"))
    assert found.run == "r5"


async def what_goes_on_is_told_without_being_asked_for(bench: Bench) -> None:
    heard: list[Report] = []

    def ours() -> list[str]:
        told = [each for each in heard if isinstance(each, Transitions) and each.run == "r7"]
        seen = [each for batch in heard if isinstance(batch, Feedback) for each in batch.snapshots]
        return [each.run for each in told] + [each.run for each in seen if each.run == "r7"]

    with bench.link.listen(heard.append):
        await bench.link.start(placed(bench.quick, "r7"))
        await shown(bench, bench.quick, has_ended("FINISHED"))
        with anyio.fail_after(bench.patience):
            while not ours():  # noqa: ASYNC110 - it comes by itself
                await anyio.sleep(0.05)


async def what_is_shown_is_what_was_sent(bench: Bench) -> None:
    await bench.link.start(placed(bench.quick, "r8"))
    await shown(bench, bench.quick, has_ended("FINISHED"))
    text = (await answer(bench)).texts.get(bench.quick.name)
    assert text is None or difference(bench.quick, text) == ""


async def commands_of_our_own_are_not_reported_as_those_of_others(bench: Bench) -> None:
    heard: list[Report] = []
    with bench.link.listen(heard.append):
        await bench.link.start(placed(bench.endless, "r9"))
        await shown(bench, bench.endless, moves)
        await bench.link.stop(bench.endless.name)
        await shown(bench, bench.endless, has_ended("STOPPED"))
    assert not [each for each in heard if type(each).__name__ == "ForeignCommand"]


async def a_start_that_is_held_back_in_its_last_step_never_leaves(bench: Bench) -> None:
    def hold() -> None:
        raise NotSent("held")

    with pytest.raises(NotSent, match="held"):
        await bench.link.start(placed(bench.endless, "r10"), hold)
    await bench.link.start(placed(bench.quick, "r11"))
    await shown(bench, bench.quick, lambda snapshot: snapshot.run == "r11")
    assert not [each for each in (await answer(bench)).graphs if each.run == "r10"]


PROMISES: tuple[Promise, ...] = (
    an_answer_shows_a_graph_under_the_identity_it_was_started_with,
    the_answer_to_a_get_tells_when_it_was_asked_for,
    a_graph_that_has_ended_stays_in_the_answers,
    stop_may_be_sent_again_and_again_and_for_graphs_that_are_not_there,
    the_incarnation_stays_for_one_life_of_an_engine,
    a_start_of_a_running_graph_starts_nothing_and_stops_that_one,
    what_goes_on_is_told_without_being_asked_for,
    what_is_shown_is_what_was_sent,
    commands_of_our_own_are_not_reported_as_those_of_others,
    a_start_that_is_held_back_in_its_last_step_never_leaves,
)


async def keep(promise: Promise, bench: Bench) -> None:
    """Hold a promise, and leave nothing running behind."""
    try:
        await promise(bench)
    finally:
        with anyio.move_on_after(bench.patience, shield=True), suppress(Exception):
            await bench.link.stop(bench.endless.name)
            await bench.link.stop(bench.quick.name)
            while any(each.active for each in (await answer(bench)).graphs):  # noqa: ASYNC110
                await anyio.sleep(0.05)
