"""Gymnasium environments: spaces, seeds, ends of episodes, and the device's controllers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")

import flexor  # noqa: E402
import flexor.gym  # noqa: E402
from flexor.gym import DeviceController, FingerEnv, PidPolicy, WallEnv, WallPolicy  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

IDS = {"flexor/Finger-v0": FingerEnv, "flexor/Wall-v0": WallEnv}


@pytest.fixture(params=[FingerEnv, WallEnv])
def short(request: pytest.FixtureRequest) -> Iterator[Any]:
    """Yield each environment with episodes of a second."""
    env = request.param(duration_s=1.0)
    yield env
    env.close()


def play(env: Any, seed: int, actions: list[list[float]]) -> tuple[Any, list[float]]:
    """Return the observations and rewards of some actions."""
    observations = [env.reset(seed=seed)[0]]
    rewards = []
    for action in actions:
        observation, reward, *_ = env.step(np.array(action, dtype=np.float32))
        observations.append(observation)
        rewards.append(reward)
    return np.array(observations), rewards


@pytest.mark.parametrize("name", IDS)
def test_passes_the_checker_of_gymnasium(name: str) -> None:
    """Both environments are registered and pass `check_env`."""
    env = gymnasium.make(name)
    assert isinstance(env.unwrapped, IDS[name])
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_the_seed_determines_an_episode(short: Any) -> None:
    """The same seed gives the same numbers, another seed others, also after another episode."""
    actions = [[0.4, 0.0]] * 30 + [[0.0, 0.3]] * 10
    first, rewards = play(short, 7, actions)
    other, _ = play(short, 8, actions)
    again, rewards_again = play(short, 7, actions)
    assert np.array_equal(first, again) and rewards == rewards_again
    assert not np.array_equal(first, other)
    assert all(observation in short.observation_space for observation in first)


def test_truncates_at_the_end_and_needs_a_reset_then(short: Any) -> None:
    """An episode has its number of steps, each as long as asked for."""
    short.reset(seed=1)
    for count in range(1, short.steps + 1):
        *_, terminated, truncated, info = short.step(short.action_space.sample())
        assert not terminated and truncated == (count == short.steps)
        assert info["time_s"] == pytest.approx((count + 1) * short.step_s, abs=1e-3)
    with pytest.raises(gymnasium.error.ResetNeeded):
        short.step(short.action_space.sample())
    short.close()
    short.close()
    with pytest.raises(gymnasium.error.ResetNeeded):
        short.step(short.action_space.sample())


def test_the_device_plays_the_amplitudes_that_the_reward_charges(short: Any) -> None:
    """0 is silent; above, the share lies between threshold and limit, as telemetry shows."""
    table = short._points
    short.reset(seed=2)
    for action, share in (([1.0, 0.0], 1.0), ([0.5, 0.0], 0.5)):
        for _ in range(10):
            *_, info = short.step(np.array(action, dtype=np.float32))
        assert info["charge_uc"] == pytest.approx(
            sum(p.uc_per_unit * (p.threshold + share * (p.limit - p.threshold)) for p in table[0])
        )
        samples = short._device.record.samples
        for point in table[0]:
            wanted = point.threshold + share * (point.limit - point.threshold)
            played = samples[f"amplitude_{point.channel}_{short._unit}"][-1]
            assert played == pytest.approx(wanted, abs=0.002)
        for point in table[1]:
            assert math.isnan(samples[f"amplitude_{point.channel}_{short._unit}"][-1])


@pytest.mark.parametrize("action", [[math.nan, 0.0], [0.5], [0.1, 0.2, 0.3]])
def test_refuses_an_action_that_is_none(short: Any, action: list[float]) -> None:
    """A NaN or another number of elements is an error; values outside are clipped."""
    short.reset(seed=1)
    with pytest.raises(ValueError, match="two numbers"):
        short.step(np.array(action, dtype=np.float32))
    observation, *_ = short.step(np.array([2.0, -1.0], dtype=np.float32))
    assert list(observation[3:]) == [1.0, 0.0]


def test_refuses_an_unknown_option_and_impossible_fields(short: Any) -> None:
    """A mistake in the options of `reset` is named."""
    with pytest.raises(ValueError, match="no option 'law'"):
        short.reset(options={"law": "pid"})
    with pytest.raises(flexor.Refused):
        short.reset(options={"controller": {"no_such_field": 1}})
    with pytest.raises(flexor.Refused):
        short.reset(options={"body": {"stiffness_nm_per_rad": -1.0}})
    with pytest.raises(ValueError, match="step_s"):
        type(short)(step_s=0.0)
    with pytest.raises(ValueError, match="telemetry_ms"):
        type(short)(step_s=0.005)
    with pytest.raises(ValueError, match="the session has no"):
        type(short)("reciprocal")


def detaching(channel: int, after_s: float) -> Callable[[int], flexor.Limb]:
    """Return a maker of limbs of which an electrode comes off."""

    def make(seed: int) -> flexor.Limb:
        def limb(pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
            loads = dict.fromkeys(range(1, 11), 2000.0)
            if t_s > after_s:
                loads[channel] = math.inf
            return 60.0, loads

        return limb

    return make


def test_a_fault_terminates_and_costs_more_than_any_error() -> None:
    """The episode ends when the device ends stimulation, and this never pays."""
    env = FingerEnv(duration_s=2.0, limb=detaching(1, 1.0))
    env.reset(seed=1)
    action = np.array([1.0, 0.0], dtype=np.float32)
    for _count in range(env.steps):
        observation, reward, terminated, truncated, info = env.step(action)
        if terminated:
            break
    assert terminated and not truncated and info["fault"]
    assert observation in env.observation_space
    left = env.steps - _count
    assert reward == -(flexor.gym.FAULT_ERROR_DEG**2) * left
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(action)
    _, info = env.reset(seed=1)
    assert "fault" not in info
    env.close()


def test_the_devices_controllers_run_the_same_episode() -> None:
    """A controller on the device, in the same loop, tracks; charge and errors are comparable."""
    env = FingerEnv(duration_s=6.0)
    results = {
        "default": flexor.gym.run_episode(env, DeviceController(), seed=3, from_s=2.0),
        "pid": flexor.gym.run_episode(env, DeviceController("pid"), seed=3, from_s=2.0),
        "own": flexor.gym.run_episode(env, PidPolicy(), seed=3, from_s=2.0),
    }
    for result in results.values():
        assert result.fault is None and result.steps == env.steps
        assert result.rms_error_deg < 5.0
        assert 100.0 < result.charge_uc < 9.2 * env.steps
    again = flexor.gym.run_episode(env, DeviceController(), seed=3, from_s=2.0)
    assert again == results["default"]
    # In a loop of one's own, the controller gives the same.
    policy = DeviceController()
    observation, _ = env.reset(seed=3, options=policy.options())
    total, is_over = 0.0, False
    while not is_over:
        observation, reward, _, is_over, _ = env.step(policy(observation))
        total += reward
    assert total == results["default"].total_reward
    env.close()


def test_the_finger_equals_the_session_that_a_device_runs() -> None:
    """The device's controller sees in the environment what it sees without it."""
    env = FingerEnv(reference=lambda t_s: (45.0, 0.0), duration_s=2.0)
    policy = DeviceController("pid")
    observation, _ = env.reset(seed=5, options=policy.options())
    angles = []
    for _ in range(90):
        observation, *_ = env.step(policy(observation))
        angles.append(float(observation[0]))
    record = env._device.record  # type: ignore[union-attr]
    assert record is not None and record.simulated
    measured = [float(np.float32(value)) for value in record.samples["measured_deg"]]
    assert set(angles) <= set(measured)
    assert abs(angles[-1] - 45.0) < 3.0
    env.close()


