#!/usr/bin/env python3
"""A second, independent judge of the output at the electrodes.

Written from docs/evidence/faults.md (What is severe) and docs/reference/hardware.md (What each stage must
do, The stage's logic, Pump and over-current, The banks' comparators), independently of
`hal_sim::trace::judge`, to find mistakes in either. It uses another method: it first
simulates a channel with small steps (course.py), where the other judge solves exponentials,
and then applies the rules to the result, where the other judge does both at once.

Reads one case per line from standard input: a JSON object {trace, pump, truth, end_us}, as
serde writes the Rust types of these names. Prints one verdict per line: {as_built, bare},
each {findings, truncated, latched, direct_ua}. Uses the standard library only.
"""

import json
import math
import sys
from dataclasses import dataclass, field

from course import GIVES_BACK_US, Stage

CHANNELS = 10
SECOND_US = 1_000_000
COMMANDED_US = 500  # longest phase that may be commanded
ANY_US = 650  # longest phase at all
LONGEST_GAP_US = 200  # between the phases of one pulse
ALONE_US = 5_000  # if no second phase follows within this time, there is none
CURRENT_MARGIN = 1.05
DIRECT_UA = 1.0
TRUNCATED_UC = 65.0
BALANCED = 0.05  # of the greater phase


@dataclass
class Account:
    """Findings at one electrode."""

    channel: int
    findings: dict = field(default_factory=dict)
    truncated: list = field(default_factory=list)
    direct_ua: float = 0.0

    def find(self, rule, t_us, amount, limit):
        known = self.findings.get(rule)
        if known is None:
            self.findings[rule] = {"rule": rule, "channel": self.channel, "t_us": t_us,
                                   "amount": amount, "limit": limit, "count": 1}
            return
        known["count"] += 1
        if amount > known["amount"]:
            known["amount"], known["limit"] = amount, limit


# The rules, applied to the simulated course.


@dataclass
class Pulse:
    """One or two phases that belong together."""

    start_us: int
    end_us: int
    phase_us: int  # when its latest phase began
    sign: int  # of the latest phase
    phases: int = 1
    net: float = 0.0
    greatest: float = 0.0
    is_long: bool = False
    # Remaining initial charge of the capacitor up to span `at`, C.
    at: int = 0
    before: float = 0.0


