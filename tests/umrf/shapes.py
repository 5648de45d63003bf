"""Graph files of shapes for which a careless algorithm takes the square of their size."""

from collections.abc import Callable
from typing import Any

SAFE = ["on_error -> ignore"]
TEXT = {"pvf_type": "string"}


def _action(name: str, parents: list[Any], children: list[Any], **fields: Any) -> dict[str, Any]:
    sides = {
        "parents": [{"name": p, "conditions": SAFE} if isinstance(p, str) else p for p in parents],
        "children": [{"name": c} if isinstance(c, str) else c for c in children],
    }
    return {"name": name, "type": "sync"} | sides | fields


def _file(actions: list[dict[str, Any]], entry: list[str], exits: list[str]) -> dict[str, Any]:
    ends = {"graph_entry": [{"name": e} for e in entry], "graph_exit": [{"name": e} for e in exits]}
    return {"graph_name": "g", "actions": actions} | ends


def _names(count: int) -> list[str]:
    return [f"A{i}" for i in range(count)]


def chain(count: int, **fields: Any) -> dict[str, Any]:
    """Return a graph of actions in sequence."""
    names = _names(count)
    actions = [
        _action(n, names[max(0, i - 1) : i], names[i + 1 : i + 2], **fields)
        for i, n in enumerate(names)
    ]
    return _file(actions, names[:1], names[-1:])


def spontaneous_chain(count: int) -> dict[str, Any]:
    """Return a chain of spontaneous actions with a loop at its end."""
    file = chain(count, type="spontaneous")
    actions = file["actions"]
    actions[-1]["children"] = [{"name": actions[-2]["name"]}]
    actions[-2]["parents"].append({"name": actions[-1]["name"], "required": False})
    return file


def dead_chain(count: int) -> dict[str, Any]:
    """Return a chain with an arrow back that is required, and the actions that wait for it."""
    file = chain(count)
    actions = file["actions"]
    actions[1]["parents"].append({"name": actions[2]["name"], "conditions": SAFE})
    actions[2]["children"].append({"name": actions[1]["name"]})
    return file


def loop(count: int) -> dict[str, Any]:
    """Return a graph in one circle, in which every way back is required."""
    names = _names(count)
    actions = [_action(n, [names[i - 1]], [names[(i + 1) % count]]) for i, n in enumerate(names)]
    return _file(actions, names[:1], names[-1:])


def pairs(count: int) -> dict[str, Any]:
    """A chain in which every two neighbours are a loop."""
    names = _names(count)
    back = [{"name": n, "required": False, "conditions": SAFE} for n in names]
    actions = [
        _action(n, [*names[max(0, i - 1) : i], *back[i + 1 : i + 2]],
                [*names[i + 1 : i + 2], *names[max(0, i - 1) : i]])
        for i, n in enumerate(names)
    ]  # fmt: skip
    return _file(actions, names[:1], names[-1:])


def fan(count: int) -> dict[str, Any]:
    """One that starts all, one that waits for all."""
    names = _names(count)
    middle = [_action(n, ["First"], ["Last"]) for n in names]
    ends = [_action("First", [], names), _action("Last", names, [])]
    return _file([*ends, *middle], ["First"], ["Last"])


def all_ends(count: int) -> dict[str, Any]:
    """Every action at entry and exit."""
    names = _names(count)
    return _file([_action(n, [], []) for n in names], names, names)


def twins(count: int) -> dict[str, Any]:
    """Return a graph whose actions have one name."""
    return _file([_action("A", ["A"], ["A"]) for _ in range(count)], ["A"], ["A"])


def ghosts(count: int) -> dict[str, Any]:
    """Return a graph of two actions that refer to many which do not exist."""
    names = _names(count)
    return _file([_action("First", names, names), _action("Last", names, names)], names, names)


def repeated(count: int) -> dict[str, Any]:
    """Return a graph in which one pair of actions, and the exit, is related many times."""
    actions = [_action("A", [], ["B"] * count), _action("B", ["A"] * count, [])]
    return _file(actions, ["A"] * count, ["A"] * count)


def parameters(count: int) -> dict[str, Any]:
    """Many parameters that nobody provides, and many renamed ones."""
    many = {name: TEXT for name in _names(count)}  # noqa: C420 - values are not shared in JSON
    remap = [{"from": name, "to": f"B{name}"} for name in _names(count)]
    lacking = {f"C{name}": TEXT for name in _names(count)}
    actions = [
        _action("A", [], [{"name": "B", "remap": remap}], output_parameters=many),
        _action("B", ["A"], [], input_parameters=lacking),
    ]
    return _file(actions, ["A"], ["B"])


