"""Work for other processes is a function of a module, never one that is made on the way."""

import ast
from pathlib import Path

import action_assistant.runner

#: Modules that run in a worker already, or only wait for disks.
AT_HOME = {
    "review/service.py",
    "analysis/replay.py",
    "analysis/keyframes.py",
    "archives/archive_store.py",
    "archives/retention.py",
    "robots/recordings.py",
}


def test_no_lambda_is_sent_to_workers() -> None:
    folder = Path(action_assistant.runner.__file__).parent
    found = [
        f"{path.name}:{node.lineno}"
        for path in folder.rglob("*.py")
        if path.relative_to(folder).as_posix() not in AT_HOME
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name | ast.Attribute)
        and (node.func.attr if isinstance(node.func, ast.Attribute) else node.func.id).strip("_")
        == "run_in_worker"
        and isinstance(node.args[0], ast.Lambda)
    ]
    assert found == []
