"""A device that a program drives call by call."""

from __future__ import annotations

import contextlib
import copy
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from . import _arguments, _native
from ._errors import FlexorError
from ._limb import Limb
from ._record import Event, Reading, Record, table_of
from ._setup import Setup
from ._train import Limits


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
        record: Folder for the record, absent or empty. The record is on disk while it runs. None
            keeps it in memory.
        title: Title of the record.
        seed: Seed of the simulated wearer's noise, 0 to 2⁶⁴ − 1. A device behind a port ignores it.
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
        Refused: There is no such session or wearer file.
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


class Device(Setup):
    """A stimulator, real or simulated. Create it with `connect`.

    The order of calls is: set up channels, `arm`, `start`, then `set` and `wait`, then `stop`.
    Setting up never stimulates. After `start` all amplitudes are zero until `set`, a program, or a
    controller on the device raises them.

    In real time the device stops if no call comes for `lease_s`: use ``dev.wait(5)`` instead of
    ``time.sleep(5)``. With the address ``"sim:"`` time stands still between calls. A call that
    sends messages takes 1 to 2 ms of device time.
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
        if limb is not None and not callable(limb):
            raise TypeError(f"limb must be a function of pulses and time, not {limb!r}")
        super().__init__(session, wearer, limits, title)
        self._amplitudes: dict[int, float] = {}
        self._closed_record: Record | None = None
        self._is_warned = False
        self._native = _native.Device(
            address,
            seed=_arguments.seed(seed),
            record=None if record is None else Path(record),
            title=self._fields["title"],
            lease_s=_arguments.seconds("lease_s", lease_s),
            telemetry_ms=telemetry_ms,
            all_edges=all_edges,
            limb=limb,
            limb_period_s=_arguments.seconds("limb_period_s", limb_period_s),
        )
        self.address = address
        """Address that was given to `connect`."""
        self.telemetry_s = telemetry_ms / 1000
        """Time between two samples, s."""

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
        self._is_warned = False
        return {reading[0]: Reading(*reading) for reading in readings}

    def start(self) -> None:
        """Start the armed trains. Amplitudes are zero until `set` raises them.

        Amplitudes that are set between `arm` and `start` rise from the start on.

        Raises:
            FlexorError: The device is not armed, or was armed more than 10 s ago.
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
            ma: Amplitudes by channel in mA, rounded to 0.001 mA: 0, or from 0.05 mA (or one step
                of the converter, if that is more) up to the channel's limit. A channel that is left
                out keeps its amplitude. An amplitude rises within `Limits.rise_ms`, by default in
                0.5 s, and again after a pause at 0.
            v: Amplitudes by channel in V, rounded to 0.001 V, likewise.
            width_us: Pulse widths by channel in whole µs, 10 up to the train's `max_width_us`.
            force_n: Forces by channel in N, for channels under force control. Each force is a
                message of its own; if the device is lost in between, the first ones have arrived.
            angle_deg: Reference angle of the joint in °, or place of the wall; steps of 0.01°.
            rate_deg_per_s: Rate at which that angle changes, °/s; steps of 0.01 °/s.
            endpoint_n: Force at the hand in N: backward, to the right, upward.
            held: Whether the wearer holds an object.

        Raises:
            Refused: A value is not possible; stimulation goes on as before.
            TypeError: A value is not a number, or not given by channel; likewise.
            ValueError: No value is given; likewise.
            DeviceFault: The device ended stimulation.
            LeaseExpired: The call came too late, and stimulation was stopped before.
        """
        if endpoint_n is not None and not isinstance(endpoint_n, list | tuple | np.ndarray):
            raise TypeError(
                "endpoint_n must have three components: backward, to the right and upward"
            )
        given = {
            "ma": _arguments.by_channel("ma", ma),
            "v": _arguments.by_channel("v", v),
            "width_us": _arguments.by_channel("width_us", width_us),
            "force_n": _arguments.by_channel("force_n", force_n),
            "angle_deg": angle_deg,
            "rate_deg_per_s": rate_deg_per_s,
            "endpoint_n": endpoint_n,
            "held": bool(held) if isinstance(held, np.bool_) else held,
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
            Refused: The list is not possible, or the train does not accept lists.
        """
        checked = [_arguments.pulse(pulse) for pulse in pulses]
        self._native.play_pulses(_arguments.whole_number("channel", channel, 255), checked)

    def measure(self, angle_deg: float, joint: int = 0) -> None:
        """Send an angle that you have measured, as measured now.

        Args:
            angle_deg: Angle in °, sent in steps of 0.01°.
            joint: Number of the joint in the protocol: 0 for the joint or wall of the setup.

        Raises:
            Refused: The setup does not expect this angle from the host.
            ValueError: The angle is not finite.
        """
        self._native.measure(joint, angle_deg)

    def mark(self, text: str) -> None:
        """Add a mark with a text to the record (`markers.csv`), at the present time.

        Raises:
            FlexorError: The device is not armed.
        """
        self._native.mark(text)

    def trigger(self, held_s: float = 0.0) -> None:
        """Give the trigger input of the simulator an edge, and hold the input for `held_s`.

        Args:
            held_s: Time for which the input is held, s, 0 to 86 400.

        Raises:
            FlexorError: The device is real: its trigger input is a pin. Or it is not armed.
        """
        self._native.trigger(_arguments.seconds("held_s", held_s))

    def wait(self, seconds: float) -> float:
        """Let device time pass, while the device is kept alive and recorded.

        Args:
            seconds: Device time, s, 0 to 86 400.

        Returns:
            Time since the start of the trains in s.

        Raises:
            DeviceFault: The device ended stimulation.
            LeaseExpired: The call came too late, and stimulation was stopped before.
            FlexorError: The trains are not started.
            ValueError: The time is out of range.
            KeyboardInterrupt: Ctrl-C; stimulation is stopped before it is raised.
        """
        return self._native.wait(_arguments.seconds("seconds", seconds))

    def wait_until(self, t_s: float) -> float:
        """Let device time pass until `t_s` seconds after the start of the trains, as `wait` does.

        Calls such as `set` take some device time themselves, about 1 ms; with this call they do
        not add up. A time that has passed ends the wait at once.

        Returns:
            Time since the start of the trains in s.
        """
        return self._native.wait_until(_arguments.seconds("t_s", t_s))

    def stop(self) -> Record | None:
        """Stop stimulation, or disarm, and return the record of the trial.

        Stopping is never refused. Amplitudes fall within `fall_ms` of the wearer's limits. If
        nothing is stimulated, the result is the record of the latest trial, or None before the
        first. A trial that ended early is reported as a `RuntimeWarning`.

        Raises:
            ConnectionLost: The device did not acknowledge; it stops by itself soon.
        """
        data = self._native.stop()
        if data is None:
            return self._closed_record
        record = Record(data)
        if record.error is not None and not self._is_warned:
            self._is_warned = True
            warnings.warn(record.error, RuntimeWarning, stacklevel=2)
        return record

    def acknowledge(self) -> None:
        """Acknowledge a latched fault of the device, after you have found and removed its cause.

        A device that ended stimulation because of a fault refuses to arm until then. Does nothing
        if no fault is latched.

        Raises:
            FlexorError: The device is armed.
            ConnectionLost: The device does not answer.
        """
        self._native.acknowledge()

    def close(self) -> None:
        """Stop and close the device, and complete the record on disk.

        A second call does nothing. Every other call to a closed device raises `FlexorError`.

        Raises:
            DeviceFault: The device has ended stimulation since the last call.
            LeaseExpired: The lease has run out since the last call.
            ConnectionLost: The device did not acknowledge; it stops by itself soon.
        """
        if self._native.state == "closed":
            return
        ended: FlexorError | None = None
        try:
            self._native.raise_end()
        except FlexorError as error:
            ended = error
        try:
            data = self._native.stop()
            self._closed_record = None if data is None else Record(data)
        finally:
            self._native.close()
        if ended is not None:
            raise ended

    # Observe

    @property
    def state(self) -> Literal["idle", "armed", "running", "closed"]:
        """State: "idle" (not armed), "armed", "running" (trains are started) or "closed"."""
        return self._native.state

    @property
    def time_s(self) -> float:
        """Time since the start of the trains, s; 0 before it."""
        return self._native.time_s

    @property
    def record(self) -> Record | None:
        """Record of the trial so far, also after the device was closed; None before the first."""
        if self._native.state == "closed":
            return self._closed_record
        data = self._native.trial()
        return None if data is None else Record(data)

    @property
    def angle_deg(self) -> float:
        """Latest measured angle of the joint or wall in °.

        NaN before the first measurement, and if neither a joint nor a wall is set up. The true
        angle of a simulated limb is in the column ``true_deg`` of `stream` and `Record.samples`.
        """
        latest = self._native.latest()
        measured = None if latest is None else latest[2]
        return float("nan") if measured is None else measured

    @property
    def info(self) -> dict[str, Any] | None:
        """Identity of a device behind a port; None for the simulator in this process.

        Keys: ``simulated``, ``firmware``, ``board``, ``unique_id``, ``reset`` (reason of the latest
        reset), ``stages`` (text) and ``stages_by_channel`` (full scale in mA or V by channel).
        """
        return self._native.info()

    def events(self) -> Iterator[Event]:
        """Iterate over what the device has reported in this trial so far. Does not wait."""
        for event in self._native.events_from(0):
            yield Event(*event)

    def steps(self, seconds: float, step_s: float) -> Iterator[float]:
        """Iterate over device time at a fixed rate: one turn at the end of each step.

        The time that the calls of a turn take is part of the next step. A turn that takes longer
        than a step delays the next one, which then begins at once.

        Args:
            seconds: Length of all steps together, s.
            step_s: Length of a step, s.

        Yields:
            Time since the start of the trains in s.
        """
        length_s = _arguments.seconds("seconds", seconds)
        step_s = _arguments.seconds("step_s", step_s)
        turns = length_s / step_s if step_s > 0 else float("nan")
        if not (0 <= turns <= 1e9 and abs(turns - round(turns)) <= 1e-6):
            raise ValueError(
                f"seconds must be a whole number of steps above 0 s, not {seconds} of {step_s}"
            )
        begin_s = self.time_s
        for turn in range(round(turns)):
            yield self.wait_until(begin_s + (turn + 1) * step_s)

    def stream(self, seconds: float) -> Iterator[npt.NDArray[np.void]]:
        """Iterate over telemetry while time passes: one row per sample, columns as `samples.csv`.

        In real time each turn renews the lease.

        Args:
            seconds: Device time after which the iteration ends, s.

        Yields:
            Row of the structured array that `Record.samples` describes, every `telemetry_ms`.

        Raises:
            DeviceFault: The device ended stimulation.
            LeaseExpired: A turn took longer than the lease, and stimulation was stopped before.
        """
        length_s = _arguments.seconds("seconds", seconds)
        if not 0 <= length_s <= 86_400:
            raise ValueError(f"seconds must be between 0 and 86400 s (a day), not {seconds}")
        self._native.take_samples()
        now_s = self.time_s
        end_s = now_s + length_s
        while end_s - now_s > 1e-6:  # device time is in whole µs
            now_s = self.wait_until(min(now_s + self.telemetry_s, end_s))
            yield from table_of(self._native.take_samples())

    def snapshot(self) -> Device:
        """Return an independent copy of the armed simulator with its wearer, in this state.

        The copy's time goes on from here, and it records nothing on disk.

        Raises:
            FlexorError: The device is real or runs in real time, or its limb is your own.
        """
        copied = object.__new__(type(self))
        copied.__dict__.update(
            copy.deepcopy(
                {k: v for k, v in vars(self).items() if k not in ("_native", "_closed_record")}
            )
        )
        copied._closed_record = None
        copied._native = self._native.fork()
        return copied

    def reset(self, seed: int = 1) -> None:
        """Begin again with a rested simulated wearer. The setup stays.

        Args:
            seed: Seed of the simulated wearer's noise, 0 to 2⁶⁴ − 1.

        Raises:
            FlexorError: The device is real, or it is armed.
        """
        self._native.reset(_arguments.seed(seed))

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
            if kind is not None and self._native.state != "closed":
                self._native.stop_early(f"{kind.__name__} left the with block")
            self.close()
        except FlexorError:
            if error is None:
                raise
            with contextlib.suppress(FlexorError):
                self.close()

    def __repr__(self) -> str:
        """Describe the device in one line."""
        return f"<flexor.Device {self.address} {self.state}>"

    def __reduce__(self) -> Any:
        """Refuse to be pickled: a device belongs to the process that opened it."""
        raise TypeError("a Device cannot be pickled; connect in the process that uses it")

    # Private

    def _ensure_idle(self, call: str) -> None:
        self._native.check_idle(call)

    def _known_stage(self, number: int) -> dict[str, Any]:
        info = self._native.info()
        return {} if info is None else info["stages_by_channel"].get(number, {})

    def _set_with_duties(self, given: dict[str, Any]) -> None:
        amplitudes = dict(self._amplitudes)
        has_change = False
        for name in ("ma", "v"):
            values = given.get(name, {})
            cyclic = {channel: values[channel] for channel in values if channel in self._duties}
            if cyclic:
                # The values are checked like any others.
                self._native.check_values(**{name: cyclic})
                # The device counts in steps of 0.001.
                amplitudes.update({c: round(float(value), 3) for c, value in cyclic.items()})
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
