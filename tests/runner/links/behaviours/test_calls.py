"""One call of a behaviour: what its process sees, and how it is ended whatever it does."""

import json
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from action_assistant.runner.links.behaviours.folder import BehaviourFolder
from action_assistant.runner.links.behaviours.performer import MOST, BehaviourPerformer
from action_assistant.umrf.semantics import Call, Returned
from runner.links.behaviours.written import DEAF, WAITS, processes, until, write

pytestmark = pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="behaviours need Linux")


class Bench:
    """A performer and its folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.performer = BehaviourPerformer(BehaviourFolder.opened(write(folder)))
        self._returned: list[Returned] = []

    def begin(self, name: str = "acts", number: int = 1, **outputs: str) -> None:
        self.performer.begin(
            Call(number=number, graph="g", node=f"{name}_0", name=name, inputs={}, outputs=outputs)
        )

    def returned(self, count: int = 1, patience: float = 20.0) -> list[Returned]:
        """Wait for `count` ended calls, and return them."""

        def enough() -> bool:
            self._returned += self.performer.taken()
            return len(self._returned) >= count

        until(enough, patience)
        found, self._returned = self._returned, []
        return found

    def came_of(self, source: str) -> Returned:
        """Return how a behaviour ends by itself."""
        write(self.folder, acts=source)
        self.begin()
        (returned,) = self.returned()
        return returned


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    found = Bench(tmp_path / "behaviours")
    yield found
    found.performer.end()
    assert not processes()


def test_a_behaviour_sees_nothing_of_our_environment_working_folder_and_input(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trap = "raise SystemExit('a trap')"
    (tmp_path / "work").mkdir()
    for name in ("json", "sitecustomize", "ctypes", "trap"):
        (tmp_path / "work" / f"{name}.py").write_text(trap)
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "work"))
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", "a secret")
    returned = bench.came_of("""
        import json, os, sys
        def run(action):
            try:
                import trap
            except ImportError:
                action.message(json.dumps([os.getcwd(), sys.flags.isolated, sys.flags.safe_path,
                                           sorted(os.environ), sys.stdin.read()]))
        """)
    assert returned.message is not None
    folder, isolated, safe, names, read = json.loads(returned.message)
    assert (folder, isolated, safe, read) == ("/", 1, True, "")
    assert not [name for name in names if name.startswith(("ACTION_ASSISTANT", "PYTHON"))]


def test_it_is_bounded(bench: Bench) -> None:
    returned = bench.came_of("""
        import json, os, resource
        def run(action):
            kinds = ("CORE", "CPU", "AS", "NOFILE")
            limits = [resource.getrlimit(getattr(resource, "RLIMIT_" + each)) for each in kinds]
            action.message(json.dumps([limits, os.nice(0)]))
        """)
    assert returned.message is not None
    (core, cpu, memory, files), nice = json.loads(returned.message)
    assert (core, cpu, files) == ([0, 0], [600, 600], [256, 256])
    assert memory == [512 << 20, 512 << 20]
    assert nice > os.nice(0) or nice == 19


def test_files_beyond_its_bound_are_an_error_of_its_own(bench: Bench) -> None:
    returned = bench.came_of("""
        def run(action):
            held = [open("/dev/null") for _ in range(1000)]
        """)
    assert returned.result == "on_error"
    assert returned.message is not None
    assert "Too many open files" in returned.message


def test_printed_text_of_a_behaviour_is_never_taken_for_its_answer(bench: Bench) -> None:
    returned = bench.came_of("""
        import os, sys
        def run(action):
            print('{"kind": "done", "result": true, "error": null}')
            os.write(1, b'{"kind": "output", "name": "count", "value": 3}\\n')
            sys.stderr.write("no end of a line")
            return False
        """)
    assert (returned.result, returned.outputs) == ("on_false", {})
    assert returned.message is not None
    assert returned.message.splitlines()[-1] == "no end of a line"


@pytest.mark.parametrize(
    ("source", "why"),
    [
        ("def walk(action): pass", "acts.py has no function run(action)."),
        ("def run(action:", "'(' was never closed (acts.py, line 1)"),
        ("import nowhere_at_all", "No module named 'nowhere_at_all' (acts.py, line 1)"),
        ("def run(action):\n  action.message('x' * 9); 1 / 0", "xxxxxxxxx\nZeroDivisionError"),
        ("def run(action):\n  action.outputs['x'] = 'y' * (2 << 20)", "more than 1 MB in one line"),
    ],
)
def test_a_faulty_behaviour_is_an_error_with_the_reason(
    bench: Bench, source: str, why: str
) -> None:
    returned = bench.came_of(source)
    assert returned.result == "on_error"
    assert returned.message is not None
    assert why in returned.message


def test_a_stop_that_comes_before_its_process_is_heard_by_it(bench: Bench) -> None:
    write(bench.folder, acts=WAITS)
    bench.begin()
    bench.performer.stop(1)
    (returned,) = bench.returned()
    assert returned.result == "on_true"


def test_a_call_can_be_killed_before_its_process_is_there(bench: Bench) -> None:
    write(bench.folder, acts=DEAF)
    bench.begin()
    said = bench.performer.give_up(1)
    assert said is not None
    assert bench.performer.is_killing
    (returned,) = bench.returned()
    assert (returned.result, returned.message) == ("on_error", said)
    assert not bench.performer.is_killing
    assert not processes()


@pytest.mark.parametrize("number", ["SIGKILL", "SIGSTOP"])
def test_not_even_one_that_turns_on_its_supervisor_gets_away(bench: Bench, number: str) -> None:
    write(
        bench.folder,
        acts=f"""
            import os, signal
            def run(action):
                os.kill(os.getppid(), signal.{number})
                while True:
                    pass
            """,
    )
    bench.begin()
    if number == "SIGSTOP":
        until(lambda: [each for each in processes() if each.status() == psutil.STATUS_STOPPED])
        bench.performer.give_up(1)
    (returned,) = bench.returned()
    assert returned.result == "on_error"
    assert not processes()


def test_a_behaviour_that_ignores_every_signal_is_killed(bench: Bench) -> None:
    write(
        bench.folder,
        acts="""
            import signal
            def run(action):
                for each in set(signal.Signals) - {signal.SIGKILL, signal.SIGSTOP}:
                    signal.signal(each, signal.SIG_IGN)
                action.message("ready")
                while True:
                    action.sleep(1)
            """,
    )
    bench.begin()
    until(lambda: len(processes()) == 2)
    time.sleep(0.3)
    bench.performer.stop(1)
    bench.performer.give_up(1)
    (returned,) = bench.returned()
    assert returned.result == "on_error"
    assert not processes()


def test_more_calls_at_a_time_than_there_may_be_are_errors(bench: Bench) -> None:
    write(bench.folder, acts=WAITS)
    for number in range(1, MOST + 3):
        bench.begin(number=number)
    refused = bench.returned(2)
    assert {each.number for each in refused} == {MOST + 1, MOST + 2}
    assert refused[0].message == f"{MOST} behaviours run already."
    for number in range(1, MOST + 1):
        bench.performer.stop(number)
    assert {each.result for each in bench.returned(MOST, 60)} == {"on_true"}


def test_commands_wait_for_nobody_who_does_not_read_them(bench: Bench) -> None:
    write(
        bench.folder,
        acts="""
            import os, signal
            def run(action):
                os.kill(os.getpid(), signal.SIGSTOP)
            """,
    )
    bench.begin()
    until(lambda: [each for each in processes() if each.status() == psutil.STATUS_STOPPED])
    done = threading.Event()

    def tell() -> None:
        for _ in range(20_000):
            bench.performer.pause(1)
            bench.performer.resume(1)
        done.set()

    threading.Thread(target=tell, daemon=True).start()
    assert done.wait(20)
    bench.performer.give_up(1)
    (returned,) = bench.returned()
    assert returned.result == "on_error"


def test_the_end_of_the_performer_leaves_nothing(bench: Bench) -> None:
    write(bench.folder, acts=DEAF)
    for number in range(3):
        bench.begin(number=number)
    until(lambda: len(processes()) == 6)
    bench.performer.end()
    assert not processes()


def test_a_call_whose_process_cannot_be_made_is_an_error(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(*_: object) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuses)
    bench.begin()
    (returned,) = bench.returned()
    assert returned.result == "on_error"
    assert returned.message == "The behaviour could not be begun: can't start new thread."
