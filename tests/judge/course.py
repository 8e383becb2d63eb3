"""Simulates the output stage of one channel from its lines, DAC code and load.

Written from docs/reference/hardware.md. Uses small steps (Runge-Kutta, fourth order). The result is a
list of spans; nothing is switched within a span.
"""

import math
from dataclasses import dataclass

BANK_OF_CHANNEL = [0, 0, 1, 1, 2, 3, 3, 4, 4, 5]
FULL_CODE = 65535
ISOLATED, CATHODIC, ANODIC, GROUNDED = 0b00, 0b01, 0b10, 0b11
SIGN = {ISOLATED: 0, CATHODIC: -1, ANODIC: 1, GROUNDED: 0}
GIVES_BACK_US = 900  # grounding as long as this gives a charge back
EQUAL_US = 2  # phases of one pulse, as the interlock counts them


@dataclass
class Span:
    """A stretch of one channel in which nothing is switched."""

    start_us: int
    end_us: int
    sign: int = 0  # of the drive, 0: none
    grounded: bool = False
    charge: float = 0.0  # through the electrode, C, anodic positive
    peak_ma: float = 0.0
    volts: float = 0.0  # across the series capacitor at the start
    end_volts: float = 0.0
    # Fate of an excess charge on the capacitor: the part that remains at the end, and the
    # part that flowed through the electrode (negative: back).
    left: float = 1.0
    returned: float = 0.0
    lines_us: int = 0  # when the lines last changed


# Signals from the pins to the stage.


def lines_at_the_stage(case, channel):
    """[(t_us, state)] of a channel as its stage sees it, broken lines included."""
    stuck = [s for s in case["truth"]["stuck"] if s["channel"] == channel]
    pins = dict((t, word >> 2 * channel & 0b11) for t, word in case["trace"]["levels"])
    times = sorted(set(pins) | {s["from_us"] for s in stuck})
    seen, state, last = [], ISOLATED, ISOLATED
    for t in times:
        state = pins.get(t, state)
        arrives = state
        for s in stuck:
            if s["from_us"] <= t:
                bit = CATHODIC if s["line"] == "Cathodic" else ANODIC
                arrives = arrives | bit if s["high"] else arrives & ~bit
        if arrives != last:
            seen.append((t, arrives))
            last = arrives
    return seen


def supply_of(pump, hardware):
    """[(t_us, what, value)]: the pump on and off, and the high voltage behind it."""
    if pump == "Throughout":
        return [(0, "supply", True)]
    events, runs = [(0, "pump off", 0)], pump["Runs"]
    for this, following in zip(runs, runs[1:] + [None]):
        begin, end = this
        following_us = math.inf if following is None else following[0]
        events += [(begin, "supply", True), (end, "pump off", end)]
        if end + hardware["pump_hold_us"] <= following_us:
            events.append((end + hardware["pump_hold_us"], "supply", False))
    return events


def changes(case, channel):
    """Returns all inputs of a channel, sorted by time. At one instant the load comes first,
    then lines, code, comparator level and supply."""
    truth, trace = case["truth"], case["trace"]
    events = [(t, "load", ohm) for t, ohm in truth["channels"][channel]["loads"]]
    events += [(t, "lines", state) for t, state in lines_at_the_stage(case, channel)]
    events += [(w["t_us"], "code", w["code"]) for w in trace["dac"]
               if w["channel"] == channel]
    events += [(w["t_us"], "level", w["code"]) for w in trace["trips"]
               if w["bank"] == BANK_OF_CHANNEL[channel]]
    events += supply_of(case["pump"], truth["hardware"])
    return sorted((e for e in events if e[0] <= case["end_us"]), key=lambda e: e[0])


