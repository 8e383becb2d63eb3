"""What a channel plays and what it may play: trains, limits, muscles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

Shape = Literal[
    "biphasic-cathodic-first",
    "biphasic-anodic-first",
    "monophasic-cathodic",
    "monophasic-anodic",
]


@dataclass(frozen=True, kw_only=True)
class Train:
    """Pulses of a channel.

    Attributes:
        rate_hz: Pulse rate in Hz, 0.5 to 200. The device plays whole µs of period.
        width_us: Width of one phase in µs, 10 to 500.
        shape: Waveform. A monophasic pulse needs `ground_us`.
        gap_us: Interphase gap in µs, 0 to 200.
        max_width_us: Largest width that a setpoint may ask for, in µs; None fixes the width.
        ground_us: Grounding after each pulse in µs.
        offset_us: Delay after the common start in µs, at most the period.
        burst_count: Pulses per burst, 1 to 8.
        burst_interval_us: Time between the pulses of a burst in µs.
        repeats: Number of bursts to play; 0 plays until stopped.
        trigger: Waits for the trigger input: "start", "toggle" or "gated".
        lists: Whether the channel accepts lists of pulses.

    Ranges and defaults are those of `[channel.train]` in docs/sessions.md.
    """

    rate_hz: float
    width_us: float
    shape: Shape = "biphasic-cathodic-first"
    gap_us: float | None = None
    max_width_us: float | None = None
    ground_us: float | None = None
    offset_us: float | None = None
    burst_count: int | None = None
    burst_interval_us: float | None = None
    repeats: int | None = None
    trigger: Literal["start", "toggle", "gated"] | None = None
    lists: bool | None = None

    def to_fields(self) -> dict[str, Any]:
        """Return the fields of `train` in a session file."""
        table = to_fields(self)
        table["frequency_hz"] = table.pop("rate_hz")
        return table


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the wearer, which hold for all channels; None keeps the device's own limit.

    Attributes have the meaning and the ranges of `[wearer]` in docs/sessions.md.
    """

    max_current_ma: float | None = None
    max_charge_uc: float | None = None
    max_rms_ma: float | None = None
    rise_ms: float | None = None
    fall_ms: float | None = None
    host_timeout_ms: int | None = None
    max_sum_ma: float | None = None
    max_sum_rms_ma: float | None = None
    return_area_mm2: float | None = None
    hand_stop_required: bool | None = None
    rise_bursts: int | None = None
    max_session_s: float | None = None
    max_dose_mc: float | None = None
    max_step_ma: float | None = None
    max_step_ma_per_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class Muscle:
    """Muscle under a channel, whose force the device predicts (Lee et al. 2020, eq. 2, 3, 5, 6).

    Attributes:
        a_n_per_s: A, the scale of the force, N/s.
        k: K, the sensitivity of the cross-bridges to calcium.
        tau_c_ms: Time constant of calcium, ms.
        tau1_ms: Time constant of the force decay without cross-bridges, ms.
        tau2_ms: Additional time constant due to cross-bridges, ms.
        motor_threshold: Smallest amplitude that moves, in the channel's unit.
        reference: Amplitude at which A was measured, in the channel's unit.
        slope_per_unit: b, the slope of the recruitment, per unit.
        model: Model level; "auto" chooses the cheapest sufficient one.
        report: Whether the predicted force is in the record.
        fatigue: Fatigue of the muscle, fields as in docs/sessions.md.

    A field that is None comes from the wearer file.
    """

    a_n_per_s: float | None = None
    k: float | None = None
    tau_c_ms: float | None = None
    tau1_ms: float | None = None
    tau2_ms: float | None = None
    motor_threshold: float | None = None
    reference: float | None = None
    slope_per_unit: float | None = None
    model: Literal["auto", "none", "calcium-force", "calcium-force-fatigue"] | None = None
    report: bool | None = None
    fatigue: Mapping[str, float] | None = None


def to_fields(value: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are not None."""
    named = ((field.name, getattr(value, field.name)) for field in fields(value))
    return {
        name: dict(entry) if isinstance(entry, Mapping) else entry
        for name, entry in named
        if entry is not None
    }
