#!/usr/bin/env python3
"""A Flexor client that uses only the standard library: one channel, 2 s at 50 Hz.

    flexor serve --tcp 127.0.0.1:4242 &
    python3 docs/examples/client.py tcp:127.0.0.1:4242
    python3 docs/examples/client.py /dev/ttyACM0       # Linux, macOS
    python3 docs/examples/client.py --selftest         # check the test vectors

docs/protocol.md explains every byte. A research instrument, not a medical
device: connect no electrodes to anyone while you try a client.
"""

import json
import os
import pathlib
import select
import socket
import sys
import time
import zlib

SCHEMA = 0xE8584DF5BD877683  # docs/protocol.md, "Schema hash"
ANSWER_S = 2.0  # a device answers within milliseconds, a busy computer hears it later
# A device ends stimulation when its host is silent for this time. On a busy computer, a
# program like this one is sometimes delayed by 0.1 s and more. If the client dies,
# stimulation continues for this time, unchanged and within the limits below.
HOST_TIMEOUT_MS = 500
SESSION_TAKEN = 112

# --- postcard: types are functions (encode) and methods of Reader (decode) ---


def varint(n):
    out = bytearray()
    while n > 0x7F:
        out.append(n & 0x7F | 0x80)
        n >>= 7
    out.append(n)
    return bytes(out)


def zigzag(n):
    return varint(2 * n if n >= 0 else -2 * n - 1)


def option(encode, value):
    return b"\0" if value is None else b"\1" + encode(value)


def vec(encode, items):
    return varint(len(items)) + b"".join(map(encode, items))


class Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def u8(self):
        self.at += 1
        return self.data[self.at - 1]

    def varint(self):
        value = shift = 0
        while True:
            byte = self.u8()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def zigzag(self):
        n = self.varint()
        return n >> 1 if n % 2 == 0 else -(n >> 1) - 1

    def bool(self):
        return self.u8() == 1

    def str(self):
        length = self.varint()
        self.at += length
        return self.data[self.at - length : self.at].decode()

    def option(self, decode):
        return decode() if self.u8() else None

    def vec(self, decode):
        return [decode() for _ in range(self.varint())]


# --- frames: COBS(message ++ CRC-32) ++ 00 ---


def cobs(data):
    out, run = bytearray(), bytearray()
    for byte in data + b"\0":  # the added zero ends the last run
        if byte:
            run.append(byte)
            if len(run) == 254:
                out += b"\xff" + run
                run.clear()
        else:
            out += bytes([len(run) + 1]) + run
            run.clear()
    return bytes(out)


def uncobs(data):
    out, at = bytearray(), 0
    while at < len(data):
        code = data[at]
        if code == 0 or at + code > len(data):
            raise ValueError("the frame is not valid COBS")
        out += data[at + 1 : at + code]
        at += code
        if code < 0xFF and at < len(data):
            out.append(0)
    return bytes(out)


def frame(message):
    return cobs(message + zlib.crc32(message).to_bytes(4, "little")) + b"\0"


def unframe(data):
    body = uncobs(data)
    message, crc = body[:-4], body[-4:]
    if len(body) < 4 or zlib.crc32(message).to_bytes(4, "little") != crc:
        raise ValueError("the frame has a wrong CRC")
    return message


# --- messages: the same shape as in protocol_vectors.json ---

REQUESTS = (
    "Hello KeepAlive Status Clear Wearer Channel Groups Sync Muscle Joint Arm "
    "Start Stop Acknowledge Amplitudes Angle Measurement Subscribe Wall "
    "ForceControl Force MuscleLevel SimulateTrigger StoreStages Pulses Limb Line Wrench "
    "Modulation ObjectHeld EnterBootLoader"
).split()
# Requests of a setup, whose bytes count in its checksum.
SETUP = (
    "Wearer Channel Groups Sync Muscle Joint Wall ForceControl Limb Line Modulation"
).split()
SHAPES = (
    "BiphasicCathodicFirst BiphasicAnodicFirst MonophasicCathodic "
    "MonophasicAnodic"
).split()
TRIGGERS = "Start Toggle Gated".split()


