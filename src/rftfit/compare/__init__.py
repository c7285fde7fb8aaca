"""Measured beside published and predicted: the reproduction table."""
