"""Errors of a trajectory against the truth, as the `evo` package defines them, in the plane.

Sources: Umeyama, Least-squares estimation of transformation parameters between two point patterns, PAMI 1991 (alignment, without
scale); Sturm et al., A benchmark for the evaluation of RGB-D SLAM systems, IROS 2012 (absolute and relative error); Grupp, evo.
"""

from __future__ import annotations

import numpy as np

from estimators.belief import F64


def aligned(points: F64, truth: F64) -> F64:
    """Return points moved rigidly so that they lie nearest to the truth, both of shape (n, 2) [m]."""
    centre, true_centre = points.mean(axis=0), truth.mean(axis=0)
    u, _, vt = np.linalg.svd((truth - true_centre).T @ (points - centre))
    proper = np.diag((1.0, float(np.sign(np.linalg.det(u) * np.linalg.det(vt)))))  # a rotation, never a reflection
    return np.asarray((points - centre) @ (u @ proper @ vt).T + true_centre)


def absolute_error_m(points: F64, truth: F64) -> float:
    """Return the absolute trajectory error [m]: RMS of the distances after alignment (evo_ape, translation, --align)."""
    distance = np.linalg.norm(aligned(points, truth) - truth, axis=1)
    return float(np.sqrt(np.mean(distance**2)))


def relative_error_m(points: F64, truth: F64, apart: int) -> float:
    """Return the relative error [m]: RMS of how much the distances over `apart` samples differ.

    It is the one that a truth without headings allows (evo_rpe, --pose_relation point_distance --delta n --all_pairs).
    """
    made = np.linalg.norm(points[apart:] - points[:-apart], axis=1)
    true = np.linalg.norm(truth[apart:] - truth[:-apart], axis=1)
    return float(np.sqrt(np.mean((made - true) ** 2)))
