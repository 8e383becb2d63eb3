"""Gymnasium environments: a finger that follows a reference, and an elbow at a virtual wall.

    import gymnasium
    import flexor.gym

    env = gymnasium.make("flexor/Finger-v0")
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

Both environments run the code of the device and a simulated limb. The action is the pair of
amplitudes of the two muscles, and the device limits them as it does for every host. The device's
own controllers run the same episodes, so a policy can be compared with them:

    env = flexor.gym.FingerEnv()
    print(flexor.gym.run_episode(env, flexor.gym.DeviceController("pid"), seed=1))
    print(flexor.gym.run_episode(env, flexor.gym.PidPolicy(), seed=1))

Simulation is never evidence about people: a policy that does well here has learnt a model.
Needs the extra ``flexor-stim[gym]``.
"""

from __future__ import annotations

import copy
import math
import tomllib
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np
import numpy.typing as npt

from . import _native
from ._device import Device, connect
from ._errors import DeviceFault
from ._limb import Limb

try:
    import gymnasium
    from gymnasium import spaces
except ImportError as error:
    raise ImportError(
        "flexor.gym needs Gymnasium 1.0 or later: pip install 'flexor-stim[gym]'", name="gymnasium"
    ) from error

__all__ = [
    "Array",
    "DeviceController",
    "Episode",
    "FAULT_ERROR_DEG",
    "FingerEnv",
    "PidPolicy",
    "Policy",
    "Reference",
    "WallEnv",
    "WallPolicy",
    "run_episode",
]

Array = npt.NDArray[np.float32]
"""Observation or action."""

Reference = Callable[[float], tuple[float, float]]
"""Reference of the finger: from the time in s to the angle in ° and its rate in °/s."""

FAULT_ERROR_DEG = 90.0
"""Error in ° that every remaining step of an episode is charged with after a fault. Without it, a
policy would learn to end episodes."""

_Latest = tuple[float, float | None, float | None, float | None, float | None]
_WATCHED_LIMIT = 0.1
_OPTIONS = {"body", "controller"}


@runtime_checkable
class Policy(Protocol):
    """A policy: from an observation to an action. `reset` is called before each episode."""

    def reset(self) -> None:
        """Forget the episode before."""

    def __call__(self, observation: Array) -> Array:
        """Return the action for an observation."""


@dataclass(frozen=True, kw_only=True)
class Episode:
    """Result of one episode.

    Attributes:
        total_reward: Sum of all rewards.
        rms_error_deg: Root mean square of the errors at the ends of the steps, °; NaN if no step
            counts. The error is the tracking error of the finger, or the penetration of the wall.
        largest_error_deg: Largest of these errors, °.
        charge_uc: Charge of all first phases, µC.
        steps: Number of steps that were completed.
        fault: Why the device ended stimulation; None if it did not.
    """

    total_reward: float
    rms_error_deg: float
    largest_error_deg: float
    charge_uc: float
    steps: int
    fault: str | None


@dataclass(frozen=True)
class DeviceController:
    """A controller on the device, used as a policy. The device ignores the actions.

    In a loop of your own, give `options` to `reset`, so that the episode runs on the device's
    controller: ``env.reset(seed=1, options=policy.options())``. `run_episode` does this itself.

    Attributes:
        law: Controller of a joint: "recommended", "paper" or "pid". None keeps the session's. A
            wall has only one controller.
        fields: Fields of `[joint]` or `[wall]` that differ from the session's.
    """

    law: str | None = None
    fields: Mapping[str, Any] = field(default_factory=dict)

    def options(self) -> dict[str, Any]:
        """Return the options of `reset` for an episode under this controller."""
        law = {} if self.law is None else {"law": self.law}
        return {"controller": {**law, **self.fields}}

    def reset(self) -> None:
        """Do nothing: the device begins anew when it is armed."""

    def __call__(self, observation: Array) -> Array:
        """Return an action of zeros, which the environment ignores."""
        return np.zeros(2, dtype=np.float32)


