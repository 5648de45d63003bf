"""The OpenAPI documents of both processes: `python -m support.openapi FOLDER` writes them."""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from action_assistant.editor import app as editor
from action_assistant.runner import app as runner
from action_assistant.settings import EditorSettings, RunnerSettings


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
    """Return the documents as the texts that are kept, by file name, without the version, which
    releases change."""
    found = documents(data)
    for document in found.values():
        document["info"]["version"] = ""
    return {
        f"{name}.openapi.json": json.dumps(document, indent=1, ensure_ascii=False) + "\n"
        for name, document in found.items()
    }


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        for name, text in texts(Path(folder)).items():
            (Path(sys.argv[1]) / name).write_text(text)
