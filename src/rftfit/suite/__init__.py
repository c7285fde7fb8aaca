"""The validation suite: published answers of authors beside the answers of this program to the same data."""
