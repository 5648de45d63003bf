"""Recorded graphs with graphs inside: imported, edited, played, and run nested and flat on an emulated robot.

All of it by the product over real rclpy. The robot indexes the files that the look before a start offers.
"""

import io
import json
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from ros.robots import RobotProcess
from support.product import Product, running
from support.real_engine import answers, browser
from support.recordings import CORPUS, NO_CORPUS, calls_of, facts, family
from support.waiting import until

OURS = ("sub_seq", "sub_error", "sub_fast", "sub_params", "sub_halt", "sub_stop")
#: Graphs of the engine's own repository: they stand where its files are.
ENGINES = ("semantics_test_6", "semantics_test_9")
_ENGINE = CORPUS / "graphs" / "temoto-framework+temoto_action_engine"
#: Recordings of each kind, when there is no time for all: with a flat graph, without one, and
#: stopped from outside.
QUICKLY = {"sub_error", "sub_stop", "semantics_test_9"}
#: These go on until somebody stops them: a graph inside that is HALTED tells nobody.
ENDLESS = {"sub_halt", "sub_stop"}
#: Seconds of a timer that ends a loop, and of each in the loop. As recorded (3.0 and 0.5) the end of the timer
#: is also that of the third round; so it is in the middle of what runs, and a robot may be 1.5 s late.
TIMERS = {"semantics_test_9": (6.5, 2.5)}
#: Reasons why no single graph does the same as these.
REFUSED = {
    "sub_halt": "It can end HALTED",
    "semantics_test_6": "It can be bypassed with on_false",
    "semantics_test_9": "It can be told to stop",
}
Way = tuple[str, ...]

pytestmark = pytest.mark.timeout(240)


def needs(name: str) -> Any:
    here = name in OURS or _ENGINE.is_dir()
    marks = [] if here else [pytest.mark.skip(reason=NO_CORPUS)]
    return pytest.param(name, marks=marks if name in QUICKLY else [*marks, pytest.mark.long])


