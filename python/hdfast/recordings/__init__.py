"""Recordings of a drive: loaded by column name, checked, saved, replayed."""

from hdfast.recordings.campaign import Campaign, CampaignRecording, load_campaign, recorded
from hdfast.recordings.columns import COLUMNS, ColumnMap, read_column_map
from hdfast.recordings.load import gather, load, load_table, save
from hdfast.recordings.priors import Prior
from hdfast.recordings.recording import Recording
from hdfast.recordings.rig import Controller
from hdfast.recordings.table import Table

__all__ = [
    "COLUMNS",
    "Campaign",
    "CampaignRecording",
    "ColumnMap",
    "Controller",
    "Prior",
    "Recording",
    "Table",
    "gather",
    "load",
    "load_campaign",
    "load_table",
    "read_column_map",
    "recorded",
    "save",
]
