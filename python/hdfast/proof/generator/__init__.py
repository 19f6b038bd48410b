"""An independent generator of blind cases: nothing of engine, terms, sensors or diagnosis comes in."""
