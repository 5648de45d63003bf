"""The container files keep their promises, as far as that shows without a container engine;
`make containers` runs them."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from action_assistant.cli import parser
from action_assistant.settings import VARIABLES

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "docker-compose.yml").read_text()
COMPOSE: dict[str, Any] = yaml.safe_load(TEXT)
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OURS = ("editor", "runner", "simulator", "robot")
EXAMPLE = (ROOT / ".env.example").read_text()
#: Settings that a container decides itself: the place of its data, and its Python.
INSIDE = {"ACTION_ASSISTANT_DATA", "ACTION_ASSISTANT_RUNNER_PYTHON", "ACTION_ASSISTANT_URL"}


def stages() -> dict[str, list[list[str]]]:
    """The instructions of each stage of the Dockerfile, split at blanks."""
    text = re.sub(r"\\\n\s*", " ", (ROOT / "Dockerfile").read_text())
    text = text.replace("--platform=$BUILDPLATFORM ", "")
    found: dict[str, list[list[str]]] = {}
    name = ""
    for line in text.splitlines():
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] == "FROM":
            name = words[-1]
        found.setdefault(name, []).append(words)
    return found


def texts(value: object) -> list[str]:
    """Every text inside a value."""
    match value:
        case str():
            return [value]
        case dict():
            return [text for pair in value.items() for each in pair for text in texts(each)]
        case list():
            return [text for each in value for text in texts(each)]
        case _:
            return []


def defaults() -> dict[str, set[str]]:
    """Each variable of compose, with what it is where nobody says."""
    found: dict[str, set[str]] = {}
    for name, default in re.findall(r"(?<!\$)\$\{([A-Z_]+):?-?([^}]*)\}", TEXT):
        found.setdefault(name, set()).add(default)
    return found


def arguments() -> dict[str, str]:
    """Return the arguments of the Dockerfile, with their defaults."""
    return dict(re.findall(r"^ARG (\w+)=(\S*)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE))


def test_every_image_has_a_version() -> None:
    bases = {words[1] for stage in stages().values() for words in stage if words[0] == "FROM"}
    bases |= {each["image"] for each in SERVICES.values()}
    known = arguments() | {name: next(iter(found)) for name, found in defaults().items()}
    assert set(arguments()) == {"ROS_IMAGE", "ROS_BUILD_IMAGE", "VERSION", "SOURCE_COMMIT"}
    bases = {re.sub(r"\$\{(\w+)(:-.*)?\}", lambda m: known[m[1]], each) for each in bases}
    for base in bases - set(stages()):
        tag = base.rpartition(":")[2]
        assert re.search(r"\d+\.\d+|jazzy-.*-noble", tag), base
        assert "latest" not in base


def test_the_version_is_that_of_the_program() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"][
        "temoto-action-assistant"
    ]["version"]
    assert arguments()["VERSION"] == version
    assert defaults()["IMAGE_VERSION"] == {version}
    for target in ("editor", "runner"):
        (label,) = [words for words in stages()[target] if words[0] == "LABEL"]
        assert 'org.opencontainers.image.version="$VERSION"' in label
        assert stages()[target][-1] == label, "whatever comes after it is made anew for a version"


@pytest.mark.parametrize("target", ["editor", "runner"])
def test_an_image_runs_as_nobody_special_and_tells_its_health(target: str) -> None:
    steps = [words[0] for words in stages()[target]]
    (user,) = [words[1] for words in stages()[target] if words[0] == "USER"]
    assert user == "10001:10001"
    assert steps.index("USER") > max(at for at, step in enumerate(steps) if step in {"RUN", "COPY"})
    assert "HEALTHCHECK" in steps
    assert "ADD" not in steps


@pytest.mark.parametrize("target", ["editor", "runner"])
def test_an_image_holds_nothing_that_only_building_needs(target: str) -> None:
    """Tools that only make an environment stay in the stage that made it."""
    own = [" ".join(words) for words in stages()[target] if words[0] in {"RUN", "COPY"}]
    copied = [line.split() for line in own if line.startswith("COPY")]
    assert copied.pop(0) == ["COPY", "scripts/image", "/opt/build/"]
    made = {
        ("--from=messages", "/opt/temoto"),
        (f"--from={target}-dependencies", "/opt/action-assistant"),
        (f"--from={target}-package", "/opt/package"),
    }
    assert {(each[1], each[2]) for each in copied} == made - (
        {("--from=messages", "/opt/temoto")} if target == "editor" else set()
    )
    steps = r"python3-venv|colcon|build-essential|image (dependencies|package|messages)"
    assert not re.search(steps, str(own))
    (base,) = [words[1] for words in stages()[target] if words[0] == "FROM"]
    assert "BUILD" not in base


@pytest.mark.parametrize("target", ["editor", "runner"])
def test_a_changed_line_of_python_builds_nothing_but_the_package(target: str) -> None:
    """The layers below the package hold only locks and the build steps of ours."""
    for stage in (f"{target}-dependencies", "messages", "page"):
        copied = {word for words in stages()[stage] if words[0] == "COPY" for word in words[1:-1]}
        assert not copied & {"server", "migrations", "pyproject.toml", "--from=wheel"}
    assert stages()[target][-1][0] == "LABEL"
    last = [words for words in stages()[target] if words[0] in {"COPY", "RUN"}][-1]
    assert last[1] == f"--from={target}-package"


@pytest.mark.parametrize(
    ("words", "called"),
    [
        ("doctor --json", "doctor --only machine --json"),
        ("doctor", "doctor --only machine"),
        ("doctor --before-upgrade", "doctor --before-upgrade"),
        ("people list", "people list"),
    ],
)
def test_doctor_looks_for_robots_where_the_image_has_ros(
    tmp_path: Path, words: str, called: str
) -> None:
    script = (ROOT / "scripts" / "image").read_text()
    script = script.replace("/opt/action-assistant/bin/action-assistant", "echo")
    for folder, said in ((tmp_path / "none", called), (tmp_path, words)):
        (tmp_path / "image").write_text(script.replace("/opt/ros", str(folder)))
        told = subprocess.run(
            ["sh", tmp_path / "image", "run", *words.split()],
            capture_output=True,
            text=True,
            check=True,
        )
        assert told.stdout == f"{said}\n"


def test_editors_of_one_folder_take_an_address_each(tmp_path: Path) -> None:
    (tmp_path / "program").write_text('#!/bin/sh\necho "$@"\nread -r _\n')
    (tmp_path / "program").chmod(0o755)
    script = (ROOT / "scripts" / "image").read_text()
    script = script.replace("/opt/action-assistant/bin/action-assistant", str(tmp_path / "program"))
    (tmp_path / "image").write_text(script.replace("/tmp/editor-", f"{tmp_path}/editor-"))
    env = {**os.environ, "EDITORS": "2", "ACTION_ASSISTANT_DATA": str(tmp_path)}

    def begin() -> "subprocess.Popen[str]":
        pipe = subprocess.PIPE
        words = ["sh", str(tmp_path / "image"), "run", "editor", "--no-open"]
        return subprocess.Popen(words, env=env, stdin=pipe, stdout=pipe, stderr=pipe, text=True)

    def said(editor: "subprocess.Popen[str]") -> str:
        assert editor.stdout is not None
        return editor.stdout.readline()

    words = "editor --host 127.0.0.{0} --cluster-listen 127.0.0.{0}:8400 --no-open\n"
    with begin() as one, begin() as two:
        assert {said(one), said(two)} == {words.format(1), words.format(2)}
        with begin() as third:
            assert third.communicate()[1].startswith("image: 2 editors run already")
            assert third.returncode == 1
        one.kill()
        one.wait()
        with begin() as again:
            assert said(again) in {words.format(1), words.format(2)}
            again.kill()
        two.kill()
    assert (tmp_path / "editor-address").read_text() in {"127.0.0.1\n", "127.0.0.2\n"}


@pytest.mark.parametrize(
    ("editors", "told"),
    [("1", " 127.0.0.1:8000 | 0\n"), ("3", " 127.0.0.1:8000 127.0.0.2:8000 127.0.0.3:8000 | 2s\n")],
)
def test_the_proxy_knows_all_editors(editors: str, told: str) -> None:
    command = SERVICES["proxy"]["command"][-1].replace("$$", "$")
    command = re.sub(r"exec caddy .*", 'echo "$EDITOR_ADDRESSES | $PATIENCE"', command)
    env = SERVICES["proxy"]["environment"]
    env = env | {"PUBLIC_URL": "https://lab.local", "EDITORS": editors, "EDITOR_PORT": "8000"}
    answer = subprocess.run(
        ["sh", "-c", command], env=env, capture_output=True, text=True, check=True
    )
    assert answer.stdout == told


#: Stands in for the Python of the help's stage: it imports what builds the help, and says what that took.
_IMPORTS = """
import json, sys
from importlib.metadata import packages_distributions
sys.path.insert(0, "docs/site")
known = set(sys.modules)
import build
tops = {name.partition(".")[0] for name in set(sys.modules) - known}
files = [each.__file__ for name, each in sys.modules.items() if name.startswith("action_assistant")]
packages = packages_distributions()
print(json.dumps([files, sorted({each for top in tops for each in packages.get(top, ())})]))
"""


def test_the_help_needs_nothing_that_its_stage_does_not_have(tmp_path: Path) -> None:
    """The build of the help imports some files of the program, and packages of requirements/site.txt."""
    pytest.importorskip("sphinx")
    for words in stages()["help"]:
        for source in words[1:-1] if words[0] == "COPY" else ():
            target = tmp_path / words[-1]
            if (ROOT / source).is_dir():
                shutil.copytree(ROOT / source, target)
            else:
                target.mkdir(parents=True, exist_ok=True)
                shutil.copy(ROOT / source, target)
    python = tmp_path / "prefix" / "bin" / "python"
    python.parent.mkdir(parents=True)
    (tmp_path / "imports.py").write_text(_IMPORTS)
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" imports.py\n')
    python.chmod(0o755)
    told = subprocess.run(
        [tmp_path / "scripts" / "image", "help", tmp_path / "prefix", tmp_path / "out"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert told.returncode == 0, told.stderr.decode()
    files, packages = json.loads(told.stdout)
    assert all(Path(each).is_relative_to(tmp_path) for each in files), files
    locked = set(
        re.findall(r"^([\w.-]+)==", (ROOT / "requirements/site.txt").read_text(), re.MULTILINE)
    )
    ours = "temoto-action-assistant"
    assert {each.lower().replace("_", "-") for each in packages} - {ours} <= locked


def test_copied_files_exist_and_no_others_are_sent_to_the_build() -> None:
    ignored = (ROOT / ".dockerignore").read_text().split()
    assert ignored[0] == "*"
    for stage in stages().values():
        for words in stage:
            if words[0] == "COPY" and not words[1].startswith("--from"):
                for source in words[1:-1]:
                    assert (ROOT / source).exists(), source
                    assert f"!{source.split('/')[0]}" in ignored, source


@pytest.mark.parametrize("name", SERVICES)
def test_a_service_is_bounded_has_no_rights_and_is_not_open_to_the_network(name: str) -> None:
    service = SERVICES[name]
    assert service["cap_drop"] == ["ALL"]
    assert service.get("cap_add", []) == (["NET_BIND_SERVICE"] if name == "proxy" else [])
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service["read_only"]
    assert name != "db" or service["user"] == "999:999"
    assert service["pids_limit"]
    assert service["logging"]["options"] == {"max-size": "10m", "max-file": "5"}
    assert "mem_limit" in service or name == "runner", "nothing ends what stops robots"
    assert service["healthcheck"].get("test") or name in {"robot", "proxy", "backups"}
    assert all(each.startswith("127.0.0.1:") for each in service.get("ports", []))
    assert all(":" in each for each in service.get("volumes", []))


def test_no_password_stands_anywhere_and_none_is_asked_for() -> None:
    said = " ".join(texts(COMPOSE))
    assert not re.search(r"(?<!\$)\$\{[A-Z_]+:\?", said), "what needs it is not all that there is"
    assert not re.search(r"://[^/@ ]*:[^@ ]*@", said + EXAMPLE)
    assert SERVICES["db"]["network_mode"] == "none"
    assert "listen_addresses=" in SERVICES["db"]["command"]
    assert SERVICES["db"]["environment"]["POSTGRES_PASSWORD_FILE"].startswith("/proc/sys/kernel/")


def test_the_example_has_every_setting_and_every_variable_and_no_other() -> None:
    named = set(re.findall(r"^#?([A-Z_]+)=", EXAMPLE, re.MULTILINE))
    ros = {"ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "RMW_IMPLEMENTATION", "CYCLONEDDS_URI"}
    assert named == (set(VARIABLES) - INSIDE) | set(defaults()) | ros
    assert not re.findall(r"^[A-Z_]+=", EXAMPLE, re.MULTILINE), "a copy of it changes nothing"


@pytest.mark.parametrize("name", OURS)
def test_every_setting_reaches_every_container_of_ours(name: str) -> None:
    """Settings reach containers by the file in which people write them; compose adds only
    required ones."""
    service = SERVICES[name]
    assert service["env_file"] == [{"path": ".env", "required": False}]
    said = set(service.get("environment", {})) - {"EDITORS"}  # read before the program begins
    assert said <= set(VARIABLES)
    alone = {"PORT", "SHARE", "HOSTS", "DATABASE_FILE"} if name == "simulator" else set()
    kept = {"DATA", "DATABASE"} if name != "robot" else set()
    assert said == {f"ACTION_ASSISTANT_{each}" for each in kept | alone}


@pytest.mark.parametrize("name", OURS)
def test_the_command_line_understands_what_each_service_says(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_DATA", "/data")
    words = [re.sub(r"\$\{\w+:-(\w+)\}", r"\1", each) for each in SERVICES[name]["command"]]
    options = parser().parse_args(words)
    assert name == "robot" or str(options.data) == "/data"


@pytest.mark.parametrize("name", ["runner", "robot"])
def test_services_that_speak_to_robots_use_the_hosts_network(name: str) -> None:
    service = SERVICES[name]
    assert (service["network_mode"], service["ipc"]) == ("host", "host")
    assert "depends_on" not in service, "Stop needs neither the editor nor the database"


def test_editor_runner_and_proxy_are_on_one_network() -> None:
    """Else none of them is where its links, proofs and commands say (decision 75)."""
    for name in ("editor", "runner", "proxy"):
        assert SERVICES[name]["network_mode"] == "host"
    also = {"EDITORS": SERVICES["editor"]["scale"]}
    assert SERVICES["editor"]["environment"] == SERVICES["runner"]["environment"] | also


def test_the_simulator_alone_needs_no_robots_and_no_postgres_and_keeps_its_data_apart() -> None:
    alone = SERVICES["simulator"]
    assert alone["profiles"] == ["simulator"]
    assert "depends_on" not in alone
    assert alone["environment"]["ACTION_ASSISTANT_DATABASE"] == ""
    assert alone["build"]["target"] == "editor"
    others = {each for name, one in SERVICES.items() if name != "simulator" for each in
              one.get("volumes", [])}  # fmt: skip
    assert not {each.split(":")[0] for each in alone["volumes"]} & {
        each.split(":")[0] for each in others
    }
