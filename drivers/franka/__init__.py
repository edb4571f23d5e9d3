"""A Franka arm behind its research interface (FCI), through pylibfranka.

`driver.py` is the device, `session.py` what its process does each millisecond, `exchange.py` the set points that it sends,
`client.py` the arm as libfranka shows it, `orders.py` a trajectory as numbers, `settings.py` how the arm is set up.
"""
