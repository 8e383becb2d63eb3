"""Flexor: drive a ten-channel muscle stimulator, or its simulator, from Python.

    import flexor
    with flexor.connect("sim:") as dev:
        dev.channel(1, flexor.Train(rate_hz=30, width_us=200), limit_ma=12)
        dev.arm()
        dev.start()
        dev.set(ma={1: 8})
        dev.wait(10)
        record = dev.stop()

The same lines run on a board behind ``serial:/dev/ttyACM0``. A simulation is no evidence about
people: every record says whether it is simulated.
"""

from __future__ import annotations

from . import models, statistics
from ._device import Device, connect
from ._errors import (
    ArmRefused,
    ConnectionLost,
    DeviceFault,
    FlexorError,
    LeaseExpired,
    Mistake,
    Refused,
)
from ._limb import Limb, Pulse
from ._procedures import (
    Calibration,
    CalibrationOperator,
    CalibrationView,
    Finding,
    Order,
    SearchOperator,
    calibrate,
    check_thresholds,
    search,
)
from ._record import Event, Marker, Reading, Record
from ._run import cite, edges, run, run_many, sessions, wearers
from ._train import Limits, Muscle, Train

__version__ = "0.2.0"
__docformat__ = "google"

__all__ = [
    "ArmRefused",
    "Calibration",
    "CalibrationOperator",
    "CalibrationView",
    "ConnectionLost",
    "Device",
    "DeviceFault",
    "Event",
    "Finding",
    "FlexorError",
    "LeaseExpired",
    "Limb",
    "Limits",
    "Marker",
    "Mistake",
    "Muscle",
    "Order",
    "Pulse",
    "Reading",
    "Record",
    "Refused",
    "SearchOperator",
    "Train",
    "calibrate",
    "check_thresholds",
    "cite",
    "connect",
    "edges",
    "models",
    "run",
    "run_many",
    "search",
    "sessions",
    "statistics",
    "wearers",
]
