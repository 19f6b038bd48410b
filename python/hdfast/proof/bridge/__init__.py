"""Semi-synthetic cases: a known effect put into recordings of a real machine, and controls with nothing put in."""
