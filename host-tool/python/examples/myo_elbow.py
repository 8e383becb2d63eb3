"""Do conclusions about walls and controllers hold on an elbow that Flexor did not write?

The limb is MyoElbow of MyoSuite (one joint, six muscles; PyPI `myo-sim`, Apache-2.0), simulated by
MuJoCo. Flexor's own simulated elbow runs the same trials beside it. Both are models: agreement is
no evidence about people.

    pip install 'flexor-stim[myo]'
    python myo_elbow.py

Preregistered, before the first run
-----------------------------------
The same on both limbs: recruitment between threshold and largest current (25 to 80 mA at 35 µs on
the triceps, 20 to 70 mA at 25 µs on the biceps, exponential with curvature 1.2), torque of full
recruitment at 90° (5 and 6 N·m), delay of 25 ms, noise of the sensor (0.02°), no gravity (Harris'
platform carries the arm), pulses at 50 Hz, and a wearer who moves at a speed and then leans on the
wall with 1.5 N·m beyond what holds the passive joint there. All of this is assumed, as it is for
Flexor's elbow (docs/reference/sessions.md). On MyoElbow, the recruited share of the last pulse,
scaled to the torque, is the excitation of all muscles of the group for 30 ms: an assumed map,
because MuJoCo's muscles know no pulses.

Different: dynamics of activation, force against length and velocity, moment arms, passive torque,
inertia, friction and the stops, which are MyoElbow's own and unchanged.

Compared, with the noise of seeds 1, 2 and 3 (the median counts):

1. Walls at 90°, stiffness 2 to 16 mA/°, damping 0, 0.05 and 0.1 s times the stiffness. An approach
   of 15°/s leans on the wall. *Rests*: at most 0.5° from peak to peak in the last 4 of 20 s.
   a. Without damping, stiff walls swing and soft ones rest, on both limbs.
   b. With each damping a stiffer wall rests than without, on both limbs.
   c. The stiffest wall that rests is the same on both limbs within a factor of 1.5, per damping.
2. Harris' wall (80 mA over 9°), approaches of 15 and 55°/s for 10 s: plain, with the pre-wall of 9°
   (20 to 80 mA), and with pre-wall and co-contraction (40 mA on the biceps). Each difference of the
   deepest penetration, and of the swing in the last 2 s, has the same sign on both limbs; less than
   0.1° is no difference.
3. Controllers with their default gains, 60 ± 20° at 0.2 Hz, RMS error from 10 to 30 s, wearer
   passive: the order of four controllers is the same on both limbs. *With file* is the default
   controller with a `[joint.wearer]` that has the limb's own rest angle, stiffness and torques.

One deviation, after the first run: in part 2 the wearer leans for 10 s instead of 5 s. MyoElbow
resists the wearer more and came to the wall 1.2 s later, so that the swing in the last 2 of 5 s
contained the approach. With 5 s, both differences of the swing from plain to pre-wall had the same
sign on both limbs at 15°/s (7.93 to 6.93° and 10.64 to 1.86°); nothing else was affected.
"""

from __future__ import annotations

import math
import statistics
import sys
from collections.abc import Iterable
from typing import Any

import flexor
import numpy as np

try:
    import mujoco
    import myo_sim
except ImportError as error:
    sys.exit(f"this example needs MuJoCo and MyoSim ({error}): pip install 'flexor-stim[myo]'")

SEEDS = (1, 2, 3)
WALL_DEG, LEAN_NM, START_DEG = 90.0, 1.5, 60.0
STIFFNESSES = (2.0, 2.8, 4.0, 5.6, 8.0, 11.2, 16.0)
DAMPINGS_S = (0.0, 0.05, 0.1)
HARRIS = 80.0 / 9.0
RESTS_DEG, SAME_DEG, LEANING_S = 0.5, 0.1, 10.0

TRICEPS, BICEPS = 1, 2
RANGES_MA = {TRICEPS: (25.0, 80.0), BICEPS: (20.0, 70.0)}
TORQUES_NM = {TRICEPS: 5.0, BICEPS: 6.0}
WIDTHS_US = {TRICEPS: 35, BICEPS: 25}
MUSCLES = {TRICEPS: ("TRIlong", "TRIlat", "TRImed"), BICEPS: ("BIClong", "BICshort", "BRA")}
CURVATURE, DELAY_S, HELD_S, NOISE_DEG = 1.2, 0.025, 0.03, 0.02
PERIOD_S = 0.002

# Motion of the wearer, as hal-sim's elbow: torque per rate, rise of the speed, return.
GAIN_NM_S_PER_RAD, ONSET_S, RETURN_DEG_PER_S, RETURN_PER_S = 30.0, 0.2, 30.0, 4.0

Approach = dict[str, float]