def channel(c):
    train, stage = c["spec"]["train"], c["spec"]["stage"]
    ((kind, of),) = stage.items()
    numbers = "width_us max_width_us gap_us ground_us period_us offset_us".split()
    return (
        bytes([c["channel"]])
        + varint(SHAPES.index(train["shape"]))
        + b"".join(varint(train[name]) for name in numbers)
        + bytes([train["burst_count"]])
        + varint(train["burst_interval_us"])
        + varint(train["repeats"])
        + option(lambda mode: varint(TRIGGERS.index(mode)), train["trigger"])
        + bytes([train["lists"]])
        + varint(["Current", "Voltage"].index(kind))
        + b"".join(map(varint, of.values()))  # in the order of the table
        + varint(c["spec"]["limit"])
        + varint(c["spec"]["start"])
        + varint(c["spec"]["area_mm2"])
    )


# The wearer's limits, in the order of protocol.md's table.
# Values of `Clear`, in the order of `WearerSpec`.
WEARER_DEFAULTS = (
    [100_000, 40_000, 50_000, 500, 50, 100, 200_000, 50_000, 2_500, False, 1]
    + [86_400, 4_320_000, 100_000, 100_000]
)
LIMITS = {
    "max_current_ua": 20_000,
    "max_charge_nc": 4_000,
    "max_rms_ua": 10_000,
    "rise_ms": 500,
    "fall_ms": 50,
    "host_timeout_ms": HOST_TIMEOUT_MS,
    "max_sum_ua": 200_000,
    "max_sum_rms_ua": 50_000,
    "return_area_mm2": 2_500,
    "hand_stop_required": False,
    "rise_bursts": 1,
    "max_session_s": 86_400,
    "max_dose_mc": 4_320_000,
    "max_step_ua": 100_000,
    "max_step_ua_per_s": 100_000,
}

# Requests that this client can encode; protocol.md has tables of all requests.
CONTENT = {
    "Hello": lambda c: varint(c["schema"]),
    "Wearer": lambda c: b"".join(varint(c[name]) for name in LIMITS),
    "Channel": channel,
    "Sync": lambda c: option(lambda n: bytes([n]), c["channel"]),
    "Amplitudes": lambda c: option(varint, c["at"])
    + varint(c["mask"])
    + vec(varint, c["values"])
    + vec(varint, c["widths"]),
    "Pulses": lambda c: bytes([c["channel"]])
    + vec(
        lambda pulse: varint(pulse["after_us"])
        + varint(pulse["amplitude"])
        + varint(pulse["width_us"]),
        c["pulses"],
    ),
    "Arm": lambda c: varint(c["setup"]),
    "Angle": lambda c: option(varint, c["at"])
    + zigzag(c["centideg"])
    + option(zigzag, c["centideg_per_s"]),
    "Measurement": lambda c: bytes([c["joint"]])
    + zigzag(c["centideg"])
    + varint(c["at"]),
    "Subscribe": lambda c: varint(c["period_ms"]),
}


def encoded(request):
    name, content = request, b""
    if not isinstance(request, str):
        ((name, of),) = request.items()
        content = CONTENT[name](of)
    return varint(REQUESTS.index(name)) + content


def to_device(session, seq, request):
    return varint(session) + varint(seq) + encoded(request)


def note(parts, name, content, postcard):
    """Stores a request of the setup, whose bytes are `postcard`, for the checksum."""
    if name in ("Clear", "Hello"):
        parts.clear()
    if name not in SETUP:
        return
    has_place = isinstance(content, dict)
    place = content.get("channel", content.get("joint")) if has_place else None
    if name in ("Wearer", "Joint", "Wall", "Limb", "Sync"):
        place = None
    parts.pop((REQUESTS.index(name), place or 0), None)
    is_default = {
        "Wearer": lambda: list(content.values()) == list(WEARER_DEFAULTS),
        "Groups": lambda: not content,
        "Sync": lambda: content["channel"] is None,
    }.get(name, lambda: False)
    if not is_default():
        parts[REQUESTS.index(name), place or 0] = postcard


def setup_sum(parts):
    """Returns the checksum for `Arm` over the setup requests, by variant and channel."""
    crcs = (zlib.crc32(part).to_bytes(4, "little") for _, part in sorted(parts.items()))
    return zlib.crc32(b"".join(crcs))


CAUSES = (
    "Request HostSilent HandStop ArmExpired Finished ArmKey TimeOver DoseReached"
).split()
EVENTS = (
    "Stopping Stopped Faulted Recovered Electrode LimitCycle HoldExpired TriggerEdge "
    "SyncEdge"
).split()
STATES = "Boot Idle Armed Stimulating Stopping Fault".split()
PHASES = "Lift Drop".split()
HOLDS = "Released Held Expired".split()


