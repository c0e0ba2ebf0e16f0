"""Compiled steps of the force loop for compiled code of other packages: arrays in place, serial."""

from sdpgrind.weldbead.force._kernels import drive_of, drive_step, sensor_of, sensor_read, sensor_step

__all__ = ["drive_of", "drive_step", "sensor_of", "sensor_read", "sensor_step"]
