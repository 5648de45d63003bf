"""Send what schemathesis makes of both OpenAPI documents, as an owner, an operator and a stranger:
`make soak ARGS=schemas`. It needs the program `schemathesis` (PyPI), which nothing else here does.

Fails if an answer is a server error. `postgres` starts a server of it for the editor, which alone is
asked then (`make soak ARGS=schemas-postgres`); `runner` asks the runner alone.
Where pyarrow is not installed, one answer is a 503 that is meant: Parquet is not available.
"""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from action_assistant.web.auth.keys import Keys
from journal import servers
from support.product import TOKEN, running

EXAMPLES: Final = os.environ.get("SCHEMAS_EXAMPLES", "50")  # of each operation
PATIENCE_S: Final = "100"  # for one answer: `GET /api/doctor` takes up to 90 s
#: Streams that do not end, and what would sign the operator out.
LEFT_OUT: Final = "(/events|/room|/api/live|/api/session|/api/devices/.*end)$"


def main(words: list[str]) -> int:
    """Run it for each process and each who; return 1 if one fails, 2 without the program."""
    on_postgres = words == ["postgres"]
    program = shutil.which("schemathesis") or shutil.which("st")
    if program is None:
        sys.stderr.write("schemathesis is not installed: pip install schemathesis\n")
        return 2
    os.environ["ACTION_ASSISTANT_LIMITS"] = "off"
    failed = False
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        flags: list[str] = []
        if on_postgres:
            flags = ["--database", stack.enter_context(servers.server()).new_database()]
        product = stack.enter_context(running(Path(folder) / "data", *flags))
        session = Keys(TOKEN).new_session("Olga", role="operator")
        cookie = f"aa_{product.port}={Keys(TOKEN).sealed(session)}"
        people = {
            "owner": [f"authorization: Bearer {TOKEN}"],
            "operator": [f"cookie: {cookie}", f"origin: {product.url}"],
            "stranger": [],
        }
        urls = [product.url, product.runner_url]
        if words:
            urls = [product.url if on_postgres else product.runner_url]
        for url in urls:
            document = Path(folder) / "openapi.json"
            document.write_bytes(_document(url))
            for who, headers in people.items():
                sent = [word for each in headers for word in ("--header", each)]
                done = subprocess.run(
                    [
                        *(program, "run", str(document), "--url", url, *sent),
                        *("--checks", "not_a_server_error", "--max-examples", EXAMPLES),
                        *("--exclude-path-regex", LEFT_OUT, "--request-timeout", PATIENCE_S),
                        *("--phases", "examples,coverage,fuzzing", "--continue-on-failure"),
                    ],
                    cwd=folder,
                    check=False,
                )
                sys.stdout.write(f"{who} at {url}: exit code {done.returncode}\n")
                failed = failed or done.returncode != 0
    return 1 if failed else 0


def _document(url: str) -> bytes:
    import httpx

    headers = {"authorization": f"Bearer {TOKEN}"}
    asked = f"{url}/schema/openapi.json"
    return httpx.get(asked, headers=headers, trust_env=False, timeout=60).content


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
