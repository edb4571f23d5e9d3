"""A runtime reduced to its base: `python -m tests.faults.commander PORT VX` opens the driver and drives until it is ended."""

import sys
import time

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup
from drivers.omni_can.driver import OmniCanBase

LIFETIME_NS = 250_000_000


def main(port: int, vx_m_s: float) -> None:
    bus = {"interface": "udp_multicast", "channel": "239.74.163.2", "port": port}
    settings = OmniCanBase.Settings(bus=bus, verify_watchdog=False, connect_s=20.0)
    base = OmniCanBase(settings, DeviceSetup("base", 0, time.monotonic_ns))
    base.open()
    while True:
        base.command(BodyTwist(vx=vx_m_s), time.monotonic_ns() + LIFETIME_NS)
        base.drain()
        time.sleep(0.05)


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