class PidPolicy:
    """A PID controller of the finger, in Python and at the rate of the steps.

    The defaults are the gains of the device's PID controller, which runs ten times as often. The
    integral stops while the effort is at its limit.
    """

    def __init__(
        self, kp: float = 1.06, ki: float = 17.0, kd: float = 0.117, step_s: float = 0.02
    ) -> None:
        """Create a controller; `step_s` is the environment's, the gains refer to rad and s."""
        self._gains = kp, ki, kd
        self._step_s = step_s
        self.reset()

    def reset(self) -> None:
        """Forget the integral and the last angle."""
        self._integral = 0.0
        self._last_deg: float | None = None

    def __call__(self, observation: Array) -> Array:
        """Return the amplitudes for an observation of `FingerEnv`."""
        angle, reference, reference_rate, *_ = observation.tolist()
        last = angle if self._last_deg is None else self._last_deg
        self._last_deg = angle
        error = math.radians(reference - angle)
        rate = math.radians(reference_rate - (angle - last) / self._step_s)
        kp, ki, kd = self._gains
        integral = self._integral + ki * error * self._step_s
        effort = kp * error + integral + kd * rate
        if abs(effort) <= 1.0 or effort * error < 0:
            self._integral = integral
        return np.array([max(effort, 0.0), max(-effort, 0.0)], dtype=np.float32).clip(0.0, 1.0)


class WallPolicy:
    """A proportional wall in Python: the first muscle rises linearly in front of the wall.

    `depth_deg` is the depth of the ramp in °, and `co_contraction` the action of the other muscle
    inside the wall, 0 to 1.
    """

    def __init__(self, depth_deg: float = 9.0, co_contraction: float = 0.0) -> None:
        """Create a wall whose ramp ends at the wall with the largest amplitude."""
        self._depth_deg = depth_deg
        self._co_contraction = co_contraction

    def reset(self) -> None:
        """Do nothing: the policy has no state."""

    def __call__(self, observation: Array) -> Array:
        """Return the amplitudes for an observation of `WallEnv`."""
        inside_deg = float(observation[1])
        resisting = min(max(1.0 + inside_deg / self._depth_deg, 0.0), 1.0)
        return np.array(
            [resisting, self._co_contraction if inside_deg > 0 else 0.0], dtype=np.float32
        )


class _Point(NamedTuple):
    """A stimulation point that an element of the action drives.

    `uc_per_unit` is the charge of one step in µC per unit of amplitude.
    """

    channel: int
    threshold: float
    limit: float
    uc_per_unit: float


