"""From recordings to a named cause: what a drive's model leaves out."""

from hdfast.diagnosis.diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