class Stage:
    """One stage with its load, through time, as a list of spans."""

    def __init__(self, case, channel, is_built):
        self.of = case["truth"]["channels"][channel]
        self.hardware = case["truth"]["hardware"]
        if is_built and self.hardware["logic"] != "Interlocked":
            raise ValueError("this judge supports only the interlock logic of docs/reference/hardware.md")
        self.channel, self.is_built, self.latched = channel, is_built, []
        self.now_us, self.volts = 0, 0.0
        self.lines, self.entered_us, self.counted_us = ISOLATED, 0, 0
        self.balance_us, self.latch, self.pump_off_us = 0, None, None
        self.code, self.ohm, self.supply = 0, None, not is_built
        self.level_ma = math.inf
        self.over_since_us = [None, None]
        self.spans = []
        for t_us, what, value in changes(case, channel):
            self.go_on(t_us)
            self.take(t_us, what, value)
            self.compare(t_us)
        self.go_on(case["end_us"])

    # Changes that the stage makes by itself.

    def go_on(self, to_us):
        while True:
            due_us, cause = self.due()
            if due_us > to_us:
                break
            self.spend(due_us)
            if cause == "Rested":
                self.latch, self.balance_us, self.counted_us = None, 0, due_us
            else:
                self.latch_for(due_us, cause)
            self.compare(due_us)
        self.spend(to_us)

    def due(self):
        """When a comparator or the one-shot ends it, the comparator first; or when pump and
        lines have rested together for so long that nothing is remembered."""
        if self.is_built and self.lines == ISOLATED and self.pump_off_us is not None:
            if self.latch or self.balance_us:
                since_us = max(self.pump_off_us, self.entered_us)
                return since_us + self.hardware["latch_clear_us"], "Rested"
        if not self.is_built or self.latch:
            return math.inf, None
        delays = (self.hardware["comparator_us"], self.hardware["bank_comparator_us"])
        trips = [since + delay for since, delay in zip(self.over_since_us, delays)
                 if since is not None]
        trip_us = min(trips, default=math.inf)
        held_us = math.inf
        if SIGN[self.lines]:
            held_us = self.entered_us + self.hardware["one_shot_us"]
        return (trip_us, "OverCurrent") if trip_us <= held_us else (held_us, "Held")

    def latch_for(self, t_us, cause):
        self.latch = cause
        self.latched.append({"t_us": t_us, "channel": self.channel, "cause": cause})

    def compare(self, t_us):
        current_ma = 1e3 * abs(self.current(self.volts)) if self.sign() else 0.0
        for k, level_ma in enumerate((self.of["trip_ma"], self.level_ma)):
            if current_ma <= level_ma:
                self.over_since_us[k] = None
            elif self.over_since_us[k] is None:
                self.over_since_us[k] = t_us

    # What is done to it.

    def take(self, t_us, what, value):
        if what == "lines":
            self.enter(t_us, value)
        elif what == "code":
            self.code = value
        elif what == "level":
            self.level_ma = self.hardware["bank_full_scale_ma"] * value / FULL_CODE
        elif what == "load":
            self.ohm = value
        elif what == "supply":
            self.supply = value or not self.is_built
            if value:
                self.pump_off_us = None
        elif what == "pump off":
            self.pump_off_us = value

    def enter(self, t_us, lines):
        """hardware.md, The stage's logic."""
        left_grounding_early = False
        if self.is_built and not self.latch:
            self.balance_us += SIGN[self.lines] * (t_us - self.counted_us)
            if self.lines == GROUNDED:
                if t_us - self.counted_us >= GIVES_BACK_US:
                    self.balance_us = 0
                else:
                    left_grounding_early = True
            owes = SIGN[lines] * self.balance_us > EQUAL_US
            owes |= left_grounding_early and abs(self.balance_us) > EQUAL_US
            if SIGN[lines] and owes:
                self.latch_for(t_us, "NotGivenBack")
        self.lines, self.entered_us, self.counted_us = lines, t_us, t_us

    # What flows.

    def state(self):
        return ISOLATED if self.latch or self.ohm is None else self.lines

    def sign(self):
        return SIGN[self.state()] if self.supply and self.code else 0

    def current(self, volts):
        """Amperes through the electrode with so much across the capacitor."""
        sign = self.sign()
        if not sign:
            return -volts / self.ohm if self.state() == GROUNDED else 0.0
        asked = self.code / FULL_CODE * (1.0 + self.of["mismatch"] if sign > 0 else 1.0)
        kind, stage = next(iter(self.of["stage"].items()))
        if kind == "Current":
            source_v, back_a = self.hardware["compliance_v"], 0.0
            most_a = 1e-3 * stage["full_scale_ma"] * asked
        else:
            source_v = stage["full_scale_v"] * asked
            most_a = back_a = 1e-3 * self.hardware["limiter_ma"]
        along = (source_v - sign * volts) / self.ohm
        return sign * max(-back_a, min(along, most_a))

    def spend(self, to_us):
        if to_us <= self.now_us:
            return
        span = Span(self.now_us, to_us, self.sign(), self.state() == GROUNDED)
        span.lines_us = self.entered_us
        span.volts, seconds = self.volts, 1e-6 * (to_us - self.now_us)
        if not self.is_built:
            amperes = self.current(0.0) if span.sign else 0.0
            span.charge, span.peak_ma = amperes * seconds, 1e3 * abs(amperes)
        else:
            begin_a = self.current(self.volts)
            if span.sign or span.grounded:
                self.steps(span, seconds)
            else:
                span.left = math.exp(-seconds / self.bleeds_s())
                self.volts *= span.left
            span.peak_ma = 1e3 * max(abs(begin_a), abs(self.current(self.volts)))
        span.end_volts = self.volts
        self.spans.append(span)
        self.now_us = to_us

    def bleeds_s(self):
        return self.hardware["capacitor_f"] * self.hardware["bleed_ohm"]

    def is_limited(self, volts):
        """Returns whether the source is at its limit, independently of the capacitor."""
        return bool(self.sign()) and self.current(volts) == self.current(volts + 1e-6)

    def slopes(self, volts, apart):
        """Returns the derivatives of the capacitor's voltage, the passed charge, the excess
        charge and its passed part. A source at its limit returns no excess charge."""
        amperes, capacitor_f = self.current(volts), self.hardware["capacitor_f"]
        through_load = 0.0
        if not self.is_limited(volts):
            through_load = apart / (self.ohm * capacitor_f)
        return (amperes / capacitor_f - volts / self.bleeds_s(), amperes,
                -apart / self.bleeds_s() - through_load, -through_load)

    def step(self, y, h, halvings=10):
        """Makes one step, which is halved while the source enters or leaves its limit."""
        k1 = self.slopes(y[0], y[2])
        k2 = self.slopes(y[0] + h / 2 * k1[0], y[2] + h / 2 * k1[2])
        k3 = self.slopes(y[0] + h / 2 * k2[0], y[2] + h / 2 * k2[2])
        k4 = self.slopes(y[0] + h * k3[0], y[2] + h * k3[2])
        after = tuple(y + h / 6 * (a + 2 * b + 2 * c + d)
                      for y, a, b, c, d in zip(y, k1, k2, k3, k4))
        if halvings and self.is_limited(y[0]) != self.is_limited(after[0]):
            middle = self.step(y, h / 2, halvings - 1)
            return self.step(middle, h / 2, halvings - 1)
        return after

    def steps(self, span, seconds):
        quick_s = self.ohm * self.hardware["capacitor_f"]
        count = max(8, math.ceil(10.0 * seconds / quick_s))
        y = (self.volts, 0.0, 1.0, 0.0)
        for _ in range(count):
            y = self.step(y, seconds / count)
        self.volts, span.charge, span.left, span.returned = y
