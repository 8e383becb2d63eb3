"""A device that a program drives call by call."""

from __future__ import annotations

import copy
import tomllib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import FlexorError, Refused
from ._limb import Limb
from ._record import Event, Reading, Record, table_of
from ._train import Limits, Muscle, Train, to_fields

_DAY_S = 86_400
_FULL_SCALE_MA = 100.0
_FULL_SCALE_V = 150.0
_LOAD_OHM = 2000.0


def connect(
    address: str,
    *,
    session: str | Path | Mapping[str, Any] | None = None,
    wearer: str | Path | None = None,
    limits: Limits | None = None,
    record: str | Path | None = None,
    title: str = "Python session",
    seed: int = 1,
    lease_s: float = 1.0,
    telemetry_ms: int = 10,
    all_edges: bool = False,
    limb: Limb | None = None,
    limb_period_s: float = 0.001,
) -> Device:
    """Connect to a device. Nothing is armed or started.

    Args:
        address: ``"sim:"`` for the simulator, whose time advances only in calls;
            ``"sim:realtime"`` for one that runs by itself; ``"serial:/dev/ttyACM0"`` or
            ``"tcp:127.0.0.1:4242"`` for a device behind a port.
        session: Session to begin with: a path, the name of a shipped session, or its fields. Its
            setpoints are not played; its programs are.
        wearer: Wearer file with limits and thresholds: a path, or the name of a shipped one.
        limits: Limits of the wearer, which may only be stricter than those of the wearer file.
        record: Folder for the record, absent or empty. The record is on disk while it runs.
        title: Title of the record.
        seed: Seed of the simulated wearer's noise.
        lease_s: Time in s, 0.05 to 10, after which a device in real time stops if the program
            makes no call.
        telemetry_ms: Time between two samples in ms, 1 to 1000.
        all_edges: Whether records keep all edges of a simulated device, not only one period.
        limb: Simulated limb of your own, in place of the session's; see `Limb`.
        limb_period_s: Time between two calls of `limb` in s, 0.0001 to 1.

    Returns:
        The device, which is also a context manager: leaving the block stops and closes it.

    Raises:
        ConnectionLost: The port cannot be opened, or the device does not answer.
        FlexorError: The folder of the record holds something else.
        ValueError: The address or another argument is not possible.
    """
    return Device(
        address,
        session=session,
        wearer=wearer,
        limits=limits,
        record=record,
        title=title,
        seed=seed,
        lease_s=lease_s,
        telemetry_ms=telemetry_ms,
        all_edges=all_edges,
        limb=limb,
        limb_period_s=limb_period_s,
    )


