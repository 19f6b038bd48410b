"""Recordings of a drive: loaded by column name, checked, saved, replayed."""

from hdfast.recordings.campaign import Campaign, load_campaign
from hdfast.recordings.columns import COLUMNS, ColumnMap, read_column_map
from hdfast.recordings.load import gather, load, save
from hdfast.recordings.recording import Recording

__all__ = [
    "COLUMNS",
    "Campaign",
    "ColumnMap",
    "Recording",
    "gather",
    "load",
    "load_campaign",
    "read_column_map",
    "save",
]
