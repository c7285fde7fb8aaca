# What several rules need.


def alpha_tables(media):
    """Alpha tables of these media."""
    return expand("results/alpha/{medium}.csv", medium=media)


def named(name):
    """Words name=path for each of a rule's input files of that name."""
    return lambda wildcards, input: [f"{name}={path}" for path in input.get(name, [])]
