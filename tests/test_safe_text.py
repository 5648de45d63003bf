"""Texts of strangers cannot steer a terminal, and no log and no list of processes holds a
secret."""

import json
import logging
import os
import pty
import re
import subprocess
import time
import unicodedata
from pathlib import Path

import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import NotFound
from action_assistant.safe_text import PrintableLog, one_line, printable, sentence
from action_assistant.umrf.model import Problem, Where
from action_assistant.web.auth.keys import Keys
from action_assistant.web.http.problems import problem_of
from journal import servers
from support.product import COMMAND, TOKEN, Product, free_ports

EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202ename"
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@given(st.recursive(st.text(), lambda some: st.lists(some) | st.dictionaries(st.text(), some)))
def test_json_stays_the_same_json_and_steers_nothing(value: object) -> None:
    shown = printable(json.dumps(value, ensure_ascii=False, indent=1))
    assert json.loads(shown) == value
    assert not _CONTROLS.search(shown)
    shown.encode()


#: Parts of names, and of what stands around them in a sentence.
_NAMES = st.lists(
    st.sampled_from(
        [*"\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u200e\u200f\u061c", "\n"]
    )
    | st.sampled_from(["ذراع", "רובוט", "٣", "arm", "1", " ", "_", ", ", "\u0301", "\\"])
    | st.characters(),
    max_size=8,
).map("".join)
_ISOLATED = re.compile("\u2068[^\u2066-\u2069\u202a-\u202e]*\u2069")
_TURNS = {"R", "AL", "AN", "RLE", "LRE", "RLO", "LRO", "PDF", "RLI", "LRI", "FSI", "PDI"}


def _turns(text: str) -> bool:
    """Return whether a character outside of isolates has a class that can change the order (UAX
    9)."""
    return any(unicodedata.bidirectional(each) in _TURNS for each in _ISOLATED.sub("", text))


@given(_NAMES, _NAMES)
def test_no_name_turns_the_sentence_around_it(graph: str, robot: str) -> None:
    said = f"{graph} waits for {robot}: 2 of 3 are (a) there."
    shown = sentence(said)
    assert not _turns(shown)
    assert shown.endswith(": 2 of 3 are (a) there.")
    assert " waits for " in _ISOLATED.sub("", shown)
    assert sentence(shown) == shown
    # No letter is lost: beside isolates, which may be there already, the letters are those as JSON
    # writes them.
    escaped = re.sub("[\u202a-\u202e\u2066-\u2069]", lambda it: f"\\u{ord(it[0]):04x}", said)
    isolates = re.compile(r"[\u2068\u2069]|\\u206[89]")
    assert isolates.sub("", shown) == isolates.sub("", escaped)
    if all(each < "\u0590" or "\u3000" <= each < "\ud800" for each in said):
        assert shown == said  # as for all letters that are written from left to right


@given(_NAMES)
def test_no_name_turns_what_stands_after_it_on_a_terminal(name: str) -> None:
    line = one_line(f"run 2 of {name} 3 of 4")
    assert not _CONTROLS.search(line)
    assert line == one_line(line)
    # A mark on both sides: nothing neutral, and no digit, stands beside what is written leftwards.
    for run in re.finditer("[^\u200e]+", line):
        classes = {unicodedata.bidirectional(each) for each in run[0]}
        assert not (classes & {"R", "AL", "AN"} and "L" in classes)


@pytest.mark.parametrize(
    "name", ["a\u202eb", "a\u2066b", "a\u200fb", "ذراع", "a\u2067\u2069\u202eb"]
)
def test_no_refusal_and_no_problem_is_turned_by_a_name(name: str) -> None:
    told = f"{name} is not there: 2 of 3."
    problem = Problem(code="x", severity="error", where=Where(path=f"/{name}"), message=told)
    body = problem_of(NotFound(told, where={"path": f"/{name}"}))
    assert problem.message == sentence(told) == json.loads(body)["detail"]
    assert not _turns(problem.message)
    assert (
        problem.where.path == json.loads(body)["where"]["path"] == f"/{name}"
    )  # exact: no sentence


def test_a_line_of_a_log_cannot_pretend_to_be_two() -> None:
    formatted = PrintableLog()
    record = logging.LogRecord("x", logging.INFO, "", 0, "refused %s", (f"/a\n{EVIL}",), None)
    shown = formatted.format(record)
    assert shown.endswith("refused /a\\n" + one_line(EVIL))
    assert not _CONTROLS.search(shown)
    try:
        raise ValueError(f"first\n2026 INFO forged\r{EVIL}")
    except ValueError as error:
        raised = (type(error), error, error.__traceback__)
    record = logging.LogRecord("x", logging.ERROR, "", 0, "failed", (), raised)
    first, *rest = formatted.format(record).split("\n")
    assert first.endswith("failed")
    assert all(line.startswith("    ") for line in rest)
    assert not _CONTROLS.search("".join(rest))


