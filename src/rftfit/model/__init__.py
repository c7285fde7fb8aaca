"""The force model: profiles, which give alpha(beta, gamma), and the compiled kernel, which integrates alpha."""
