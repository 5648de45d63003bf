"""Every command that a document tells people to type: tried, or at least known to the command line.

Lines of shell blocks are run, in their order, in a scratch folder and against a real server. What
cannot be run here stands in `LISTED` with the reason; of our own commands the words and options are
looked up all the same, in sentences, too.
"""

import argparse
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import pytest

from action_assistant.cli import parser
from docs import scratch
from docs.documented_commands import DOCUMENTS, PROGRAM, ROOT, Command, commands, inline
from support.product import Product, free_ports

MAKEFILE: Final = (ROOT / "Makefile").read_text()
#: Commands, by how they begin, that are not run here, and why.
LISTED: Final = {
    "make": "builds, tests or serves everything: CI does, and tests look at what comes of it",
    "git": "needs the place that the source code comes from",
    "./install": "is in what `make bundle` writes",
    "cd": "belongs to the line that it stands in",
    "export": "sets the shell of whoever types it; these tests set the same",
    "source": "needs a ROS 2 of the distribution: tests/ros lays one out",
    "ros2": "needs a ROS 2 of the distribution: `make workspace`",
    "docker": "needs a container engine: tests/test_image.py looks at what the files say",
    "podman": "needs a container engine",
    "cp": "belongs to containers",
    "curl": "goes to the port that is taken by default",
    "systemctl": "needs systemd",
    "journalctl": "needs systemd",
    "sudo": "needs another user's rights",
    "apt": "changes the computer",
    "apt-get": "changes the computer",
    "brew": "changes the computer",
    "pip": "installs from a registry",
    "pipx": "installs from a registry",
    "uv": "installs from a registry",
    "uvx": "installs from a registry",
    "action-assistant service": "needs systemd: tests of the command look at what it writes",
    "psql": "needs a Postgres of the reader's",
    "pg_basebackup": "needs a Postgres of the reader's",
    "action-assistant move --to sqlite": "needs graphs in a Postgres: tests/commands has one",
    "action-assistant migrate --back": "needs the data of an older version: tests/commands has some",
    "action-assistant backup --into /backups --data DIR --every": "needs rclone, and a day",
    "action-assistant serve --index-folder": "needs the folders of two robots",
    "action-assistant serve --runner": "needs a second runner: tests/commands has one",
    "action-assistant runner --data ./hall-b": "needs the token of a server: tests/commands has one",
    "action-assistant editor --cluster-listen": "needs a Postgres: tests/editor/cluster has one",
    "action-assistant editor --host": "needs a Postgres: tests/editor/cluster has one",
    "action-assistant runner --page-port": "needs the token of a server: tests/commands has one",
    "action-assistant serve --data": "needs a data folder that no server has: tests start hundreds",
    "action-assistant stop --all --server": "speaks to another computer",
    "action-assistant stop --all --url": "speaks to another computer",
    "action-assistant graphs --url": "speaks to another computer",
    "action-assistant login": "needs a person who confirms: tests/commands has one",
    "action-assistant run meet --robots": "needs two robots that may be led: tests/ros leads some",
    "action-assistant runs wait": "needs a led run: tests/ros leads some",
    "action-assistant runs step": "needs a led run that is held: tests/ros leads some",
    "action-assistant runs go-on": "needs a led run that is held: tests/ros leads some",
    "action-assistant audit verify": "needs that the server has ended, as `verify`, which is tried",
    "action-assistant incident": "needs the id of a run: tests/test_incident.py keeps some",
    "action-assistant rights": "needs persons, a group and a folder: tests/commands has some",
    "action-assistant simulate-robot": "needs rclpy: tests/ros and the browser start it",
    ".venv-ros/bin/action-assistant simulate-robot": "needs rclpy: tests/ros and the browser start it",
}
#: Commands that go on until they are interrupted, and their first output.
LASTING: Final = {
    "serve": "ready",
    "sync": "is the file of",
    "watch": "",
}
#: Commands that need the data to themselves, as documents say; the server is ended for them.
ALONE: Final = frozenset({"verify", "restore", "rebuild", "migrate"})
#: Exit codes other than 0 that a command may have here, since the answer is no.
MAY_SAY_NO: Final = ("diff", "doctor", "check")
SERVED_SECONDS: Final = 60
IN_HASTE: Final = "TEST_LONG" not in os.environ


