"""What the container files promise, as far as it can be told without a container engine."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from action_assistant.cli import parser

ROOT = Path(__file__).parents[1]
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OURS = ("editor", "runner", "simulator")


def stages() -> dict[str, list[list[str]]]:
    """The instructions of each stage of the Dockerfile, split at blanks."""
    text = re.sub(r"\\\n\s*", " ", (ROOT / "Dockerfile").read_text())
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


def test_every_image_has_a_version() -> None:
    bases = {words[1] for stage in stages().values() for words in stage if words[0] == "FROM"}
    bases |= {each["image"] for each in SERVICES.values()}
    arguments = dict(
        re.findall(r"^ARG (\w+)=(\S+)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    )
    assert set(arguments) == {"ROS_IMAGE", "ROS_BUILD_IMAGE"}
    bases = {re.sub(r"^\$\{(\w+)(:-.*)?\}$", lambda m: arguments[m[1]], each) for each in bases}
    for base in bases - {"page", "wheel"}:
        tag = base.rpartition(":")[2]
        assert re.search(r"\d+\.\d+|jazzy-.*-noble", tag), base
        assert "latest" not in base


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
    """What is needed to make an environment stays in the stage that made it."""
    own = [" ".join(words) for words in stages()[target] if words[0] in {"RUN", "COPY"}]
    copied = [line for line in own if line.startswith("COPY")]
    assert "COPY scripts/image /opt/build/" in copied
    made = {f"--from={target}-environment /opt/{each}" for each in ("action-assistant", "temoto")}
    others = [line for line in copied if line != "COPY scripts/image /opt/build/"]
    assert {" ".join(line.split()[1:3]) for line in others} <= made
    assert not re.search(r"python3-venv|colcon|build-essential|image (install|messages)", str(own))
    (base,) = [words[1] for words in stages()[target] if words[0] == "FROM"]
    assert "BUILD" not in base


def test_what_is_copied_exists_and_nothing_else_is_sent() -> None:
    ignored = (ROOT / ".dockerignore").read_text().split()
    assert ignored[0] == "*"
    for stage in stages().values():
        for words in stage:
            if words[0] == "COPY" and not words[1].startswith("--from"):
                for source in words[1:-1]:
                    assert (ROOT / source).exists(), source
                    assert f"!{source.split('/')[0]}" in ignored, source


@pytest.mark.parametrize("name", [*OURS, "db"])
def test_a_service_is_not_root_has_a_health_and_is_not_open_to_the_network(name: str) -> None:
    service = SERVICES[name]
    assert service["healthcheck"]["test"]
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert name in OURS or service["user"] == "999:999"
    assert all(each.startswith("127.0.0.1:") for each in service.get("ports", []))
    assert all(":" in each for each in service["volumes"])
    if name in OURS:
        assert service["read_only"]


def test_no_password_stands_anywhere() -> None:
    said = " ".join(texts(COMPOSE))
    assert said.count("${POSTGRES_PASSWORD:?") == 2
    assert "${POSTGRES_PASSWORD:-" not in said
    assert not re.search(r"://[^/@ ]*:[^@ ]*@", said)
    assert re.search(r"^POSTGRES_PASSWORD=$", (ROOT / ".env.example").read_text(), re.MULTILINE)


def test_the_example_names_every_variable_and_no_other() -> None:
    used = set(re.findall(r"\$\{([A-Z_]+)", (ROOT / "docker-compose.yml").read_text()))
    named = set(re.findall(r"^([A-Z_]+)=", (ROOT / ".env.example").read_text(), re.MULTILINE))
    assert used == named


@pytest.mark.parametrize("name", OURS)
def test_the_command_line_understands_what_each_service_says(name: str) -> None:
    options = parser().parse_args(SERVICES[name]["command"])
    assert str(options.data) == "/data"


def test_the_runner_stands_where_engines_are() -> None:
    runner = SERVICES["runner"]
    assert (runner["network_mode"], runner["ipc"]) == ("host", "host")
    assert {"RMW_IMPLEMENTATION", "ROS_DOMAIN_ID"} <= runner["environment"].keys()
    assert "depends_on" not in runner, "Stop needs neither the editor nor the database"


def test_the_simulator_alone_needs_no_robots_and_no_postgres() -> None:
    alone = SERVICES["simulator"]
    assert alone["profiles"] == ["simulator"]
    assert "depends_on" not in alone
    assert "POSTGRES_PASSWORD" not in " ".join(texts(alone))
    assert alone["build"]["target"] == "editor"
