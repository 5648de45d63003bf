"""The images as they were built: what is in them, and what is not."""

import time

import pytest

from containers.engine import ROOT, inspect, podman, run
from containers.images import EDITOR, RUNNER, VERSION, compose_build, say

#: A module of the program that every image imports at its start.
_LINE = ROOT / "server" / "action_assistant" / "version.py"


def inside(image: str, script: str) -> str:
    """Return the output of a shell in the image."""
    return podman("run", "--rm", "--network=none", "--entrypoint=/bin/sh", image, "-c", script)


@pytest.mark.parametrize("image", [EDITOR, RUNNER])
def test_an_image_says_what_it_is(image: str) -> None:
    found = inspect(image)
    labels = found["Labels"]
    assert labels["org.opencontainers.image.version"] == VERSION
    assert labels["org.opencontainers.image.title"].startswith("TeMoto Action Assistant")
    assert found["User"] == "10001:10001"
    assert found["Healthcheck"]["Test"][1].endswith("/image")
    commit = labels["org.opencontainers.image.revision"]
    run("git", "merge-base", "--is-ancestor", commit, "HEAD")
    said = inside(image, "action-assistant --version")
    assert said == f"action-assistant {VERSION.replace('-', '+')} (commit {commit[:8]})\n"


@pytest.mark.parametrize("image", [EDITOR, RUNNER])
def test_nothing_that_builds_or_tests_is_in_an_image(image: str) -> None:
    found = inside(image, "find /opt/action-assistant -name pip -o -name tests -o -name '*.pip'")
    assert found == ""
    assert (
        inside(image, "for each in node npm g++ cmake colcon; do command -v $each; done; true")
        == ""
    )
    left = "python3 -m pip --version >/dev/null 2>&1 && echo pip; ls /opt/build"
    of_the_base = {"ros.txt"}
    assert set(inside(image, left).split()) - of_the_base == {"image"}


def test_a_changed_line_of_python_is_in_the_images_within_a_minute() -> None:
    """Told is how long it took; the bound is wide, since machines are busy at times."""
    before = _LINE.read_text()
    try:
        _LINE.write_text(f"{before}# changed at {time.time()}\n")
        for service, image in (("editor", EDITOR), ("runner", RUNNER)):
            layers = inspect(image)["RootFS"]["Layers"]
            seconds = compose_build(service)
            again = inspect(image)["RootFS"]["Layers"]
            kept = sum(one == other for one, other in zip(layers, again, strict=True))
            say(
                f"{image} after a changed line: {seconds:.0f} s, {kept} of {len(layers)} layers kept"
            )
            assert kept == len(layers) - 1
            assert "# changed" in inside(
                image,
                "cat /opt/action-assistant/lib/python3*/site-packages/action_assistant/version.py",
            )
    finally:
        _LINE.write_text(before)
        compose_build("editor", "runner")
