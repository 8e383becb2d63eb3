#!/usr/bin/env python3
"""Runs `flexor calibrate` from another program, which reads and writes JSON lines.

    python3 docs/examples/calibrate.py host-tool/calibrations/one_electrode.toml w.toml

Like every such program, it asks the operator before each raise, and turns the keys that
the operator types into orders. docs/guides/calibrate.md lists every event and order. Without
--device the wearer is simulated. A research instrument, not a medical device.
"""

import json
import subprocess
import sys
import threading

KEYS = {
    "u": "raise", "d": "lower", "a": "again", "y": "yes", "n": "no",
    "t": "too-much", "e": "enough", "x": "skip", "": "abort", "q": "abort",
}
HELP = "u raise, d lower, a again, y yes, n no, t too much, e enough, x skip, q quit"


def ordering(flexor, view):
    """Sends typed orders until the input ends; then flexor ends by itself."""
    for line in sys.stdin:
        if order := typed(line, view):
            print(json.dumps(order), file=flexor.stdin, flush=True)
        else:
            print(HELP, flush=True)
    flexor.stdin.close()


def typed(line, view):
    """Returns the order for a typed line; None if there is none."""
    if view.get("question") and view["step"] == "points":
        names = [name.strip() for name in line.split(",")]
        return {"order": "moves", "moves": [name for name in names if name]}
    order = KEYS.get(line.strip().lower())
    return order and {"order": order}


def told(event):
    """Returns a line of text for an event; None for events that need no text."""
    kind = event.get("event")
    if kind == "view":
        asked = event["question"] or " ".join(event["orders"])
        return (
            f"electrode {event['electrode']} of {event['of']}, {event['step']}, "
            f"{event['level']} {event['unit']}, {event['phase']}: {asked}"
        )
    if kind == "refused" or event.get("error"):
        return event["error"]
    if kind == "done":
        return f"done: {event['file']}, {event['device_s'] / 60:.1f} min"
    return None


def main(plan, out, *more):
    command = ["flexor", "--json", "calibrate", "--electrodes", plan, "--out", out, *more]
    flexor = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    )
    view = {}
    threading.Thread(target=ordering, args=(flexor, view), daemon=True).start()
    for line in flexor.stdout:
        event = json.loads(line)
        if event.get("event") == "view":
            view.update(event)
        if words := told(event):
            print(words, flush=True)
    return flexor.wait()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
