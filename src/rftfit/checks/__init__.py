"""Checks of a medium: whether its numbers can be believed."""