class Device:
    """A stimulator, real or simulated. Create it with `connect`.

    The order of calls is: set up channels, `arm`, `start`, then `set` and `wait`, then `stop`.
    Everything but `start` and `set` leaves the outputs at zero, and setting up never stimulates.
    In real time the device stops if no call comes for `lease_s`: use ``dev.wait(5)`` instead of
    ``time.sleep(5)``.
    """

    def __init__(
        self,
        address: str,
        *,
        session: str | Path | Mapping[str, Any] | None = None,
        wearer: str | Path | None = None,
        limits: Limits | None = None,
        record: str | Path | None = None,
        title: str = "Python session",
        seed: int = 1,
        lease_s: float = 1.0,
        telemetry_ms: int = 10,
        all_edges: bool = False,
        limb: Limb | None = None,
        limb_period_s: float = 0.001,
    ) -> None:
        """Connect; see `connect`."""
        self._fields = _session_fields(session, title)
        self._wearer: dict[str, Any] = {}
        self._duties: dict[int, dict[str, Any]] = {}
        self._amplitudes: dict[int, float] = {}
        if wearer is not None or limits is not None:
            self._set_wearer(wearer, limits)
        self._native = _native.Device(
            address,
            seed=seed,
            record=None if record is None else Path(record),
            title=self._fields["title"],
            lease_s=lease_s,
            telemetry_ms=telemetry_ms,
            all_edges=all_edges,
            limb=limb,
            limb_period_s=limb_period_s,
        )
        self.address = address
        """Address that was given to `connect`."""
        self.telemetry_s = telemetry_ms / 1000
        """Time between two samples, s."""

    # Set up

    def channel(
        self,
        number: int,
        train: Train,
        *,
        limit_ma: float | None = None,
        limit_v: float | None = None,
        name: str | None = None,
        start_ma: float | None = None,
        start_v: float | None = None,
        full_scale_ma: float | None = None,
        full_scale_v: float | None = None,
        load_ohm: float | None = None,
        area_mm2: float | None = None,
        muscle: Muscle | None = None,
        force: Mapping[str, Any] | None = None,
    ) -> None:
        """Set up a channel, or set it up anew. Takes effect when the device is armed.

        Args:
            number: Number of the channel on the board, 1 to 10.
            train: Its pulses.
            limit_ma: Largest amplitude of a current stage in mA. Required unless the wearer file
                has a limit for the channel.
            limit_v: Largest amplitude of a voltage stage in V, likewise.
            name: Name of the muscle or place; by default the wearer file's, or the number.
            start_ma: Amplitude in mA that is reached at once, without the wearer's rise.
            start_v: The same in V.
            full_scale_ma: Output of a current stage at its full code; by default what the board
                says, or 100 mA.
            full_scale_v: The same of a voltage stage; by default 150 V.
            load_ohm: Load for which volts are judged against current limits; by default 2000 Ω.
            area_mm2: Area of the active electrode in mm²; by default 800.
            muscle: Muscle whose force the device predicts.
            force: Force control on the device; fields as in docs/sessions.md.

        Raises:
            Refused: With all mistakes of the channel. The setup stays as it was.
        """
        if limit_ma is not None and limit_v is not None:
            raise TypeError("give limit_ma for a current stage or limit_v for a voltage stage")
        electrode = self._electrode(number)
        is_voltage = (
            limit_v is not None
            or full_scale_v is not None
            or (limit_ma is None and electrode.get("stage") == "voltage")
        )
        known = self._known_stage(number)
        stage: dict[str, Any]
        if is_voltage:
            stage = {
                "kind": "voltage",
                "full_scale_v": _first(full_scale_v, known.get("full_scale_v"), _FULL_SCALE_V),
                "load_ohm": _first(load_ohm, known.get("load_ohm"), _LOAD_OHM),
            }
        else:
            stage = {
                "kind": "current",
                "full_scale_ma": _first(full_scale_ma, known.get("full_scale_ma"), _FULL_SCALE_MA),
            }
        entry = {
            "number": number,
            "name": _first(name, electrode.get("place"), f"channel {number}"),
            "stage": stage,
            "limit": limit_v if is_voltage else limit_ma,
            "start": start_v if is_voltage else start_ma,
            "area_mm2": area_mm2,
            "train": train.to_fields(),
            "muscle": None if muscle is None else to_fields(muscle),
            "force": None if force is None else dict(force),
        }
        if entry["limit"] is None and "limit" not in electrode:
            raise Refused(
                f"channel {number} has no limit: give limit_ma=, or wearer= with a wearer file "
                "that has an electrode for the channel"
            )
        channels = [c for c in self._fields.get("channel", []) if c["number"] != number]
        self._try({"channel": [*channels, entry]})

    def duty(
        self,
        channel: int | Sequence[int],
        *,
        on_s: float,
        off_s: float,
        ramp_s: float = 0.0,
        ramp_up_s: float | None = None,
        ramp_down_s: float | None = None,
        delay_s: float = 0.0,
    ) -> None:
        """Play channels in a duty cycle, from the start of the trains on.

        The amplitude is the one that `set` gives. A change of it takes up to 0.1 s.

        Args:
            channel: A channel or several.
            on_s: Time from the begin of the ramp up to the end of the ramp down, s.
            off_s: Pause, s.
            ramp_s: Length of both ramps, s.
            ramp_up_s: Length of the ramp up, s, in place of `ramp_s`.
            ramp_down_s: Length of the ramp down, s, in place of `ramp_s`.
            delay_s: Time until the first cycle, s.

        Raises:
            Refused: The cycle is not possible with the channel's train.
        """
        numbers = [channel] if isinstance(channel, int) else list(channel)
        cycle = {
            "kind": "on-off",
            "on_s": on_s,
            "off_s": off_s,
            "ramp_up_s": ramp_s if ramp_up_s is None else ramp_up_s,
            "ramp_down_s": ramp_s if ramp_down_s is None else ramp_down_s,
            "delay_s": delay_s,
        }
        duties = {**self._duties, **dict.fromkeys(numbers, cycle)}
        # A tiny amplitude: what the ramps need at the real one is checked when it is set.
        self._check({"program": self._programs(duties, dict.fromkeys(duties, 0.001))})
        self._duties = duties

    def group(self, channels: Sequence[int], partner: Literal["conducted", "isolated"]) -> None:
        """Join channels of one muscle: what the others do while one of them pulses.

        Raises:
            Refused: The channels cannot be a group.
        """
        groups = [*self._fields.get("group", []), {"channels": list(channels), "partner": partner}]
        self._try({"group": groups})

    def sync(self, channel: int) -> None:
        """Choose the channel whose first phases drive the sync output."""
        self._try({"sync": {"channel": channel}})

    def joint(self, **fields: Any) -> None:
        """Set up the joint whose angle the device controls; fields as `[joint]` of a session.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"joint": fields})

    def wall(self, **fields: Any) -> None:
        """Set up the virtual wall; fields as `[wall]` of a session.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"wall": fields})

    def modulation(self, **fields: Any) -> None:
        """Add a joint whose angle modulates its muscles; fields as `[[modulation]]` of a session.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"modulation": [*self._fields.get("modulation", []), fields]})

    def program(self, **fields: Any) -> None:
        """Add amplitudes over time for channels; fields as `[[program]]` of a session.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"program": [*self._fields.get("program", []), fields]})

    def body(self, **fields: Any) -> None:
        """Choose the simulated wearer; fields as `[body]` of a session. A board ignores it.

        Raises:
            Refused: With all mistakes.
        """
        self._try({"body": fields})

    @property
    def session_text(self) -> str:
        """Present setup as a session file.

        Raises:
            Refused: The setup is not complete.
        """
        return _native.check(self._complete(self._fields))[0]

    # Stimulate

    def arm(self) -> dict[int, Reading]:
        """Send the setup, check the electrodes with a pulse below threshold, and arm.

        Returns:
            For each channel the reading of the electrode check.

        Raises:
            Refused: The setup is not complete.
            ArmRefused: The device refuses: an electrode, an input, its stages, a fault.
        """
        readings = self._native.arm(self._complete(self._fields))
        self._amplitudes = {}
        return {reading[0]: Reading(*reading) for reading in readings}

    def start(self) -> None:
        """Start the armed trains. Amplitudes are zero until `set` raises them.

        Raises:
            FlexorError: The device is not armed, or its arming has expired.
        """
        self._native.start()

    def set(
        self,
        *,
        ma: Mapping[int, float] | None = None,
        v: Mapping[int, float] | None = None,
        width_us: Mapping[int, float] | None = None,
        force_n: Mapping[int, float] | None = None,
        angle_deg: float | None = None,
        rate_deg_per_s: float | None = None,
        endpoint_n: Sequence[float] | None = None,
        held: bool | None = None,
    ) -> None:
        """Send setpoints. Of one call, all take effect or none.

        Args:
            ma: Amplitudes by channel in mA, rounded to 0.001 mA.
            v: Amplitudes by channel in V, rounded to 0.001 V.
            width_us: Pulse widths by channel in whole µs; needs `max_width_us` in the train.
            force_n: Forces by channel in N, for channels under force control.
            angle_deg: Reference angle of the joint in °.
            rate_deg_per_s: Rate at which that angle changes, °/s.
            endpoint_n: Force at the hand in N: backward, to the right, upward.
            held: Whether the wearer holds an object.

        Raises:
            Refused: A value is not possible; stimulation goes on as before.
            DeviceFault: The device ended stimulation.
            LeaseExpired: The call came too late.
        """
        given = {
            "ma": None if ma is None else dict(ma),
            "v": None if v is None else dict(v),
            "width_us": None if width_us is None else dict(width_us),
            "force_n": None if force_n is None else dict(force_n),
            "angle_deg": angle_deg,
            "rate_deg_per_s": rate_deg_per_s,
            "endpoint_n": endpoint_n,
            "held": held,
        }
        direct = {name: value for name, value in given.items() if value is not None}
        if self._duties:
            self._set_with_duties(direct)
        else:
            self._native.send(**direct)

    def play(self, channel: int, pulses: Sequence[tuple[float, int, int]]) -> None:
        """Play a list of pulses once, in place of the channel's own.

        Args:
            channel: A channel whose train has ``lists=True``.
            pulses: Up to 16 pulses: amplitude in the channel's unit, width in µs, and delay in µs
                after the start of the pulse before (of the first: after the next burst's begin).

        Raises:
            Refused: The list is not possible.
        """
        self._native.play_pulses(channel, list(pulses))

    def measure(self, angle_deg: float, joint: int = 0) -> None:
        """Send an angle that you have measured, as measured now.

        Args:
            angle_deg: Angle in °, sent in steps of 0.01°.
            joint: Number of the joint on the link: 0 for the joint or wall of the setup.

        Raises:
            Refused: The setup does not expect this angle from the host.
        """
        self._native.measure(joint, angle_deg)

    def mark(self, text: str) -> None:
        """Add a mark with a text to the record (`markers.csv`), at the present time."""
        self._native.mark(text)

    def trigger(self, held_s: float = 0.0) -> None:
        """Give the trigger input of the simulator an edge, and hold the input for `held_s`.

        Raises:
            FlexorError: The device is real: its trigger input is a pin.
        """
        self._native.trigger(held_s)

    def wait(self, seconds: float) -> float:
        """Let device time pass, while the device is kept alive and recorded.

        Returns:
            Time since the start of the trains in s.

        Raises:
            DeviceFault: The device ended stimulation.
            LeaseExpired: The call came too late, and stimulation was stopped before.
            KeyboardInterrupt: Ctrl-C; stimulation is stopped before it is raised.
        """
        return self._native.wait(seconds)

    def stop(self) -> Record | None:
        """Stop stimulation, or disarm, and return the record of the trial.

        Stopping is never refused. Without a trial the result is None.

        Raises:
            ConnectionLost: The device did not acknowledge; it stops by itself soon.
        """
        data = self._native.stop()
        if data is None:
            return None
        if data.error is not None:
            warnings.warn(data.error, RuntimeWarning, stacklevel=2)
        return Record(data)

    def close(self) -> None:
        """Stop and close the device, and complete the record on disk."""
        self._native.close()

    # Observe

    @property
    def state(self) -> Literal["idle", "armed", "running", "closed"]:
        """What the device does at present."""
        return self._native.state

    @property
    def time_s(self) -> float:
        """Time since the start of the trains, s; 0 before it."""
        return self._native.time_s

    @property
    def record(self) -> Record | None:
        """Record of the trial so far; None before the first."""
        data = self._native.trial()
        return None if data is None else Record(data)

    @property
    def angle_deg(self) -> float:
        """Latest measured joint angle in °; NaN without one."""
        latest = self._native.latest()
        measured = None if latest is None else latest[2]
        return float("nan") if measured is None else measured

    @property
    def info(self) -> dict[str, Any] | None:
        """What the device says of itself; None for the simulator in this process."""
        return self._native.info()

    def events(self) -> Iterator[Event]:
        """Iterate over what the device has reported in this trial."""
        for event in self._native.events_from(0):
            yield Event(*event)

    def steps(self, seconds: float, step_s: float) -> Iterator[float]:
        """Iterate over device time: let `step_s` pass before each turn, `seconds` in all.

        Yields:
            Time since the start of the trains in s.
        """
        count = round(seconds / step_s)
        for _ in range(count):
            yield self.wait(step_s)

    def stream(self, seconds: float) -> Iterator[npt.NDArray[np.void]]:
        """Iterate over telemetry while time passes: one row per sample, columns as `samples.csv`.

        In real time each turn renews the lease.

        Args:
            seconds: Device time after which the iteration ends.
        """
        self._native.take_samples()
        end_s = self.time_s + seconds
        while (left_s := end_s - self.time_s) > 0:
            self.wait(min(self.telemetry_s, left_s))
            yield from table_of(self._native.take_samples())

    def snapshot(self) -> Device:
        """Return an independent copy of the armed simulator with its wearer, in this state.

        The copy's time goes on from here, and it records nothing on disk.

        Raises:
            FlexorError: The device is real or runs in real time, or its limb is your own.
        """
        copied = object.__new__(type(self))
        copied.__dict__.update(
            copy.deepcopy({k: v for k, v in vars(self).items() if k != "_native"})
        )
        copied._native = self._native.fork()
        return copied

    def reset(self, seed: int = 1) -> None:
        """Begin again with a rested simulated wearer. Needs a simulator that is not armed."""
        self._native.reset(seed)

    def __enter__(self) -> Self:
        """Return the device."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop and close the device; an exception of the block is not replaced."""
        try:
            self.close()
        except FlexorError:
            if error is None:
                raise

    def __repr__(self) -> str:
        """Describe the device in one line."""
        return f"<flexor.Device {self.address} {self.state}>"

    def __reduce__(self) -> Any:
        """Refuse to be pickled: a device belongs to the process that opened it."""
        raise TypeError("a Device cannot be pickled; connect in the process that uses it")

    # Private

    def _set_wearer(self, wearer: str | Path | None, limits: Limits | None) -> None:
        table: dict[str, Any] = dict(self._fields.get("wearer", {}))
        if wearer is not None:
            text = _native.wearer_text(str(wearer))
            self._wearer = tomllib.loads(text)
            table["file"] = str(wearer)
        if limits is not None:
            table.update(to_fields(limits))
        self._fields["wearer"] = table

    def _electrode(self, number: int) -> dict[str, Any]:
        for electrode in self._wearer.get("electrode", []):
            if electrode.get("channel") == number:
                return dict(electrode)
        return {}

    def _known_stage(self, number: int) -> dict[str, Any]:
        info = self._native.info()
        return {} if info is None else info["stages_by_channel"].get(number, {})

    def _complete(self, fields: dict[str, Any]) -> dict[str, Any]:
        longest = self._wearer.get("limits", {}).get("max_session_s", _DAY_S)
        own = fields.get("wearer", {}).get("max_session_s")
        return {
            **fields,
            "duration_s": min(longest, own if own is not None else longest),
            "setpoints": {"kind": "keep-alive", "rate_hz": 1000},
        }

    def _check(self, change: dict[str, Any]) -> None:
        _native.check(self._complete({**self._fields, **change}))

    def _try(self, change: dict[str, Any]) -> None:
        change = copy.deepcopy(change)
        self._check(change)
        self._fields.update(change)

    def _programs(
        self, duties: dict[int, dict[str, Any]], amplitudes: dict[int, float]
    ) -> list[dict[str, Any]]:
        own: list[dict[str, Any]] = list(self._fields.get("program", []))
        played = [
            {**cycle, "channels": [channel], "value": amplitudes[channel]}
            for channel, cycle in duties.items()
            if amplitudes.get(channel, 0) > 0
        ]
        return own + played

    def _set_with_duties(self, given: dict[str, Any]) -> None:
        amplitudes = dict(self._amplitudes)
        has_change = False
        for name in ("ma", "v"):
            values = given.get(name, {})
            cyclic = {channel: values[channel] for channel in values if channel in self._duties}
            if cyclic:
                # The values are checked like any others.
                self._native.check_values(**{name: cyclic})
                amplitudes.update(cyclic)
                has_change = True
                rest = {c: values[c] for c in values if c not in self._duties}
                given = {**given, name: rest}
                if not rest:
                    del given[name]
        fields = {**self._fields, "program": self._programs(self._duties, amplitudes)}
        complete = self._complete(fields)
        if has_change:
            _native.check(complete)
        if given:
            self._native.send(**given)
        if has_change:
            self._native.play(complete)
            self._amplitudes = amplitudes


def _first(*values: Any) -> Any:
    return next(value for value in values if value is not None)


def _session_fields(session: str | Path | Mapping[str, Any] | None, title: str) -> dict[str, Any]:
    if session is None:
        return {"title": title}
    if isinstance(session, Mapping):
        fields = copy.deepcopy(dict(session))
    else:
        fields = tomllib.loads(_native.session_text(str(session)))
    fields.setdefault("title", title)
    for unused in ("duration_s", "setpoints", "measure"):
        fields.pop(unused, None)
    return fields
