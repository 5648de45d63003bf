"""The words of an order, and the yes to it, are for those who may see all of its graphs."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from action_assistant.errors import Conflict, Forbidden
from action_assistant.runner.api.approvals import shown_to
from action_assistant.runner.execution.service import ExecutionService
from action_assistant.runner.execution.start_checks import StartSources
from action_assistant.runner.links.port import Registration
from action_assistant.runner.runs.events import Author
from action_assistant.runner.start.approvals import ApprovalQuestion, ApprovalRequest
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.web.auth.graph_rules import OPEN, Rule
from action_assistant.web.auth.graph_seals import Sight
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Person
from runner.execution.test_conducted_subgraphs import TASK, looking
from runner.execution.test_conductor import Lab
from runner.execution.test_opened_levels import MIXED, opened
from runner.harness import ANN, BEN, until, virtual
from runner.runs.test_sight import NOW, Sights

CARL = Author("carl", "Carl")
FOR_CARL = Rule((CARL.id,), ())


def operator(author: Author) -> Identity:
    return Identity(Person(author.id, author.name, "operator"))


def told(control: ExecutionService, questions: Any, by: Author) -> str:
    unseen = control.sight.unseen(operator(by))
    return msgspec.json.encode([shown_to(each, unseen) for each in questions]).decode()


async def careful(control: ExecutionService) -> None:
    """Let each robot ask for a second person."""
    for name in ("David", "Carol"):
        demanding = Registration(name=name, led=True, profile={"second_person": True})
        control.robots.add(demanding)
    await until(lambda: all(control.robots.robot(n).heard_at for n in ("David", "Carol")))


def start(sights: Sights, rule: Rule, at: int) -> Any:
    """The start of a graph that everybody sees, with an opened graph inside under this rule."""
    inside = (Breakpoint(action="Work_1", inside="Pick"),)
    asked = opened(MIXED, breakpoints=inside)
    (pick,) = asked.subgraphs
    pick = msgspec.structs.replace(pick, graph="pick")
    sight = Sight("v1", asked.digest, ("g1", "pick"), (OPEN, rule), NOW + at * 1_000_000)
    return msgspec.structs.replace(asked, subgraphs=(pick,), sight=sights.seals.sealed(sight))


async def order_of(control: ExecutionService, request: Any, by: Author) -> str:
    looks = await control.look(looking(request), by.id, operator(by))
    return next(each.order_digest for each in looks if each.order_digest)


@virtual
async def test_who_may_not_see_a_graph_inside_reads_no_word_of_the_order_and_says_no_yes(
    tmp_path: Path,
) -> None:
    sights, lab = Sights(tmp_path), Lab({"*": [{"after_s": 1}]})
    lab.harness.sources = StartSources(sight=sights.runner)
    async with lab.runner() as control:
        await careful(control)
        both = Rule((ANN.id, CARL.id), ())
        request = start(sights, both, 1)
        digest = await order_of(control, request, ANN)
        question = ApprovalQuestion(
            digest=digest, robots=("David",), graph_name=TASK.name, graph="g1"
        )
        await control.approvals.ask(question, ANN)
        questions = await control.approvals.questions_of("g1")
        assert 'of the sub-graph \\"Pick\\"' in told(control, questions, CARL)
        hidden = told(control, questions, BEN)
        assert "Pick" not in hidden
        assert digest not in hidden
        assert "You may not see all graphs of this start, so you cannot say yes" in hidden
        assert all(each in hidden for each in ("David", '"name":"Ann"'))

        said = ApprovalRequest(digest=digest, graph="g1")
        for graph in ("g1", None):
            with pytest.raises(Forbidden, match="has to see the whole order"):
                await control.approvals.require_seen(digest, graph, operator(BEN))
        await control.approvals.require_seen(digest, "g1", operator(CARL))
        await control.approvals.give(said, BEN)  # as before anybody asked
        with pytest.raises(Conflict, match="Ben, who did, may not see all of it"):
            await control.start(request, ANN, operator(ANN))
        await control.approvals.give(said, CARL)
        run = (await control.start(request, ANN, operator(ANN))).run.id
        control.stop_all(ANN)
        await until(lambda: run not in control.open)


@virtual
async def test_who_may_no_longer_see_a_graph_inside_has_said_no_yes(tmp_path: Path) -> None:
    sights, lab = Sights(tmp_path), Lab({"*": [{"after_s": 1}]})
    lab.harness.sources = StartSources(sight=sights.runner)
    async with lab.runner() as control:
        await careful(control)
        request = start(sights, OPEN, 1)
        digest = await order_of(control, request, ANN)
        await control.approvals.require_seen(digest, "g1", operator(BEN))
        await control.approvals.give(ApprovalRequest(digest=digest, graph="g1"), BEN)
        narrow = start(sights, Rule((ANN.id,), ()), 2)
        with pytest.raises(Conflict, match="Ben, who did, may not see all of it"):
            await control.start(narrow, ANN, operator(ANN))
        await control.start(start(sights, OPEN, 3), ANN, operator(ANN))
        control.stop_all(ANN)
        await until(lambda: not control.open)
