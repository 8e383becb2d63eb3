#!/usr/bin/env python3
"""Requests a force at the hand from a device; a wearer file describes the arm.

    flexor serve --tcp 127.0.0.1:4242 &
    python3 docs/examples/hand.py tcp:127.0.0.1:4242 host-tool/wearers/arm-1.toml -2 3 2.5
    python3 docs/examples/hand.py --selftest         # check the test vectors

The numbers are newtons backward, to the right and upward, held for 2 s. The client sends
the arm's nine angles 50 times a second, as a sensor would (`measured`); here the arm is
still. The device refuses a force that the arm cannot exert; the client then requests the
nearest possible force. Needs Python 3.11. client.py encodes the messages,
docs/guides/endpoint_session.md describes them. A research instrument, not a medical device:
connect no electrodes to anyone while you try a client.
"""

import sys
import time
import tomllib

import client
from client import option, varint, vec, zigzag

AXES = (
    "sc_protraction sc_elevation sc_roll gh_flexion gh_abduction gh_rotation "
    "el_flexion el_bend el_pronation"
).split()
JOINTS = ["sternoclavicular", "glenohumeral", "elbow"]
SEGMENTS = ["thorax", "girdle", "upper-arm", "forearm"]

MEASUREMENT_TIME, TOO_STRONG, NO_MUSCLE_HELPS = 312, 317, 318
PERIOD_S = 0.02
# An older angle is a fault, because the arm may have moved. A busy computer is sometimes
# late by more than the 20 ms between measurements, as with HOST_TIMEOUT_MS. In a quarter of
# a second, an arm that moves at 60 degrees a second moves by 15 degrees.
STALE_MS = 250
HELD_S = 2.0

# --- messages that client.py does not encode, in the order of protocol.md's tables ---


def limb(c):
    ((kind, of),) = c["posture"].items()
    fixed = kind == "Fixed"
    return (
        b"".join(zigzag(um) for way in c["offsets_um"] for um in way)
        + b"".join(zigzag(mdeg) for axis in c["ranges_mdeg"] for mdeg in axis)
        + bytes([c["recruit_ms"]])
        + (b"\0" + b"".join(map(zigzag, of)) if fixed else b"\1" + varint(of["stale_after_ms"]))
    )


def line(c):
    via = lambda it: bytes([it["segment"]]) + b"".join(map(zigzag, it["at_um"]))
    return (
        bytes([c["channel"], JOINTS.index(c["joint"].lower())])
        + vec(via, c["vias"])
        + varint(c["gain_mn_per_ma"])
        + varint(c["threshold"])
        + varint(c["limit"])
    )


client.CONTENT |= {
    "Limb": limb,
    "Line": line,
    "Wrench": lambda c: option(varint, c["at"]) + b"".join(map(zigzag, c["force_mn"])),
}

# --- an arm ---


def whole(number, per_unit):
    return round(number * per_unit)


def limits_of(limits):
    """Returns the limits of a wearer file or a session, which has these six. The host timeout
    is at least that of client.py, because the file's may be too short for a busy computer."""
    return client.LIMITS | {
        "max_current_ua": whole(limits["max_current_ma"], 1000),
        "max_charge_nc": whole(limits["max_charge_uc"], 1000),
        "max_rms_ua": whole(limits["max_rms_ma"], 1000),
        "rise_ms": limits["rise_ms"],
        "fall_ms": limits["fall_ms"],
        "host_timeout_ms": max(limits["host_timeout_ms"], client.HOST_TIMEOUT_MS),
    }


def setup(wearer):
    """Returns the requests that configure the arm of a wearer file, by channel."""
    bones = wearer["limb"]
    yield "Wearer", limits_of(wearer["limits"])
    electrodes = {it["channel"]: it for it in wearer["electrode"]}
    lines = sorted(bones["line"], key=lambda it: it["channel"])
    for number, it in enumerate(lines):
        electrode = electrodes[it["channel"]]
        period_us = round(1e6 / electrode["frequency_hz"])
        train = {
            "shape": "BiphasicCathodicFirst",
            "width_us": electrode["width_us"],
            "max_width_us": electrode["width_us"],
            "gap_us": 50,
            "ground_us": 0,
            "period_us": period_us,
            "offset_us": number * period_us // len(lines),  # one after the other
            "burst_count": 1,
            "burst_interval_us": 0,
            "repeats": 0,
            "trigger": None,
            "lists": False,
        }
        stage = {"Current": {"full_scale_ua": 50_000}}
        limit = whole(electrode["limit"], 1000)
        start = whole(electrode.get("start", 0), 1000)
        spec = {"train": train, "stage": stage, "limit": limit, "start": start}
        spec["area_mm2"] = electrode["area_mm2"]
        yield "Channel", {"channel": it["channel"] - 1, "spec": spec}
    yield "Limb", {
        "offsets_um": [
            [whole(mm, 1000) for mm in bones[name]]
            for name in ("to_sc_mm", "to_gh_mm", "to_el_mm", "to_hand_mm")
        ],
        "ranges_mdeg": [[whole(deg, 1000) for deg in bones[axis + "_deg"]] for axis in AXES],
        "recruit_ms": 5,
        "posture": {"Measured": {"stale_after_ms": STALE_MS}},
    }
    for it in lines:
        electrode = electrodes[it["channel"]]
        yield "Line", {
            "channel": it["channel"] - 1,
            "joint": it["joint"],
            "vias": [
                {
                    "segment": SEGMENTS.index(via["segment"]),
                    "at_um": [whole(mm, 1000) for mm in via["at_mm"]],
                }
                for via in it["points"]
            ],
            "gain_mn_per_ma": whole(it["gain_n_per_unit"], 1000),
            "threshold": whole(electrode["motor_threshold"], 1000),
            "limit": whole(electrode["limit"], 1000),
        }


