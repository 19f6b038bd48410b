"""The nominal drive fitted to recordings, within what is known of its parameters."""

from hdfast.calibration.calibrate import Calibration, calibrate

__all__ = ["Calibration", "calibrate"]
