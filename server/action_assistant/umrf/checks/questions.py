"""Checks the actions that no robot carries out: what they ask people, and how long the runner waits.

See docs/decisions/140-people-as-performers.md.
"""

from action_assistant.umrf.checks.places import Subject, joined
from action_assistant.umrf.checks.subgraphs import SubGraphs
from action_assistant.umrf.json.text import pointer
from action_assistant.umrf.model import Action
from action_assistant.umrf.questions import is_asked, literal_faults


def check_questions(subject: Subject, graphs: SubGraphs) -> None:
    """Report in `subject` what is wrong with the questions and waits of a graph, and that one engine
    cannot be given them. `graphs`: its sub-graphs, which have been checked."""
    asked = [action for action in subject.real if is_asked(action)]
    for action in asked:
        for fault in literal_faults(action):
            member = pointer("input_parameters", fault.name, "pvf_value")
            message = f"{action.full_name}: {fault}"
            subject.report("question", "error", message, action=action, member=member)
    for action in subject.real:
        if action.name in graphs.by_name and (inner := _asked_inside(action.name, graphs)):
            message = (
                f"In the sub-graph “{action.name}”, {inner} asks people, or waits for a time. A sub-graph is "
                "carried out as a whole, so nobody can be asked there: open the sub-graphs at the start, "
                "or make one graph without graphs inside."
            )
            subject.report("question-inside", "error", message, action=action, member="/name")
    facts = subject.facts
    if asked and not (facts.simulated and facts.synchronises):
        names = joined({action.full_name for action in asked})
        message = (
            f"{names}: people are asked there, or the runner waits. No engine can do that, so the graph is led "
            "by the runner, step by step; one engine cannot be given it."
        )
        subject.report("asks-people", "warning", message, action=asked[0], also=asked[1:])


def _asked_inside(name: str, graphs: SubGraphs) -> str:
    """Return the full name of an action that is asked in a sub-graph, or in one inside of it; "" if
    none is."""
    seen: set[str] = set()
    left = [name]
    while left:
        each = left.pop()
        if each in seen or each not in graphs.by_name:
            continue
        seen.add(each)
        found: list[Action] = list(filter(is_asked, graphs.by_name[each].actions))
        if found:
            return found[0].full_name
        left += [action.name for action in graphs.by_name[each].actions if not action.missing]
    return ""
