"""One sensor effect per file."""
