"""Everything that answers alpha(beta, gamma): symmetry, Fourier fits, scaling."""
