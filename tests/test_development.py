"""Hooks, the development container and targets of make agree."""

import json
import os
import re
import shlex
import socket
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
MAKEFILE = (ROOT / "Makefile").read_text()


def test_hooks_run_what_make_check_runs() -> None:
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert repository["repo"] == "local"
    hooks = {shlex.split(each["entry"])[-1] for each in repository["hooks"]}
    (check,) = re.findall(r"^check: (.*?) ##", MAKEFILE, re.MULTILINE)
    assert hooks == set(check.split())
    for each in repository["hooks"]:
        assert (each["language"], each["pass_filenames"]) == ("system", False)
        assert re.search(rf"^{shlex.split(each['entry'])[-1]}:", MAKEFILE, re.MULTILINE)


def test_the_container_for_development_has_what_ci_installs() -> None:
    folder = ROOT / ".devcontainer"
    settings = json.loads((folder / "devcontainer.json").read_text())
    installed = (folder / settings["build"]["dockerfile"]).read_text().split()
    ci = (ROOT / ".ci" / "run").read_text()
    needed = {
        package
        for package in re.findall(r"[\w)]=([a-z][a-z0-9+-]+)", ci)
        if package not in {"true", "target"}
    }
    assert {"make", "chromium", "postgresql", "python3-venv", "ninja-build"} <= needed
    assert needed <= set(installed)
    assert settings["postCreateCommand"].split() == ["make", "setup"]
    assert f"USER {settings['remoteUser']}" in (folder / "Dockerfile").read_text()


def test_a_step_of_make_is_one_line_unless_it_fails() -> None:
    def step(command: str) -> subprocess.CompletedProcess[str]:
        words = [str(ROOT / "scripts" / "step"), "the page", "sh", "-c", command]
        return subprocess.run(words, capture_output=True, text=True, check=False)

    done = step("seq 250; seq 250 >&2")
    assert (done.returncode, done.stdout, done.stderr) == (0, "» the page\n", "")
    failed = step("echo made; echo because >&2; exit 3")
    assert (failed.returncode, failed.stdout) == (3, "» the page\n")
    assert failed.stderr == "made\nbecause\n"


@pytest.mark.parametrize("swallows", [False, True])
def test_a_dead_index_of_packages_is_named_at_once_with_what_to_do(
    tmp_path: Path, swallows: bool
) -> None:
    with ExitStack() as stack:
        index = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        port = index.getsockname()[1]
        if not swallows:  # a system takes connections that no program accepts
            index.close()
        environment = {name: text for name, text in os.environ.items() if "PIP" not in name}
        environment |= {
            "PIP_INDEX_URL": f"http://me:secret@127.0.0.1:{port}/simple",
            "PIP_CONFIG_FILE": os.devnull,
        }
        for name in ("http_proxy", "https_proxy", "all_proxy"):
            environment.pop(name, None)
            environment.pop(name.upper(), None)
        program = ROOT / "scripts" / "packages"
        words = [program, sys.executable, "--target", tmp_path, "no-such-package"]
        failed = subprocess.run(
            list(map(str, words)), env=environment, capture_output=True, text=True, check=False
        )
    assert failed.returncode == 1
    why = "timed out" if swallows else "Connection refused"
    said = f"The index of Python packages does not answer: 127.0.0.1:{port} ({why})."
    assert said in failed.stderr
    assert "`make bundle`" in failed.stderr
    assert "Retrying" not in failed.stderr
    assert "secret" not in failed.stderr.split("The index of", 1)[1]


def test_running_needs_nothing_that_builds_the_documentation() -> None:
    locked = (ROOT / "requirements" / "dev.txt").read_text()
    assert not re.findall(
        r"^(sphinx|furo|myst-parser|docutils|accessible-pygments)", locked, re.MULTILINE
    )
    (needed,) = re.findall(r"^run: (.*?) ##", MAKEFILE, re.MULTILINE)
    assert needed.split() == [".venv/.done", "frontend/dist/index.html"]


def test_every_target_that_is_listed_has_a_word_on_what_it_does() -> None:
    targets = re.findall(r"^\.PHONY: (.*)$", MAKEFILE, re.MULTILINE)
    documented = set(re.findall(r"^([a-z0-9-]+):.*## ", MAKEFILE, re.MULTILINE))
    assert {name for line in targets for name in line.split()} <= documented