class _LimbEnv(gymnasium.Env[Array, Array], ABC):
    """Two muscles, an angle, and the device between policy and limb."""

    metadata = {"render_modes": []}

    def __init__(
        self,
        session: str | Path | Mapping[str, Any],
        *,
        table: str,
        duration_s: float,
        step_s: float,
        charge_weight: float,
        telemetry_ms: int,
        limb: Callable[[int], Limb] | None,
        limb_period_s: float,
    ) -> None:
        if not 0.005 <= step_s <= duration_s:
            raise ValueError(f"step_s must be between 0.005 and duration_s, not {step_s}")
        if telemetry_ms > 1000 * step_s:
            raise ValueError(
                f"telemetry_ms must be at most the step of {1000 * step_s:g} ms, not {telemetry_ms}"
            )
        self._table = table
        self._fields = _fields_of(session)
        if table not in self._fields:
            raise ValueError(f"the session has no [{table}], which {type(self).__name__} needs")
        self.step_s = step_s
        """Device time per step, s."""
        self.steps = round(duration_s / step_s)
        """Number of steps of an episode."""
        self._charge_weight = charge_weight
        self._telemetry_ms = telemetry_ms
        self._make_limb = limb
        self._limb: Limb | None = None
        self._limb_period_s = limb_period_s
        self._trains = {c["number"]: c for c in self._fields["channel"]}
        self._unit = "v" if self._fields["channel"][0]["stage"]["kind"] == "voltage" else "ma"
        self._device: Device | None = None
        self._is_on_device = False
        self._count = 0
        self._now_s = 0.0
        self._measured_deg = 0.0
        self._played = [0.0, 0.0]
        self.action_space = spaces.Box(0.0, 1.0, (2,), np.float32)
        self._points = self._find_points()

    # Gymnasium

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode with a rested wearer and let one step pass without stimulation.

        Args:
            seed: Seed of the episode: of the sensor's noise, and of what the environment draws.
            options: ``controller``: fields of the controller on the device that is to run the
                episode in place of the actions, as `DeviceController.options` returns them.
                ``body``: fields of the simulated wearer that differ from the session's.

        Returns:
            Observation and info, as `step` does.

        Raises:
            Refused: The controller or the body is not possible.
            ValueError: There is no such option.
        """
        super().reset(seed=seed)
        options = options or {}
        if unknown := set(options) - _OPTIONS:
            known = " and ".join(sorted(_OPTIONS))
            raise ValueError(f"reset has no option {sorted(unknown)[0]!r}; it has {known}")
        wearer_seed = int(self.np_random.integers(1 << 32))
        body = {**self._fields["body"], **self._draw(), **options.get("body", {})}
        controller = options.get("controller")
        self.close()
        if self._make_limb is not None:
            self._limb = self._make_limb(wearer_seed)
        self._is_on_device = controller is not None
        self._device = connect(
            "sim:",
            session={**self._setup(controller), "body": body},
            seed=wearer_seed,
            telemetry_ms=self._telemetry_ms,
            limb=self._limb,
            limb_period_s=self._limb_period_s,
        )
        self._device.arm()
        self._device.start()
        if self._is_on_device:
            self._device._native.take_samples()  # later samples wait for the next call
        self._count = 0
        self._played = [0.0, 0.0]
        self._now_s = self._device.wait(self.step_s)
        _, measured, true = self._latest()
        self._begin(measured)
        return self._observe(measured), {"time_s": self._now_s, "true_deg": true}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Play the amplitudes of `action` for one step.

        Args:
            action: For each muscle 0 for no pulses, or the place of the amplitude between motor
                threshold (just above 0) and limit (1). Values outside are clipped. Ignored while a
                controller on the device runs the episode.

        Returns:
            Observation, reward, terminated (the device ended stimulation), truncated (the episode
            is over), and info: ``time_s``, ``error_deg``, ``charge_uc`` (of the step), ``true_deg``
            (angle without the errors of the sensor), and after a fault ``fault``.

        Raises:
            gymnasium.error.ResetNeeded: There is no episode, or it is over.
            ValueError: The action is not a number.
        """
        device = self._device
        if device is None or self._count >= self.steps:
            raise gymnasium.error.ResetNeeded("call reset() before step(): there is no episode")
        next_s = (self._count + 2) * self.step_s
        self._count += 1
        try:
            if self._is_on_device:
                self._follow(device)
                self._now_s, latest = device._native.advance(next_s)
                charge_uc = self._read_played(device)
            else:
                amplitudes, charge_uc = self._amplitudes(action)
                values = {self._unit: amplitudes}
                self._now_s, latest = device._native.advance(next_s, **values)
        except DeviceFault as fault:
            return self._end(fault)
        t_s, measured, true = self._read(latest)
        error, cost = self._judge(t_s, measured, charge_uc)
        info = {
            "time_s": self._now_s,
            "error_deg": error,
            "charge_uc": charge_uc,
            "true_deg": true,
        }
        is_over = self._count == self.steps
        return self._observe(measured), -cost, False, is_over, info

    def close(self) -> None:
        """Stop and close the simulated device."""
        if self._device is not None:
            self._device.close()
            self._device = None

    def snapshot(self) -> Self:
        """Return an independent copy in this state, for policies that try actions first.

        Raises:
            FlexorError: The limb is your own, or there is no episode.
        """
        if self._device is None:
            raise gymnasium.error.ResetNeeded("call reset() before snapshot()")
        copied = copy.copy(self)
        copied._device = self._device.snapshot()
        if self._is_on_device:
            copied._device._native.take_samples()
        copied._played = list(self._played)
        copied.np_random = copy.deepcopy(self.np_random)
        return copied

    # What the environments differ in

    @abstractmethod
    def _find_points(self) -> tuple[list[_Point], list[_Point]]:
        """Return the points that the two elements of the action drive."""

    @abstractmethod
    def _draw(self) -> dict[str, Any]:
        """Draw the episode, and return the fields of the body that differ in it."""

    @abstractmethod
    def _begin(self, measured: float) -> None:
        """Begin the episode at the measured angle."""

    @abstractmethod
    def _follow(self, device: Device) -> None:
        """Send what the controller on the device needs at the present time."""

    @abstractmethod
    def _judge(self, t_s: float, measured: float, charge_uc: float) -> tuple[float, float]:
        """Return the error in ° and the cost of a step."""

    @abstractmethod
    def _observe(self, measured: float) -> Array:
        """Return the observation."""

    # Shared

    def _setup(self, controller: Mapping[str, Any] | None) -> dict[str, Any]:
        """Return the session for the controller, or for amplitudes if there is none.

        The device measures an angle only for a joint or a wall. Without its controller it gets a
        wall at the end of the range, on a channel of its own, which never pulses.
        """
        fields = {k: v for k, v in self._fields.items() if k not in ("joint", "wall")}
        table = self._fields[self._table]
        if controller is not None:
            return {**fields, self._table: {**table, **controller}}
        fields = _without_wearer_file(fields)
        number = next(n for n in range(1, 11) if n not in self._trains)
        first = self._fields["channel"][0]
        watched = {
            "number": number,
            "name": "never pulses",
            "stage": first["stage"],
            "limit": _WATCHED_LIMIT,
            "train": first["train"],
        }
        end_deg = table.get("angle_max_deg", 100.0 if self._table == "joint" else 150.0)
        codes = (800, 3300) if self._table == "joint" else (500, 2500)
        fields["wall"] = {
            "at_deg": end_deg,
            "channel": number,
            "max": _WATCHED_LIMIT,
            "stiffness_per_deg": 0.001,
            "angle_min_deg": table.get("angle_min_deg", 0.0),
            "angle_max_deg": end_deg,
            "sensor": "adc",
            "code_at_0_deg": table.get("code_at_0_deg", codes[0]),
            "code_at_100_deg": table.get("code_at_100_deg", codes[1]),
        }
        return {**fields, "channel": [*fields["channel"], watched]}

    def _point(self, channel: int, threshold: float, limit: float) -> _Point:
        entry = self._trains[channel]
        stage, train = entry["stage"], entry["train"]
        ma_per_unit = 1000.0 / stage["load_ohm"] if stage["kind"] == "voltage" else 1.0
        rate_hz = train.get("frequency_hz") or 1e6 / train["period_us"]
        pulses = rate_hz * self.step_s * train.get("burst_count", 1)
        uc_per_unit = ma_per_unit * train["width_us"] * 1e-3 * pulses
        return _Point(channel, threshold, limit, uc_per_unit)

    def _amplitudes(self, action: Array) -> tuple[dict[int, float], float]:
        """Return the amplitudes of an action by channel, and the charge of the step in µC."""
        shares = action.tolist() if isinstance(action, np.ndarray) else [*map(float, action)]
        if len(shares) != 2 or shares[0] != shares[0] or shares[1] != shares[1]:  # NaN
            raise ValueError(f"an action has two numbers from 0 to 1, not {action}")
        amplitudes: dict[int, float] = {}
        charge_uc = 0.0
        for index, points in enumerate(self._points):
            share = shares[index]
            share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
            self._played[index] = share
            for channel, threshold, limit, uc_per_unit in points:
                amplitude = 0.0
                if share > 0.0:
                    amplitude = min(threshold + share * (limit - threshold), limit)
                amplitudes[channel] = amplitude
                charge_uc += amplitude * uc_per_unit
        return amplitudes, charge_uc

    def _read_played(self, device: Device) -> float:
        """Read the amplitudes that the device played, and return their charge in µC."""
        columns = dict(device._native.take_samples())
        charge_uc = 0.0
        for index, points in enumerate(self._points):
            for channel, threshold, limit, uc_per_unit in points:
                values = columns[f"amplitude_{channel}_{self._unit}"]
                played = [0.0 if math.isnan(float(v)) else float(v) for v in values]
                amplitude = sum(played) / max(len(played), 1)
                charge_uc += amplitude * uc_per_unit
                share = (played[-1] - threshold) / (limit - threshold) if played else 0.0
                self._played[index] = min(max(share, 0.0), 1.0)
        return charge_uc

    def _latest(self) -> tuple[float, float, float]:
        """Return time, measured angle and true angle of the newest sample."""
        return self._read(None if self._device is None else self._device._native.latest())

    def _read(self, latest: _Latest | None) -> tuple[float, float, float]:
        if latest is None:
            return self._now_s, self._measured_deg, math.nan
        t_s, _, measured, true, _ = latest
        if measured is not None:  # without one, as after a fault, the last one stays
            self._measured_deg = measured
        return t_s, self._measured_deg, math.nan if true is None else true

    def _end(self, fault: DeviceFault) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Return the last step of an episode in which the device ended stimulation."""
        _, measured, true = self._latest()
        cost = FAULT_ERROR_DEG**2 * (self.steps - self._count + 1)
        self._count = self.steps
        self._played = [0.0, 0.0]
        info = {
            "time_s": self._now_s,
            "error_deg": FAULT_ERROR_DEG,
            "charge_uc": 0.0,
            "true_deg": true,
            "fault": str(fault),
        }
        return self._observe(measured), -cost, True, False, info


class FingerEnv(_LimbEnv):
    """A simulated finger follows a reference angle (``flexor/Finger-v0``).

    The observation is the measured angle in °, the reference in ° and its rate in °/s, and the two
    amplitudes as in the action, flexor first. Both flexor points get the same share of their range,
    as the device's controllers do it.

    The reward of a step is −(e/°)² − `charge_weight` · q: e is the reference minus the measured
    angle at the newest sample of the step, and q the charge of the step's first phases in µC (at
    most 9 µC for the default session). After a fault, every remaining step costs (90)².

    Without `reference`, each episode has a sine of its own: 45° ± 10 to 40° with 0.1 to 0.3 Hz. In
    the first second the reference goes from the finger's angle at rest to this sine.

    Args:
        session: Session with a `[joint]` and a `[body]`: a path, a name, or fields. The models of
            its muscles are left out.
        reference: Reference of every episode.
        duration_s: Length of an episode, s.
        step_s: Device time per step, s, at least 0.005.
        charge_weight: Cost of charge, 1/µC.
        telemetry_ms: Time between two samples of the angle, ms, at most a step.
        limb: Creates a simulated limb of your own for each episode, from a seed.
        limb_period_s: Time between two calls of that limb, s.

    Raises:
        ValueError: An argument is not possible.
    """

    def __init__(
        self,
        session: str | Path | Mapping[str, Any] = "hamana_exp4_two_point_finger",
        *,
        reference: Reference | None = None,
        duration_s: float = 10.0,
        step_s: float = 0.02,
        charge_weight: float = 0.1,
        telemetry_ms: int = 10,
        limb: Callable[[int], Limb] | None = None,
        limb_period_s: float = 0.001,
    ) -> None:
        """Create the environment; the device is opened by `reset`."""
        super().__init__(
            session,
            table="joint",
            duration_s=duration_s,
            step_s=step_s,
            charge_weight=charge_weight,
            telemetry_ms=telemetry_ms,
            limb=limb,
            limb_period_s=limb_period_s,
        )
        if reference is not None and np.shape(reference(0.0)) != (2,):
            raise ValueError("reference must return an angle in ° and its rate in °/s")
        self._own_reference = reference
        self._reference = reference or _sine(0.0, 0.0, 0.0, 0.0)
        self._drawn = 0.0, 0.0
        self.observation_space = spaces.Box(
            np.array([-180, -180, -1000, 0, 0], dtype=np.float32),
            np.array([180, 180, 1000, 1, 1], dtype=np.float32),
        )

    def _find_points(self) -> tuple[list[_Point], list[_Point]]:
        joint = self._fields["joint"]
        pairs = [
            [self._point(p["channel"], p["threshold"], p["max"]) for p in points]
            for points in (joint["flexors"], [joint["extensor"]])
        ]
        return pairs[0], pairs[1]

    def _draw(self) -> dict[str, Any]:
        amplitude_deg = float(self.np_random.uniform(10.0, 40.0))
        frequency_hz = float(self.np_random.uniform(0.1, 0.3))
        self._drawn = amplitude_deg, frequency_hz
        return {}

    def _begin(self, measured: float) -> None:
        self._reference = self._own_reference or _sine(measured, 45.0, *self._drawn)

    def _follow(self, device: Device) -> None:
        angle, rate = self._reference(self._now_s)
        device._native.send(angle_deg=angle, rate_deg_per_s=rate)

    def _judge(self, t_s: float, measured: float, charge_uc: float) -> tuple[float, float]:
        error = self._reference(t_s)[0] - measured
        return error, error * error + self._charge_weight * charge_uc

    def _observe(self, measured: float) -> Array:
        angle, rate = self._reference(self._now_s)
        return np.array([measured, angle, rate, *self._played], np.float32)


class WallEnv(_LimbEnv):
    """A simulated elbow moves against a virtual wall (``flexor/Wall-v0``).

    The wearer moves the arm into flexion from 0.5 s on, at a speed that the episode draws between
    15 and 55 °/s, and keeps pushing. The policy stimulates the muscle that pulls the arm out
    (triceps, first element of the action) and its antagonist (biceps, second element).

    The observation is the measured angle in °, the same relative to the wall, positive inside, its
    rate over the last step in °/s, and the two amplitudes as in the action.

    The reward of a step is −(p/°)² − w · q: p is the penetration at the newest sample of the step,
    0 outside, and q the charge of the step's first phases in µC. The weight w is `charge_weight`
    inside the wall and its ramp, and `free_weight` in front of them, where the wearer is to move
    freely. After a fault, every remaining step costs (90)².

    Args:
        session: Session with a `[wall]` that stops flexion, a `[body]` of kind "elbow", and limits
            in a wearer file: a path, a name, or fields.
        duration_s: Length of an episode, s.
        step_s: Device time per step, s, at least 0.005.
        charge_weight: Cost of charge at the wall, 1/µC.
        free_weight: Cost of charge in front of it, 1/µC.
        telemetry_ms: Time between two samples of the angle, ms, at most a step.
        limb: Creates a simulated limb of your own for each episode, from a seed.
        limb_period_s: Time between two calls of that limb, s.

    Raises:
        ValueError: An argument is not possible.
    """

    def __init__(
        self,
        session: str | Path | Mapping[str, Any] = "harris_wall/1_pre_wall",
        *,
        duration_s: float = 6.0,
        step_s: float = 0.02,
        charge_weight: float = 0.1,
        free_weight: float = 10.0,
        telemetry_ms: int = 10,
        limb: Callable[[int], Limb] | None = None,
        limb_period_s: float = 0.001,
    ) -> None:
        """Create the environment; the device is opened by `reset`."""
        super().__init__(
            session,
            table="wall",
            duration_s=duration_s,
            step_s=step_s,
            charge_weight=charge_weight,
            telemetry_ms=telemetry_ms,
            limb=limb,
            limb_period_s=limb_period_s,
        )
        wall = self._fields["wall"]
        if wall.get("stops", "flexion") != "flexion":
            raise ValueError("WallEnv needs a wall that stops flexion")
        self._free_weight = free_weight
        self.at_deg = float(wall["at_deg"])
        """Angle of the wall, °."""
        self._ramp_deg = float(wall.get("pre_wall", {}).get("depth_deg", 0.0))
        self._last_deg = math.nan
        self._duration_s = duration_s
        self.observation_space = spaces.Box(
            np.array([-180, -360, -2000, 0, 0], dtype=np.float32),
            np.array([180, 360, 2000, 1, 1], dtype=np.float32),
        )

    def _find_points(self) -> tuple[list[_Point], list[_Point]]:
        body, wall = self._fields["body"], self._fields["wall"]
        other = next(c for c in (body["triceps"], body["biceps"]) if c != wall["channel"])
        electrodes = _electrodes(_wearer_of(self._fields))
        pairs = []
        for channel in (wall["channel"], other):
            electrode = electrodes.get(channel)
            if electrode is None:
                raise ValueError(f"WallEnv needs a wearer file with an electrode {channel}")
            limit = self._trains[channel].get("limit", electrode["limit"])
            pairs.append([self._point(channel, electrode["motor_threshold"], limit)])
        return pairs[0], pairs[1]

    def _draw(self) -> dict[str, Any]:
        speed = round(float(self.np_random.uniform(15.0, 55.0)), 3)
        approach = {"at_s": 0.5, "speed_deg_per_s": speed, "for_s": self._duration_s}
        return {"approaches": [approach]}

    def _begin(self, measured: float) -> None:
        self._last_deg = measured

    def _follow(self, device: Device) -> None:
        """Send nothing: the wall needs no setpoints."""

    def _judge(self, t_s: float, measured: float, charge_uc: float) -> tuple[float, float]:
        inside = measured - self.at_deg
        weight = self._charge_weight if inside > -self._ramp_deg else self._free_weight
        error = max(inside, 0.0)
        return error, error * error + weight * charge_uc

    def _observe(self, measured: float) -> Array:
        rate = (measured - self._last_deg) / self.step_s
        self._last_deg = measured
        return np.array([measured, measured - self.at_deg, rate, *self._played], np.float32)


def run_episode(
    env: gymnasium.Env[Array, Array],
    policy: Policy | Callable[[Array], Array],
    *,
    seed: int | None = None,
    from_s: float = 0.0,
    body: Mapping[str, Any] | None = None,
) -> Episode:
    """Run one episode of `env` with `policy`, and return its result.

    With a `DeviceController` the device controls; the episode, its seed, its wearer and the rewards
    are the same.

    Args:
        env: A `FingerEnv` or `WallEnv`, also within wrappers that keep actions and info.
        policy: The policy, or a function from observation to action.
        seed: Seed of the episode.
        from_s: Time in s from which the errors count.
        body: Fields of the simulated wearer that differ from the session's.
    """
    options = policy.options() if isinstance(policy, DeviceController) else {}
    if body is not None:
        options["body"] = dict(body)
    observation, _ = env.reset(seed=seed, options=options)
    if isinstance(policy, Policy):
        policy.reset()
    total, charge_uc, steps = 0.0, 0.0, 0
    errors: list[float] = []
    while True:
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        total += float(reward)
        if terminated:
            break
        steps += 1
        charge_uc += info["charge_uc"]
        if info["time_s"] >= from_s:
            errors.append(abs(info["error_deg"]))
        if truncated:
            break
    return Episode(
        total_reward=total,
        rms_error_deg=math.sqrt(sum(e * e for e in errors) / len(errors)) if errors else math.nan,
        largest_error_deg=max(errors, default=math.nan),
        charge_uc=charge_uc,
        steps=steps,
        fault=info.get("fault"),
    )


def _fields_of(session: str | Path | Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a session without its setpoints and its muscles' models."""
    if isinstance(session, Mapping):
        fields = copy.deepcopy(dict(session))
    else:
        fields = tomllib.loads(_native.session_text(str(session)))
    for channel in fields["channel"]:
        channel.pop("muscle", None)
    for unused in ("setpoints", "measure", "fidelity"):
        fields.pop(unused, None)
    return fields