@pytest.mark.parametrize(
    "text",
    [
        "/t={token}",
        "/x?token={token}",
        "Bearer {token}",
        "'{token}'",
        "/api/session/i={link}",
        "{link}",
        "aa_8000={cookie}",
        "postgresql://me:{password}@db/x",
        "postgresql://me:a/{password}@db/x",
        "postgresql+psycopg://me:a:/{password}@db/x",
        "postgresql://me@db/x?password={password}",
    ],
)
def test_no_log_shows_what_lets_somebody_in(text: str, tmp_path: Path) -> None:
    keys = Keys.of(tmp_path)
    secret = {
        "token": keys.token,
        "link": f"trlQRDEFzMaX.{keys.secret_of('trlQRDEFzMaX')}",
        "cookie": keys.sealed(keys.new_session("Ada")),
        "password": "hunter2-and-more",
    }
    record = logging.LogRecord(
        "x", logging.INFO, "", 0, "refused %s", (text.format(**secret),), None
    )
    shown = PrintableLog().format(record)
    for each in secret.values():
        assert each.rpartition(".")[2] not in shown


def test_a_token_that_somebody_chose_is_not_shown_either() -> None:
    record = logging.LogRecord("x", logging.INFO, "", 0, "at %s", (f"/wrong/{TOKEN}/",), None)
    assert TOKEN not in PrintableLog(TOKEN).format(record)


def test_neither_log_nor_processes_show_secrets_and_nothing_in_them_steers(tmp_path: Path) -> None:
    flags = ["--share", "--host", "127.0.0.1"]
    with_postgres = servers.binaries() is not None
    if with_postgres:
        with servers.server() as postgres:
            url = postgres.new_database().replace("aa@", "aa:a/hunter2@")
            _try_secrets(Product(tmp_path / "data", *flags, "--database", url, hosts="lab.test"))
    else:
        _try_secrets(Product(tmp_path / "data", *flags, hosts="lab.test"))


def _try_secrets(product: Product) -> None:
    product.start()
    try:
        with product.editor() as editor, product.runner() as runner:
            name = f"patrol{EVIL}\nforged"
            editor.post("/api/graphs", json={"graph_name": name, "actions": []}).raise_for_status()
            link = editor.post("/api/invitations", json={"role": "viewer", "label": "x"}).json()
            proof = link["path"].removeprefix("/#i=")
            for client in (editor, runner):
                for path in ("/%1b[2J%0aINFO forged", f"/t={TOKEN}", f"/i={proof}", "/%C2%9b31m"):
                    client.get(path, headers={"authorization": ""})
                client.get("/", headers={"host": "evil\x7f.example"})
        listed = product.cli("graphs")
        assert listed.returncode == 0, listed.stderr
        assert one_line(name) in listed.stdout
        assert not _CONTROLS.search(listed.stdout)
        family = psutil.Process(product.process("editor").ppid())
        for process in (family, *family.children(recursive=True)):
            arguments = " ".join(process.cmdline())
            assert not any(word in arguments for word in ("hunter2", TOKEN, proof)), arguments
        deadline = time.monotonic() + 20
        while "people list" not in product.log.read_text():
            assert time.monotonic() < deadline
            time.sleep(0.05)
    finally:
        product.end()
    said = product.log.read_text()
    assert "\\u001b[2J\\nINFO forged" in said
    assert not _CONTROLS.search(said)
    for word in ("hunter2", TOKEN, proof.partition(".")[2], "#i=", "#t="):
        assert word not in said
    assert TOKEN in (product.data / "open.html").read_text()


@pytest.mark.long
def test_printed_addresses_of_databases_have_no_password(tmp_path: Path) -> None:
    for command in ("migrate", "doctor", "verify"):
        for url in ("postgresql://me:hunter2@127.0.0.1:1/x", "postgresql:/me:hunter2@[/x"):
            answer = subprocess.run(
                [*COMMAND, command, "--data", str(tmp_path), "--database", url],
                capture_output=True,
                text=True,
                check=False,
            )
            assert answer.returncode != 0
            assert "hunter2" not in answer.stdout + answer.stderr
            assert "Traceback" not in answer.stderr


@pytest.mark.long
def test_at_a_terminal_the_link_is_shown_to_its_owner(tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    port = free_ports()
    serve = subprocess.Popen(
        [*COMMAND, "serve", "--no-open", "--data", str(tmp_path / "data"), "--port", str(port)],
        env={**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN},
        stderr=theirs,
    )
    try:
        said = ""
        while f"http://127.0.0.1:{port}/#t={TOKEN}" not in said:
            said += os.read(ours, 4096).decode()
    finally:
        serve.terminate()
        serve.wait(20)
        os.close(ours)
        os.close(theirs)
