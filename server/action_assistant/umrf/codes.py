"""The codes of problems: meaning, severity, consequence and fixes of each.

Checks may report only these; *Help* makes the tables of its page *UMRF here* from them.
"""

from collections.abc import Iterator
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.model import Problem, Severity

#: `unreadable`: there is no graph. `refused`: the engine's parser refuses the text. `structural`: the parser takes it and
#: the start does not. `unsendable`: it is sent to no robot. `hazard`: one of docs/umrf-and-the-engine.md 3.
Kind: TypeAlias = Literal["unreadable", "refused", "structural", "unsendable", "hazard", "other"]


class Code(msgspec.Struct, frozen=True):
    """One kind of problem that checks report. `fixes`: the names of the fixes that `fixes.fix` can
    apply to it."""

    kind: Kind
    severities: tuple[Severity, ...]
    meaning: str
    consequence: str
    fixes: tuple[str, ...] = ()


_ERROR: Final[tuple[Severity, ...]] = ("error",)
_WARNING: Final[tuple[Severity, ...]] = ("warning",)
_BOTH: Final[tuple[Severity, ...]] = ("error", "warning")
_REFUSES: Final = "the engine refuses the graph"
_NO_GRAPH: Final = "nothing is read"


def _unreadable(meaning: str) -> Code:
    return Code("unreadable", _ERROR, meaning, _NO_GRAPH)


def _refused(meaning: str, *fixes: str) -> Code:
    return Code("refused", _ERROR, meaning, _REFUSES, fixes)


