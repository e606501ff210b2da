"""`sensor_msgs`: what sensors measure, one file per kind of sensor."""

from busflow import imported_at_use

__getattr__ = imported_at_use(globals())  # reading an Imu needs no camera
