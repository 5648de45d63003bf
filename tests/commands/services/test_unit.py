"""Units that `service install` writes, as systemd reads them."""

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx
import pytest

from action_assistant.commands.services.unit import (
    NAME,
    Scope,
    ServicePlan,
    is_untouched,
    options_of,
    quoted,
    text_of,
)
from support.product import COMMAND, TOKEN, free_ports

systemd = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="systemd is not here; it reads the units"
)
PROGRAM = (shutil.which("true") or "/bin/true",)


def plan(scope: Scope = "system", **more: object) -> ServicePlan:
    """Return a plan of a service, with these values changed."""
    user = "daemon" if scope == "system" else ""
    settings = Path("/etc/action-assistant/environment")
    known = {"scope": scope, "program": PROGRAM, "user": user, "settings": settings, **more}
    return ServicePlan(**known)  # type: ignore[arg-type]


def read_by_systemd(text: str, scope: Scope, folder: Path, *words: str) -> str:
    """Return the complaints of systemd about this unit, or its output."""
    (folder / NAME).write_text(text)
    manager = ["--user"] if scope == "user" else []
    # Units of others have sockets there, whose paths must be short.
    with TemporaryDirectory(dir="/tmp") as run:
        answer = subprocess.run(
            ["systemd-analyze", *manager, *words, str(folder / NAME)],
            env={**os.environ, "XDG_RUNTIME_DIR": run},
            capture_output=True,
            text=True,
            check=False,
        )
    assert answer.returncode == 0, answer.stderr
    return answer.stderr if words == ("verify",) else answer.stdout


@systemd
def test_systemd_reads_the_unit_of_an_editor_alone(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "ros" / "action-assistant-editor.service").read_text()
    assert (
        read_by_systemd(text.replace("User=robot", "User=daemon"), "system", tmp_path, "verify")
        == ""
    )


@systemd
@pytest.mark.parametrize("scope", ["system", "user"])
@pytest.mark.parametrize("data", [None, "/var/lib/lab", '/srv/a folder/100 %/it\'s "ours" $HOME'])
def test_systemd_reads_them_without_a_word(scope: Scope, data: str | None, tmp_path: Path) -> None:
    text = text_of(
        plan(
            scope,
            data=Path(data) if data else None,
            words=("--port", "9000", "--share", "--public-url", "https://robots.example.org/a/"),
            environment={"ROS_DISTRO": "jazzy", "CYCLONEDDS_URI": '<a b="c"/>%'},
            writes=(Path("/srv/archive"),),
        )
    )
    assert read_by_systemd(text, scope, tmp_path, "verify") == ""


@systemd
def test_systemd_would_complain_of_a_wrong_one(tmp_path: Path) -> None:
    text = text_of(plan()).replace("ProtectSystem=strict", "ProtectSystem=somewhat")
    assert "protect system" in read_by_systemd(text, "system", tmp_path, "verify")


@systemd
def test_the_service_of_a_computer_is_little_exposed(tmp_path: Path) -> None:
    said = read_by_systemd(text_of(plan()), "system", tmp_path, "security", "--offline=true")
    found = re.search(r"Overall exposure level .*: ([0-9.]+)", said)
    assert found is not None
    assert float(found[1]) <= 2.5, "docs/installing.md has the figure"


def test_an_edit_shows_and_the_options_can_be_read_again() -> None:
    text = text_of(plan(options=("--system", "--port", "9000")))
    assert is_untouched(text)
    assert options_of(text) == ("--system", "--port", "9000")
    assert not is_untouched(text.replace("RestartSec=5", "RestartSec=6"))
    assert not is_untouched(text + "# mine\n")
    assert options_of("[Service]\nExecStart=/bin/true\n") is None


def test_words_are_quoted_as_systemd_takes_them_off_again() -> None:
    assert quoted("/srv/data") == "/srv/data"
    assert quoted("a b") == '"a b"'
    assert quoted("100%") == "100%%"
    assert quoted('say "hi"\\') == '"say \\"hi\\"\\\\"'


def test_the_command_of_a_unit_serves_the_page(tmp_path: Path) -> None:
    port = free_ports()
    text = text_of(
        plan("user", program=COMMAND, data=tmp_path / "my data", words=("--port", str(port)))
    )
    (command,) = re.findall(r"^ExecStart=(.*)$", text, re.MULTILINE)
    settings = dict(re.findall(r"^Environment=(\w+)=(.*)$", text, re.MULTILINE))
    clean = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "ACTION_ASSISTANT_TOKEN": TOKEN}
    with subprocess.Popen(
        shlex.split(command), env={**clean, **settings}, cwd="/", stderr=subprocess.PIPE
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if b"ready" in line:
                break
        page = httpx.get(
            f"http://127.0.0.1:{port}", headers={"accept": "text/html"}, trust_env=False
        )
        assert '<div id="root">' in page.text
        process.terminate()
        process.stderr.read()
        assert process.wait(20) == 0, "systemd calls this a success, and does not start it again"
    assert (tmp_path / "my data" / "editor.db").exists()