def ours(command: Command) -> Sequence[str]:
    """The words after `action-assistant`, also where another program starts it; none for others."""
    names = [Path(each).name for each in command.words]
    if PROGRAM not in names[:1] and command.program not in {"ros2", "docker", "podman", "sudo"}:
        return ()
    return command.words[names.index(PROGRAM) + 1 :] if PROGRAM in names else ()


def _below(of: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    for action in of._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


def unknown(words: Sequence[str]) -> list[str]:
    """Return the words and options that the command line does not have."""
    at = parser()
    missing: list[str] = []
    for word in words:
        if word.startswith("-") and word != "-":
            if word.split("=")[0] not in at._option_string_actions:
                missing.append(word)
        elif (below := _below(at)) and (word in below or at.prog.count(" ") == 0):
            if word not in below:
                return [word]
            at = below[word]
            complete = getattr(at, "complete", None)
            if complete is not None:
                complete()
                at.complete = None  # type: ignore[attr-defined]
    return missing


def unknown_to_make(words: Sequence[str]) -> list[str]:
    """Targets and variables that the Makefile lacks."""
    variables = [word.split("=")[0] for word in words if "=" in word]
    targets = [word for word in words if "=" not in word and not word.startswith("-")]
    return [
        *(each for each in targets if not re.search(rf"^{each}:", MAKEFILE, re.MULTILINE)),
        *(each for each in variables if each not in MAKEFILE),
    ]


def reason(command: Command) -> str:
    """Return why a command is not run here; "" when it is run."""
    if "postgresql://" in command.text:
        return "needs a Postgres of the reader's: tests/commands has one"
    if command.is_placeholder and command.program == PROGRAM:
        return "somebody has to fill something in"
    is_slow = {"serve", "doctor"} & {*command.words} and len(command.words) > 2
    if IN_HASTE and is_slow:
        return "takes seconds: `make soak ARGS=documents`"
    return next((why for start, why in LISTED.items() if command.text_begins(start)), "")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda each: each.name)
def test_words_and_options_that_a_document_names_exist(document: Path) -> None:
    found = [*commands(document), *inline(document)]
    wrong = {each.place: missing for each in found if (missing := unknown(ours(each)))}
    wrong |= {
        each.place: missing
        for each in found
        if each.program == "make" and (missing := unknown_to_make(each.words[1:]))
    }
    assert wrong == {}


def lasts(command: Command) -> bool:
    """Return whether a command goes on until it is interrupted."""
    return command.words[1] in LASTING and (
        command.words[1] != "sync" or "--watch" in command.words
    )


