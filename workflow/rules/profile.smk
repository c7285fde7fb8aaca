# Alpha tables to symmetry, Fourier coefficients and scaling.


def alpha_tables(media):
    return expand("results/alpha/{medium}.csv", medium=media)


def named(name):
    """Words name=path for each of a rule's input files of that name."""
    return lambda wildcards, input: [f"{name}={path}" for path in input.get(name, [])]


rule symmetry:
    input:
        alpha=alpha_tables(PLAN.laboratory),
    output:
        extended="results/alpha_extended.csv",
    params:
        code=PLAN.code("symmetry"),
        alpha=named("alpha"),
    log:
        "results/logs/symmetry.log",
    shell:
        "{STAGE} symmetry {params.alpha:q} extended={output.extended:q} 2> {log:q}"


rule fourier:
    input:
        alpha=alpha_tables(PLAN.laboratory),
    output:
        coefficients="results/fourier/media.csv",
        terms="results/fourier/terms.csv",
    params:
        campaign=CONFIG,
        code=PLAN.code("fourier"),
        settings=PLAN.settings("fit", "fourier", "media"),
        alpha=named("alpha"),
    log:
        "results/logs/fourier.log",
    shell:
        "{STAGE} fourier config={params.campaign:q} {params.alpha:q}"
        " coefficients={output.coefficients:q} terms={output.terms:q} 2> {log:q}"


rule scaling:
    input:
        alpha=alpha_tables(PLAN.laboratory),
        sands=alpha_tables(PLAN.sands),
        media="results/fourier/media.csv",
    output:
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
    params:
        campaign=CONFIG,
        code=PLAN.code("scaling"),
        settings=PLAN.settings("fit", "fourier", "media"),
        alpha=named("alpha"),
        sands=named("sands"),
    log:
        "results/logs/scaling.log",
    shell:
        "{STAGE} scaling config={params.campaign:q} {params.alpha:q} {params.sands:q}"
        " media_coefficients={input.media:q} coefficients={output.coefficients:q}"
        " penetration={output.penetration:q} 2> {log:q}"


rule reproduction:
    input:
        alpha=alpha_tables(PLAN.laboratory),
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
    output:
        reproduction="results/reproduction.csv",
    params:
        campaign=CONFIG,
        code=PLAN.code("reproduction"),
        settings=PLAN.settings("media"),
        alpha=named("alpha"),
    log:
        "results/logs/reproduction.log",
    shell:
        "{STAGE} reproduction config={params.campaign:q} {params.alpha:q}"
        " coefficients={input.coefficients:q} penetration={input.penetration:q}"
        " reproduction={output.reproduction:q} 2> {log:q}"
