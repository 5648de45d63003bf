"""Leads the steps of a led run that no robot plays: those of the simulator, of people, and waits."""

from collections.abc import Awaitable, Callable
from typing import Final

import anyio

from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.asked_steps import AskedEnd, AskedSteps, ended
from action_assistant.runner.execution.conducted_steps import StallWatch, Step
from action_assistant.runner.execution.led_gate import LedGate
from action_assistant.runner.execution.played_steps import PlayedSteps
from action_assistant.runner.runs.events import PieceEnded

_STOOD_STILL_S: Final = 0.1


class OwnSteps:
    """Leads steps through the gate to their begin, and those that the simulator does not play to their
    outcome. `has_stored_causes` waits until what a step follows from is stored, and says whether it is;
    `begins` is called for a step that the simulator plays from now on; `finish` passes an outcome on, and
    `drop` that of a step that has not begun."""

    def __init__(
        self,
        gate: LedGate,
        played: PlayedSteps,
        asked: AskedSteps,
        stalls: StallWatch,
        has_stored_causes: Callable[[Step], Awaitable[bool]],
        begins: Callable[[Step], object],
        finish: Callable[[Step, PieceEnded], Awaitable[None]],
        drop: Callable[[Step], Awaitable[None]],
        clock_us: ClockUs,
    ) -> None:
        self._gate = gate
        self._played = played
        self._asked = asked
        self._stalls = stalls
        self._has_stored_causes = has_stored_causes
        self._begins = begins
        self._finish = finish
        self._drop = drop
        self._clock_us = clock_us

    async def lead(self, step: Step) -> None:
        """Lead a step until its outcome is passed on, or the simulator plays it."""
        if step.node in self._asked.actions:
            await self._lead_asked(step)
        else:
            await self._lead_played(step)

    async def _lead_asked(self, step: Step) -> None:
        """Ask people, or wait, once the gate is open. A question that is closed since the run waits
        passes the gate again."""
        end: AskedEnd | None = None
        while not step.is_stopped and end is None:
            with step.waiting():
                if await self._may_begin(step):
                    end = await self._asked.carry_out(step)
        self._played.end_asked(step)
        if end is None:
            await self._drop(step)
        else:
            await self._finish(
                step, ended(step, end, self._asked.actions[step.node], self._clock_us())
            )

    async def _lead_played(self, step: Step) -> None:
        while not step.is_stopped:
            with step.waiting():
                if await self._may_begin(step):
                    self._begins(step)
                    with anyio.CancelScope(shield=True):
                        await self._played.begin(step)
                    return
        await self._drop(step)

    async def _may_begin(self, step: Step) -> bool:
        """Wait until the gate lets a step pass, and return whether it may begin in the step of the event
        loop of this return."""
        await self._gate.admit(step)
        if not await self._has_stored_causes(step):
            return False
        if self._stalls.stands_still:  # noticed soon, and the run is held then
            await anyio.sleep(_STOOD_STILL_S)
            return False
        self._gate.halt_before(step)
        return self._gate.lets(step) and not step.is_stopped