def measured(_t_s):
    """Angles of the arm, degrees. Put your sensors here; all others are 0."""
    return {"gh_flexion": 45, "gh_abduction": 30, "gh_rotation": 20, "el_flexion": 80}


class Live(client.Device):
    """A configured device that receives several requests at once."""

    def __init__(self, place, setup):
        super().__init__(place)
        self.hello()
        for name, content in setup:
            self.configure(name, **content)
        self.clock = None  # device time less ours, µs
        self.given = None

    def exchange(self, *requests):
        """Sends the requests at once and waits for every answer. Returns the refusals by index."""
        sent = time.monotonic_ns() // 1000
        numbers = [self.send(request) for request in requests]
        left, refusals = set(numbers), {}
        while left:
            message = self.receive(client.ANSWER_S)
            if message is None:
                raise TimeoutError(f"the device did not answer {requests[0]}")
            kind, content = message
            if kind == "Telemetry":
                self.given = content
            elif kind == "Event" and "Electrode" not in content["event"]:
                print(kind, content, flush=True)
            elif content.get("seq") in left:
                left.discard(content["seq"])
                if kind == "Ack":
                    self.set_clock(content["at"], sent, time.monotonic_ns() // 1000)
                else:
                    refusals[numbers.index(content["seq"])] = content["refusal"]
        return refusals

    def set_clock(self, at, sent, received):
        """Estimates device time minus computer time, which is between `least` and `most`. Keeps
        the largest lower bound: a late answer gives a smaller one."""
        least, most = at - received, at - sent
        # Above `most` if a simulator on a busy computer has lost time, or time has wrapped.
        if self.clock is None or not least <= self.clock <= most:
            self.clock = least

    def must(self, *requests):
        if refusals := self.exchange(*requests):
            raise RuntimeError(f"refused: {list(refusals.values())}")

    def now(self):
        """Returns a lower bound of the device time, µs."""
        return (time.monotonic_ns() // 1000 + self.clock) % 2**32

    def measurements(self, angles):
        """Returns the measurements of joint or axis 0, 1, …: its angle now, degrees."""
        now = self.now()
        return [
            {"Measurement": {"joint": n, "centideg": whole(deg, 100), "at": now}}
            for n, deg in enumerate(angles)
        ]


class Hand(Live):
    """A device that is configured with an arm."""

    def __init__(self, place, wearer):
        super().__init__(place, setup(wearer))
        self.names = {it["channel"] - 1: it["place"] for it in wearer["electrode"]}
        self.channels = sorted(it["channel"] - 1 for it in wearer["limb"]["line"])

    def wish(self, t_s, force_mn):
        """Sends the posture and requests a force. Returns the refusal, if there is one."""
        angles = measured(t_s)
        posture = self.measurements(angles.get(axis, 0) for axis in AXES)
        refusals = self.exchange(*posture, {"Wrench": {"at": None, "force_mn": force_mn}})
        refusal = refusals.pop(len(posture), None)
        # If the device clock was late, the next measurement follows in 20 ms.
        if others := [it for it in refusals.values() if it["code"] != MEASUREMENT_TIME]:
            raise RuntimeError(f"refused: {others}")
        return refusal

    def nearest(self, force_mn, refusal):
        """Prints why a force is refused, and returns the nearest possible force."""
        code = refusal["code"]
        permille = refusal["max"] if code == TOO_STRONG else 0
        nearest = [int(mn * permille / 1000) for mn in force_mn]
        if code == TOO_STRONG:
            why = f"{self.names[refusal['channel']]} is too weak: {permille / 10} % is possible"
        elif code == NO_MUSCLE_HELPS:
            why = "no muscle can contribute"
        else:
            raise RuntimeError(f"refused: {refusal}")
        print(f"E{code} {newtons(force_mn)}: {why}; the nearest force is {newtons(nearest)}", flush=True)
        return nearest

    def told(self):
        """Returns the last reported force and amplitudes as text."""
        wrench = self.given["wrench"]
        got = zip(self.channels, self.given["amplitudes"])
        got = [f"{self.names[n]} {ua / 1000} mA" for n, ua in got if ua]
        made = f"{wrench['achievable_permille'] / 10} % of {newtons(wrench['reference_mn'])}"
        return f"{made}: {', '.join(got) or 'no stimulation'}"


def newtons(force_mn):
    return str([mn / 1000 for mn in force_mn]) + " N"


def exert(place, path, force_n):
    with open(path, "rb") as file:
        hand = Hand(place, tomllib.load(file))
    force_mn = [whole(n, 1000) for n in force_n]
    hand.must({"Subscribe": {"period_ms": 50}})
    hand.must({"Arm": {"setup": client.setup_sum(hand.parts)}})
    if refusal := hand.wish(0, [0, 0, 0]):
        raise RuntimeError(f"refused: {refusal}")
    hand.must("Start")
    begin, step = time.monotonic(), 0
    try:
        while step * PERIOD_S < HELD_S:
            if refusal := hand.wish(step * PERIOD_S, force_mn):
                force_mn = hand.nearest(force_mn, refusal)
            step += 1
            if step % 25 == 0:
                print(hand.told(), flush=True)
            time.sleep(max(0.0, begin + PERIOD_S * step - time.monotonic()))
    finally:
        hand.must("Stop")


if __name__ == "__main__":
    if sys.argv[1:] == ["--selftest"]:
        client.selftest()
    elif len(sys.argv) == 6:
        exert(*sys.argv[1:3], [float(n) for n in sys.argv[3:]])
    else:
        sys.exit(__doc__)
