"""What the clearance-manifold planner may find of somebody who closes in."""

import numpy as np


def found(x, y, vx, vy, slopes=(0.5, 0.0, 0.5), share=1.0):
    """Return a boundary of twenty cells, of which this share gave the velocity, beside these slopes: xx, xy, yy."""
    return np.array([x, y, vx, vy, 20.0, *slopes, 0.0, 0.0, 0.0, share])
