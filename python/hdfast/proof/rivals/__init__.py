"""Simpler strategies, and the diagnosis with one part taken out, on the same sealed cases."""
