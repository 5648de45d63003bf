"""Runs that shall go the same for ever, simulated again: `runs verify`, for continuous integration."""

import argparse
from collections.abc import Iterator
from typing import Literal

import msgspec

from action_assistant.commands.client import Server, print_json, running
from action_assistant.errors import RequestRefused
from action_assistant.runner.analysis.expected_runs import Expectation
from action_assistant.safe_text import one_line, told
from action_assistant.umrf.courses.expected import check_expected
from action_assistant.umrf.files import codec
from action_assistant.umrf.semantics import script_from


class VerifyVerdict(msgspec.Struct, frozen=True, kw_only=True):
    """The verdict on one expected run.

    `against`: the graph that was simulated, either the one that the run was sent (`then`) or the
    present one (`now`).
    """

    name: str
    run: str
    against: Literal["then", "now"]
    same: bool
    why: str = ""


def verify(options: argparse.Namespace) -> int:
    """Simulate every expected run again, with its graph of then and with the present one, and print
    the verdicts. Return 0 if all go the same course, else 1. Raise RequestRefused or CannotStart if
    the server does not give the runs."""
    with running(options) as server:
        verdicts = list(_verdicts(server, options))
    if options.json:
        print_json(msgspec.to_builtins(verdicts))
    elif not verdicts:
        print("Nothing is expected yet: open a run in the page and choose “Expect this course”.")
    else:
        for each in verdicts:
            verdict = "same   " if each.same else "DIFFERS"
            print(one_line(f"{verdict}  {each.name} ({each.against})"))
            if each.why:
                print(told(f"         {each.why}"))
    return 0 if all(each.same for each in verdicts) else 1


def _verdicts(server: Server, options: argparse.Namespace) -> Iterator[VerifyVerdict]:
    wanted = server.graph_id(options.graph) if options.graph else None
    answer = server.runner("GET", "/api/expectations").content
    for each in msgspec.json.decode(answer, type=list[Expectation]):
        if wanted is not None and each.graph != wanted:
            continue
        yield _verdict(each, bytes(each.umrf), "then")
        if each.graph is not None:
            yield _now(server, each, each.graph)


def _now(server: Server, each: Expectation, graph: str) -> VerifyVerdict:
    """Compare an expected run with the present state of its graph; the verdict is negative if the
    graph does not exist any more."""
    try:
        umrf = server.editor("GET", f"/api/graphs/{graph}/umrf").content
    except RequestRefused as error:
        return VerifyVerdict(
            name=each.name, run=each.run, against="now", same=False, why=str(error)
        )
    return _verdict(each, umrf, "now")


def _verdict(each: Expectation, umrf: bytes, against: Literal["then", "now"]) -> VerifyVerdict:
    script = script_from(msgspec.json.decode(each.script))
    try:
        was, now = codec.read(bytes(each.umrf)).graph, codec.read(umrf).graph
    except codec.Unreadable as wrong:
        return VerifyVerdict(
            name=each.name, run=each.run, against=against, same=False, why=wrong.message
        )
    check = check_expected(was, each.course, script, now)
    return VerifyVerdict(
        name=each.name, run=each.run, against=against, same=check.apart is None, why=check.why
    )
