"""The steps of a led run that the simulator plays.

They pass the same gate as the pieces that robots get. The engine of the whole graph waits before each of
its actions until the conductor lets it begin (`LeadingEngine.play`); from then on the script plays it. While
an action waits the engine counts it as running, which nobody is shown: it has not begun.
"""

from typing import Final

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.conducted_steps import LeftOpen, Step, Tell
from action_assistant.runner.execution.leading_engine import LeadingEngine
from action_assistant.runner.execution.led_gate import LedGate
from action_assistant.runner.links.observations import Exact, NodeResult, NodeState
from action_assistant.runner.links.port import SIMULATOR, CallPlayed
from action_assistant.runner.runs.events import PlayBegan, Requested
from action_assistant.umrf.kept_values import as_json
from action_assistant.umrf.semantics import Call

_OVER: Final = frozenset({"FINISHED", "ERROR"})


class PlayedSteps:
    """Lets the simulator play its steps of one led run, and knows which of them have begun. `first`:
    the first event of the run; `engine` plays them; `tell` records an event; `left`: how far an
    earlier process led the run, None for a new one."""

    def __init__(
        self,
        first: Requested,
        gate: LedGate,
        engine: LeadingEngine,
        tell: Tell,
        clock_us: ClockUs,
        left: LeftOpen | None = None,
    ) -> None:
        assert first.led is not None
        self._graph = first.graph_name
        self._nodes = first.actions.keys() - first.led.players.keys()
        self._gate = gate
        self._engine = engine
        self._tell = tell
        self._clock_us = clock_us
        self._going: dict[int, Step] = {}  # that have begun and were not reported as ended, by call
        self._shown: dict[str, Step] = {}  # the newest that has begun, by full name of its action
        #: The calls that an earlier process let begin.
        self._before = frozenset(left.played) if left is not None else frozenset[int]()
        for number, node in (left.played | left.asked).items() if left is not None else ():
            self._going[number] = self._shown[node] = _step_of(number, node, self._graph)

    async def begin(self, step: Step) -> None:
        """Let a step begin, which the gate lets pass, and record that."""
        self._going[step.call.number] = self._shown[step.node] = step
        self._tell(PlayBegan(at=self._clock_us(), call=step.call.number, node=step.node))
        await self._engine.play(step.call)
        self._gate.passed(step)

    def begin_asked(self, step: Step) -> NodeState | None:
        """Remember that a step which people answer, or for which the runner waits, has begun. Return
        its state, None if that was known."""
        is_known = step.call.number in self._going
        self._going[step.call.number] = self._shown[step.node] = step
        inputs = {name: as_json(value) for name, value in step.call.inputs.items()}
        began = NodeState(self._clock_us(), self._graph, step.node, "RUNNING", inputs)
        return None if is_known else began

    def end_asked(self, step: Step) -> None:
        """Remember that a step which people answer, or for which the runner waits, has its outcome."""
        self._going.pop(step.call.number, None)

    def end(self, played: CallPlayed) -> None:
        """Hold the run at the breakpoints after a step that has ended, before anything follows."""
        step = self._going.pop(played.number, None)
        if step is None:
            return
        if not played.is_past or played.number not in self._before:
            # Also one that ended after its engine had died, before anybody knew: nobody has seen it end.
            self._gate.halt_after(step, played.outcome, played.outputs)
        elif self._shown.get(step.node) is step:  # it was shown to its end, by an earlier process
            del self._shown[step.node]

    def shows(self, change: Exact) -> bool:
        """Return whether people are shown a change that the engine reports. False for a change of
        an action that the simulator plays, while that action has not begun. Call this for each
        change, in order."""
        if not isinstance(change, NodeState | NodeResult) or change.graph != self._graph:
            return True
        if change.node not in self._nodes:
            return True
        step = self._shown.get(change.node)
        if isinstance(change, NodeState) and step is not None:
            if change.state == "RUNNING" and step.call.number not in self._going:
                step = None  # its next visit, which waits
            if step is None or change.state in _OVER:
                del self._shown[change.node]
        return step is not None

    def state(self, node: str, engine: str, shown: str) -> str:
        """Return the state of an action of the simulator. `engine`: as the engine has it; `shown`: as
        it was shown last."""
        step = self._shown.get(node)
        has_begun = step is not None and (step.call.number in self._going or engine in _OVER)
        return engine if has_begun else shown


def _step_of(number: int, node: str, graph: str) -> Step:
    """Return the step of a call that an earlier process let begin."""
    call = Call(number=number, graph=graph, node=node, name=node, inputs={}, outputs={})
    return Step(call, SIMULATOR)
