#!/usr/bin/env python3
"""A client for a game engine: two hands grab an object, carry it to shelves and release it.

    flexor serve --tcp 127.0.0.1:4242 &
    python3 docs/examples/lift.py tcp:127.0.0.1:4242 host-tool/sessions/lift.toml
    python3 docs/examples/lift.py tcp:127.0.0.1:4242 host-tool/sessions/lift.toml low forget
    python3 docs/examples/lift.py --selftest         # check the test vectors

`high`, `middle` and `low` are shelves that only this client knows; the device receives four
angles and whether the object is held, 100 times a second. `forget` does not report that the
object was released; `fall` drops it on the way up. Without any of them, the client does all
five. Limits, channels and quartics come from the session file. Its `angles` and `setpoints`
are not used: here `moved` computes the angles. A busy computer is sometimes late; tolerated
are HOST_TIMEOUT_MS of client.py and STALE_MS of hand.py, unless the file has larger values.
Needs Python 3.11. client.py encodes the messages, docs/guides/lift.md describes them. A research
instrument, not a medical device: connect no electrodes to anyone while you try a client.
"""

import sys
import time
import tomllib

import client
import hand
from client import option, varint, zigzag
from hand import whole

# Angles of elbow and shoulder, degrees, from the example of docs/evidence/buatier.md: at the table, and
# above and on each shelf.
TABLE = (61.0, 18.0)
SHELVES = {
    "high": ((87.0, 70.0), (64.0, 74.0)),
    "middle": ((97.0, 48.0), (72.0, 55.0)),
    "low": ((97.0, 29.0), (68.0, 42.0)),
}
FORGET, FALL = "forget", "fall"
JOINTS = "left-elbow left-shoulder right-elbow right-shoulder".split()
PERIOD_S, UP_S, DOWN_S, REST_S = 0.01, 1.2, 0.8, 0.2
FAULT_LATCHED, HOLD_OVER = 306, 322

# --- messages that client.py does not encode, in the order of protocol.md's tables ---


def quartic(coefficients):
    return b"".join(map(zigzag, coefficients))


def muscle(c):
    form = c["form"]
    return (
        bytes([c["channel"]])
        + varint(c["base"])
        + (b"\0" if form == "Scaled" else b"\1" + varint(form["AboveThreshold"]["threshold"]))
        + option(quartic, c["lift"])
        + option(quartic, c["drop"])
    )


def modulation(c):
    return (
        bytes([c["joint"], c["phase_joint"]])
        + varint(c["dead_band_centideg_per_s"])
        + varint(c["cutoff_mhz"])
        + zigzag(c["angle_min_mdeg"])
        + zigzag(c["angle_max_mdeg"])
        + varint(c["stale_after_ms"])
        + varint(c["max_hold_ms"])
        + muscle(c["flexor"])
        + muscle(c["extensor"])
    )


client.CONTENT |= {"Modulation": modulation, "ObjectHeld": lambda c: bytes([c["held"]])}

# --- two arms ---


