# Alpha tables to symmetry, Fourier coefficients and scaling.


rule symmetry:
    input:
        alpha=alpha_tables(PLAN.laboratory),
    output:
        extended="results/alpha_extended.csv",
    log:
        "results/logs/symmetry.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        code=PLAN.code("symmetry"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit symmetry {params.alpha:q} extended={output.extended:q} 2> {log:q}"


rule fourier:
    input:
        alpha=alpha_tables(PLAN.laboratory),
    output:
        coefficients="results/fourier/media.csv",
        terms="results/fourier/terms.csv",
    log:
        "results/logs/fourier.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("fourier"),
        settings=PLAN.settings("fit", "fourier", "media"),
        alpha=named("alpha"),
    shell:
        "python -m rftfit fourier config={params.campaign:q} {params.alpha:q}"
        " coefficients={output.coefficients:q} terms={output.terms:q} 2> {log:q}"


rule scaling:
    input:
        alpha=alpha_tables(PLAN.laboratory),
        sands=alpha_tables(PLAN.sands),
        media="results/fourier/media.csv",
    output:
        coefficients=report(
            "results/coefficients.csv",
            caption="../report/coefficients.rst",
            category=PROFILES,
            labels=shown("table", "coefficients"),
        ),
        penetration=report(
            "results/penetration.csv",
            caption="../report/penetration.rst",
            category=PROFILES,
            labels=shown("table", "zeta and chi"),
        ),
    log:
        "results/logs/scaling.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("scaling"),
        settings=PLAN.settings("fit", "fourier", "media"),
        alpha=named("alpha"),
        sands=named("sands"),
    shell:
        "python -m rftfit scaling config={params.campaign:q} {params.alpha:q} {params.sands:q}"
        " media_coefficients={input.media:q} coefficients={output.coefficients:q}"
        " penetration={output.penetration:q} 2> {log:q}"


rule trials:
    input:
        alpha=alpha_tables(PLAN.laboratory),
        sands=alpha_tables(PLAN.sands),
        legs=expand("results/legs/{medium}.csv", medium=PLAN.media),
    output:
        predicted="results/predicted.csv",
        errors=report(
            "results/leg_errors.csv",
            caption="../report/leg_errors.rst",
            category=LEGS,
            labels=shown("table", "errors of every curve"),
        ),
    log:
        "results/logs/trials.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("trials"),
        settings=PLAN.settings("arm", "fit", "fourier", "intruders", "media"),
        alpha=named("alpha"),
        sands=named("sands"),
        legs=named("legs"),
    shell:
        "python -m rftfit trials config={params.campaign:q} {params.alpha:q} {params.sands:q}"
        " {params.legs:q} predicted={output.predicted:q} errors={output.errors:q} 2> {log:q}"


rule sands:
    input:
        runs=expand("results/runs/{medium}.csv", medium=PLAN.sands),
        tared=expand("results/tared/{medium}.parquet", medium=PLAN.sands),
        penetration="results/penetration.csv",
    output:
        sands=report(
            "results/sands.csv",
            caption="../report/fig_s11_penetration.rst",
            category=SANDS,
            labels=shown("table", "penetration"),
        ),
    log:
        "results/logs/sands.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("sands"),
        settings=PLAN.settings("fit", "fourier", "intruders", "media"),
        runs=named("runs"),
        tared=named("tared"),
    shell:
        "python -m rftfit sands config={params.campaign:q} {params.runs:q} {params.tared:q}"
        " penetration={input.penetration:q} sands={output.sands:q} 2> {log:q}"


rule correction:
    input:
        legs=expand("results/legs/{medium}.csv", medium=PLAN.sands),
        predicted="results/predicted.csv",
    output:
        correction=report(
            "results/sand_correction.csv",
            caption="../report/sand_correction.rst",
            category=SANDS,
            labels=shown("table", "correction factors"),
        ),
    log:
        "results/logs/correction.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        code=PLAN.code("correction"),
        legs=named("legs"),
    shell:
        "python -m rftfit correction {params.legs:q} predicted={input.predicted:q}"
        " correction={output.correction:q} 2> {log:q}"


rule reproduction:
    input:
        alpha=alpha_tables(PLAN.laboratory),
        coefficients="results/coefficients.csv",
        penetration="results/penetration.csv",
        errors="results/leg_errors.csv",
        legs=expand("results/legs/{medium}.csv", medium=PLAN.media),
        robot_errors=["results/robot/errors.csv"] * bool(PLAN.robot_medium),
        robot_optimum=["results/robot/optimum.csv"] * bool(PLAN.robot_medium),
    output:
        reproduction=report(
            "results/reproduction.csv",
            caption="../report/reproduction.rst",
            category=OVERVIEW,
            labels=shown("table", "the paper's numbers and ours"),
        ),
    log:
        "results/logs/reproduction.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        campaign=CONFIG,
        code=PLAN.code("reproduction"),
        settings=PLAN.settings("fourier", "media"),
        alpha=named("alpha"),
        legs=named("legs"),
        robot_errors=named("robot_errors"),
        robot_optimum=named("robot_optimum"),
    shell:
        "python -m rftfit reproduction config={params.campaign:q} {params.alpha:q}"
        " coefficients={input.coefficients:q} penetration={input.penetration:q}"
        " errors={input.errors:q} {params.legs:q} {params.robot_errors:q}"
        " {params.robot_optimum:q} reproduction={output.reproduction:q} 2> {log:q}"
