"""The OpenAPI documents of both processes, and the ready-made actions: `python -m support.openapi FOLDER`
writes them for the page."""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from action_assistant.editor import app as editor
from action_assistant.runner import app as runner
from action_assistant.settings import EditorSettings, RunnerSettings
from action_assistant.umrf.questions import READY_MADE, title_of


def documents(data: Path) -> dict[str, dict[str, Any]]:
    """Return the OpenAPI documents of the editor and the runner, without starting either; `data`
    is an empty folder."""
    database = f"sqlite:///{data / 'editor.db'}"
    apps: dict[str, Any] = {
        "editor": editor.create_app(EditorSettings(data=data, database=database)),
        "runner": runner.create_app(RunnerSettings(data=data)),
    }
    return {name: json.loads(app.openapi()) for name, app in apps.items()}


def texts(data: Path) -> dict[str, str]:
    """Return the documents and the ready-made actions as the texts that are kept, by file name, without
    the version, which releases change."""
    found = documents(data)
    for document in found.values():
        document["info"]["version"] = ""
    kept: dict[str, Any] = {f"{name}.openapi.json": each for name, each in found.items()}
    kept["ready-made.json"] = ready_made()
    # Alone for STOP, which names actions and loads nothing besides.
    kept["ready-made-titles.json"] = {each.name: title_of(each.name) for each in READY_MADE}
    return {
        name: json.dumps(content, indent=1, ensure_ascii=False) + "\n"
        for name, content in kept.items()
    }


def ready_made() -> list[dict[str, Any]]:
    """Return the ready-made actions, in the form in which the page places actions."""
    return [
        {
            "name": each.name,
            "title": title_of(each.name),
            "description": each.description,
            **{
                side: [{"path": one.path, "text": one.text} for one in parameters]
                for side, parameters in (("inputs", each.inputs), ("outputs", each.outputs))
            },
        }
        for each in READY_MADE
    ]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        for name, text in texts(Path(folder)).items():
            (Path(sys.argv[1]) / name).write_text(text)
