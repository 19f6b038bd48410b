"""An independent generator of blind cases; it imports nothing of the engine, the terms, the diagnosis or the sensors."""
