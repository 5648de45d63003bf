"""Routing of lines on the canvas, by the page's own code under Node."""

import json
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from table import Table, seconds

TITLE = "Arrows: layered graphs, 1.3 lines for each card"
FRONTEND = Path(__file__).parent.parent / "frontend"


def tables() -> Iterator[Table]:
    """Medians of five."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = ["npx", "vitest", "bench", "--run", "src/testing/routes.bench.ts"]
        subprocess.run(
            [*command, "--outputJson", str(report)],
            cwd=FRONTEND,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        groups = json.loads(report.read_text())["files"][0]["groups"]
    names = [each["name"] for each in groups[0]["benchmarks"]]
    rows = [
        [group["fullName"].split(" > ")[-1]]
        + [seconds(each["median"] / 1000) for each in group["benchmarks"]]
        for group in groups
    ]
    yield Table(["graph", *names], rows)
