"""The validation suite: real data, the authors' own answer beside the program's."""
