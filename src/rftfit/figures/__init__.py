"""Figures of a campaign, each drawn from the tables of the measurement chain."""
