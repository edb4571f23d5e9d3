"""A simulated camera that sees the scene's marker plates: their pictures are drawn, spoilt, and given to the real detector."""

from __future__ import annotations

from typing import Any, ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.devices import DeviceSetup
from drivers.interface.errors import ConfigurationError
from drivers.interface.marker_detector import DictionaryName, MarkerDetector
from drivers.interface.samples import MarkerSample, Stamp, frozen_array
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.camera_mount import CameraMount
from sim_drivers.depth_camera import intrinsics
from sim_drivers.marker_plates import Print, draw_plate, print_of
from sim_drivers.ray_caster import RayCaster
from sim_drivers.sensor import SimSensor
from sim_drivers.world import MujocoWorld

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
BACKGROUND = 0.4  # grey of everything that is no plate
FAR_M = 20.0


class MarkerCameraSettings(CameraMount):
    """Settings of the marker camera: a D455's colour stream behind its rectification."""

    width: int = Field(default=848, ge=64, le=1920, description="pixels")
    height: int = Field(default=480, ge=64, le=1200, description="pixels")
    horizontal_fov_deg: float | None = Field(default=None, ge=20.0, le=150.0, description="none: the D455's 88.6 degrees")
    rate_hz: float = Field(default=15.0, gt=0.0, le=90.0, description="images per second")
    latency_s: float = Field(default=0.06, ge=0.0, le=1.0, description="from capture to the detected markers")
    loss_probability: float = Field(default=0.002, ge=0.0, le=1.0, description="of a whole image")
    buffered_samples: int = Field(default=8, ge=1, le=1000, description="images that wait for the loop")
    blur_px: float = Field(default=0.7, ge=0.0, le=20.0, description="standard deviation of the lens's point spread")
    noise_grey: float = Field(default=3.0, ge=0.0, le=100.0, description="standard deviation of a pixel, of 255")
    sees_robot: bool = Field(default=True, description="whether the robot's own body hides what is behind it")
    dictionary: DictionaryName = Field(default="4X4_50", description="the set of markers that is looked for")


class SimMarkerCamera(SimSensor[MarkerSample]):
    """A camera in the simulated world that delivers the ArUco markers it sees: blur, noise, occlusion, latency."""

    Settings: ClassVar[type[Settings]] = MarkerCameraSettings
    role: ClassVar[str] = "markers"

    def __init__(self, settings: MarkerCameraSettings, setup: DeviceSetup) -> None:
        """Register with the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        super().__init__(setup, settings.rate_hz, settings.latency_s, settings.loss_probability, settings.buffered_samples)
        self._settings = settings
        self._intrinsics = intrinsics(settings.width, settings.height, settings.horizontal_fov_deg)
        self._detector = MarkerDetector(settings.dictionary)
        self._plates: tuple[tuple[int, F64, F64, Print], ...] = ()  # carrier's geom; rotation and place on it; picture
        self._base_id = 0
        self._caster: RayCaster | None = None

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing: the camera only looks, and a print has no thickness."""

    def bind(self, world: MujocoWorld) -> None:
        """Take over the model's geoms, print the plates and look once, so that nothing is compiled later.

        Raises:
            ConfigurationError: a geom is of a type that cannot be cast, or a plate sticks on nothing.
        """
        self._base_id = world.model.body("base").id
        self._caster = RayCaster(world.model, None if self._settings.sees_robot else "base")
        plates = []
        for plate in world.scene.markers:
            try:
                geom = world.model.geom(plate.carrier).id
            except KeyError as error:
                raise ConfigurationError(f"marker {plate.identity} sticks on '{plate.carrier}', which the scene lacks") from error
            place = plate.carrier_from_marker
            plates.append((geom, place.rotation, place.translation, print_of(plate)))
        self._plates = tuple(plates)
        self._measure(world, Stamp(0, 0, 0))

    def _measure(self, world: MujocoWorld, stamp: Stamp) -> MarkerSample:
        ids, corners = self._detector.detect(self._picture(world, stamp.sequence))
        return MarkerSample(stamp, ids, frozen_array(corners), self._intrinsics, self._settings.base_from_optical)

    def _picture(self, world: MujocoWorld, sequence: int) -> U8:
        """Return the grey image, shape (height, width), that the camera takes now."""
        assert self._caster is not None  # bound before the world acts
        data, k, mount = world.data, self._intrinsics, self._settings.base_from_optical
        base_rotation = data.xmat[self._base_id].reshape(3, 3)
        position = data.xpos[self._base_id] + base_rotation @ mount.translation
        rotation = base_rotation @ mount.rotation  # map from the optical frame
        depth_m = self._caster.depth_image(data, position, rotation, k, FAR_M)
        image = np.full((k.height, k.width), BACKGROUND, dtype=np.float32)
        for geom, turned, offset, picture in self._plates:
            carrier = data.geom_xmat[geom].reshape(3, 3)
            place = data.geom_xpos[geom] + carrier @ offset - position
            draw_plate(image, depth_m, picture, rotation.T @ carrier @ turned, rotation.T @ place, k)
        return self._spoilt(image, sequence)

    def _spoilt(self, image: NDArray[np.float32], sequence: int) -> U8:
        settings = self._settings
        if settings.blur_px > 0.0:
            image = np.asarray(cv2.GaussianBlur(image, (0, 0), settings.blur_px), dtype=np.float32)
        noise = stream(self._setup.seed, self._setup.name, sequence).standard_normal(image.shape, dtype=np.float32)
        return np.clip(255.0 * image + settings.noise_grey * noise + 0.5, 0.0, 255.0).astype(np.uint8)
