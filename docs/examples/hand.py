#!/usr/bin/env python3
"""A force at the hand, asked for live: whose arm it is says a wearer file.

    flexor serve --tcp 127.0.0.1:4242 &
    python3 docs/examples/hand.py tcp:127.0.0.1:4242 host-tool/wearers/arm-1.toml -2 3 2.5
    python3 docs/examples/hand.py --selftest         # against the vectors

Newtons backward, to the right and upward, held for 2 s. The arm's nine angles are told 50
times a second as a sensor on it would (`measured`): here it is still. What cannot be made
is refused by the device; the nearest force that can be made is asked for instead. Python
3.11; bytes are client.py's, docs/endpoint_session.md has the rest. A research instrument,
not a medical device: no electrodes on anyone while you try a client.
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
# An older angle is a fault: the arm is no longer where it was. As with HOST_TIMEOUT_MS a
# busy computer is late at times, by more than the 20 ms from one measurement to the next;
# within a quarter of a second an arm that moves at 60 degrees a second has gone 15.
STALE_MS = 250
HELD_S = 2.0

# --- what client.py does not say: the order is that of protocol.md's tables ---


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
    """The limits of a wearer file or a session, which says these six. Host silence may be as
    long as client.py says, whatever the file has: that is for a program that is never kept
    waiting."""
    return client.LIMITS | {
        "max_current_ua": whole(limits["max_current_ma"], 1000),
        "max_charge_nc": whole(limits["max_charge_uc"], 1000),
        "max_rms_ua": whole(limits["max_rms_ma"], 1000),
        "rise_ms": limits["rise_ms"],
        "fall_ms": limits["fall_ms"],
        "host_timeout_ms": max(limits["host_timeout_ms"], client.HOST_TIMEOUT_MS),
    }


def setup(wearer):
    """The requests that configure a wearer file's arm; by channel, whose muscle it is."""
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
    """A device that was told of a setup and gets several requests at once."""

    def __init__(self, place, setup):
        super().__init__(place)
        self.hello()
        for name, content in setup:
            self.configure(name, **content)
        self.clock = None  # device time less ours, µs
        self.given = None

    def exchange(self, *requests):
        """Sends these at once and waits for every answer; the refusals, by number."""
        sent = time.monotonic_ns() // 1000
        numbers = [self.send(request) for request in requests]
        left, refusals = set(numbers), {}
        while left:
            message = self.receive(client.ANSWER_S)
            if message is None:
                raise TimeoutError(f"no answer to {requests[0]}")
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
        """Device time less ours lies between these two. The latest that it is sure to be is
        kept: an answer that was read late says less, and must make no measurement older."""
        least, most = at - received, at - sent
        # Above the most if a simulator on a busy computer has lost time, or time wrapped.
        if self.clock is None or not least <= self.clock <= most:
            self.clock = least

    def must(self, *requests):
        if refusals := self.exchange(*requests):
            raise RuntimeError(f"refused: {list(refusals.values())}")

    def now(self):
        """Device time, µs, at least: never in the future."""
        return (time.monotonic_ns() // 1000 + self.clock) % 2**32

    def measurements(self, angles):
        """Of joint or axis 0, 1, … its angle now, degrees."""
        now = self.now()
        return [
            {"Measurement": {"joint": n, "centideg": whole(deg, 100), "at": now}}
            for n, deg in enumerate(angles)
        ]


class Hand(Live):
    """A device that was told of an arm."""

    def __init__(self, place, wearer):
        super().__init__(place, setup(wearer))
        self.names = {it["channel"] - 1: it["place"] for it in wearer["electrode"]}
        self.channels = sorted(it["channel"] - 1 for it in wearer["limb"]["line"])

    def wish(self, t_s, force_mn):
        """Tells the posture, asks for a force; its refusal, if it was refused."""
        angles = measured(t_s)
        posture = self.measurements(angles.get(axis, 0) for axis in AXES)
        refusals = self.exchange(*posture, {"Wrench": {"at": None, "force_mn": force_mn}})
        refusal = refusals.pop(len(posture), None)
        # A device whose clock was late is measured again in 20 ms.
        if others := [it for it in refusals.values() if it["code"] != MEASUREMENT_TIME]:
            raise RuntimeError(f"refused: {others}")
        return refusal

    def nearest(self, force_mn, refusal):
        """Says why a force is refused, and which is the nearest that can be made."""
        code = refusal["code"]
        permille = refusal["max"] if code == TOO_STRONG else 0
        nearest = [int(mn * permille / 1000) for mn in force_mn]
        if code == TOO_STRONG:
            why = f"{self.names[refusal['channel']]} is too weak: {permille / 10} % can be made"
        elif code == NO_MUSCLE_HELPS:
            why = "no muscle helps"
        else:
            raise RuntimeError(f"refused: {refusal}")
        print(f"E{code} {newtons(force_mn)}: {why}; the nearest is {newtons(nearest)}", flush=True)
        return nearest

    def told(self):
        """What the device last said that it gives."""
        wrench = self.given["wrench"]
        got = zip(self.channels, self.given["amplitudes"])
        got = [f"{self.names[n]} {ua / 1000} mA" for n, ua in got if ua]
        made = f"{wrench['achievable_permille'] / 10} % of {newtons(wrench['reference_mn'])}"
        return f"{made}: {', '.join(got) or 'nothing'}"


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
