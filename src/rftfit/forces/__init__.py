"""Forces on bodies, in the plane and in space: alpha of a medium integrated over what moves through it."""