def through(values):
    """Returns the quartic through five values of a session, in millionths (docs/protocol.md)."""
    a, b, c, d, e = (whole(value, 1_000_000) for value in values)
    rounded = lambda total, by: (total + by // 2) // by
    return [
        a,
        rounded(-13 * a + 48 * b - 36 * c + 16 * d - 3 * e, 12),
        rounded(13 * a - 64 * b + 120 * c - 64 * d + 13 * e, 18),
        rounded(-3 * a + 16 * b - 36 * c + 48 * d - 13 * e, 12),
        e,
    ]


def muscles_of(it):
    """Returns flexor and extensor of a session's joint; the mode decides their shares."""
    lift, drop = (it.get(name) and through(it[name]) for name in ("lift", "drop"))
    resists = it.get("mode") == "resist"
    shares = [(None, drop), (lift, None)] if resists else [(lift, None), (None, drop)]
    for name, (lift, drop) in zip(("flexor", "extensor"), shares):
        own = it[name]
        form = "Scaled"
        if own.get("form") == "above-threshold":
            form = {"AboveThreshold": {"threshold": whole(own["threshold"], 1000)}}
        base = whole(own["base"], 1000)
        yield {"channel": own["channel"] - 1, "base": base, "form": form, "lift": lift, "drop": drop}


def setup(session):
    """The requests that configure a session's channels and joints."""
    yield "Wearer", hand.limits_of(session["wearer"])
    for it in session["channel"]:
        own, stage = it["train"], it["stage"]
        words = own["shape"].split("-")
        train = {
            "shape": "".join(word.capitalize() for word in words),
            "width_us": own["width_us"],
            "max_width_us": own["width_us"],
            "gap_us": own["gap_us"],
            "ground_us": 0,
            "period_us": own["period_us"],
            "offset_us": own["offset_us"],
            "burst_count": 1,
            "burst_interval_us": 0,
            "repeats": 0,
            "trigger": None,
            "lists": False,
        }
        stage = {"Current": {"full_scale_ua": whole(stage["full_scale_ma"], 1000)}}
        limit, area = whole(it["limit"], 1000), it.get("area_mm2", 800)
        start = whole(it.get("start", 0), 1000)
        spec = {"train": train, "stage": stage, "limit": limit, "start": start, "area_mm2": area}
        yield "Channel", {"channel": it["number"] - 1, "spec": spec}
    for it in session["modulation"]:
        joint = JOINTS.index(it["joint"])
        flexor, extensor = muscles_of(it)
        yield "Modulation", {
            "joint": joint,
            "phase_joint": joint // 2 * 2,  # the elbow of its arm
            "dead_band_centideg_per_s": whole(it.get("dead_band_deg_per_s", 8), 100),
            "cutoff_mhz": whole(it.get("cutoff_hz", 2), 1000),
            "angle_min_mdeg": whole(it["angle_min_deg"], 1000),
            "angle_max_mdeg": whole(it["angle_max_deg"], 1000),
            "stale_after_ms": it.get("stale_after_ms", hand.STALE_MS),
            "max_hold_ms": whole(it.get("longest_hold_s", 30), 1000),
            "flexor": flexor,
            "extensor": extensor,
        }


def moved(start, end, part):
    """Returns elbow and shoulder on a minimum-jerk path. Put your encoder readings here."""
    part = part**3 * (10 + part * (6 * part - 15))
    return [a + part * (b - a) for a, b in zip(start, end)]


class Hands(hand.Live):
    """A device that is configured with two arms, and the angles of the arms."""

    def __init__(self, place, session):
        super().__init__(place, setup(session))
        self.names = {it["number"] - 1: it["name"] for it in session["channel"]}
        self.longest_s = min(it.get("longest_hold_s", 30) for it in session["modulation"])
        self.at, self.due = TABLE, 0.0

    def frame(self, held):
        """Sends one frame of the engine: four angles, and whether the object is held. Returns
        the number of the refusal if the device refuses the latter."""
        told = self.measurements([*self.at, *self.at])  # both arms alike
        refusals = self.exchange(*told, {"ObjectHeld": {"held": held}})
        refusal = refusals.pop(len(told), None)
        # If the device clock was late, the next measurement follows in 10 ms.
        if others := [it for it in refusals.values() if it["code"] != hand.MEASUREMENT_TIME]:
            raise RuntimeError(f"refused: {others}")
        self.due = max(self.due, time.monotonic()) + PERIOD_S
        time.sleep(self.due - time.monotonic())
        return refusal["code"] if refusal else None

    def must_frame(self, held):
        if code := self.frame(held):
            raise RuntimeError(f"E{code}: the device does not accept that the object is held")

    def move(self, end, seconds, held):
        start, begin = self.at, time.monotonic()
        while self.at != end:
            part = min(1.0, (time.monotonic() - begin) / seconds)
            self.at = moved(start, end, part) if part < 1 else end
            self.must_frame(held)

    def tell(self, where):
        """Prints the amplitudes that the device last reported."""
        given = zip(sorted(self.names), self.given["amplitudes"])
        given = [f"{self.names[n]} {ua / 1000} mA" for n, ua in given if ua]
        hold = self.given["lift"]["hold"].lower()
        elbow, shoulder = self.at
        where += f" at {elbow:g} and {shoulder:g} degrees ({hold})"
        print(f"{where}: {', '.join(given) or 'no stimulation'}", flush=True)

    def rest(self, held, where):
        until = time.monotonic() + REST_S
        while time.monotonic() < until:
            self.must_frame(held)
        self.tell(where)

    # --- actions of the hands; each begins and ends at the table ---

    def carry(self, shelf):
        above, on = SHELVES[shelf]
        self.move(above, UP_S, True)
        self.rest(True, f"above the {shelf} shelf")
        self.move(on, DOWN_S, True)
        self.rest(True, f"on the {shelf} shelf")
        self.rest(False, "released")

    def forget(self):
        """The engine misses the release of the object; the device ends the hold by itself."""
        self.move(SHELVES["low"][0], UP_S, True)
        # By the device's clock: a simulator on a busy computer is slower than ours.
        end, code = self.now() + round(1e6 * (self.longest_s + 1)), None
        while code is None and 0 < (end - self.now()) % 2**32 < 2**31:
            code = self.frame(True)
        if code != HOLD_OVER:
            raise RuntimeError(f"E{code}: expected E{HOLD_OVER}")
        print(f"E{code}: the object was held for longer than {self.longest_s} s; release it first")
        self.rest(False, "released")
        self.rest(True, "grabbed again")
        self.rest(False, "released")

    def fall(self):
        """Both hands open on the way up."""
        half = moved(TABLE, SHELVES["high"][0], 0.5)
        self.move(half, UP_S / 2, True)
        self.tell("on the way up")
        self.move(SHELVES["high"][0], UP_S / 2, False)
        self.tell("dropped")

    def do(self, what):
        {FORGET: self.forget, FALL: self.fall}.get(what, lambda: self.carry(what))()
        self.move(TABLE, UP_S, False)


def play(place, path, deeds):
    with open(path, "rb") as file:
        session = tomllib.load(file)
    if "modulation" not in session:
        raise SystemExit(f"{path} has no [[modulation]]: use host-tool/sessions/lift.toml")
    hands = Hands(place, session)
    hands.must({"Subscribe": {"period_ms": 20}})
    refused = hands.exchange({"Arm": {"setup": client.setup_sum(hands.parts)}}).get(0)
    if refused and refused["code"] == FAULT_LATCHED:
        fault = refused["min"]
        raise RuntimeError(f"E306: fault {fault} is latched: find its cause, then send `Acknowledge`")
    if refused:
        raise RuntimeError(f"refused: {refused}")
    hands.must(*hands.measurements([*TABLE, *TABLE]), {"ObjectHeld": {"held": False}})
    hands.must("Start")
    try:
        for deed in deeds:
            hands.do(deed)
    finally:
        hands.must("Stop")


if __name__ == "__main__":
    known = [*SHELVES, FORGET, FALL]
    if sys.argv[1:] == ["--selftest"]:
        client.selftest()
    elif len(sys.argv) < 3:
        sys.exit(__doc__)
    elif strange := [deed for deed in sys.argv[3:] if deed not in known]:
        sys.exit(f"no shelf or action {', '.join(strange)}; choose from {', '.join(known)}")
    else:
        try:
            play(*sys.argv[1:3], sys.argv[3:] or known)
        except (OSError, RuntimeError, tomllib.TOMLDecodeError) as error:
            sys.exit(str(error))
        except KeyboardInterrupt:
            sys.exit(130)