def _wearer_of(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the wearer file of a session; empty if it has none."""
    file = fields.get("wearer", {}).get("file")
    if file is None:
        return {}
    name = Path(file)
    is_shipped = name.stem in _native.wearers()
    return tomllib.loads(_native.wearer_text(name.stem if is_shipped else str(name)))


def _electrodes(wearer: Mapping[str, Any]) -> dict[int, dict[str, Any]]:
    """Return the electrodes of a wearer file, by channel."""
    return {e["channel"]: e for e in wearer.get("electrode", [])}


def _without_wearer_file(fields: dict[str, Any]) -> dict[str, Any]:
    """Return a session with the limits of its wearer file, which allows no further channel."""
    wearer = _wearer_of(fields)
    if not wearer:
        return fields
    own = {k: v for k, v in fields["wearer"].items() if k not in ("file", "name", "haptic_range")}
    electrodes = _electrodes(wearer)
    names = ("limit", "start", "area_mm2")
    channels = [
        {**{k: v for k, v in electrodes[c["number"]].items() if k in names}, **c}
        for c in fields["channel"]
    ]
    return {**fields, "wearer": {**wearer.get("limits", {}), **own}, "channel": channels}


def _sine(
    first_deg: float, offset_deg: float, amplitude_deg: float, frequency_hz: float
) -> Reference:
    """Return a sine to which the reference goes from `first_deg` in one second."""
    turn = 2.0 * math.pi * frequency_hz

    def reference(t_s: float) -> tuple[float, float]:
        angle = offset_deg + amplitude_deg * math.sin(turn * t_s)
        rate = amplitude_deg * turn * math.cos(turn * t_s)
        if t_s >= 1.0:
            return angle, rate
        share = t_s**3 * (10.0 - 15.0 * t_s + 6.0 * t_s**2)
        slope = 30.0 * (t_s * (1.0 - t_s)) ** 2
        moved = angle - first_deg
        return first_deg + share * moved, slope * moved + share * rate

    return reference


for _name, _kind in (("flexor/Finger-v0", FingerEnv), ("flexor/Wall-v0", WallEnv)):
    if _name not in gymnasium.registry:
        gymnasium.register(_name, entry_point=f"flexor.gym:{_kind.__name__}")