def telemetry(r):
    """Decodes telemetry, with the names of protocol.md."""

    def force():
        sample = {"reference_mn": r.option(r.varint), "period_us": r.option(r.varint)}
        gap = lambda: {"lower_mn": r.varint(), "upper_mn": r.varint()}
        return {**sample, "gap": r.option(gap)}

    def wrench():
        target = [r.zigzag() for _ in range(3)]
        return {"reference_mn": target, "achievable_permille": r.varint()}

    def joint():
        measured = r.option(r.zigzag)
        return {"measured_centideg": measured, "phase": r.option(lambda: PHASES[r.varint()])}

    lift = lambda: {"hold": HOLDS[r.varint()], "joints": r.vec(joint)}
    each = lambda: r.option(r.varint)
    return {
        "at": r.varint(),
        "reference_centideg": r.option(r.zigzag),
        "measured_centideg": r.option(r.zigzag),
        "effort_milli": r.option(r.zigzag),
        "limiting": r.bool(),
        "amplitudes": r.vec(each),
        "widths_us": r.vec(each),
        "forces_mn": r.vec(each),
        "force_control": r.vec(force),
        "wrench": r.option(wrench),
        "lift": r.option(lift),
        "state": STATES[r.varint()],
    }


def from_device(message):
    """Returns (variant, content); content is empty for messages that are not needed here."""
    r = Reader(message)
    kind = r.varint()
    if kind == 0:
        names = "seq session schema".split()
        return "Hello", {name: r.varint() for name in names}
    if kind == 1:
        return "Ack", {"seq": r.varint(), "at": r.varint()}
    if kind == 2:
        seq = r.option(r.varint)
        refusal = {
            "code": r.varint(),
            "field": r.str(),
            "channel": r.option(r.u8),
            "min": r.zigzag(),
            "max": r.zigzag(),
        }
        return "Refused", {"seq": seq, "refusal": refusal}
    if kind == 4:
        at, number = r.varint(), r.varint()
        event = EVENTS[number]
        if number < 2:
            event = {event: CAUSES[r.varint()]}
        elif event == "Faulted":
            event = {event: r.varint() + 1}  # the number that messages show
        elif event == "Electrode":
            reading = {"channel": r.u8(), "applied": r.varint(), "current_ua": r.varint()}
            event = {event: reading}
        elif event == "LimitCycle":
            cycle = ("swing_centideg", "period_ms", "gain_milli")
            event = {event: {name: r.varint() for name in cycle}}
        return "Event", {"at": at, "event": event}
    if kind == 5:
        return "Telemetry", telemetry(r)
    return "Status", {}


# --- a device ---


class Device:
    def __init__(self, place):
        if place.startswith("tcp:"):
            host, port = place[4:].rsplit(":", 1)
            self.socket = socket.create_connection((host, int(port)))
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.fd = self.socket.fileno()
        else:
            import tty

            self.fd = os.open(place, os.O_RDWR | os.O_NOCTTY)
            tty.setraw(self.fd)
        self.session = self.seq = 0
        self.bytes = b""
        self.parts = {}  # of the setup, as the device accepted them

    def write(self, data):
        while data:
            data = data[os.write(self.fd, data) :]

    def send(self, request):
        seq, self.seq = self.seq, (self.seq + 1) % 65536
        self.write(frame(to_device(self.session, seq, request)))
        return seq

    def receive(self, timeout_s):
        """Returns the next message, or None. Damaged frames are skipped."""
        until = time.monotonic() + timeout_s
        while True:
            while b"\0" not in self.bytes:
                left = max(0.0, until - time.monotonic())
                if not select.select([self.fd], [], [], left)[0]:
                    return None
                data = os.read(self.fd, 4096)
                if not data:
                    raise ConnectionError("the device closed the connection")
                self.bytes += data
            data, self.bytes = self.bytes.split(b"\0", 1)
            try:
                if data:
                    return from_device(unframe(data))
            except (ValueError, IndexError):
                pass

    def hello(self):
        """Opens a session. Messages before the answer were meant for an earlier host. The
        0x00 ends a frame that an earlier host did not complete."""
        self.write(b"\0")
        seq = self.send({"Hello": {"schema": SCHEMA}})
        while message := self.receive(ANSWER_S):
            kind, content = message
            if kind == "Hello" and content["seq"] == seq:
                break
            if kind == "Refused":
                code, number = content["refusal"]["code"], content["seq"]
                # A device that serves another host refuses before it reads the number.
                if number == seq or number is None and code == SESSION_TAKEN:
                    raise RuntimeError(f"refused: {content['refusal']}")
        else:
            raise TimeoutError(f"the device did not answer Hello within {ANSWER_S} s")
        if content["schema"] != SCHEMA:
            of = f"{content['schema']:#018x}"
            raise RuntimeError(f"the device uses schema {of}, this client {SCHEMA:#018x}")
        self.session = content["session"]

    def configure(self, name, **content):
        """Sends a part of the setup and stores it for the checksum."""
        request = {name: content}
        self.ask(request)
        note(self.parts, name, content, encoded(request))

    def ask(self, request):
        """Sends a request and waits for its answer."""
        seq = self.send(request)
        while message := self.receive(ANSWER_S):
            kind, content = message
            if kind == "Refused" and content["seq"] in (seq, None):
                raise RuntimeError(f"refused: {content['refusal']}")
            if kind != "Event" and content.get("seq") == seq:
                return kind, content
            print(kind, content)
        raise TimeoutError(f"the device did not answer {request} within {ANSWER_S} s")


