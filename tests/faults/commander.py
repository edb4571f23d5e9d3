"""A runtime reduced to its base: `python -m tests.faults.commander PORT VX` drives until it is told to stop, or ended."""

import signal
import sys
import time

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup
from drivers.omni_can.driver import OmniCanBase
from tests.faults.told import until_told

LIFETIME_NS = 250_000_000


def main(port: int, vx_m_s: float) -> None:
    bus = {"interface": "udp_multicast", "channel": "239.74.163.2", "port": port}
    settings = OmniCanBase.Settings(bus=bus, verify_watchdog=False, connect_s=20.0)
    base = OmniCanBase(settings, DeviceSetup("base", 0, time.monotonic_ns))
    base.open()
    for _ in until_told():
        base.command(BodyTwist(vx=vx_m_s), time.monotonic_ns() + LIFETIME_NS)
        base.drain()
    base.stop()
    signal.pause()


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