CODES: Final[dict[str, Code]] = {
    # The text
    "not-json": _unreadable("the text is not JSON (NaN and Infinity are not JSON either)"),
    "not-utf-8": _unreadable("the text is not UTF-8"),
    "not-umrf": _unreadable("JSON without anything of UMRF"),
    "double-key": _unreadable("an object names a key twice"),
    "lone-surrogate": _unreadable("half of a character pair in a text"),
    "number-too-big": _unreadable("a number that no double can hold"),
    "too-deep": _unreadable("more than 64 levels"),
    "too-large": _unreadable("more than 10 MB, or more than a million values"),
    # Refused by the engine's parser
    "dialect-old": _refused("the form of an earlier engine, or of the designer"),
    "graph-name-missing": _refused("no `graph_name`"),
    "entry-exit-missing": _refused("several actions without `graph_entry` or `graph_exit`"),
    "action-illegal": _refused("an item of `actions` that is no object"),
    "name-empty": _refused("an action without a name"),
    "type-missing": _refused("an action without `type`"),
    "type-empty": _refused("an action with an empty `type`", "type-sync"),
    "value-type": _refused("a field of the wrong JSON type"),
    "state-illegal": _refused("a `state` or `graph_state` that the engine does not know"),
    "runtime-illegal": _refused("a `runtime` without messages as the engine writes them"),
    "relation-unnamed": _refused("a relation without a name"),
    "condition-illegal": _refused("a condition that is not `precondition -> response`"),
    "remap-illegal": _refused("a renaming that repeats a `from` or lacks an end"),
    "parameter-illegal": _refused("a parameter whose members do not fit its `pvf_type`"),
    # Refused by the engine's start
    "ghost": Code(
        "structural", _ERROR, "a relation with an action that does not exist",
        "at the entry or exit the engine refuses the graph, elsewhere it aborts or never starts it",
        ("remove-relation",),
    ),
    "instance-id": Code(
        "structural", _ERROR, "a number that relations cannot refer to (0 to 65,535)",
        "the engine cuts it in relations, which then miss the action", ("renumber",),
    ),
    "H6": Code(
        "structural", _ERROR, "two actions with one full name, or one called like an end",
        "the start throws, and a broken graph stays in the engine", ("renumber",),
    ),
    # Sent to no robot
    "graph-name": Code(
        "unsendable", _ERROR, "control characters, `%`, or more than 200 characters in the graph's name",
        "nothing is sent: no log or file can carry the name, and the engine dies of `%` when it logs an error about it",
    ),
    "graph-name-empty": Code(
        "unsendable", _ERROR, "an empty `graph_name`", "nothing is sent: nobody could tell in a log or a Stop which graph is meant",
    ),
    "action-name": Code(
        "unsendable", _ERROR, "control characters, `%`, or more than 200 characters in an action's name",
        "as for the name of a graph",
    ),
    # Hazards
    "H1": Code(
        "hazard", _ERROR, "the file carries a run state",
        "the engine aborts with every running graph, or the action never runs",
    ),
    "H2": Code(
        "hazard", _ERROR, "a child that does not list its parent, or a renamed output that is none",
        "the engine aborts with every running graph when the parent ends", ("mirror-relation",),
    ),
    "H2b": Code(
        "hazard", _BOTH, "a parent that does not list its child",
        "the child is never started (error if it needs this parent)", ("mirror-relation",),
    ),
    "H3": Code(
        "hazard", _WARNING, "`bypass` to an action, also the default of `on_error`",
        "this build reads freed memory and may abort with every running graph, or answer nothing any more",
    ),
    "H4": Code(
        "hazard", _WARNING, "`run` may reach an action that is being paused or stopped, or still loads",
        "the engine aborts with every running graph",
    ),
    "H5": Code(
        "hazard", _WARNING, "`pause` and `stop` of one action, a pause that nothing ends, a loop that takes no time",
        "the action ends in ERROR, stays PAUSED, or the engine blocks itself",
    ),
    "H7": Code(
        "hazard", _BOTH, "an entry action whose required input has no value",
        "the engine says nothing and never starts the graph", ("take-example",),
    ),
    "H8": Code(
        "hazard", _BOTH, "something waits for what may never come (error: never comes)",
        "the graph stays RUNNING for ever", ("not-required", "outputs-optional", "take-example"),
    ),
    "H9": Code(
        "hazard", _ERROR, "a spontaneous action that leads into a loop",
        "the engine recurses until it dies with every running graph",
    ),
    "H12": Code(
        "hazard", _BOTH, "the graph can be FINISHED while actions still run (error: a spontaneous one does when all goes well)",
        "the engine ignores every stop of the graph",
    ),
    "H14": Code(
        "hazard", _WARNING, "an action may still load when another one ends and halts the graph",
        "it runs in a graph that is HALTED, and nothing follows it",
    ),
    "subgraph": Code(
        "hazard", _ERROR, "a sub-graph that has an error itself",
        "what its error says; a crash takes all graphs with it",
    ),
    "recursion": Code(
        "hazard", _ERROR, "a sub-graph that contains itself, or the graph that it is in",
        "the engine cannot resolve the graph",
    ),
    "subgraph-twice": Code(
        "hazard", _ERROR, "one sub-graph used twice, beside itself or beside one that contains it",
        "the engine cannot resolve the graph",
    ),
    "subgraph-ambiguous": Code(
        "other", _WARNING, "a sub-graph with the name of several graphs",
        "the oldest of them is taken",
    ),
    "subgraph-hidden": Code(
        "other", _WARNING, "an action of the library with the name of a graph",
        "the action is taken, never the graph",
    ),
    # Several actors, in the graph or its sub-graphs
    "actors": Code(
        "hazard", _WARNING, "several actors, and an engine that cannot synchronise",
        "one engine refuses the graph; the runner can lead several robots through it, and it plays everywhere else",
    ),
    "synchroniser": Code(
        "hazard", _WARNING, "several actors, and a profile that claims `synchronises`",
        "a robot that is not reached for 5 s, or two ends at about the same time, abort engines, and a graph that waits cannot be stopped",
    ),
    "values-across-robots": Code("hazard", _WARNING, "an arrow that hands an output to an action of another actor", "a runner that leads the robots can hand values on only with the package `zz_keep_values`"),
    "two-at-once": Code("hazard", _WARNING, "two actions of one actor that may run at the same time", "on a robot that is led, a Stop reaches the second one up to 5 s later"),
    "loaded-anew": Code("hazard", _WARNING, "an action that may run more than once", "on a robot that is led, it is loaded anew each time and forgets what it remembers"),
    "spontaneous-across": Code("hazard", _WARNING, "a spontaneous action in a graph of several actors", "a led start refuses the graph: a runner cannot stop what comes after the action at each of its ends"),
    "pause-across": Code("hazard", _WARNING, "an arrow that pauses an action, in a graph of several actors", "a led start refuses the graph"),
    "values-across": Code("hazard", _WARNING, "an arrow that hands an output to an action of the same actor, in a graph of several", "a robot that is led needs the package `zz_keep_values`"),
    "values-unreadable": Code("hazard", _WARNING, "an arrow that hands on an output which no robot shows, in a graph of several actors", "a led start refuses the graph, also with the package `zz_keep_values`"),
    "stop-across": Code("hazard", _WARNING, "an arrow that stops an action, in a graph of several actors", "the stop is a message of the runner that leads the robots, and does not come without it"),
    "subgraph-across": Code("hazard", _WARNING, "a sub-graph whose actions several actors perform", "a runner that leads the robots sends a sub-graph to one robot and refuses this one; one graph without graphs inside can be led"),
    # People who answer, and waits of the runner
    "question": Code("other", _ERROR, "a question, choice, deadline or time that cannot be asked or waited for", "the start is refused; nobody is asked"),
    "question-inside": Code("other", _ERROR, "a question or a wait in a sub-graph", "a led start refuses the graph; one graph without graphs inside can be led"),
    "asks-people": Code("other", _WARNING, "an action that people answer, or for which the runner waits", "one engine cannot be given the graph; the runner leads it, and it plays everywhere else"),
    # The rest
    "instance-id-cut": Code("other", _WARNING, "a number with decimals", "the engine cuts them"),
    "name-class": Code("other", _WARNING, "a name that no C++ class can have", "no action package can have it; a sub-graph may"),
    "name-reserved": Code("other", _WARNING, "`graph_entry` or `graph_exit` with another number than 0", "the engine never runs the action, and leaves it out of what it prints"),
    "type-unknown": Code("other", _WARNING, "a type other than sync, async, spontaneous", "treated like sync"),
    "relation-repeated": Code("other", _WARNING, "the same pair listed more than once", "the engine looks at one of them", ("remove-relation",)),
    "wrong-side": Code("other", _WARNING, "`conditions` or `required` at the parent, `remap` at the child", "ignored"),
    "empty": Code("other", _WARNING, "no actions", "the graph ends as soon as it starts"),
    "no-entry": Code("other", _ERROR, "nothing is connected to the entry", "HALTED as soon as it starts; nothing runs"),
    "no-exit": Code("other", _WARNING, "nothing leads to the exit", "never FINISHED: HALTED, or no end"),
    "unreachable": Code("other", _WARNING, "no way from the entry", "never runs"),
    "never-run": Code("other", _WARNING, "no parent answers `run`", "never runs"),
    "not-tried": Code("other", _WARNING, "a graph in which not every way was tried, since that would take too long", "whether those that are left end is not known"),
    "restart": Code("other", _WARNING, "the response `restart`", "does nothing in this engine"),
    "self-loop": Code("other", _WARNING, "an action that is to run itself again", "it still runs when it is asked; nothing happens"),
    "parameter-inside": Code("other", _WARNING, "a parameter inside another one", "not written"),
    "parameter-name": Code("other", _WARNING, "an empty name, one with `:`, or two that are one for the engine", "the engine does not find the parameter again"),
    "parameter-allowed": Code("other", _WARNING, "a value outside `pvf_allowed_values`", "the engine does not notice"),
    "stop-awaited": Code("other", _WARNING, "in a file of ROS 1: an action waits for the parent that is to stop it", "the older engine never ran it; now it runs after its other parents, or never"),
    "remap-target": Code("other", _WARNING, "an output renamed to an input that the child lacks", "the value is lost"),
    "remap-order": Code("other", _BOTH, "a renaming that changes the order of several outputs", "the engine does not find them any more (error: the child then never runs)"),
    "unknown-action": Code("other", _WARNING, "no library knows the action", "an engine that does not either refuses the graph"),
    "signature": Code("other", _ERROR, "other parameters than the action's own file has", "the engine cannot resolve the graph"),
    "parameter-type": Code("other", _ERROR, "another type than in the action's own file", "the action ends in ERROR"),
}  # fmt: skip