def test_walls_in_python_and_on_the_device_hold_the_arm() -> None:
    """Both walls stop the arm, and without one it goes on."""
    env = WallEnv()
    on_device = flexor.gym.run_episode(env, DeviceController(), seed=4)
    own = flexor.gym.run_episode(env, WallPolicy(), seed=4)

    class Silent(WallPolicy):
        def __call__(self, observation: flexor.gym.Array) -> flexor.gym.Array:
            return np.zeros(2, dtype=np.float32)

    none = flexor.gym.run_episode(env, Silent(), seed=4)
    assert on_device.largest_error_deg < 8.0 and own.largest_error_deg < 8.0
    assert none.largest_error_deg > 20.0 and none.charge_uc == 0.0
    assert none.total_reward < min(on_device.total_reward, own.total_reward)
    damped = DeviceController(fields={"damping_s_per_deg": 0.5})
    assert flexor.gym.run_episode(env, damped, seed=4) != on_device
    env.close()


def test_a_snapshot_goes_on_alike_and_independently(short: Any) -> None:
    """A copy with the same actions has the same future; another future leaves the first alone."""
    actions = [[0.6, 0.0]] * 10
    play(short, 1, actions)
    twin, other = short.snapshot(), short.snapshot()
    strong, weak = (np.array(a, dtype=np.float32) for a in ([1.0, 0.0], [0.0, 0.0]))
    for _ in range(15):
        other.step(weak)
    for _ in range(15):
        mine, reward, *_ = short.step(strong)
        its, its_reward, *_ = twin.step(strong)
        assert np.array_equal(mine, its) and reward == its_reward
    assert short._device.time_s == pytest.approx(other._device.time_s, abs=1e-3)
    twin.close()
    other.close()


def test_vectors_of_environments_run() -> None:
    """Several environments run in one process and in several."""
    for mode in ("sync", "async"):
        envs = gymnasium.make_vec("flexor/Finger-v0", num_envs=2, vectorization_mode=mode)
        observations, _ = envs.reset(seed=1)
        assert observations.shape == (2, 5)
        for _ in range(3):
            observations, *_ = envs.step(envs.action_space.sample())
        assert np.isfinite(observations).all()
        envs.close()


def test_says_what_to_install_without_gymnasium(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The error names the extra."""
    import importlib
    import sys

    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "flexor.gym")
    with pytest.raises(ImportError, match=r"flexor-stim\[gym\]"):
        importlib.import_module("flexor.gym")