def nested(count: int) -> dict[str, Any]:
    """Groups of parameters as deep as it gets, side by side."""
    group: dict[str, Any] = dict(TEXT)
    for _ in range(55):
        group = {"g": group}
    many = {name: group for name in _names(count // 55 + 1)}  # noqa: C420
    return _file([_action("A", [], [], input_parameters=many)], ["A"], ["A"])


def joined(count: int) -> dict[str, Any]:
    """Many parents with outputs and one child with inputs from none of them."""
    side = max(2, int(count**0.5))
    names = _names(side)
    outputs = {f"o{i}": TEXT for i in range(side)}
    inputs = {f"i{i}": TEXT for i in range(side)}
    child = {"name": "Z", "remap": [{"from": "o0", "to": "zz"}]}
    parents = [_action(n, [], [child], output_parameters=outputs) for n in names]
    return _file([*parents, _action("Z", names, [], input_parameters=inputs)], names, ["Z"])


SHAPES: dict[str, Callable[[int], dict[str, Any]]] = {
    shape.__name__: shape
    for shape in (
        chain, spontaneous_chain, dead_chain, loop, pairs, fan, all_ends, twins, ghosts, repeated,
        parameters, nested, joined,
    )
}  # fmt: skip


# Shapes whose single deviations go far: each with `on_error -> ignore` or with the engine's defaults

Arrow = tuple[int, int, list[str] | None, bool]


def _drawn(
    count: int, arrows: list[Arrow], last: int, usual: list[str], entry: int = 0
) -> dict[str, Any]:
    """A graph by places; an arrow without conditions has the usual ones."""
    parents: list[list[Any]] = [[] for _ in range(count)]
    children: list[list[Any]] = [[] for _ in range(count)]
    for above, below, said, required in arrows:
        said = usual if said is None else said
        parents[below].append({"name": f"A{above}", "required": required, "conditions": said})
        children[above].append(f"A{below}")
    actions = [_action(f"A{n}", parents[n], children[n]) for n in range(count)]
    file = _file(actions, [f"A{entry}"], [])
    file["graph_exit"] = [{"name": f"A{last}", "conditions": usual}]
    return file


def _then(above: int, below: int, said: list[str] | None = None, required: bool = True) -> Arrow:
    return above, below, said, required


def diamonds(count: int, usual: list[str]) -> dict[str, Any]:
    """Forks and joins, one after the other."""
    places = range(0, count - 3, 3)
    arrows = [
        _then(n + above, n + below)
        for n in places
        for above, below in ((0, 1), (0, 2), (1, 3), (2, 3))
    ]
    return _drawn(3 * len(places) + 1, arrows, 3 * len(places), usual)


def decisions(count: int, usual: list[str]) -> dict[str, Any]:
    """Short and long ways, one decision after the other."""
    true, false = ["on_true -> run", "on_false -> ignore"], ["on_true -> ignore", "on_false -> run"]
    arrows: list[Arrow] = []
    places = range(0, count - 5, 5)
    for n in places:
        arrows += [_then(n, n + 1, [*true, *usual]), _then(n, n + 2, [*false, *usual])]
        arrows += [_then(n + 2, n + 3), _then(n + 3, n + 4)]
        arrows += [_then(n + 1, n + 5, None, False), _then(n + 4, n + 5, None, False)]
    return _drawn(5 * len(places) + 1, arrows, 5 * len(places), usual)


def lanes(count: int, usual: list[str]) -> dict[str, Any]:
    """Ten long chains side by side, and one that waits for all."""
    long = (count - 2) // 10
    arrows: list[Arrow] = []
    for first in range(2, 2 + 10 * long, long):
        arrows += [_then(0, first), _then(first + long - 1, 1)]
        arrows += [_then(n, n + 1) for n in range(first, first + long - 1)]
    return _drawn(2 + 10 * long, arrows, 1, usual)


def grid(count: int, usual: list[str]) -> dict[str, Any]:
    """Each waits for the one above and the one on its left."""
    side = int(count**0.5)
    arrows = [_then(n, n + 1) for n in range(side * side) if (n + 1) % side]
    arrows += [_then(n, n + side) for n in range(side * (side - 1))]
    return _drawn(side * side, arrows, side * side - 1, usual)


def laps(count: int, usual: list[str]) -> dict[str, Any]:
    """Small loops that are left when something is false, one after the other."""
    places = range(0, count - 2, 3)
    arrows: list[Arrow] = []
    for n in places:
        again = ["on_true -> ignore", "on_false -> run", *usual]
        arrows += [_then(n, n + 1), _then(n + 1, n, again, False)]
        arrows += [_then(n + 1, n + 2, ["on_false -> ignore", *usual])]
        arrows += [_then(n + 2, n + 3)] if n + 3 < 3 * len(places) else []
    return _drawn(3 * len(places), arrows, 3 * len(places) - 1, usual)


def patrol(count: int, usual: list[str]) -> dict[str, Any]:
    """One large loop without end, that something false leaves."""
    back = ["on_false -> ignore", *usual]
    out = ["on_true -> ignore", "on_false -> run", *usual]
    arrows = [_then(n, n + 1) for n in range(count - 2)]
    arrows += [_then(count - 2, 0, back, False), _then(count - 2, count - 1, out)]
    return _drawn(count, arrows, count - 1, usual)


def everybody(count: int, usual: list[str]) -> dict[str, Any]:
    """Each waits for all before it."""
    side = min(count, 180)
    arrows = [_then(a, b) for a in range(side) for b in range(a + 1, side)]
    return _drawn(side, arrows, side - 1, usual)


def tree(count: int, usual: list[str]) -> dict[str, Any]:
    """Return a graph in which each action starts two others."""
    return _drawn(count, [_then((n - 1) // 2, n) for n in range(1, count)], count - 1, usual)


GROWING: dict[str, Callable[[int], dict[str, Any]]] = {
    f"{shape.__name__}-{name}": lambda count, shape=shape, usual=usual: shape(count, usual)
    for shape in (diamonds, decisions, lanes, grid, laps, patrol, everybody, tree)
    for name, usual in (("ignore", SAFE), ("default", []))
}
