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
        gap_us: Interphase gap in µs, 0 to 200; None is 0. The device keeps at least 5 µs.
        max_width_us: Largest width that a setpoint may ask for, in µs; None fixes the width. Not
            together with a muscle.
        ground_us: Grounding after each pulse in µs, 1000 to 20 000; None is none, which only
            biphasic pulses may have.
        offset_us: Delay after the common start in µs, 0 up to the period; None is 0.
        burst_count: Pulses per burst, 1 to 8; None is 1.
        burst_interval_us: Time from pulse start to pulse start within a burst in µs, 200 to
            50 000; needed for bursts.
        repeats: Number of bursts to play, at most 65 535; None or 0 plays until stopped.
        trigger: Waits for the trigger input. With "start" an edge starts the train, with "toggle"
            the next edge ends it, with "gated" it plays while the input is held.
        lists: Whether the channel accepts lists of pulses (`Device.play`).

    Values are checked by `Device.channel`. Ranges and defaults are those of `[channel.train]` in
    docs/reference/sessions.md.
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
        table["frequency_hz"] = table.pop("rate_hz", None)
        return table


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the wearer, which hold for all channels.

    A limit that is None is that of the wearer file, or else the default in brackets. The ranges are
    those of `[wearer]` in docs/reference/sessions.md.

    Attributes:
        max_current_ma: Largest current, mA (100).
        max_charge_uc: Largest charge of one phase, µC (40).
        max_rms_ma: Largest rms current of a channel, mA (50).
        rise_ms: Time in which an amplitude rises from zero, ms (500).
        fall_ms: Time in which amplitudes fall when stimulation ends, ms (50).
        host_timeout_ms: Host silence that ends stimulation, ms (100).
        max_sum_ma: Largest sum of all channels at any microsecond, mA (200).
        max_sum_rms_ma: Largest rms current of all channels together, mA (50).
        return_area_mm2: Area of the common return electrode, mm² (2500).
        hand_stop_required: Whether arming needs a closed hand-held stop (no).
        rise_bursts: Smallest number of bursts of a rise (1).
        max_session_s: Longest total stimulation since power-on, s (86 400).
        max_dose_mc: Largest total charge through a channel since power-on, mC (4 320 000).
        max_step_ma: Largest increase of an amplitude from burst to burst, mA (100).
        max_step_ma_per_s: Largest increase of an amplitude within a second, mA (100).
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
        a_n_per_s: A, the scale of the force, N/s, 0.1 to 10 000.
        k: K, the sensitivity of the cross-bridges to calcium, 0.002 to 5.
        tau_c_ms: Time constant of calcium, ms, 5 to 100.
        tau1_ms: Time constant of the force decay without cross-bridges, ms, 2 to 200.
        tau2_ms: Additional time constant due to cross-bridges, ms, 1 to 1000.
        motor_threshold: Smallest amplitude that moves, in the channel's unit, below its limit.
        reference: Amplitude at which A was measured, in the channel's unit, at least the limit.
        slope_per_unit: b, the slope of the recruitment, per unit, 0.01 to 5.
        model: Model level. "auto" (None) chooses the cheapest sufficient one by running the
            session, which only `run` can do: a device that is driven call by call predicts a force
            only with "calcium-force" or "calcium-force-fatigue".
        report: Whether the predicted force is in the record (column ``force_N_n``); None is yes.
        fatigue: Fatigue of the muscle; fields of `[channel.muscle.fatigue]`
            (docs/reference/sessions.md).

    A constant that is None comes from the wearer file.
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
