"""Detects fiducial markers in a camera's image, at the camera's side: simulated and real ones detect alike.

Source: Garrido-Jurado et al., Automatic generation and detection of highly reliable fiducial markers under occlusion (2014); the
detector is OpenCV's.
"""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

U8 = NDArray[np.uint8]
F64 = NDArray[np.float64]
DictionaryName = Literal["4X4_50", "4X4_100", "5X5_50", "5X5_100", "6X6_50", "6X6_250", "APRILTAG_36h11"]

# Half the window in which a corner is refined, in modules of the marker.  OpenCV's 0.3 leaves the corners of a marker of 20 px
# half a pixel inside the true ones; from 0.8 on the window reaches the code's own corners.
REFINEMENT_MODULES = 0.6


def dictionary_of(name: DictionaryName) -> cv2.aruco.Dictionary:
    """Return one of the predefined sets of markers."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))


class MarkerDetector:
    """Finds the markers of one dictionary; those of another are not seen."""

    def __init__(self, name: DictionaryName) -> None:
        """Refine corners to a fraction of a pixel: where a marker is, hangs on them."""
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        parameters.relativeCornerRefinmentWinSize = REFINEMENT_MODULES
        self._detector = cv2.aruco.ArucoDetector(dictionary_of(name), parameters)

    def detect(self, grey: U8) -> tuple[tuple[int, ...], F64]:
        """Return the ids and corners [px], shape (n, 4, 2), of the markers in a grey image, in the order of their ids."""
        corners, ids, _ = self._detector.detectMarkers(grey)
        if ids is None or len(ids) == 0:
            return (), np.zeros((0, 4, 2))
        order = np.argsort(np.ravel(ids), kind="stable")
        return tuple(np.ravel(ids)[order].tolist()), np.asarray(corners, dtype=np.float64).reshape(-1, 4, 2)[order]
