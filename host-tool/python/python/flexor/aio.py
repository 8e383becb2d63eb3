"""The package for asyncio: the same names, with calls that do not block the event loop.

    import asyncio, flexor
    from flexor import aio

    async def main():
        async with aio.connect("sim:realtime") as dev:
            dev.channel(1, flexor.Train(rate_hz=30, width_us=200), limit_ma=12)
            await dev.arm()
            await dev.start()
            await dev.set(ma={1: 8})
            await dev.wait(2)

    asyncio.run(main())

Use ``await dev.wait(2)`` instead of ``await asyncio.sleep(2)``: the lease ends while the program
sleeps. A cancelled call stops stimulation before the cancellation goes on.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from types import TracebackType
from typing import Any, Self, TypeVar

import numpy as np
import numpy.typing as npt

from . import _procedures
from ._device import Device as _Device
from ._device import connect as _connect
from ._errors import FlexorError
from ._procedures import Calibration, Finding
from ._record import Reading, Record

__all__ = ["Device", "calibrate", "check_thresholds", "connect", "search"]

_T = TypeVar("_T")

_SET_UP = (
    "channel",
    "duty",
    "group",
    "sync",
    "joint",
    "wall",
    "endpoint",
    "modulation",
    "program",
    "body",
    "remove",
)
_OBSERVED = (
    "address",
    "angle_deg",
    "events",
    "info",
    "record",
    "session_text",
    "state",
    "telemetry_s",
    "time_s",
)


def connect(address: str, **arguments: Any) -> Device:
    """Return a device that connects when its ``async with`` block is entered.

    Args:
        address: Address, as for `flexor.connect`.
        **arguments: Arguments of `flexor.connect`.
    """
    return Device(address, **arguments)


async def calibrate(*arguments: Any, **named: Any) -> Calibration:
    """Calibrate; see `flexor.calibrate`. A cancelled call ends the calibration first."""
    return await _procedure(lambda: _procedures.calibrate(*arguments, **named))


async def check_thresholds(*arguments: Any, **named: Any) -> Calibration:
    """Check a wearer file; see `flexor.check_thresholds`. A cancelled call ends the check first."""
    return await _procedure(lambda: _procedures.check_thresholds(*arguments, **named))


async def search(*arguments: Any, **named: Any) -> list[Finding]:
    """Search; see `flexor.search`. A cancelled call ends the search first."""
    return await _procedure(lambda: _procedures.search(*arguments, **named))


async def _procedure(call: Callable[[], _T]) -> _T:
    """Carry out a procedure on a thread; it has ended before a cancellation goes on."""
    is_cancelled = False

    def watch() -> None:
        if is_cancelled:
            raise asyncio.CancelledError

    token = _procedures.WATCH.set(watch)
    running = asyncio.ensure_future(asyncio.to_thread(call))
    _procedures.WATCH.reset(token)
    try:
        return await asyncio.shield(running)
    except asyncio.CancelledError:
        is_cancelled = True
        with contextlib.suppress(asyncio.CancelledError, FlexorError):
            await running
        raise


class Device:
    """`flexor.Device` for asyncio. What sets up a channel or joint needs no ``await``."""

    def __init__(self, address: str, **arguments: Any) -> None:
        """Keep the arguments, which are those of `flexor.connect`."""
        self._open: Callable[[], _Device] = lambda: _connect(address, **arguments)
        self._device: _Device | None = None

    @property
    def sync_device(self) -> _Device:
        """The device whose calls block.

        Raises:
            FlexorError: The block was not entered.
        """
        if self._device is None:
            raise FlexorError("the device is not connected; use `async with`")
        return self._device

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of `flexor.Device` that sets up the device or describes it.

        These are `channel`, `duty`, `group`, `sync`, `joint`, `wall`, `endpoint`, `modulation`,
        `program`, `body`, `remove`, `state`, `time_s`, `angle_deg`, `info` and `session_text`; none
        is awaited.
        """
        if name in _SET_UP or name in _OBSERVED:
            return getattr(self.sync_device, name)
        raise AttributeError(name)

    async def arm(self) -> dict[int, Reading]:
        """Arm; see `flexor.Device.arm`."""
        return await self._run(self.sync_device.arm)

    async def acknowledge(self) -> None:
        """Acknowledge a latched fault; see `flexor.Device.acknowledge`."""
        await self._run(self.sync_device.acknowledge)

    async def start(self) -> None:
        """Start; see `flexor.Device.start`."""
        await self._run(self.sync_device.start)

    async def set(self, **values: Any) -> None:
        """Send setpoints; see `flexor.Device.set`."""
        await self._run(lambda: self.sync_device.set(**values))

    async def play(self, channel: int, pulses: list[tuple[float, int, int]]) -> None:
        """Play a list of pulses; see `flexor.Device.play`."""
        await self._run(lambda: self.sync_device.play(channel, pulses))

    async def measure(self, angle_deg: float, joint: int = 0) -> None:
        """Send a measured angle; see `flexor.Device.measure`."""
        await self._run(lambda: self.sync_device.measure(angle_deg, joint))

    async def mark(self, text: str) -> None:
        """Add a mark; see `flexor.Device.mark`."""
        await self._run(lambda: self.sync_device.mark(text))

    async def wait(self, seconds: float) -> float:
        """Let device time pass; see `flexor.Device.wait`."""
        return await self._run(lambda: self.sync_device.wait(seconds))

    async def trigger(self, held_s: float = 0.0) -> None:
        """Give the simulator's trigger input an edge; see `flexor.Device.trigger`."""
        await self._run(lambda: self.sync_device.trigger(held_s))

    async def reset(self, seed: int = 1) -> None:
        """Begin again with a rested simulated wearer; see `flexor.Device.reset`."""
        await self._run(lambda: self.sync_device.reset(seed))

    async def snapshot(self) -> Device:
        """Return a copy of the simulator; see `flexor.Device.snapshot`. Close it when done."""
        copied = Device(self.sync_device.address)
        copied._device = await self._run(self.sync_device.snapshot)
        return copied

    async def steps(self, seconds: float, step_s: float) -> AsyncIterator[float]:
        """Iterate over device time; see `flexor.Device.steps`."""
        times = self.sync_device.steps(seconds, step_s)
        while (t_s := await self._run(lambda: next(times, None))) is not None:
            yield t_s

    async def wait_until(self, t_s: float) -> float:
        """Let device time pass until a time; see `flexor.Device.wait_until`."""
        return await self._run(lambda: self.sync_device.wait_until(t_s))

    async def stream(self, seconds: float) -> AsyncIterator[npt.NDArray[np.void]]:
        """Iterate over telemetry; see `flexor.Device.stream`."""
        rows = self.sync_device.stream(seconds)
        end = object()
        while (row := await self._run(lambda: next(rows, end))) is not end:
            yield row  # type: ignore[misc]

    async def stop(self) -> Record | None:
        """Stop; see `flexor.Device.stop`. It is carried out even if this call is cancelled."""
        return await asyncio.shield(asyncio.to_thread(self.sync_device.stop))

    async def close(self) -> None:
        """Stop and close the device."""
        if self._device is not None:
            await asyncio.shield(asyncio.to_thread(self._device.close))

    async def __aenter__(self) -> Self:
        """Connect."""
        self._device = await asyncio.to_thread(self._open)
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop and close the device; an exception of the block is not replaced."""
        if self._device is not None:
            await asyncio.shield(asyncio.to_thread(self._device.__exit__, kind, error, trace))

    def __repr__(self) -> str:
        """Describe the device in one line."""
        shown = "not connected" if self._device is None else repr(self._device)
        return f"<flexor.aio.Device: {shown}>"

    async def _run(self, call: Callable[[], _T]) -> _T:
        try:
            return await asyncio.to_thread(call)
        except asyncio.CancelledError:
            # The thread of the call ends by itself when nothing is stimulated any more.
            with contextlib.suppress(FlexorError):
                self.sync_device._native.stop_early("a call was cancelled")
            raise
