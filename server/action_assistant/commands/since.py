"""`runs since`: which edit made a graph go another way, found by simulating its past."""

import argparse
from typing import Any

import msgspec

from action_assistant.commands.client import No, Server, command, print_json, refused, running
from action_assistant.safe_text import one_line
from action_assistant.umrf.difference import Difference
from action_assistant.umrf.difference_text import lines, without_looks


def add_to(runs: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """The command below `runs`."""
    since = command(
        runs,
        "since",
        "which edit made a run's graph go another way than it went before, with what the actions of that "
        "run did; exit 1 if an edit did",
        "RUN",
    )
    since.add_argument("run", metavar="RUN", help="id of the run that went wrong")
    since.add_argument(
        "--good",
        type=int,
        metavar="CHANGE",
        help="of the graph, when it still went well (default: that of the last run before that did)",
    )
    since.add_argument("--json", action="store_true", help="as JSON, for programs")
    since.set_defaults(handler=_since)


def _since(options: argparse.Namespace) -> int:
    with running(options) as server:
        try:
            run = server.runner("GET", f"/api/runs/{options.run}").json()
            graph, bad = run["graph"], _seq(server, run)
            good = options.good or _last_good(server, run)
            script = server.runner("GET", f"/api/runs/{options.run}/script").json()
            asked = {"good": good, "bad": bad, "script": {"behaviours": script["behaviours"]}}
            found = server.editor("POST", f"/api/graphs/{graph}/since", json=asked).json()
            query = {"from": good, "to": bad}
            answer = server.editor("GET", f"/api/graphs/{graph}/diff", params=query)
        except No as error:
            return refused(error)
    if options.json:
        print_json(found)
    else:
        _tell(found, msgspec.json.decode(answer.content, type=Difference))
    return 1 if found["partings"] else 0


def _seq(server: Server, run: dict[str, Any]) -> int:
    """The change of the graph that a run had. Raises No."""
    if run["graph"] is None or run["version"] is None:
        raise No("This run is of no version of a graph here.")
    version = server.editor("GET", f"/api/versions/{run['version']}").json()
    seq: int = version["seq"]
    return seq


def _last_good(server: Server, run: dict[str, Any]) -> int:
    """The change of the last run before that went well. Raises No."""
    query = {"graph": run["graph"]}
    for each in server.runner("GET", "/api/runs", params=query).json():
        went_well = each["state"] == "finished" and each["result"] in {None, "on_true"}
        if each["number"] < run["number"] and went_well and each["version"] is not None:
            return _seq(server, each)
    raise No("No run before it went well; name a change of the graph with --good.")


def _tell(found: dict[str, Any], difference: Difference) -> None:
    for each in found["partings"]:
        who = each["author"]["name"] or each["author"]["id"]
        verb = "goes another way" if each["parts"] else "goes the first way again"
        print(one_line(f"since change {each['seq']} of {who}, {each['at'][:16]}, it {verb}:"))
        changes = {"before": 0, "after": 0, "fields": [], "actions": [], "relations": []}
        told = msgspec.convert(changes | each["changes"], Difference)
        for line in lines(told):
            print(one_line(f"    {line}"))
        was, now = each["before"], each["after"]
        print(one_line(f"    step {each['place']}: {was} before, {now} after"))
    if not found["partings"]:
        print("No edit explains it: with what its actions did, the graph goes the same way.")
        for line in lines(without_looks(difference)):
            print(one_line(line))
    if not found["exact"]:
        print(f"Only {found['looked']} moments were looked at; there may be further places.")
