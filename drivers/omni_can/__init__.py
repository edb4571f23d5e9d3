"""An omni base whose three wheels are turned by ODrive controllers on a CAN bus.

`driver.py` is the device, `session.py` what its process does on the bus, `axis.py` what is known of one controller,
`settings.py` how robot and bus are built, `codec.py` and `dbc.py` the messages, `can_wire.py` and `bus_load.py` the bus.
"""
