"""Forces from a profile: element kernel, outlines, leg rotation, free paths, bootstrap draws."""
