"""The force model: what answers alpha(beta, gamma), and what integrates it."""