class MyoElbow:
    """MyoElbow under two channels, with a wearer who moves it."""

    model = mujoco.MjModel.from_xml_path(str(myo_sim.get_xml_path("myoelbow")))
    model.opt.gravity[:] = 0.0

    def __init__(self, seed: int, push_nm: float, approaches: Iterable[Approach] = ()) -> None:
        """Create an elbow at the start angle; `seed` determines the noise of its sensor."""
        self.random = np.random.default_rng(seed)
        self.push_nm = push_nm
        self.approaches = list(approaches)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[0] = math.radians(START_DEG)
        self.waiting: list[flexor.Pulse] = []
        self.shares = {TRICEPS: (0.0, -1.0), BICEPS: (0.0, -1.0)}
        self.muscles = {
            channel: [self.model.actuator(name).id for name in names]
            for channel, names in MUSCLES.items()
        }
        passive_nm = self.torque_nm(WALL_DEG, {})
        self.scales = {
            channel: TORQUES_NM[channel] / abs(self.torque_nm(WALL_DEG, {channel: 1}) - passive_nm)
            for channel in MUSCLES
        }

    def torque_nm(self, angle_deg: float, activations: dict[int, float]) -> float:
        """Return the torque of muscles at rest at an angle, N·m, flexion positive."""
        data = mujoco.MjData(self.model)
        data.qpos[0] = math.radians(angle_deg)
        for channel, activation in activations.items():
            data.act[self.muscles[channel]] = activation
        mujoco.mj_forward(self.model, data)
        return float(data.qfrc_actuator[0])

    def __call__(self, pulses: list[flexor.Pulse], t_s: float) -> float:
        """Advance by one period, and return the measured angle."""
        self.waiting += pulses
        while self.waiting and self.waiting[0].t_s + DELAY_S <= t_s:
            pulse = self.waiting.pop(0)
            self.shares[pulse.channel] = recruited(pulse), t_s
        for channel, (share, since_s) in self.shares.items():
            is_held = t_s - since_s <= HELD_S
            excitation = self.scales[channel] * share if is_held else 0.0
            self.data.ctrl[self.muscles[channel]] = excitation
        rate = float(self.data.qvel[0])
        wanted = GAIN_NM_S_PER_RAD * (self.intended_rad_per_s(t_s) - rate)
        self.data.qfrc_applied[0] = min(max(wanted, -self.push_nm), self.push_nm)
        mujoco.mj_step(self.model, self.data)
        noise_deg = NOISE_DEG * float(self.random.standard_normal())
        return math.degrees(float(self.data.qpos[0])) + noise_deg

    def intended_rad_per_s(self, t_s: float) -> float:
        """Return the speed that the wearer intends."""
        for approach in self.approaches:
            gone_s = t_s - approach["at_s"]
            if 0.0 <= gone_s < approach["for_s"]:
                u = min(gone_s / ONSET_S, 1.0)
                rise = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
                return rise * math.radians(approach["speed_deg_per_s"])
        way_deg = START_DEG - math.degrees(float(self.data.qpos[0]))
        speed = min(max(RETURN_PER_S * way_deg, -RETURN_DEG_PER_S), RETURN_DEG_PER_S)
        return math.radians(speed)

    def wearer(self) -> dict[str, float]:
        """Return `[joint.wearer]`: passive torque about the middle of the reference."""
        low, high = (self.torque_nm(angle, {}) for angle in (40.0, 80.0))
        stiffness = (low - high) / math.radians(40.0)
        rest_deg = 60.0 + math.degrees(self.torque_nm(60.0, {}) / stiffness)
        return {"rest_deg": round(rest_deg, 1), "stiffness_nm_per_rad": round(stiffness, 2)}


FLEXOR_WEARER = {"rest_deg": 70.0, "stiffness_nm_per_rad": 1.0}
LIMBS = ("Flexor", "MyoElbow")


def recruited(pulse: flexor.Pulse) -> float:
    """Return the recruited share of a pulse, 0 to 1; every pulse has the width of its range."""
    low, high = RANGES_MA[pulse.channel]
    x = min(max((pulse.amplitude - low) / (high - low), 0.0), 1.0)
    return math.expm1(CURVATURE * x) / math.expm1(CURVATURE)


