"""A computer of its own for documented commands: a home, the files that the documents speak of."""

import json
from pathlib import Path
from typing import Any, Final

#: An action that documents use.
_GRIPPER: Final[dict[str, Any]] = {
    "name": "OpenGripper",
    "type": "sync",
    "package_name": "open_gripper",
    "input_parameters": {"width": {"pvf_type": "number", "pvf_required": True}},
    "output_parameters": {},
}
_BEHAVIOUR: Final = "def run(action):\n    return action.sleep(0.01)\n"


def chain(name: str, *actions: str) -> dict[str, Any]:
    """A graph of actions that follow each other."""
    named = [{"name": each, "instance_id": 0} for each in actions]
    return {
        "graph_name": name,
        "graph_entry": named[:1],
        "graph_exit": named[-1:],
        "actions": [
            {
                **action,
                "type": "sync",
                "parents": [named[at - 1]] if at else [],
                "children": named[at + 1 : at + 2],
            }
            for at, action in enumerate(named)
        ],
    }


def fill(folder: Path, home: Path) -> None:
    """Fill the working folder and the home as a reader of the documents would have them."""
    patrol = chain("patrol", "Drive", "Look")
    graphs = {
        **dict.fromkeys(
            ("patrol.json", "patrol.umrf.graph.json", "patrol.graph.json", "old.json"), patrol
        ),
        "new.json": chain("patrol", "Drive", "Look", "Beep"),
        "grasp.json": chain("grasp", "Reach"),
        "dock.json": chain("dock", "Back"),
        "graphs/grasp.graph.json": chain("grasp", "Reach"),
    }
    files = {
        **graphs,
        "open_gripper.umrf.json": _GRIPPER,
        "carol.json": {"behaviours": {"*": [{"after_s": 0.1}]}},
    }
    for name, value in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(value))
    for name in ("graphs", "behaviours", "ws/src", "workspace/install"):
        (home / name).mkdir(parents=True, exist_ok=True)
    (home / "behaviours" / "drive.py").write_text(_BEHAVIOUR)
