"""`service` on an image below a folder, by the real systemctl; nothing of this computer is touched."""

import argparse
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from action_assistant.cli import main
from action_assistant.commands.processes import add_serve_options
from action_assistant.commands.services import unit as units
from action_assistant.commands.services.service import _FLAGS, _VALUES
from action_assistant.commands.services.unit import is_untouched

pytestmark = pytest.mark.skipif(
    shutil.which("systemctl") is None, reason="systemd is not here; it reads the units"
)
Service = Callable[..., int]


@pytest.fixture
def service(tmp_path: Path) -> Service:
    """Runs the command on an image."""

    def run(verb: str, *words: str) -> int:
        return main(["service", verb, "--system", "--root", str(tmp_path), *words])

    return run


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    """Return the path of the unit below the root `tmp_path`."""
    return tmp_path / "etc" / "systemd" / "system" / "action-assistant.service"


def wanted(unit: Path) -> bool:
    """Return whether the unit starts with the computer."""
    return (unit.parent / "multi-user.target.wants" / unit.name).is_symlink()


def test_a_unit_is_written_enabled_and_removed_again(
    service: Service, unit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert service("install", "--as", "robot", "--port", "9000") == 0
    told = capsys.readouterr().out
    assert f"writes  {unit}" in told
    assert "systemctl --root=" in told
    assert "/etc/action-assistant/environment" in told
    text = unit.read_text()
    assert "User=robot" in text
    assert " --port 9000" in text
    assert "StateDirectory=action-assistant" in text
    assert wanted(unit)
    assert service("status") == 0
    assert "as it was written" in capsys.readouterr().out
    assert service("uninstall") == 0
    assert not unit.exists()
    assert not wanted(unit)
    assert "graphs, runs and settings stay" in capsys.readouterr().out
    assert service("status") == 1
    assert service("uninstall") == 2


def test_twice_is_once(service: Service, unit: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert service("install", "--as", "robot") == 0
    before = unit.stat().st_mtime_ns
    assert service("install", "--as", "robot") == 0
    assert unit.stat().st_mtime_ns == before
    assert "is as it should be" in capsys.readouterr().out
    assert service("install", "--as", "robot", "--share") == 0
    assert " --share" in unit.read_text()


@pytest.mark.parametrize("verb", ["install", "upgrade", "uninstall"])
def test_an_edited_one_is_left_alone_until_somebody_says_so_and_then_kept(
    service: Service, unit: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    assert service("install", "--as", "robot") == 0
    unit.write_text(unit.read_text() + "\n# mine\n")
    more = ("--as", "robot") if verb == "install" else ()
    assert service(verb, *more) == 2
    assert unit.read_text().endswith("# mine\n")
    assert "was edited" in capsys.readouterr().err
    assert service(verb, *more, "--replace") == 0
    kept = unit.with_name(f"{unit.name}.before")
    assert kept.read_text().endswith("# mine\n")
    assert not unit.exists() or is_untouched(unit.read_text())


def test_a_unit_of_another_program_is_left_alone(service: Service, unit: Path) -> None:
    unit.parent.mkdir(parents=True)
    unit.write_text("[Service]\nExecStart=/usr/bin/other\n")
    assert service("install", "--as", "robot") == 2
    assert service("upgrade") == 2
    assert "other" in unit.read_text()


def test_an_upgrade_keeps_the_options_and_writes_what_this_version_would(
    service: Service, unit: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("--as", "robot", "--port", "9000", "--share", "--data", "/srv/lab data")
    words += ("--index-folder", "David=/ws/install", "--index-folder", "Eve=/mnt/eve")
    with monkeypatch.context() as earlier:
        earlier.setattr("action_assistant.commands.services.unit.VERSION", "0.0.9")
        assert service("install", *words) == 0
    before = unit.read_text()
    assert "version 0.0.9" in before
    assert service("upgrade") == 0
    after = unit.read_text()
    assert "version 0.0.9" not in after
    assert before.splitlines()[3:] == after.splitlines()[3:]
    assert 'ReadWritePaths="/srv/lab data"' in after
    assert "--index-folder David=/ws/install --index-folder Eve=/mnt/eve" in after
    assert "ReadWritePaths=/ws/install" in after
    assert "ReadWritePaths=/mnt/eve" in after


def test_the_unit_gets_the_shells_ros_variables_and_no_secrets(
    service: Service, unit: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy:/ws/install")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    monkeypatch.setenv("ACTION_ASSISTANT_HOSTS", "lab.local")
    monkeypatch.setenv("ACTION_ASSISTANT_ARCHIVE", "/srv/archive")
    monkeypatch.setenv("ACTION_ASSISTANT_METRICS_TOKEN", "secret-" * 8)
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN_FILE", "/run/secrets/token")
    monkeypatch.setenv("PYTHONPATH", "/opt/ros/jazzy/lib/python3.12/site-packages")
    assert service("install", "--as", "robot") == 0
    text = unit.read_text()
    assert "Environment=AMENT_PREFIX_PATH=/opt/ros/jazzy:/ws/install" in text
    assert "Environment=RMW_IMPLEMENTATION=rmw_cyclonedds_cpp" in text
    assert "Environment=ACTION_ASSISTANT_HOSTS=lab.local" in text
    assert "ReadWritePaths=/srv/archive" in text
    assert "Environment=ACTION_ASSISTANT_TOKEN_FILE=/run/secrets/token" in text
    assert "secret-" not in text
    assert "PYTHONPATH=" not in text


def test_every_option_of_serve_reaches_it_or_has_a_reason_not_to() -> None:
    parser = argparse.ArgumentParser()
    add_serve_options(parser)
    known = {each.dest for each in parser._actions} - {"help"}
    left_out = {
        "data": "it has a place of its own",
        "port": "the usual one is left out",
        "database": "one with a password is refused",
        "switch_database": "it is meant for one start",
        "index_folder": "there may be several",
        "runners": "the same",
        "backup_to": "backups have a rule of their own",
        "backup_every": "the same",
        "backup_keep": "the same",
        "backup_after": "the same",
    }
    apart = {"index_folder", "runners", "backup_to", "backup_every", "backup_keep", "backup_after"}
    assert known == {*_VALUES, *_FLAGS, *left_out, *apart}


def test_the_service_makes_the_requested_backups_and_may_write_to_their_folder(
    service: Service, unit: Path
) -> None:
    words = ("--backup-to", "/srv/copies", "--backup-every", "12h", "--backup-keep", "3d")
    assert service("install", "--as", "robot", *words, "--backup-after", "push there") == 0
    text = unit.read_text()
    assert "--backup-to /srv/copies --backup-every 43200s --backup-keep 3d" in text
    assert "--backup-after" in text
    assert "ReadWritePaths=/srv/copies" in text
    assert service("upgrade") == 0
    assert unit.read_text() == text


def test_impossible_options_are_refused_before_anything_is_written(
    service: Service,
    unit: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("SUDO_USER", raising=False)
    password = ("--database", "postgresql://ann:hunter2@db/x")
    for words, why in (
        ((), "Say with --as who is to run it"),
        (("--as", "root"), "name another user"),
        (("--as", "robot", *password), "may hold a password"),
        (("--as", "robot", "--public-url", "robots"), "The public address"),
    ):
        assert service("install", *words) == 2
        assert why in capsys.readouterr().err
    monkeypatch.setattr(sys, "executable", "/home/ann/.cache/uv/archive-v0/x/bin/python")
    assert service("install", "--as", "robot") == 2
    assert "uv tool install" in capsys.readouterr().err
    assert not unit.exists()


def test_without_systemd_it_says_so_and_still_shows_the_unit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(units, "_BOOTED", tmp_path / "nothing")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert main(["service", "install", "--user"]) == 2
    assert "systemd does not run this computer" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert main(["service", "install", "--user", "--print"]) == 0
    assert is_untouched(capsys.readouterr().out)


def test_the_service_leads_the_named_runners(service: Service, unit: Path) -> None:
    words = ("--runner", "Hall A=http://127.0.0.1:8001", "--runner", "Hall B=http://127.0.0.1:8011")
    assert service("install", "--as", "robot", *words) == 0
    assert "'Hall B=http://127.0.0.1:8011'" in unit.read_text().replace('"', "'")