def stimulate(place):
    device = Device(place)
    device.hello()
    device.configure("Wearer", **LIMITS)
    train = {
        "shape": "BiphasicCathodicFirst",
        "width_us": 200,
        "max_width_us": 200,
        "gap_us": 50,
        "ground_us": 0,
        "period_us": 20_000,
        "offset_us": 0,
        "burst_count": 1,
        "burst_interval_us": 0,
        "repeats": 0,
        "trigger": None,
        "lists": False,
    }
    stage = {"Current": {"full_scale_ua": 100_000}}
    spec = {"train": train, "stage": stage, "limit": 20_000, "start": 0, "area_mm2": 800}
    device.configure("Channel", channel=0, spec=spec)
    device.ask({"Arm": {"setup": setup_sum(device.parts)}})
    device.ask("Start")
    print("stimulating")
    begin = time.monotonic()
    for step in range(100):  # 2 s at 50 Hz: 0 to 10 mA
        value = 100 * (step + 1)
        device.ask(
            {"Amplitudes": {"at": None, "mask": 1, "values": [value], "widths": []}}
        )
        time.sleep(max(0.0, begin + 0.02 * (step + 1) - time.monotonic()))
    device.ask("Stop")
    while message := device.receive(0.5):
        print(*message)


def selftest():
    """Encodes and decodes the committed test vectors."""
    path = pathlib.Path(__file__).parent.parent / "protocol_vectors.json"
    vectors = json.loads(path.read_text())
    assert int(vectors["schema"], 16) == SCHEMA, "the test vectors have another schema"
    encoded = decoded = 0
    for vector in vectors["vectors"]:
        wire, message = bytes.fromhex(vector["frame"]), vector["message"]
        postcard = unframe(wire[:-1])
        assert postcard.hex() == vector["postcard"], vector["name"]
        assert frame(postcard) == wire, vector["name"]
        if vector["direction"] == "to device":
            request = message["request"]
            if isinstance(request, str) or next(iter(request)) in CONTENT:
                told = to_device(message["session"], message["seq"], request)
                assert told == postcard, vector["name"]
                encoded += 1
        else:
            ((kind, content),) = message.items()
            got_kind, got = from_device(postcard)
            assert got_kind == kind, vector["name"]
            if kind in ("Ack", "Refused", "Event", "Telemetry") and "Faulted" not in str(got):
                assert got == content, vector["name"]
            decoded += 1
    for setup in vectors["setup_sums"]:
        parts = {}
        for sent in setup["requests"]:
            request = sent["request"]
            name = request if isinstance(request, str) else next(iter(request))
            content = {} if isinstance(request, str) else request[name]
            note(parts, name, content, bytes.fromhex(sent["postcard"]))
        assert setup_sum(parts) == setup["setup"], setup["name"]
    print(
        f"{encoded} requests encoded, {decoded} responses recognized, "
        f"{len(vectors['setup_sums'])} setups summed"
    )


if __name__ == "__main__":
    if sys.argv[1:] == ["--selftest"]:
        selftest()
    elif len(sys.argv) == 2 and not sys.argv[1].startswith("-"):
        stimulate(sys.argv[1])
    else:
        sys.exit(__doc__)
