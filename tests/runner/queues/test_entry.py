"""The values of an entry of the queue: what it orders, and what of a look has to stay as it is."""

import msgspec

from action_assistant.runner.queues.entry import (
    QueueRequest,
    differences,
    digest_of,
    looked_of,
    order_of,
)
from action_assistant.runner.start.preflight import Item, Preflight, Verdict
from action_assistant.web.auth.graph_seals import Sight
from runner.queues.test_queues import on


def test_a_start_that_is_sent_again_is_the_same_order_although_its_rules_are_sealed_anew() -> None:
    start = on("David").start
    sights = (Sight(version="v", digest="d", graphs=(), rules=(), at=at) for at in (1, 2))
    sealed = [QueueRequest(start=msgspec.structs.replace(start, sight=each)) for each in sights]
    assert len({order_of(each) for each in (*sealed, QueueRequest(start=start))}) == 1
    assert order_of(QueueRequest(start=start, by_itself=True)) != order_of(
        QueueRequest(start=start)
    )


def test_one_of_several_checks_of_a_robot_that_is_worse_now_is_said() -> None:
    def look(*verdicts: Verdict) -> list[Preflight]:
        items = [Item(code="health", verdict=each, text=f"It is {each}.") for each in verdicts]
        return [Preflight("David", "", "", tuple(items), (), False)]

    before, now = look("passed", "passed"), look("warned", "passed")
    seen = looked_of(before, {})
    assert digest_of(seen, before, 1) != digest_of(looked_of(now, {}), now, 1)
    assert differences(seen, looked_of(now, {}), now) == ("It is warned.",)
    assert differences(seen, seen, before) == ()


def test_a_look_is_another_one_when_what_was_unknown_is_bad_or_at_another_turn() -> None:
    def digest(text: str, ready_at: int = 1) -> str:
        item = Item(code="health", verdict="warned", text=text)
        look = [Preflight("David", "", "", (item,), (), False)]
        return digest_of(looked_of(look, {}), look, ready_at)

    unknown = digest("The battery is unknown: the newest message is 31.5 s old.")
    assert unknown == digest("The battery is unknown: the newest message is 36 s old.")
    assert unknown != digest("The battery has 4 %.")
    assert unknown != digest("The battery is unknown: the newest message is 36 s old.", 2)
    assert digest("David does not know Work_1.") != digest("David does not know Work_2.")