#: Codes for which the engine's parser refuses a text.
REFUSED: Final = frozenset(name for name, code in CODES.items() if code.kind == "refused")
#: Codes that block every engine and cannot be overridden.
STRUCTURAL: Final[frozenset[str]] = REFUSED | {
    name for name, code in CODES.items() if code.kind == "structural"
}
#: Codes of errors that cannot be overridden: structural ones, and those that are sent to no robot.
FINAL: Final[frozenset[str]] = STRUCTURAL | {
    name for name, code in CODES.items() if code.kind == "unsendable"
}

#: Warnings for which one engine refuses a graph that several robots or the simulator can play.
REFUSED_ALONE: Final = frozenset({"actors", "asks-people"})

#: The order of possible hazards: the engine dies or blocks, the graph cannot be stopped, it never ends.
_WORST: Final = ("H4", "H5", "H12", "H8", "H14")
#: Warnings that apply to nearly every graph, since they come with the engine's own defaults or with values. They are
#: reported once, after all others, and not counted, so that people read the other warnings.
QUIET: Final = frozenset({"H3", "values-across"})


def rank(problem: Problem) -> tuple[Severity, int]:
    """Return the key by which problems are sorted: errors before warnings, then the gravest code
    first."""
    code = problem.code
    if code in QUIET:
        return problem.severity, len(_WORST) + 1
    return problem.severity, _WORST.index(code) if code in _WORST else len(_WORST)


def table() -> str:
    """Return Markdown tables of the codes of all problems that graphs and their texts can have, for
    the documentation: what cannot be read, what the engine's parser refuses, and the others."""
    return "\n".join(
        (
            *_alike("unreadable", "error: nothing is read"),
            *_alike("refused", "error: the engine refuses the graph"),
            "| code | severity | what it is | what happens |",
            "|---|---|---|---|",
            *(
                f"| `{name}` | {' or '.join(code.severities)} | {code.meaning} |"
                f" {code.consequence}{_fixes(code)} |"
                for name, code in CODES.items()
                if code.kind not in ("unreadable", "refused")
            ),
            "",
        )
    )


def _alike(kind: Kind, consequence: str) -> Iterator[str]:
    """Yield the lines of the table of one kind whose codes all have the same consequence."""
    yield f"| code | {consequence} |"
    yield "|---|---|"
    for name, code in CODES.items():
        if code.kind == kind:
            yield f"| `{name}` | {code.meaning}{_fixes(code)} |"
    yield ""


def _fixes(code: Code) -> str:
    """Return the names of the fixes of a code in brackets; empty without fixes."""
    return f" (fix: {', '.join(f'`{fix}`' for fix in code.fixes)})" if code.fixes else ""
