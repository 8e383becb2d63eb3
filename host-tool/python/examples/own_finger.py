"""A simulated finger of your own, in 40 lines, under the controllers of the device.

The limb is a first-order muscle per electrode, driven by pulses, and a joint of spring and damper.
Flexor's own simulated finger runs the same trial beside it. Simulation is never evidence about
people, and two models that agree are none either.

    python own_finger.py
"""

import math

import flexor

LAWS = {"recommended": "default controller", "pid": "PID controller", "paper": "paper's controller"}
SECONDS, SCORED_FROM_S, STEP_S = 20.0, 10.0, 0.02

# Amplitudes in V from threshold to full recruitment: participant P of Hamana 2022, table 7. The
# linear rise between them is assumed. Channels: flexor A, flexor B, extensor.
RANGES_V = {1: (20.0, 28.0), 2: (25.0, 36.0), 3: (14.0, 26.0)}
FLEXION_NM, EXTENSION_NM = 0.22, 0.15  # as Flexor's own finger, docs/reference/sessions.md
STIFFNESS, DAMPING = 0.12, 0.018  # N·m/rad and N·m·s/rad, likewise
REST_DEG, STOPS_DEG = 20.0, (0.0, 100.0)  # assumed
MUSCLE_S, DELAY_S = 0.1, 0.025  # time constant assumed; delay as Flexor's own finger
LOADS_OHM = dict.fromkeys(RANGES_V, 2000.0)  # assumed
PERIOD_S, PULSES_HZ = 0.001, 50.0
OFFSETS_US = {1: 0, 2: 2000, 3: 10_000}  # as in the session hamana_exp4_two_point_finger


class Finger:
    """Finger whose muscles forget exponentially and whose joint has no inertia."""

    def __init__(self) -> None:
        """Create a finger at rest."""
        self.angle_deg = REST_DEG
        self.activation = dict.fromkeys(RANGES_V, 0.0)
        self.waiting: list[flexor.Pulse] = []

    def __call__(self, pulses: list[flexor.Pulse], t_s: float) -> tuple[float, dict[int, float]]:
        """Advance by one period, and return the angle and the load of the electrodes."""
        self.waiting += pulses
        self.decay()
        while self.waiting and self.waiting[0].t_s + DELAY_S <= t_s:
            self.recruit(self.waiting.pop(0))
        flexion = FLEXION_NM * max(self.activation[1], self.activation[2])
        torque = flexion - EXTENSION_NM * self.activation[3]
        aim_deg = REST_DEG + math.degrees(torque / STIFFNESS)
        share = 1.0 - math.exp(-PERIOD_S * STIFFNESS / DAMPING)
        moved = self.angle_deg + share * (aim_deg - self.angle_deg)
        self.angle_deg = min(max(moved, STOPS_DEG[0]), STOPS_DEG[1])
        return self.angle_deg, LOADS_OHM

    def decay(self) -> None:
        """Let one period pass for the muscles."""
        for channel in self.activation:
            self.activation[channel] *= math.exp(-PERIOD_S / MUSCLE_S)

    def recruit(self, pulse: flexor.Pulse) -> None:
        """Raise the activation, so that full pulses at 50 Hz hold it at 1 on the average."""
        low, high = RANGES_V[pulse.channel]
        recruited = min(max((pulse.amplitude - low) / (high - low), 0.0), 1.0)
        self.activation[pulse.channel] += recruited / (MUSCLE_S * PULSES_HZ)


def set_up(dev: flexor.Device, law: str) -> None:
    """Set up two flexor points, an extensor, and the joint that the device controls."""
    for channel, (_, high) in RANGES_V.items():
        train = flexor.Train(rate_hz=PULSES_HZ, width_us=200, offset_us=OFFSETS_US[channel])
        dev.channel(channel, train, limit_v=high, start_v=high, full_scale_v=60)
    dev.group([1, 2], "conducted")
    points = [{"channel": c, "threshold": t, "max": m} for c, (t, m) in RANGES_V.items()]
    dev.joint(law=law, flexors=points[:2], extensor=points[2], sensor="adc")
    dev.body(kind="finger", participant="P", flexor_a=1, flexor_b=2, extensor=3)


def track(law: str, limb: flexor.Limb | None) -> tuple[float, float]:
    """Return RMS and largest error in ° of a sine, 45 ± 40° at 0.2 Hz.

    Without `limb`, Flexor's own finger tracks it.
    """
    turn = 2 * math.pi * 0.2
    with flexor.connect("sim:", limb=limb, limb_period_s=PERIOD_S) as dev:
        set_up(dev, law)
        dev.arm()
        dev.start()
        for t_s in dev.steps(SECONDS, STEP_S):
            rate = 40 * turn * math.cos(turn * t_s)
            dev.set(angle_deg=45 + 40 * math.sin(turn * t_s), rate_deg_per_s=rate)
        record = dev.stop()
    assert record is not None
    samples = record.samples
    scored = (samples["t_s"] >= SCORED_FROM_S) & (samples["t_s"] <= SECONDS)
    errors = abs(samples["target_deg"] - samples["true_deg"])[scored]
    return float((errors**2).mean() ** 0.5), float(errors.max())


def main() -> None:
    """Print the tracking errors of each controller on both fingers."""
    print("Error of a sine, 45 +/- 40 deg at 0.2 Hz, RMS (largest), deg; simulated fingers")
    print(f"{'controller':<20}{'own finger':>18}{'Flexor finger':>18}")
    for law, name in LAWS.items():
        results = (track(law, Finger()), track(law, None))
        cells = "".join(f"{f'{rms:.2f} ({largest:.2f})':>18}" for rms, largest in results)
        print(f"{name:<20}{cells}")


if __name__ == "__main__":
    main()
