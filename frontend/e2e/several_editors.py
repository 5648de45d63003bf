"""Three editors and a runner of one Postgres behind the documented nginx, for a test in a browser:
`several_editors.py FOLDER`. It says where they are as one line of JSON, obeys a line of `kill N`, `start N` or
`owner GRAPH` with a line each, and ends with its input."""

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))

from editor.cluster.several import OneOfSeveral, started
from journal.servers import Server, server
from support.product import TOKEN, free_ports
from support.proxy import EDITORS, nginx


def _say(what: object) -> None:
    sys.stdout.write(f"{json.dumps(what)}\n")
    sys.stdout.flush()


def _owner(postgres: Server, database: str, graph: str) -> int:
    """Return which editor has a graph open, from 0; -1 for none."""
    query = f"SELECT url FROM room JOIN editor USING (life) WHERE stream = 'graph/{graph}'"
    url = postgres.ask(query, database.rpartition("/")[2])
    return _INNER.index(url.removeprefix("http://")) if url else -1


_INNER: list[str] = []
#: Two people of one graph are led to two editors, by the names of their browsers as well, and can see to which.
_CHANGES: Final = {
    "hash $graph consistent": 'hash "$graph $http_user_agent" consistent',
    "proxy_connect_timeout 1s;": "proxy_connect_timeout 1s; add_header X-Editor $upstream_addr always;",
}


def main(folder: Path) -> None:
    """Be there until the input ends."""
    port = free_ports()
    url = f"https://localhost:{port}"
    data = folder / "data"
    documented = folder / "nginx-editors.conf"
    text = EDITORS.read_text()
    for old, new in _CHANGES.items():
        assert old in text
        text = text.replace(old, new)
    documented.write_text(text)
    with contextlib.ExitStack() as stack:
        postgres = stack.enter_context(server())
        database = postgres.new_database()
        editors = [
            OneOfSeveral(data, database, n, f"127.0.0.{n + 1}", "--public-url", url)
            for n in range(3)
        ]
        for each in editors[1:]:
            each.port = editors[0].port
        _INNER.extend(each.inner for each in editors)
        stack.enter_context(started(editors))
        runner = subprocess.Popen(
            [sys.executable, "-m", "action_assistant", "runner", "--data", str(data),
             "--port", str(editors[0].port + 1), "--page-port", str(editors[0].port),
             "--public-url", url],
            env={**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN},
            stdout=(folder / "runner.log").open("wb"), stderr=subprocess.STDOUT,
        )  # fmt: skip
        stack.callback(runner.wait)
        stack.callback(runner.kill)
        stack.enter_context(
            nginx(folder / "proxy", name="localhost", port=port, editor=editors[0].port,
                  documented=documented)
        )  # fmt: skip
        _say({"url": url, "token": TOKEN, "editors": [each.url for each in editors]})
        for line in sys.stdin:
            match line.split():
                case ["kill", n]:
                    editors[int(n)].kill()
                    _say(None)
                case ["start", n]:
                    editors[int(n)].start()
                    _say(None)
                case ["owner", graph]:
                    _say(_owner(postgres, database, graph))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
