"""Repeats by the command line: `run --times … --grid …`, `runs repeats`, `runs next`, `runs stop-repeating`
and `runs look-again`."""

import argparse
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import msgspec

from action_assistant.commands.client import Server, command, print_json, running
from action_assistant.commands.runners import Gathered
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line

if TYPE_CHECKING:
    from action_assistant.umrf.start_values import AskedInput

_POLL_S: Final = 0.3


def add_options(run: argparse.ArgumentParser) -> None:
    """Add the options by which `run` opens a repeat."""
    again = run.add_argument_group("again and again")
    again.add_argument(
        "--times", type=int, metavar="N", help="repeat it; on robots you start each run: runs next"
    )
    again.add_argument(
        "--grid",
        type=_axis,
        action="append",
        default=[],
        metavar="[ACTION.]INPUT=VALUES",
        help="a run for each value, with commas between them or as a JSON list; again for each input",
    )
    again.add_argument("--seed", type=int, metavar="N", help="shuffle each round of the grid by it")


def is_asked(options: argparse.Namespace) -> bool:
    """Return whether the options of `run` ask for a repeat."""
    return options.times is not None or bool(options.grid)


def grid_of(axes: Sequence[tuple[str, str]], asked: Sequence["AskedInput"]) -> list[dict[str, Any]]:
    """Return the grid of a repeat. `axes`: names of inputs, with or without that of their action, and
    texts of their values; `asked`: what the graph asks for. Raise CannotStart for a name that means no
    one input, or a text without values of its type."""
    found: list[dict[str, Any]] = []
    for name, text in axes:
        named = [each for each in asked if name in {each.name, f"{each.action}.{each.name}"}]
        if len(named) != 1:
            every = ", ".join(f"{each.action}.{each.name}" for each in named or asked)
            why = "is asked of several actions" if named else "is not asked for"
            raise CannotStart(
                f"--grid {name}: it {why}. One of: {every or 'nothing is asked for'}."
            )
        (one,) = named
        found.append({"action": one.action, "name": one.name, "values": _values(one, text)})
    return found


def _axis(text: str) -> tuple[str, str]:
    name, equals, values = text.partition("=")
    if not equals or not name or not values:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form [ACTION.]INPUT=VALUES")
    return name, values


def _values(one: "AskedInput", text: str) -> list[Any]:
    if one.type == "string" and not text.startswith("["):
        return text.split(",")
    try:
        return msgspec.json.decode(text if text.startswith("[") else f"[{text}]", type=list[Any])
    except (msgspec.DecodeError, RecursionError):
        raise CannotStart(
            f"--grid {one.name}: {text!r} are no values of type {one.type}."
        ) from None


def open_repeat(
    server: Server, start: dict[str, Any], grid: list[dict[str, Any]], options: argparse.Namespace
) -> int:
    """Open a repeat, print its id, and return the exit code. `start`: the body of a request to
    start; `grid`: the values of inputs, by `grid_of`. If only the simulator plays, the runner
    starts each next run by itself, and the command waits for the end of the repeat, except with
    `--no-wait`. On robots a person starts each run, and the command returns at once."""
    robots = set(start.get("robots", {}).values()) or {start["engine"]}
    by_itself = robots <= {"simulator"}
    wanted = {
        "start": start,
        "times": options.times or 1,
        "grid": grid,
        "seed": options.seed,
        "by_itself": by_itself,
    }
    repeat = server.runner("POST", "/api/repeats", json=wanted).json()
    print(repeat["id"], flush=True)
    if not by_itself:
        print(f"set everything back, look, and start each run: runs next {repeat['id']}")
        return 0
    return 0 if options.no_wait else _followed(server, repeat["id"])


def _followed(server: Server, id_: str, until: int = sys.maxsize) -> int:
    """Print each run of a repeat as it ends, until it is closed or cell `until` is over. Return the
    exit code: 0 if every run ended true, or that cell did."""
    told = set[int]()
    while True:
        repeat = server.runner("GET", f"/api/repeats/{id_}").json()
        for cell in repeat["cells"]:
            run = cell["run"]
            is_over = run is not None and run["ended_at"] is not None
            if is_over and cell["cell"] not in told and until in {cell["cell"], sys.maxsize}:
                told.add(cell["cell"])
                print(one_line(_line(cell)), flush=True)
        if repeat["state"] == "closed":
            print(one_line(f"closed: {repeat['closed']['text']}"))
            return 0 if repeat["closed"]["why"] == "complete" else 1
        if until in told:
            print(f"next: {repeat['next']} of {repeat['total']}")
            return 0
        time.sleep(_POLL_S)


