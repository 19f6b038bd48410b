"""Tables, figures and the result folder; may import everything, nothing but the command line imports it."""
