"""What every real driver shares: its wire lives in a process of its own, and shared memory joins that process to the loop.

So a slow library never holds the loop's interpreter lock, and whatever happens to the runtime, the last process before the
wire still sends zero.  In ten lines:

1.  Write a `Session` (see `session.py`), built as `MySession(settings, port)`: `open`, `poll(now_ns)`, `rest()`, `close()`,
    `send(values, now_ns)`, `clear_faults()`, and `wakes_on()` / `next_ns(now_ns)`, which say what the process waits for.  It
    never asks for the time, so a test runs it in its own process: `MySession(settings, local_port(memory))` under a `LastHop`.
2.  It delivers through `port.rings["name"].put(record)` and `port.frames["name"].put(meta, pixels)` and tells of itself in
    `port.health` (`received`, `dropped`, `state`, `fault`, `battery_v`, `firmware`, ...); the shell publishes that.
3.  It raises `DeviceError` or `OSError` when the wire is lost: the shell rests and closes it, says RECONNECTING, and opens it
    again with back-off; `port.reopened` is then true, and what moves must not arm itself before `clear_faults()`.
4.  The driver derives from `WireDevice` (`device.py`), or holds `io = IoProcess(IoSpec(name, "drivers.my.session:MySession",
    settings, MemorySpec(...)))` itself.
5.  `io.open()` starts the child and returns once the session is open, or raises `DeviceError` with the child's own sentence.
6.  `io.command(values, expires_ns)` hands over float64 values that the child sends at most once, and for no longer than they are
    valid; then it calls `rest()`.  `io.stop()` rests now.  Times are CLOCK_MONOTONIC: convert the loop's with `HostClock`.
7.  `io.ring("name").drain()` returns every record since the last call, `io.frame("name").take()` the newest frame or None.
8.  `io.health()` returns a `HealthRecord`: the child's own word, or the host's where the child is dead, stuck or being restarted.
9.  `io.clear_faults()` is the operator's reset; until the child has done it a fault reads as RECONNECTING.
    `io.close()` ends in every state, also on a stuck child.
10. Devices that share a wire share the `IoProcess`: `setup.links.get(key, make)`, whose lease counts `open` and `close`.
"""
