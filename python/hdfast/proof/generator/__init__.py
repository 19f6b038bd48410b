"""An independent generator of blind cases: nothing of engine, terms, sensors or diagnosis comes in."""

#: Of the cases: sets of two versions differ in what is asked.
VERSION = "12"
