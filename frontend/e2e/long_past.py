"""Writes graphs with long pasts into the data of an editor that is not running: `long_past.py DATA`."""

import asyncio
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))

import past

from action_assistant.editor.log.graph_events import (
    CREATED,
    GraphCreated,
    about_stream,
    draft,
    fold,
)
from action_assistant.journal.journal import Journal


async def _written(data: Path) -> None:
    data.mkdir(parents=True, exist_ok=True)
    journal = await Journal.open(f"sqlite:///{data / 'editor.db'}", branch="editor", fold=fold)
    try:
        for changes, actions in past.SIZES:
            updates, _ = past.long_past(random.Random(1), changes, actions)
            name = f"past{changes}"
            await journal.append(
                about_stream(name), [draft(CREATED, "ada", GraphCreated(name, ""))]
            )
            await past.store(journal, updates, name)
    finally:
        await journal.close()


asyncio.run(_written(Path(sys.argv[1])))