class Computer:
    """A home, and a server whose data lies where commands look for it by themselves."""

    def __init__(self, folder: Path) -> None:
        self.home = folder / "home"
        data = self.home / ".local" / "share" / "temoto-action-assistant"
        data.parent.mkdir(parents=True)
        self.product = Product(data)
        self._goes = False
        bare = {name: each for name, each in os.environ.items() if not name.startswith("XDG_")}
        mine = {"HOME": str(self.home), "PATH": f"{Path(sys.executable).parent}:{bare['PATH']}"}
        self.environment = {**bare, **self.product.environment, **mine}

    def serve(self, wanted: bool) -> None:
        """Start the server or end it, if it is otherwise."""
        if wanted != self._goes:
            (self.product.start if wanted else self.product.kill)()
            self._goes = wanted

    def filled_in(self, text: str, folder: Path) -> str:
        """Replace the folders of the document by folders of this test."""
        data, backups = (shlex.quote(str(each)) for each in (self.product.data, folder / "backups"))
        return text.replace("--data DIR", f"--data {data}").replace(" /backups", f" {backups}")

    def run(self, command: Command, folder: Path) -> str:
        """Run a whole line as a shell would. What is wrong; "" if nothing."""
        done = subprocess.run(
            ["sh", "-c", self.filled_in(command.text, folder)],
            cwd=folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=SERVED_SECONDS,
            check=False,
        )
        allowed = {0, 1} if command.words[1] in MAY_SAY_NO else {0}
        if done.returncode in allowed and "Traceback" not in done.stderr:
            return ""
        return f"{command.place}: exit {done.returncode}\n{done.stdout[-800:]}{done.stderr[-800:]}"

    def begin_and_end(self, command: Command, folder: Path) -> str:
        """Start what goes on until Ctrl-C, and press that. What is wrong; "" if nothing."""
        more = ""
        if command.words[1] == "serve":
            more = f" --port {free_ports()} --no-open --data {shlex.quote(str(folder / 'served'))}"
        log = folder / "lasting.log"
        with log.open("wb") as out:
            process = subprocess.Popen(
                ["sh", "-c", f"exec {self.filled_in(command.text, folder)}{more}"],
                cwd=folder,
                env=self.environment,
                stdout=out,
                stderr=out,
                start_new_session=True,
                # Scripts start what stays behind them deaf to it.
                preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            )
        awaited, deadline = LASTING[command.words[1]], time.monotonic() + SERVED_SECONDS
        try:
            if not awaited:
                time.sleep(2)
            while process.poll() is None and awaited not in log.read_text():
                if time.monotonic() > deadline:
                    return f"{command.place}: never said {awaited!r}\n{log.read_text()[-800:]}"
                time.sleep(0.05)
            ended_early = process.poll() is not None
            if not ended_early:
                os.killpg(process.pid, signal.SIGINT)
                process.wait(SERVED_SECONDS)
            if ended_early or process.returncode not in {0, 130}:
                return f"{command.place}: exit {process.returncode}\n{log.read_text()[-800:]}"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        return ""


@pytest.fixture(scope="module")
def computer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Computer]:
    """A computer on whose server the tutorial's graph is drawn."""
    made = Computer(tmp_path_factory.mktemp("computer"))
    made.serve(True)
    with made.product.editor() as editor:
        graph = scratch.chain("water_plant", "GoToPlant", "IsDry", "Water")
        assert editor.post("/api/graphs", json=graph).status_code == 201
    yield made
    made.serve(False)


def _runnable(document: Path) -> list[Command]:
    found: dict[str, Command] = {}
    for command in commands(document):
        if not reason(command):
            found.setdefault(command.text, command)
    return list(found.values())


TRIED: Final = [
    pytest.param(each, id=each.name, marks=() if each.name == "README.md" else pytest.mark.long)
    for each in DOCUMENTS
    if _runnable(each)
]


@pytest.mark.turns
@pytest.mark.slow
@pytest.mark.timeout(240)
@pytest.mark.parametrize("document", TRIED)
def test_commands_of_a_document_work(document: Path, computer: Computer, tmp_path: Path) -> None:
    scratch.fill(tmp_path, computer.home)
    for command in _runnable(document):
        computer.serve(command.words[1] not in ALONE)
        wrong = (computer.begin_and_end if lasts(command) else computer.run)(command, tmp_path)
        assert wrong == ""


def test_most_commands_are_tried_and_every_other_has_a_reason() -> None:
    found = [each for document in DOCUMENTS for each in commands(document)]
    tried = [each for each in found if not reason(each)]
    assert len(tried) >= 25, f"{len(tried)} of {len(found)}"
    assert {each.program for each in tried} == {PROGRAM}


@pytest.mark.parametrize(
    ("words", "missing"),
    [
        ("serve --share --port 9000", []),
        ("runs at-rest RUN --how x", []),
        ("runs --graph patrol", []),
        ("serv", ["serv"]),
        ("serve --shared", ["--shared"]),
        ("runs at-rest RUN --why x", ["--why"]),
        ("people invite editor --lable x", ["--lable"]),
    ],
)
def test_a_word_or_option_that_is_not_there_is_found(words: str, missing: list[str]) -> None:
    assert unknown(words.split()) == missing


def test_a_target_or_variable_that_is_not_there_is_found() -> None:
    assert unknown_to_make(["soak", "ARGS=kills"]) == []
    assert unknown_to_make(["soaked", "COLOUR=red"]) == ["soaked", "COLOUR"]