def run(
    limb: str,
    seed: int,
    seconds: float,
    approaches: list[Approach],
    *,
    wall: dict[str, Any] | None = None,
    joint: dict[str, Any] | None = None,
) -> flexor.Record:
    """Run one trial on a limb, with a wall or a joint on the device."""
    own = None
    if limb == "MyoElbow":
        own = MyoElbow(seed, 0.0)
        passive_nm = -own.torque_nm(WALL_DEG, {})
    else:
        passive_nm = 1.0 * math.radians(WALL_DEG - FLEXOR_WEARER["rest_deg"])
    push_nm = LEAN_NM + passive_nm if approaches else 0.0
    if own is not None:
        own.push_nm, own.approaches = push_nm, approaches
    limits = flexor.Limits(rise_ms=1)
    with flexor.connect("sim:", seed=seed, limits=limits, limb=own, limb_period_s=PERIOD_S) as dev:
        for channel, (_, high) in RANGES_MA.items():
            offset_us = 10_000 * (channel - 1)
            train = flexor.Train(rate_hz=50, width_us=WIDTHS_US[channel], offset_us=offset_us)
            dev.channel(channel, train, limit_ma=high, start_ma=high)
        if wall is not None:
            dev.wall(at_deg=WALL_DEG, channel=TRICEPS, max=80.0, sensor="adc", **wall)
        if joint is not None:
            points = {
                c: {"channel": c, "threshold": t, "max": m} for c, (t, m) in RANGES_MA.items()
            }
            dev.joint(
                flexors=[points[BICEPS]],
                extensor=points[TRICEPS],
                sensor="adc",
                angle_max_deg=130.0,
                **joint,
            )
        dev.body(
            kind="elbow",
            triceps=TRICEPS,
            biceps=BICEPS,
            start_deg=START_DEG,
            push_nm=round(push_nm, 3),
            approaches=approaches,
        )
        dev.arm()
        dev.start()
        if joint is None:
            dev.wait(seconds)
        else:
            turn = 2 * math.pi * 0.2
            for t_s in dev.steps(seconds, 0.02):
                rate = 20 * turn * math.cos(turn * t_s)
                dev.set(angle_deg=60 + 20 * math.sin(turn * t_s), rate_deg_per_s=rate)
        record = dev.stop()
    assert record is not None
    return record


def swing_deg(record: flexor.Record, from_s: float, to_s: float) -> float:
    """Return the true angle's range within a time, °."""
    samples = record.samples
    within = samples["true_deg"][(samples["t_s"] >= from_s) & (samples["t_s"] <= to_s)]
    return float(within.max() - within.min())


def median(values: Iterable[float]) -> float:
    """Return the median over the seeds."""
    return statistics.median(values)


def compare_walls() -> list[tuple[str, bool]]:
    """Print which walls rest, and return what holds."""
    approach = [{"at_s": 1.0, "speed_deg_per_s": 15.0, "for_s": 60.0}]
    print("1. Swing in deg in the last 4 s, by stiffness in mA/deg; at most 0.5 rests")
    print(f"{'limb':<10}{'damping':>8}" + "".join(f"{s:>8.1f}" for s in STIFFNESSES))
    stiffest: dict[tuple[str, float], float] = {}
    softest_rests: dict[str, bool] = {}
    for limb in LIMBS:
        for damping_s in DAMPINGS_S:
            swings = []
            for stiffness in STIFFNESSES:
                wall = {
                    "stiffness_per_deg": stiffness,
                    "damping_s_per_deg": round(damping_s * stiffness, 6),
                }
                records = (run(limb, seed, 20.0, approach, wall=wall) for seed in SEEDS)
                swings.append(median(swing_deg(record, 16.0, 20.0) for record in records))
            resting = [s for s, d in zip(STIFFNESSES, swings, strict=True) if d <= RESTS_DEG]
            stiffest[limb, damping_s] = max(resting, default=0.0)
            if damping_s == 0.0:
                softest_rests[limb] = swings[0] <= RESTS_DEG and swings[-1] > RESTS_DEG
            print(f"{limb:<10}{damping_s:>6.2f} s" + "".join(f"{d:>8.2f}" for d in swings))
    print("stiffest wall that rests, mA/deg:")
    for limb in LIMBS:
        cells = (f"{stiffest[limb, d]:.1f} ({d:g} s)" for d in DAMPINGS_S)
        print(f"  {limb:<10}" + ", ".join(cells))
    helped = [all(stiffest[x, d] > stiffest[x, 0.0] for d in DAMPINGS_S[1:]) for x in LIMBS]
    return [
        ("1a stiff walls swing, soft ones rest", all(softest_rests.values())),
        ("1b with damping a stiffer wall rests", all(helped)),
        *(
            (f"1c same stiffest wall, damping {d:g} s", alike(*(stiffest[x, d] for x in LIMBS)))
            for d in DAMPINGS_S
        ),
    ]


def alike(first: float, second: float) -> bool:
    """Return whether two stiffnesses are the same within a factor of 1.5."""
    return max(first, second) <= 1.5 * min(first, second)


def sign(difference: float) -> str:
    """Return the sign of a difference in °."""
    return "same" if abs(difference) < SAME_DEG else "less" if difference < 0 else "more"


