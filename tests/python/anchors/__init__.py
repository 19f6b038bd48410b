"""Recordings of real machines as campaign folders: one module per machine, each with `write(folder)`."""
