"""The courses of a small graph show which actions run at the same time, and which run again."""

from hypothesis import HealthCheck, assume, given, settings
from msgspec.structs import replace

from action_assistant.umrf.courses.together import together
from action_assistant.umrf.model import PRECONDITIONS, Conditions, Graph, Parameter
from action_assistant.umrf.semantics import NodeResultEvent, NodeStateEvent, simulate
from support.doses import examples
from umrf.checks.test_overlaps import CALLS, Calls, scripted
from umrf.drawn import busy_graphs
from umrf.semantics.traces import graph_of, optional

TRUE = Conditions("run", "ignore", "ignore", "ignore")
FALSE = Conditions("ignore", "run", "ignore", "ignore")
ERROR = Conditions("ignore", "ignore", "run", "ignore")


def names(graph: Graph) -> dict[str, str]:
    return {action.key: action.name for action in graph.actions}


def again(graph: Graph) -> set[str]:
    found = together(graph)
    assert found is not None
    return {names(graph)[key] for key in found.again}


def beside(graph: Graph) -> set[frozenset[str]]:
    found = together(graph)
    assert found is not None
    name = names(graph)
    return {frozenset({name[a], name[b]}) for a, others in found.beside.items() for b in others}


RETRY = optional(
    graph_of(
        *("entry>A", "A>B", "B>A", "B>C", "B>D", "C>E", "D>E", "E>exit"),
        AB=TRUE, BA=FALSE, BC=TRUE, BD=TRUE, CE=TRUE, DE=TRUE,
    ),
    "B>A",
)  # fmt: skip


def test_what_follows_a_loop_runs_once_where_the_way_out_excludes_the_way_back() -> None:
    assert again(RETRY) == {"A", "B"}
    assert beside(RETRY) == {frozenset("CD")}


def test_what_follows_a_loop_runs_again_where_one_outcome_leads_out_and_back() -> None:
    way = {"AB": TRUE, "BA": TRUE, "BC": TRUE, "Cexit": TRUE}
    both = optional(graph_of("entry>A", "A>B", "B>A", "B>C", "C>exit", **way), "B>A")
    assert again(both) == {"A", "B", "C"}
    assert frozenset("AC") in beside(both)


def test_two_ways_to_one_action_that_exclude_each_other_let_it_run_once() -> None:
    graph = graph_of(
        *("entry>A", "A>B", "A>H", "B>H", "B>exit", "H>exit"), AB=TRUE, AH=ERROR, BH=FALSE
    )
    graph = optional(graph, "A>H", "B>H", "B>exit", "H>exit")
    assert again(graph) == set()
    assert beside(graph) == set()


def test_a_course_goes_on_past_an_exit_that_waits_for_an_output() -> None:
    ends = Conditions("run", "ignore", "run", "ignore")
    graph = graph_of(
        *("entry>Look", "Look>Go", "Look>exit", "Go>Lift", "Go>Wave", "Wave>Look", "Lift>exit"),
        LookGo=TRUE, Lookexit=ends, GoLift=TRUE, GoWave=TRUE, WaveLook=FALSE, Liftexit=TRUE,
    )  # fmt: skip
    graph = optional(graph, "Look>exit", "Lift>exit", "Wave>Look")
    assert beside(graph) == set(), "it ends when Look has ended"
    text = Parameter(path="p", text='{"pvf_type":"string"}')
    lifts = (replace(a, outputs=(text,)) if a.name == "Lift" else a for a in graph.actions)
    graph = replace(graph, actions=tuple(lifts))  # the exit takes that, and Look has none
    assert frozenset({"Lift", "Wave"}) in beside(graph)
    assert again(graph) >= {"Look", "Go"}


def test_nothing_is_said_of_a_graph_that_stops_an_action_or_has_too_many_courses() -> None:
    stops = Conditions("stop", "ignore", "ignore", "ignore")
    assert together(graph_of("entry>A", "entry>B", "A>B", "B>exit", AB=stops)) is None
    assert together(RETRY, budget=20) is None


def _followed(graph: Graph) -> Graph:
    """Return the graph with every answer but run and bypass ignored."""
    relations = []
    for relation in graph.relations:
        answers = {o: relation.conditions.answer(o) for o in PRECONDITIONS}
        kept = {o: a if a in {"run", "bypass"} else "ignore" for o, a in answers.items()}
        relations.append(replace(relation, conditions=replace(relation.conditions, **kept)))
    return replace(graph, relations=tuple(relations))


@given(busy_graphs(), CALLS)
@settings(max_examples=examples(200), deadline=None, suppress_health_check=list(HealthCheck))
def test_no_simulation_shows_more_at_once_or_again(graph: Graph, calls: Calls) -> None:
    graph = _followed(graph)
    found = together(graph)
    assume(found is not None)
    assert found is not None
    keys = {action.full_name: action.key for action in graph.actions}
    now: set[str] = set()
    begun: set[str] = set()
    for trace in simulate(graph, script=scripted(graph, calls), max_events=400, until_ms=60_000):
        match trace:
            case NodeStateEvent(node=node, state="RUNNING"):
                assert node not in begun or keys[node] in found.again
                begun.add(node)
                now.add(node)
                for other in now - {node}:
                    assert keys[other] in found.beside[keys[node]]
                    assert keys[node] in found.beside[keys[other]]
            case NodeResultEvent(node=node) | NodeStateEvent(node=node):
                now.discard(node)
            case _:
                pass
