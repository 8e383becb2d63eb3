"""Muscle models, the inverse model and the device's controllers as functions, without a device.

These are the device's own fixed-point computations, and for the muscle also the high-accuracy
reference against which they are tested.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _native
from ._run import Session, argument
from ._train import Muscle

_RESPONSE = np.dtype([("t_s", "f8"), ("c", "f8"), ("force_n", "f8")])


def muscle_response(
    muscle: Muscle,
    pulses_s: Sequence[float] | npt.NDArray[np.floating[Any]],
    duration_s: float,
    *,
    step_s: float = 0.01,
    model: Literal["device", "reference"] = "device",
) -> npt.NDArray[np.void]:
    """Return the force of a rested muscle in answer to pulses (Lee et al. 2020, eq. 2, 3, 5).

    Args:
        muscle: Its parameters a_n_per_s, k, tau_c_ms, tau1_ms and tau2_ms; all are needed.
        pulses_s: Times of the pulses in s, increasing, taken to the nearest µs.
        duration_s: Length of the result in s, at most 3600.
        step_s: Time between two rows in s, a multiple of 0.001.
        model: "device" for the device's fixed point, "reference" for the reference in floating
            point.

    Returns:
        Structured array: t_s in s, c (the calcium–troponin complex, without unit), force_n in N.

    Raises:
        ValueError: A parameter is missing or outside of the device's range.
    """
    names = ("a_n_per_s", "k", "tau_c_ms", "tau1_ms", "tau2_ms")
    values = [getattr(muscle, name) for name in names]
    missing = [name for name, value in zip(names, values, strict=True) if value is None]
    if missing:
        raise ValueError(f"the muscle lacks {', '.join(missing)}")
    if not 0 < duration_s <= 3600:
        raise ValueError(f"duration_s must be above 0 and at most 3600 s, not {duration_s}")
    row_us = round(step_s * 1e6)
    if row_us < 1000 or row_us % 1000:
        raise ValueError(f"step_s must be a multiple of 0.001 s, not {step_s}")
    pulses_us = [round(float(t) * 1e6) for t in pulses_s]
    if pulses_us and not 0 <= min(pulses_us) <= max(pulses_us) <= 3_600_000_000:
        raise ValueError("the times of the pulses must be between 0 and 3600 s")
    if model not in ("device", "reference"):
        raise ValueError(f"model must be 'device' or 'reference', not {model!r}")
    columns = _native.muscle_response(
        [float(value) for value in values],
        pulses_us,
        round(duration_s * 1e6),
        row_us,
        model == "reference",
    )
    table = np.empty(len(columns[0]), dtype=_RESPONSE)
    table["t_s"], table["c"], table["force_n"] = columns
    return table


class ForceStimulus(NamedTuple):
    """Stimulus by which the device would give a force.

    Attributes:
        amplitude: Amplitude in the channel's unit, mA or V.
        rate_hz: Pulse rate in Hz.
        force_n: Mean force of the rested muscle in N.
        is_limited: Whether the limits do not allow the wanted force.
    """

    amplitude: float
    rate_hz: float
    force_n: float
    is_limited: bool


def force_stimulus(session: Session, channel: int, force_n: float) -> ForceStimulus:
    """Return the stimulus by which the device would give a force with a channel's muscle.

    Args:
        session: Path, name of a shipped session, or fields.
        channel: Number of a channel that has a muscle.
        force_n: Wanted force in N, 0 to 4000.

    Raises:
        Refused: The session has mistakes.
        ValueError: The channel has no muscle, or the force is out of range.
    """
    return ForceStimulus(*_native.force_stimulus(argument(session), channel, force_n))


class ControllerOutput(NamedTuple):
    """Output of a controller after a step.

    Attributes:
        effort: Output of the control law before any clamp, at most 1 in size; flexion is positive.
        amplitudes: Amplitude of each channel of the joint, in its unit.
        is_limited: Whether an amplitude was held at the wearer's maximum.
    """

    effort: float
    amplitudes: dict[int, float]
    is_limited: bool


class JointController:
    """The device's controller of a joint, with its state, advanced by calls.

    It computes with the device's own code at 1 kHz, so that a controller of your own can be
    compared with it sample by sample.
    """

    def __init__(self, session: Session) -> None:
        """Create the controller of a session's `[joint]`, at rest.

        Raises:
            Refused: The session has mistakes or no joint.
        """
        self._native = _native.Controller(argument(session))

    def step(
        self,
        reference_deg: float,
        measured_deg: float,
        *,
        rate_deg_per_s: float = 0.0,
        step_s: float = 0.001,
    ) -> ControllerOutput:
        """Set the reference, then let the controller run with a constant measured angle.

        Args:
            reference_deg: Reference angle in °, within the joint's range.
            measured_deg: Measured angle in °.
            rate_deg_per_s: Rate at which the reference changes, °/s.
            step_s: Length of the step in s, a multiple of 0.001, at most 1.

        Raises:
            Refused: An angle is out of range.
            ValueError: A value is not finite, or the step is not possible.
        """
        ticks = round(step_s * 1000)
        if not 1 <= ticks <= 1000 or abs(ticks - step_s * 1000) > 1e-9:
            raise ValueError(f"step_s must be a multiple of 0.001 s up to 1 s, not {step_s}")
        effort, amplitudes, is_limited = self._native.step(
            reference_deg, rate_deg_per_s, measured_deg, ticks
        )
        return ControllerOutput(effort, dict(amplitudes), is_limited)
