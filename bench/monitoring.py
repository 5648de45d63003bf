"""Metrics of a running product, looked at by promtool: `make monitoring`."""

import subprocess
import sys
import tempfile
from pathlib import Path

from support.product import running


def main() -> int:
    """The exit code."""
    failed = 0
    with tempfile.TemporaryDirectory() as folder, running(Path(folder) / "data") as product:
        for name, client in (("editor", product.editor()), ("runner", product.runner())):
            with client:
                text = client.get("/metrics").text
            found = subprocess.run(
                ["promtool", "check", "metrics"], input=text, text=True, check=False
            )
            sys.stdout.write(
                f"{name}: {len(text.splitlines())} lines, promtool: {found.returncode}\n"
            )
            failed = failed or found.returncode
    return failed


if __name__ == "__main__":
    sys.exit(main())
