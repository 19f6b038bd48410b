"""Sensors: what lies between the motion of a drive and its recording."""

from hdfast.sensors.channels import CHANNELS
from hdfast.sensors.facts import SensorFacts, encoder, stage_of
from hdfast.sensors.stage import SensorStage

__all__ = ["CHANNELS", "SensorFacts", "SensorStage", "encoder", "stage_of"]
