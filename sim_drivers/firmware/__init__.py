"""Emulated devices: the other end of a real driver's wire, in a MuJoCo world that free-runs in a process of its own.

The contract (`sim_drivers/firmware/firmware.py`) in ten lines:

1. A firmware stands in for a device that a real driver talks to.  It is registered under the DRIVER's name in the entry-point
   group `trundle.firmware`, and built as `Firmware(driver_settings, settings, setup)`: the validated settings of the driver (so
   both ends know the same wire), its own `Settings` (`robot.emulation.<role>`), and a `FirmwareSetup`.
2. It is a `Part` of the `MujocoWorld` and registers itself with `setup.world.add(self)` in its constructor; nothing is touched.
3. `build` and `bind` add the mechanics and find them again; reuse the chassis, encoders, arm and cameras of `sim_drivers`.
   A whole simulated device can live inside: build it with `setup.device()`, then it is a part of the same world by itself.
4. `open()` binds the wire (socket, bus, pseudo-terminal); `close()` lets go of it, in every state, any number of times.
5. `listens` says in a few words where, once open: it is what `trundle emulate` prints.
6. `act(world)` runs every `period_ns`: take what is on the wire without blocking, advance the controller's state machine by
   `world.now_ns`, set controls, send what is due.  No threads, no sleeping, no system clock: the same class runs in lockstep
   in a test.
7. Time: state machines, watchdogs and rates go by `world.now_ns`; a stamp that the other process reads goes by
   `setup.host.now_ns`, the world's present on CLOCK_MONOTONIC.
8. It starts as the real thing does after power-up (idle, disarmed) and keeps the real thing's watchdogs.  Every random draw comes
   from `seeds.stream(setup.seed, ...)`.
9. The scene's walkers set off at `host.begin()` and the world is made anew after `host.end()`; the truth's link calls both.
10. A device that another one's firmware serves (an autopilot's own IMU) is registered with `Alongside`.
"""