class Rules:
    """Applies the rules to the course of one channel, in one pass."""

    def __init__(self, case, stage):
        self.case, self.stage, self.account = case, stage, Account(stage.channel)
        self.of = case["truth"]["channels"][stage.channel]
        stuck = case["truth"]["stuck"]
        self.faults = sorted(
            [f["t_us"] for f in case["truth"]["faults"]]
            + [s["from_us"] for s in stuck if s["channel"] == stage.channel])
        self.pulse, self.ungrounded_us = None, 0
        self.begun_us, self.samples, self.excused = [], [], []
        # Passed charge and excess charge up to span `at` and `sum_us` inside it, C.
        self.at, self.sum_us, self.passed, self.apart = 0, 0, 0.0, 0.0
        for span in stage.spans:
            limit = CURRENT_MARGIN * self.of["limit_ma"]
            if span.peak_ma > limit:
                self.account.find("Current", span.start_us, span.peak_ma, limit)
        end_us = case["end_us"]
        for kind, start_us, to_us, sign, first, end in self.course():
            self.rest(start_us)
            if kind == "phase":
                self.phase(start_us, to_us, sign, first, end)
            elif to_us < end_us:
                self.ungrounded_us = to_us
                if to_us - start_us >= GIVES_BACK_US:
                    if self.pulse:
                        self.pulse.net = 0.0
                    self.end_pulse(to_us)
        last = stage.spans[-1] if stage.spans else None
        if last and not last.grounded and not last.sign and self.rest(end_us):
            self.end_pulse(end_us)

    def course(self):
        """Returns phases and groundings; spans without a pause between them are joined."""
        joined = []
        for index, span in enumerate(self.stage.spans):
            kind = "phase" if span.sign else "ground" if span.grounded else None
            if not kind:
                continue
            last = joined[-1] if joined else None
            if last and last[:2] == [kind, span.sign] and last[3] == span.start_us:
                last[3], last[5] = span.end_us, index + 1
            else:
                joined.append([kind, span.sign, span.start_us, span.end_us, index, index + 1])
        return [(kind, a, b, sign, first, end) for kind, sign, a, b, first, end in joined]

    def rest(self, until_us):
        """Ends the pulse if it is over by then although nothing follows. Returns whether it
        was."""
        if self.pulse:
            wait_us = ALONE_US if self.pulse.phases == 1 else LONGEST_GAP_US + 1
            due_us = max(self.pulse.end_us, self.ungrounded_us) + wait_us
            put_off = self.pulse.phases == 1 and self.has_fault_by(due_us)
            if due_us <= until_us and not put_off:  # otherwise the next phase decides
                self.end_pulse(due_us)
            return due_us <= until_us
        return False

    def own_charge(self, pulse, first, end):
        """Returns the charge of these spans without the charge that the capacitor had before."""
        own = 0.0
        for index in range(pulse.at, end):
            span = self.stage.spans[index]
            if index >= first:
                own += span.charge - pulse.before * span.returned
            pulse.before *= span.left
        pulse.at = end
        return own

    def phase(self, start_us, end_us, sign, first, end):
        pulse = self.pulse
        is_second = pulse and pulse.phases == 1 and pulse.sign != sign
        is_late = pulse and start_us - pulse.start_us > COMMANDED_US + LONGEST_GAP_US
        if (pulse and pulse.sign == sign
                and self.stage.spans[first].lines_us <= pulse.phase_us):
            start_us = pulse.phase_us  # the latest phase continues after an interruption
        elif is_second and not is_late:
            pulse.phases, pulse.phase_us, pulse.sign = 2, start_us, sign
        elif is_second and self.has_fault_by(start_us):
            pulse.phases, pulse.phase_us, pulse.sign = 2, start_us, sign
            self.count(start_us)
        else:
            excused = len(self.excused)
            self.end_pulse(start_us)
            if (len(self.excused) > excused
                    and start_us - pulse.end_us <= LONGEST_GAP_US):
                # This may be the rest of that pulse, so no second is counted between them.
                self.samples.pop()
            pulse = self.pulse = Pulse(start_us, start_us, start_us, sign, at=first)
            pulse.before = self.stage.hardware["capacitor_f"] * self.stage.spans[first].volts
            self.count(start_us)
        lasted_us = end_us - start_us
        if lasted_us > ANY_US:
            self.account.find("AnyPhase", start_us, lasted_us, ANY_US)
        elif lasted_us > COMMANDED_US and not self.has_fault_by(end_us):
            self.account.find("CommandedPhase", start_us, lasted_us, COMMANDED_US)
        for quiet in self.case["truth"]["quiet"]:
            late_us, last_us = max(start_us, quiet["from_us"]), min(end_us, quiet["until_us"])
            if late_us < last_us:
                self.account.find("PastDeadline", late_us, last_us - quiet["from_us"], 0)
        charge = self.own_charge(pulse, first, end)
        pulse.end_us = end_us
        pulse.net += charge
        pulse.greatest = max(pulse.greatest, abs(charge))
        pulse.is_long |= lasted_us > COMMANDED_US

    def count(self, t_us):
        """Counts a pulse and checks the number of pulses within a second."""
        self.begun_us = [t for t in self.begun_us if t > t_us - SECOND_US] + [t_us]
        if len(self.begun_us) > self.of["pulses_per_s"]:
            self.account.find("Rate", t_us, len(self.begun_us), self.of["pulses_per_s"])

    def has_fault_by(self, t_us):
        return bool(self.faults) and self.faults[0] <= t_us

    def end_pulse(self, t_us):
        pulse, self.pulse = self.pulse, None
        if not pulse:
            return
        volts = self.sum_up(t_us)
        is_cut = abs(pulse.net) > BALANCED * pulse.greatest
        if is_cut and self.stage.is_built:
            self.apart += pulse.net
        if self.has_fault_by(t_us) and (is_cut or pulse.is_long):
            self.faults.pop(0)
            self.excused.append((t_us, pulse.net))
            self.account.truncated.append(
                {"t_us": pulse.start_us, "channel": self.account.channel,
                 "charge_uc": 1e6 * pulse.net})
            if abs(1e6 * pulse.net) > TRUNCATED_UC:
                self.account.find("TruncatedCharge", pulse.start_us,
                                  abs(1e6 * pulse.net), TRUNCATED_UC)
        held = 0.0
        if self.stage.is_built:
            held = self.stage.hardware["capacitor_f"] * volts - self.apart
        self.direct(t_us, held)

    def sum_up(self, t_us):
        """Sums the passed charge up to `t_us`. Returns the capacitor's voltage at that time."""
        spans, volts = self.stage.spans, 0.0
        while self.at < len(spans) and spans[self.at].start_us < t_us:
            span = spans[self.at]
            if span.end_us > t_us:  # at rest: only the bleed resistor acts
                kept = math.exp(-1e-6 * (t_us - self.sum_us) / self.stage.bleeds_s())
                self.apart *= kept if self.stage.is_built else 1.0
                self.sum_us = t_us
                since_s = 1e-6 * (t_us - span.start_us)
                return span.volts * math.exp(-since_s / self.stage.bleeds_s())
            if self.sum_us > span.start_us:
                kept = math.exp(-1e-6 * (span.end_us - self.sum_us) / self.stage.bleeds_s())
                self.apart *= kept if self.stage.is_built else 1.0
            else:
                self.passed += span.charge - self.apart * span.returned
                self.apart *= span.left
            self.sum_us, volts = span.end_us, span.end_volts
            self.at += 1
        return volts if self.at == 0 else spans[self.at - 1].end_volts

    def direct(self, t_us, held):
        """Checks the charge of the second before `t_us`, minus the charge that returns."""
        from_us = max(0, t_us - SECOND_US)
        before = [s for s in self.samples if s[0] <= from_us]
        then_us, then_passed, then_held = before[-1] if before else (0, 0.0, 0.0)
        keeps = 1.0
        if self.stage.is_built:
            keeps = math.exp(-1e-6 * (from_us - then_us) / self.stage.bleeds_s())
        sums = [self.passed - then_passed - (held - then_held * keeps)]
        for over_us, net in self.excused:  # with and without each excused charge
            if over_us > then_us:
                sums += [amperes - net for amperes in sums]
        amperes = min(sums, key=abs)
        self.samples = before[-1:] + [s for s in self.samples if s[0] > from_us]
        self.samples.append((t_us, self.passed, held))
        self.account.direct_ua = 1e6 * amperes
        if abs(1e6 * amperes) > DIRECT_UA:
            self.account.find("DirectCurrent", t_us, abs(1e6 * amperes), DIRECT_UA)


def judged(case, is_built):
    """Returns the findings of all electrodes."""
    stages = [Stage(case, channel, is_built) for channel in range(CHANNELS)]
    accounts = [Rules(case, stage).account for stage in stages]
    return {
        "findings": [f for a in accounts for f in a.findings.values()],
        "truncated": [t for a in accounts for t in a.truncated],
        "latched": [entry for stage in stages for entry in stage.latched],
        "direct_ua": [a.direct_ua for a in accounts],
    }


def main():
    for line in sys.stdin:
        case = json.loads(line)
        verdict = {"as_built": judged(case, True), "bare": judged(case, False)}
        print(json.dumps(verdict), flush=True)


if __name__ == "__main__":
    main()