def files(name: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The graph of a recording, and those that can be inside."""
    if name in ENGINES:
        names = (name, *facts("engine")["sub_graphs"])
        texts = [(_ENGINE / f"test__umrf_graphs__{each}.graph.json").read_text() for each in names]
        outer, *inner = [json.loads(each) for each in texts]
        if name in TIMERS:
            for graph, seconds in zip((outer, inner[-1]), TIMERS[name], strict=True):
                set_timers(graph, seconds)
        return outer, inner
    outer = json.loads((family("engine") / f"{name}.graph.json").read_text())
    paths = sorted((family("engine") / "subgraphs").glob("*.graph.json"))
    return outer, [json.loads(path.read_text()) for path in paths]


def set_timers(graph: dict[str, Any], seconds: float) -> None:
    for action in graph["actions"]:
        if action["name"] == "TaTimer":
            action["input_parameters"]["count_until"]["pvf_value"] = seconds


def leaves(graphs: list[dict[str, Any]]) -> list[tuple[str, dict[str, Any]]]:
    """Actions that are no graphs, each with the name of its graph."""
    names = {each["graph_name"] for each in graphs}
    return [
        (graph["graph_name"], action)
        for graph in graphs
        for action in graph["actions"]
        if action["name"] not in names
    ]


def full_name(action: dict[str, Any]) -> str:
    return f"{action['name']}_{action.get('instance_id', 0)}"


def values(parameters: dict[str, Any]) -> dict[str, Any]:
    return {name: each.get("pvf_value") for name, each in parameters.items()}


def behaviours(graphs: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Return the behaviours of the recorded actions, by graph and action."""
    return {
        f"{graph}/{full_name(action)}": calls_of(
            "engine", action["name"], values(action.get("input_parameters", {}))
        )
        for graph, action in leaves(graphs)
    }


class Task(msgspec.Struct, kw_only=True):
    """A recorded graph on the server, and what it is as one graph."""

    id: str
    script: dict[str, list[dict[str, Any]]]
    index: bytes
    origins: dict[str, Way]
    flat: str | None
    reasons: list[str]


def imported(editor: httpx.Client, name: str) -> Task:
    """Imported, and edited: one of the graphs, and so the version."""
    outer, inner = files(name)
    used = [each for each in inner if each["graph_name"] in inside_of(outer, inner)]
    ids = [editor.post("/api/graphs", json=each).json()["id"] for each in (*used, outer)]
    seq = editor.get(f"/api/graphs/{ids[0]}").json()["seq"]
    edited = used[0] | {"graph_description": "edited here"}
    changed = editor.put(f"/api/graphs/{ids[0]}/umrf", params={"seq": seq}, json=edited)
    assert changed.is_success, changed.text
    script = behaviours([outer, *used])
    flat = editor.get(f"/api/graphs/{ids[-1]}/flat").json()
    origins = {
        each["action"]: tuple(step["action"] for step in each["levels"])
        for each in flat["origins"] or ()
    }
    made = None
    if flat["umrf"] is not None:
        body = {"seq": flat["seq"], "name": f"{name}_flat"}
        made = editor.post(f"/api/graphs/{ids[-1]}/flat", json=body).json()["id"]
        script |= {
            f"{name}_flat/{action}": script[nested_key(outer, used, way)]
            for action, way in origins.items()
        }
    return Task(
        id=ids[-1],
        script=script,
        index=editor.get(f"/api/graphs/{ids[-1]}/subgraphs.zip").content,
        origins=origins,
        flat=made,
        reasons=[each["message"] for each in flat["reasons"] or ()],
    )


def inside_of(outer: dict[str, Any], inner: list[dict[str, Any]]) -> set[str]:
    """The names of the graphs inside, at all levels."""
    by_name = {each["graph_name"]: each for each in inner}
    found, left = set[str](), [outer]
    while left:
        names = {each["name"] for each in left.pop()["actions"]} & by_name.keys() - found
        found |= names
        left += [by_name[each] for each in names]
    return found


def nested_key(outer: dict[str, Any], used: list[dict[str, Any]], way: Way) -> str:
    """The key in scripts of an action of a graph inside."""
    graph = way[-2].rpartition("_")[0] if len(way) > 1 else outer["graph_name"]
    assert graph in {each["graph_name"] for each in (outer, *used)}
    return f"{graph}/{way[-1]}"


def robot_index(folder: Path, name: str, index: bytes) -> Path:
    """Packages with the actions, and the files of the graphs inside as they were downloaded."""
    outer, inner = files(name)
    with zipfile.ZipFile(io.BytesIO(index)) as packed:
        packed.extractall(folder / "graphs")
    for _, action in leaves([outer, *inner]):
        path = folder / action["name"] / f"{action['name']}.umrf.json"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(template(action)))
    return folder


def template(action: dict[str, Any]) -> dict[str, Any]:
    """An action as its package describes it: without values."""
    fields = {"name": action["name"], "type": action.get("type", "sync"), "instance_id": 0}
    for side in ("input_parameters", "output_parameters"):
        parameters = action.get(side, {})
        fields[side] = {
            each: {key: value for key, value in of.items() if key != "pvf_value"}
            for each, of in parameters.items()
        }
    return fields


def order_of(editor: httpx.Client, graph: str) -> dict[str, Any]:
    version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
    parts = {key: version[key] for key in ("digest", "umrf", "tree_digest")}
    parts["subgraphs"] = [
        {key: each[key] for key in ("name", "digest", "umrf")} for each in version["subgraphs"]
    ]
    return {"version": version["id"], "graph": graph, **parts}