def compare_harris() -> list[tuple[str, bool]]:
    """Print penetration and swing of Harris' conditions, and return what holds."""
    pre = {"pre_wall": {"depth_deg": 9.0, "begin": 20.0, "end": 80.0}}
    co = {"co_contraction": {"channel": BICEPS, "amplitude": 40.0}}
    conditions: dict[str, dict[str, Any]] = {"plain": {}, "pre-wall": pre, "both": {**pre, **co}}
    approaches = [
        {"at_s": 1.0, "speed_deg_per_s": 15.0, "for_s": LEANING_S},
        {"at_s": 14.0, "speed_deg_per_s": 55.0, "for_s": LEANING_S},
    ]
    print("\n2. Harris' wall: deepest penetration / swing, deg, at 15 and 55 deg/s")
    print(f"{'limb':<10}{'condition':<10}{'15 deg/s':>16}{'55 deg/s':>16}")
    found: dict[str, dict[str, list[float]]] = {limb: {} for limb in LIMBS}
    for limb in LIMBS:
        for name, extra in conditions.items():
            wall = {"stiffness_per_deg": round(HARRIS, 3), **extra}
            records = [run(limb, seed, 26.0, approaches, wall=wall) for seed in SEEDS]
            row = []
            for end_s in (10.6, 23.6):
                deepest = (furthest_deg(r, end_s - LEANING_S, end_s) - WALL_DEG for r in records)
                swings = (swing_deg(r, end_s - 2, end_s) for r in records)
                row += [max(median(deepest), 0.0), median(swings)]
            found[limb][name] = row
            cells = "".join(f"{f'{d:.2f} / {s:.2f}':>16}" for d, s in (row[:2], row[2:]))
            print(f"{limb:<10}{name:<10}{cells}")
    verdicts = []
    names = ("deepest 15", "swing 15", "deepest 55", "swing 55")
    for before, after in (("plain", "pre-wall"), ("pre-wall", "both")):
        for index, name in enumerate(names):
            signs = [sign(found[x][after][index] - found[x][before][index]) for x in LIMBS]
            text = f"2 {before} to {after}, {name} deg/s: {signs[0]}, {signs[1]}"
            verdicts.append((text, signs[0] == signs[1]))
    return verdicts


def furthest_deg(record: flexor.Record, from_s: float, to_s: float) -> float:
    """Return the largest true angle within a time, °."""
    samples = record.samples
    within = (samples["t_s"] >= from_s) & (samples["t_s"] <= to_s)
    return float(samples["true_deg"][within].max())


def compare_controllers() -> list[tuple[str, bool]]:
    """Print the tracking errors of controllers, and return what holds."""
    print("\n3. RMS error in deg, 60 +/- 20 deg at 0.2 Hz (number of limit cycles)")
    laws: dict[str, dict[str, Any]] = {
        "default": {"law": "recommended"},
        "with file": {"law": "recommended"},
        "PID": {"law": "pid"},
        "paper's": {"law": "paper"},
    }
    orders = []
    print(f"{'limb':<10}" + "".join(f"{name:>16}" for name in laws))
    for limb in LIMBS:
        own = FLEXOR_WEARER if limb == "Flexor" else MyoElbow(1, 0.0).wearer()
        torques = {"flexion_nm": TORQUES_NM[BICEPS], "extension_nm": TORQUES_NM[TRICEPS]}
        errors = {}
        cells = ""
        for name, joint in laws.items():
            extra = {"wearer": {**own, **torques}} if name == "with file" else {}
            records = [run(limb, seed, 30.0, [], joint={**joint, **extra}) for seed in SEEDS]
            errors[name] = median(rms_deg(record) for record in records)
            cycles = max(sum("limit cycle" in e.text for e in record.events) for record in records)
            cells += f"{f'{errors[name]:.2f} ({cycles})':>16}"
        print(f"{limb:<10}{cells}")
        orders.append(sorted(errors, key=errors.__getitem__))
    return [(f"3 order: {' < '.join(orders[0])}", orders[0] == orders[1])]


def rms_deg(record: flexor.Record) -> float:
    """Return the RMS error from 10 to 30 s, °."""
    samples = record.samples
    scored = (samples["t_s"] >= 10.0) & (samples["t_s"] <= 30.0)
    errors = (samples["target_deg"] - samples["true_deg"])[scored]
    return float(np.sqrt((errors**2).mean()))


def main() -> None:
    """Run the comparison, and print what holds."""
    print("Flexor's elbow and MyoElbow: two models; no evidence about people\n")
    verdicts = compare_walls() + compare_harris() + compare_controllers()
    print("\nconclusion (on Flexor's elbow, on MyoElbow)")
    for text, holds in verdicts:
        print(f"  {text:<62}{'holds' if holds else 'does not hold'}")


if __name__ == "__main__":
    main()
