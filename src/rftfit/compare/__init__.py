"""Comparisons: runs with each other, two media, measured with predicted legs, this campaign with the paper."""
