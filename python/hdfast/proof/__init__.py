"""The open blind benchmark: cases in which one effect is concealed, and the scores of the answers."""
