"""An editor whose owners of graphs are what a file says. Run as a script: DATA DATABASE PORT
INNER_PORT FILE."""

import json
import sys
from pathlib import Path

from action_assistant.editor.app import create_app
from action_assistant.editor.cluster.owners import Alone, Elsewhere, Here, Owner
from action_assistant.editor.workers import prepare_workers
from action_assistant.settings import Cluster, EditorSettings
from action_assistant.web.server.listen import serve


class FixedOwners(Alone):
    """Owners by a file, which never move by themselves: the URL of the owner of each stream, and of
    all others under `*`."""

    def __init__(self, file: Path, url: str) -> None:
        self._file = file
        self._url = url

    async def owner(self, stream: str) -> Owner:
        """Return the owner that the file names."""
        owners = json.loads(self._file.read_text())
        url = owners.get(stream, owners["*"])
        return Here(0) if url == self._url else Elsewhere(url)


def main(data: Path, database: str, port: int, inner: int, file: Path) -> None:
    """Serve until a signal."""
    url = f"http://127.0.0.1:{inner}"
    settings = EditorSettings(
        data=data,
        database=database,
        port=port,
        cluster=Cluster("127.0.0.1", inner, url),
        limits=False,
    )
    serve(
        lambda: create_app(settings, FixedOwners(file, url)),
        host="127.0.0.1",
        port=port,
        direct=True,
        inside=("127.0.0.1", inner),
    )


if __name__ == "__main__":
    prepare_workers()
    folder = Path(sys.argv[1])
    folder.mkdir(exist_ok=True)
    main(folder, sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), Path(sys.argv[5]))