def _line(cell: dict[str, Any]) -> str:
    run = cell["run"]
    values = ", ".join(
        f"{action}.{name}={value}"
        for action, given in cell["values"].items()
        for name, value in given.items()
    )
    end = "not started" if run is None else f"run {run['number']}  {run['state']}"
    result = f" ({run['result']})" if run is not None and run["result"] else ""
    return f"{cell['cell']}  {end}{result}  {values}".rstrip()


def add_repeats(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands about repeats to `commands`, the sub-commands of `runs`."""
    lists = command(commands, "repeats", "the repeats, or the runs of one", "REPEAT --csv")
    lists.add_argument("repeat", nargs="?", default="", metavar="REPEAT", help="its id; else all")
    form = lists.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="as JSON, for programs")
    form.add_argument("--csv", action="store_true", help="with REPEAT: its table as CSV")
    form.add_argument(
        "--parquet",
        action="store_true",
        help="with REPEAT: its table as Parquet, for a file (> repeat.parquet)",
    )
    lists.set_defaults(handler=_repeats)
    nexts = command(
        commands,
        "next",
        "say that everything is set back, and start the next run of a repeat: its robots may begin to "
        "move at once; wait for its end",
        "REPEAT",
    )
    nexts.add_argument("repeat", metavar="REPEAT", help="id of the repeat")
    nexts.add_argument(
        "--watching",
        action="append",
        default=[],
        metavar="ROBOT",
        help="you watch this robot, with its hardware stop within reach; again for each",
    )
    nexts.set_defaults(handler=_next)
    ends = command(
        commands, "stop-repeating", "close a repeat; it stops no run (to stop one: stop)", "REPEAT"
    )
    ends.add_argument("repeat", metavar="REPEAT", help="id of the repeat")
    ends.set_defaults(handler=_close)
    again = command(
        commands,
        "look-again",
        "open a closed repeat again, if a look at its next start blocks nothing",
        "REPEAT",
    )
    again.add_argument("repeat", metavar="REPEAT", help="id of the repeat")
    again.set_defaults(handler=_look_again)


def _repeats(options: argparse.Namespace) -> int:
    path = f"/api/repeats/{options.repeat}"
    if (options.csv or options.parquet) and not options.repeat:
        raise CannotStart(f"--{'csv' if options.csv else 'parquet'} is of one repeat: name it.")
    if options.parquet and sys.stdout.isatty():
        raise CannotStart("Parquet is no text: write it into a file (> repeat.parquet).")
    with running(options) as server:
        form = "parquet" if options.parquet else "csv"
        is_table = options.csv or options.parquet
        if not options.repeat:
            return _all(server.runners.gathered("/api/repeats"), as_json=options.json)
        answer = server.runner("GET", f"{path}/table?format={form}" if is_table else path)
    if options.parquet:
        sys.stdout.buffer.write(answer.content)
        return 0
    if options.csv:
        sys.stdout.write(answer.text)
        return 0
    found = answer.json()
    if options.json:
        print_json(found)
    else:
        for cell in found["cells"]:
            print(one_line(_line(cell)))
        if found["closed"] is not None:
            print(one_line(f"closed: {found['closed']['text']}"))
    return 0


def _all(found: Gathered, *, as_json: bool) -> int:
    """Print the repeats of all sites, and return the exit code."""
    if as_json:
        print_json(found.json())
        return found.code
    for each in found.json():
        state = "open" if each["closed"] is None else f"closed: {each['closed']['text']}"
        total = f"{each['total']} runs" if each["total"] != 1 else "1 run"
        print(one_line(f"{each['id']}  {each['graph_name']}  {each['engine']}  {total}  {state}"))
    return found.code


def _next(options: argparse.Namespace) -> int:
    path = f"/api/repeats/{options.repeat}"
    with running(options) as server:
        cell = server.runner("GET", path).json()["next"]
        if cell is None:
            raise CannotStart("Every run of this repeat was started.")
        asked = {"cell": cell, "watching": dict.fromkeys(options.watching, True)}
        run = server.runner("POST", f"{path}/start", json=asked).json()
        print(run["id"], flush=True)
        return _followed(server, options.repeat, cell)


def _close(options: argparse.Namespace) -> int:
    with running(options) as server:
        found = server.runner("POST", f"/api/repeats/{options.repeat}/close").json()
    print(one_line(f"closed: {found['closed']['text']}"))
    return 0


def _look_again(options: argparse.Namespace) -> int:
    path = f"/api/repeats/{options.repeat}"
    with running(options) as server:
        seen = server.runner("GET", path).json()
        asked = {"closings": seen["closings"]}
        found = server.runner("POST", f"{path}/open", json=asked).json()
        print(f"open; next: {found['next']} of {found['total']}")
        return _followed(server, options.repeat) if found["by_itself"] else 0
