"""Truth from outside: nothing here shares a formula or a line with the engine or the reference."""