def ran(runner: httpx.Client, order: dict[str, Any], *, endless: bool) -> dict[str, Any]:
    """A run at its end; one without an end is stopped once all is done that will be."""
    asked = {
        key: value for key, value in order.items() if key not in ("engine", "request_id", "script")
    }
    (look,) = runner.post("/api/preflight", json=asked | {"engines": [order["engine"]]}).json()
    assert not look["never"], look["items"]
    codes = look["override"]
    despite = {"override": {"codes": codes, "reason": "recorded so"}} if codes else {}
    answer = runner.post("/api/runs", json=order | despite)
    assert answer.status_code == 201, answer.text
    path = f"/api/runs/{answer.json()['id']}"
    if endless:
        until("something goes on", lambda: "RUNNING" in states(runner, path).values())
        until("nothing new happens", settled(runner, path))
        runner.post(f"{path}/stop", json={"stop_id": path})
    until("it has ended", lambda: runner.get(path).json()["ended_at"] is not None)
    found: dict[str, Any] = runner.get(path).json()
    return found


def states(runner: httpx.Client, path: str) -> dict[str, str]:
    return {name: each["state"] for name, each in runner.get(path).json()["actions"].items()}


def settled(runner: httpx.Client, path: str) -> Callable[[], bool]:
    """Return a function that tells whether the states were the same in the last looks."""
    seen: list[dict[str, str]] = []

    def looks_alike() -> bool:
        seen.append(states(runner, path))
        return len(seen) > 6 and all(each == seen[-1] for each in seen[-6:])

    return looks_alike


def course(run: dict[str, Any], ways: dict[str, Way]) -> dict[Way, tuple[int, str]]:
    """Return how often each of these actions ran, and its last state."""
    return {
        way: (len(run["actions"][name]["visits"]), run["actions"][name]["state"])
        for name, way in ways.items()
        if name in run["actions"]
    }


def nested_ways(run: dict[str, Any]) -> dict[str, Way]:
    """The ways to all actions that hold no others."""
    graph, names = run["graph_name"], run["actions"]
    found: dict[str, Way] = {}

    def under(part: str, above: Way) -> None:
        own = [n for n in names if ("/" not in n if not above else n.startswith(f"{part}/"))]
        for name in own:
            action = name.removeprefix(f"{part}/") if above else name
            kind, _, number = action.rpartition("_")
            below = f"{part}__{kind}__{number}"
            if any(each.startswith(f"{below}/") for each in names):
                under(below, (*above, action))
            else:
                found[name] = (*above, action)

    under(graph, ())
    return found


@contextmanager
def robots(product: Product, domain: int, folder: Path, task: Task, name: str) -> Iterator[None]:
    index = robot_index(folder / "index", name, task.index)
    robot = RobotProcess(domain, folder, task.script, "--actions", str(index), "--quirk", "loss=0")
    try:
        with browser(product, "Ada") as ada:
            assert ada.post("/api/robots", json={"name": "David", "domain": domain}).is_success
            until("David answers", lambda: answers(ada, "David"))
            yield
    finally:
        robot.end()


@pytest.mark.parametrize("name", [needs(each) for each in (*OURS, *ENGINES)])
def test_a_recorded_hierarchy_runs_alike_played_nested_and_flat(
    name: str, domain: int, tmp_path: Path
) -> None:
    with running(tmp_path / "data") as product:
        with product.editor() as editor:
            task = imported(editor, name)
            nested = order_of(editor, task.id)
            flat = order_of(editor, task.flat) if task.flat is not None else None
        with robots(product, domain, tmp_path, task, name), browser(product, "Ada") as ada:
            endless = name in ENDLESS
            script = {"behaviours": task.script}
            simulated = nested | {"engine": "simulator", "script": script, "request_id": "played"}
            played = ran(ada, simulated, endless=endless)
            there = nested | {"engine": "David", "request_id": "nested"}
            real = ran(ada, there, endless=endless)
            ways = nested_ways(played)
            assert any(len(way) > 1 for way in ways.values())
            expected = course(played, ways)
            assert course(real, ways) == expected
            assert set(real["actions"]) == set(played["actions"])
            if name in REFUSED:
                assert (flat, task.reasons[0].startswith(REFUSED[name])) == (None, True)
                return
            assert flat is not None
            there = flat | {"engine": "David", "request_id": "flat"}
            one = ran(ada, there, endless=endless)
            assert course(one, task.origins) == expected
