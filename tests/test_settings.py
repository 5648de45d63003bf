"""The environment gives settings that the command line does not."""

from pathlib import Path

import pytest

from action_assistant import paths, settings
from action_assistant.cli import main, parser
from action_assistant.commands.client import reach
from action_assistant.errors import CannotStart


def test_the_data_folder_is_where_the_environment_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_DATA", "/somewhere")
    assert paths.data() == Path("/somewhere")
    for command in ("serve", "runner", "verify", "link", "doctor"):
        assert parser().parse_args([command]).data == Path("/somewhere")
    assert parser().parse_args(["verify", "--data", "/else"]).data == Path("/else")


def test_the_ports_are_those_that_the_environment_says(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_PORT", "9000")
    (tmp_path / "token").write_text("t" * 43)
    assert [parser().parse_args([each]).port for each in ("serve", "editor", "runner")] == [
        9000,
        9000,
        9001,
    ]
    found = reach(parser().parse_args(["graphs", "--data", str(tmp_path)]))
    assert found["base_url"] == "http://127.0.0.1:9000"


def test_the_environment_sets_limits_of_persons_and_graphs() -> None:
    name = "ACTION_ASSISTANT_LIMITS"
    usual = settings.LoadLimits()
    assert settings.load_limits({}) == settings.load_limits({name: " OFF "}) == usual
    assert not settings.limits({name: " OFF "})
    set_here = settings.load_limits({name: "sockets=20, actions=500"})
    assert set_here == settings.LoadLimits(sockets=20, actions=500)
    assert settings.limits({name: "sockets=20"})
    for wrong in ("of", "sockets", "sockets=9", "actions=5001", "graph-mib=x", "actions=1,", "a=1"):
        with pytest.raises(CannotStart, match=r"LIMITS is `off`, or a list of sockets=10…10000"):
            settings.load_limits({name: wrong})


@pytest.mark.parametrize(("said", "seconds"), [("", 60.0), ("OFF", None), ("2.5", 2.5)])
def test_the_environment_sets_how_long_an_editor_may_be_silent(
    said: str, seconds: float | None
) -> None:
    assert settings.watchdog({"ACTION_ASSISTANT_WATCHDOG": said}) == seconds


@pytest.mark.parametrize("said", ["0", "soon", "nan", "inf", "-5"])
def test_an_impossible_patience_is_refused(said: str) -> None:
    with pytest.raises(CannotStart, match="from 1 to 86400"):
        settings.watchdog({"ACTION_ASSISTANT_WATCHDOG": said})


@pytest.mark.parametrize(
    ("said", "share", "tls"), [("", False, False), ("http", True, False), ("TLS", True, True)]
)
def test_the_environment_sets_who_may_enter(
    said: str, share: bool, tls: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_SHARE", said)
    for command in ("serve", "editor", "runner"):
        options = parser().parse_args([command])
        assert (options.share, options.tls) == (share, tls)
    monkeypatch.setenv("ACTION_ASSISTANT_SHARE", "yes")
    assert main(["serve"]) == 2


@pytest.mark.parametrize("text", ["x", "0", "65535", "-1"])
def test_a_port_that_is_none_is_refused(
    text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_PORT", text)
    assert main(["serve"]) == 2
    assert "ACTION_ASSISTANT_PORT is a port below 65535" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "secret"),
    [
        ("ACTION_ASSISTANT_TOKEN_FILE", "ACTION_ASSISTANT_TOKEN"),
        ("ACTION_ASSISTANT_DATABASE_FILE", "ACTION_ASSISTANT_DATABASE"),
        ("ACTION_ASSISTANT_DATABASE_PASSWORD_FILE", "PGPASSWORD"),
    ],
)
def test_a_secret_may_stand_in_a_file(name: str, secret: str, tmp_path: Path) -> None:
    file = tmp_path / "secret"
    file.write_text("s" * 43 + "\n")
    found = {name: str(file), "OTHER": "1"}
    settings.take_secrets_from_files(found)
    assert found == {secret: "s" * 43, "OTHER": "1"}
    unset = {name: ""}
    settings.take_secrets_from_files(unset)
    assert unset == {}
    with pytest.raises(CannotStart, match=f"{name} and {secret} are both set"):
        settings.take_secrets_from_files({name: str(file), secret: "another"})


@pytest.mark.parametrize("content", [b"", b" \n", b"two\nlines", b"\xff\xfe", None])
def test_a_secret_that_is_named_and_not_there_is_not_done_without(
    content: bytes | None, tmp_path: Path
) -> None:
    file = tmp_path / "secret"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(CannotStart, match="ACTION_ASSISTANT_TOKEN_FILE is "):
        settings.take_secrets_from_files({"ACTION_ASSISTANT_TOKEN_FILE": str(file)})


def test_links_from_runs_have_a_name_a_web_address_and_known_places() -> None:
    name = "ACTION_ASSISTANT_RUN_LINKS"
    good = (
        "Video=https://nvr.lab/{robot}?from={from}&to={to_ms}; Bags = http://10.0.0.2:8080/{run} ;"
    )
    assert settings.run_links({}) == ()
    assert settings.run_links({name: good}) == (
        settings.RunLink("Video", "https://nvr.lab/{robot}?from={from}&to={to_ms}"),
        settings.RunLink("Bags", "http://10.0.0.2:8080/{run}"),
    )


@pytest.mark.parametrize(
    ("written", "why"),
    [
        ("https://nvr.lab/", "NAME=URL"),
        ("Video=javascript:alert(1)", "http:// or https://"),
        ("Video=https://{robot}.lab/", "a host"),
        ("Video=https://nvr.lab/a b", "NAME=URL"),
        ("Video=https://nvr.lab/{password}", "{password} is none of {at}"),
    ],
)
def test_another_link_from_runs_stops_the_start_with_its_reason(written: str, why: str) -> None:
    with pytest.raises(CannotStart) as refused:
        settings.run_links({"ACTION_ASSISTANT_RUN_LINKS": written})
    assert why in str(refused.value)
