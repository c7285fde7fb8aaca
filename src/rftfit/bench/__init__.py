"""Measuring with the program at hand: each push is judged when its log is still, and the next one is chosen."""
