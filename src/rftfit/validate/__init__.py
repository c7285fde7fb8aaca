"""Measured against published and predicted: the reproduction table."""
