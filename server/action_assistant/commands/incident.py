"""`incident`: keeps a run from being archived, and writes all that is known of it into one file."""

import argparse
import contextlib
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

import msgspec

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, add_server, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.private_files import opener
from action_assistant.safe_text import one_line
from action_assistant.web.audit.rows import AuditPage

_AROUND: Final = timedelta(hours=1)
_PAGES: Final = 10  # of the editor's audit
_PAGE: Final = 500


def _add_incident(incident: argparse.ArgumentParser) -> None:
    add_server(incident, "RUN --reason 'it drove into the shelf'")
    incident.add_argument("run", metavar="RUN", help="id of the run")
    incident.add_argument("--reason", default="", help="why it is kept; stands in the file")
    incident.add_argument("--out", type=Path, metavar="FILE", help="default: incident-RUN.zip here")
    incident.set_defaults(handler=_incident)


COMMANDS: Final = {"incident": _add_incident}


def _incident(options: argparse.Namespace) -> int:
    out = options.out or Path(f"incident-{options.run}.zip")
    if out.exists():
        raise CannotStart(f"{out} is there already; name another file with --out.")
    with running(options) as server:
        run = server.runner("GET", f"/api/runs/{options.run}").json()
        body = {"reason": options.reason, "editor_audit": _editor_audit(server, run)}
        answer = server.runner("POST", f"/api/runs/{options.run}/incident", json=body, timeout=120)
    with open(out, "xb", opener=opener) as file:
        file.write(answer.content)
    print(one_line(f"{out}: run {run['number']} of {run['graph_name']}; it is never archived now"))
    return 0


def _editor_audit(server: Server, run: dict[str, Any]) -> list[Any]:
    """Return the rows of the editor's audit from one hour before a run was requested until one hour
    after its end (until now if it has not ended), at most 5,000, and have it keep them. If the editor refuses or does not
    answer, return the rows got so far."""
    begin = datetime.fromisoformat(run["requested_at"]) - _AROUND
    ended = run.get("ended_at")
    query: dict[str, Any] = {"since": begin.isoformat(), "limit": _PAGE}
    end = (datetime.fromisoformat(ended) if ended else datetime.now(UTC)) + _AROUND
    if ended:
        query["until"] = end.isoformat()
    kept = {"run": run["id"], "since": begin.isoformat(), "until": end.isoformat()}
    with contextlib.suppress(CannotStart, RequestRefused):  # one of an earlier version keeps all
        server.editor("POST", "/api/audit/kept", json=kept)
    found: list[Any] = []
    for _ in range(_PAGES):
        try:
            page = decoded(server.editor("GET", "/api/audit", params=query), AuditPage)
        except (CannotStart, RequestRefused):
            break
        found += msgspec.to_builtins(page.rows)
        if page.before is None:
            break
        query["before"] = page.before
    return found
