"""Simulated limbs that a user writes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Pulse(NamedTuple):
    """One pulse that a simulated limb receives.

    Attributes:
        t_s: Start of the first phase in s of simulated time.
        channel: Number of the channel, from 1.
        amplitude: Amplitude in `unit`.
        unit: "mA" for a current stage, "V" for a voltage stage.
        width_us: Width of one phase in µs.
    """

    t_s: float
    channel: int
    amplitude: float
    unit: str
    width_us: int


Limb = Callable[[list[Pulse], float], "float | tuple[float, dict[int, float]]"]
"""A simulated limb: a callable that is called once per period (1 ms by default) with the pulses
since the call before and the present time in s. It returns the joint angle in °, flexion positive,
or a pair of the angle and the load of electrodes in Ω by channel; an infinite load is a detached
electrode. The first call has no pulses, at time 0."""
